"""Shortcut: does a model hear the object, or a sound that comes with the label?

The models of cross-validation are asked about recordings made with the speaker silent, which hold
nothing of the object (see `evaluate.shortcut_test`).
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from ajgdata.experiments.base import Experiment, Inputs, Outcome, Result, TaskResults, score_table
from ajgdata.experiments.cross_validation import evaluate
from ajgdata.experiments.cross_validation.results import (
    GROUPED,
    elsewhere,
    metric_axis,
    metric_name,
    shown_score,
)
from ajgdata.report.blocks import Illustration
from ajgdata.report.format import Caption, Score, number, sentence, with_unit
from ajgdata.types import ModelName, Name, Strict
from ajgdata.types.table import table_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TEST_COLUMNS = {
    "data_set": "Data set", "measure": "Measure", "value": "Value", "null": "By chance",
    "permutations": "Permutations", "p": "p", "flagged": "Flagged",
}  # fmt: skip


class Settings(Strict):
    """Test of the folds' models on recordings with the speaker silent."""

    test_on: tuple[Name, ...] = Field(
        min_length=1,
        description="data sets that were recorded with the speaker silent: a model whose "
        "predictions from them depend on the target has learned another sound, and is flagged",
    )
    sounding: tuple[Name, ...] = Field(
        (),
        description="those of test_on in which the speaker plays all the same: the figure shows "
        "their errors beside, and no model is flagged for them",
    )
    models: tuple[ModelName, ...] = Field(
        ("cnn", "linear", "knn"), min_length=1, description="models that are tested"
    )

    @property
    def silent(self) -> tuple[str, ...]:
        """Return the data sets that were recorded with the speaker silent."""
        return tuple(name for name in self.test_on if name not in self.sounding)

    @model_validator(mode="after")
    def _some_are_silent(self) -> Settings:
        if more := sorted(set(self.sounding) - set(self.test_on)):
            raise ValueError(f"sounding: {more[0]} is not in test_on; add it there")
        if not self.silent:
            raise ValueError("test_on: no data set is left that is silent; add one")
        return self


def measure(inputs: Inputs, settings: Settings, model: str) -> Outcome:
    """Return how far predictions of `model` from silence depend on the target."""
    from ajgdata.evaluate.metrics import METRICS
    from ajgdata.evaluate.shortcut_test import shortcut_test

    found = evaluate(inputs, model, settings.test_on)
    grouped = found.splits[GROUPED]
    tests = {}
    for name in settings.silent:
        p = grouped.extra_tests[elsewhere(name)].predictions
        tests[name] = shortcut_test(
            p.y_true, p.y_pred, p.fold, found.data[elsewhere(name)].group[p.row],
            kind=inputs.kind, period=inputs.period_deg, seed=inputs.seed,
        )  # fmt: skip
    scores = (
        (model, f"silent:{name}", *row)
        for name, test in tests.items()
        for row in (
            (test.measure, "pooled", test.value),
            (test.measure, "chance", test.null),
            ("p", f"of {test.permutations}", test.p),
        )
    )
    metric = METRICS[inputs.kind][0]
    tested = {"": grouped.scores}
    tested |= {name: grouped.extra_tests[elsewhere(name)].scores for name in settings.sounding}
    errors = (
        {"data_set": name, "mean": s.mean[metric], "sd": s.sd[metric], "chance": s.chance[metric]}
        for name, s in tested.items()
    )
    told = ({"data_set": name, **dataclasses.asdict(test)} for name, test in tests.items())
    columns = {"data_set": "Data set", "mean": "Mean", "sd": "Deviation", "chance": "Chance"}
    return Outcome(
        (
            score_table(scores, "Dependence of predictions from silence on the truth"),
            table_of("silence", "Tests of predictions from silence", told, **TEST_COLUMNS),
            table_of("errors", "Errors while something is played", errors, **columns),
        ),
        about={"folds": grouped.scores.folds},
    )


class Played(NamedTuple):
    """Errors of a model on a data set in which something is played: score, and that of chance."""

    title: str
    score: Score
    chance: float


def played(results: TaskResults, result: Result) -> list[Played]:
    """Return the errors at home, then on the other data sets in which something is played."""
    table = result.tables["errors"]
    columns = (table.numbers(key) for key in ("mean", "sd", "chance"))
    titles = [
        results.others[str(name)].title if name else results.dataset_title
        for name in table.column("data_set")
    ]
    return [
        Played(title, Score(float(mean), float(sd)), float(chance))
        for title, mean, sd, chance in zip(titles, *columns, strict=True)
    ]


def tests_of(results: TaskResults) -> list[tuple[Result, dict]]:
    """Return the tests on silence, rows of the table `silence`, each with its model's result.

    p values are corrected for all tests on the page, and decide which model is flagged.
    """
    from ajgdata.evaluate.shortcut_test import LEVEL

    corrected = results.corrected(p_values(results))
    rows = [(result, row) for result in results.results for row in result.tables["silence"].rows]
    return [
        (result, row | {"p": p, "flagged": p < LEVEL})
        for (result, row), p in zip(rows, corrected, strict=True)
    ]


def p_values(results: TaskResults) -> list[float]:
    """Return the p value of each test, without correction."""
    tables = [result.tables["silence"] for result in results.results]
    return [float(p) for table in tables for p in table.numbers("p")]


def finding(results: TaskResults) -> str:
    """Return whether a model is flagged, and where it errs how much, in a few words."""
    flagged = [result for result, row in tests_of(results) if row["flagged"]]
    shown = (flagged or list(results.results))[0]
    home, *others = played(results, shown)
    told = [f"{shown_score(results, one.score)} on {one.title}" for one in others]
    errors = ", ".join([f"{shown_score(results, home.score)} where it was trained", *told])
    learned = "learned a sound that is not the object's" if flagged else "is not flagged by silence"
    return f"{shown.label} {learned}: {metric_name(results)} {errors}"


def figure(results: TaskResults) -> Figure:
    """Return errors where models were trained and elsewhere, and what is left in silence."""
    from ajgdata.report.canvas import WIDTH_IN, new_figure

    drawn = new_figure(
        (WIDTH_IN, 3.7),
        finding(results),
        f"{results.title}: {metric_name(results)}, mean ± sd over "
        f"{results.results[0].about['folds']} folds; what is predicted from silence, and the truth",
        [results.source],
    )
    left, right = drawn.subplots(1, 2, width_ratios=(3, 2))
    _errors(left, results)
    _silence(right, results)
    return drawn


def _errors(axes: Axes, results: TaskResults) -> None:
    """Draw for each model a point with its spread for each data set, side by side."""
    from ajgdata.report.canvas import model_style
    from ajgdata.report.labels import LABEL_PT, label_end, reference_line, wrapped

    models = [played(results, result) for result in results.results]
    for i, other in enumerate(models[0]):
        title = f"{'on' if i else 'held out of'} {other.title}"
        place = np.arange(len(models)) + 0.16 * (i - (len(models[0]) - 1) / 2)
        mean = [results.scale * model[i].score.mean for model in models]
        sd = [results.scale * model[i].score.sd for model in models]
        style: dict[str, Any] = {**model_style(i), "ls": "", "ms": 7, "capsize": 3}
        style["mfc"] = "white" if i else style["color"]
        axes.errorbar(place, mean, sd, label=title, **style)
        name = "\n".join(wrapped(title, 1.1, LABEL_PT))
        label_end(axes, float(place[-1]), mean[-1], name, str(style["color"]))
    reference_line(axes, "chance", results.scale * models[0][0].chance, "chance")
    axes.set_xticks(range(len(models)), [result.label for result in results.results])
    axes.set_xlim(-0.5, len(models) - 0.5)
    axes.set_ylim(bottom=0)
    axes.grid(False, axis="x")
    axes.set_ylabel(metric_axis(results))


def _silence(axes: Axes, results: TaskResults) -> None:
    """Draw a bar for each model, in another colour if it is flagged, and chance across it."""
    from ajgdata.report.canvas import COLOURS, GREY
    from ajgdata.report.labels import label_end

    tests = tests_of(results)
    colours = [COLOURS[3] if row["flagged"] else "white" for _, row in tests]
    values = [row["value"] for _, row in tests]
    axes.bar(range(len(tests)), values, 0.6, color=colours, ec=COLOURS[3], lw=1.2)
    null, place = [row["null"] for _, row in tests], np.arange(len(tests))
    axes.hlines(null, place - 0.4, place + 0.4, color=GREY, ls=":")
    label_end(axes, float(place[-1]) + 0.4, float(null[-1]), "labels\nexchanged", GREY)
    style: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "fontsize": 8}
    for x, (_, row) in enumerate(tests):
        told = "flagged" if row["flagged"] else "not\nflagged"
        text = f"{told}\np = {number(row['p'], 2)}"
        axes.annotate(text, (x, max(row["value"], row["null"])), (0, 3), **style)
    axes.set_xticks(range(len(tests)), [result.label for result, _ in tests])
    axes.grid(False, axis="x")
    axes.margins(y=0.4)
    axes.set_ylim(bottom=0)
    axes.set_ylabel(f"{tests[0][1]['measure']}, speaker silent")


def _verdict(results: TaskResults, result: Result, row: dict) -> str:
    """Return whether a model is flagged, in a sentence."""
    found = f"{row['measure']} with the truth {number(row['value'], 2)}"
    by_chance = f"{number(row['null'], 2)} with labels exchanged, p = {number(row['p'], 2)}"
    flagged = "flagged: it has learned a sound that is not the object's"
    verdict = flagged if row["flagged"] else "not flagged"
    title = results.others[row["data_set"]].title
    return f"{result.label} on {title}: {found}, {by_chance}: {verdict}."


def caption(results: TaskResults) -> Caption:
    """Return the caption of `figure`."""
    listed = []
    for result in results.results:
        home, *others = played(results, result)
        told = (f", {shown_score(results, one.score)} on {one.title}" for one in others)
        listed.append(f"{result.label}: {shown_score(results, home.score)}{''.join(told)}")
    verdicts = " ".join(_verdict(results, *test) for test in tests_of(results))
    period = ""
    if results.period_deg is not None:
        way = with_unit(number(results.period_deg), "°")
        period = f" Errors are the shortest way round of {way}."
    return Caption(
        f"Left: models of {results.title} on grasps held out of their own data set and on the "
        f"same grasps elsewhere. Right: recordings with the speaker silent hold nothing of the "
        f"object; dotted: chance, labels of grasps exchanged. p is corrected for the "
        f"{results.tests_on_page(p_values(results))} tests on this page (Holm). "
        f"{verdicts}{period}",
        f"{sentence(finding(results))}. {'; '.join(listed)}. {verdicts}",
    )


def figures(results: TaskResults) -> list[Illustration]:
    """Return the one figure of all models."""
    if not results.results:
        return []
    return [Illustration(results.named(), caption(results), lambda: figure(results))]


EXPERIMENT = Experiment(
    name="shortcut",
    title="Shortcut",
    settings=Settings,
    measure=measure,
    figures=figures,
    by_model=True,
    order=15,
    p_values=p_values,
)
