"""Repeated fits: the error on other data sets over many fits, as a median with an interval.

The fits differ by their folds and by the random state of the model. The models are trained on the
task's own data set only.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from ajgdata.evaluate.agreement import Interval, compare
from ajgdata.experiments.base import (
    SCORES,
    Experiment,
    Inputs,
    Lookup,
    Outcome,
    Result,
    TaskResults,
    score_table,
)
from ajgdata.report.blocks import Illustration, ShownTable
from ajgdata.report.comparison import Mark, PaperComparison
from ajgdata.report.format import Caption, number, sentence, with_unit
from ajgdata.types import ModelName, Name, Strict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Features that let less noise in than the default, whatever their errors are.
LESS_NOISE = ("feature:stft root_power", "feature:sweep_tracking magnitude 0.05 s")


class Settings(Strict):
    """Error on other data sets over many fits of models that are trained on the task's own."""

    test_on: tuple[Name, ...] = Field(
        min_length=1, description="data sets that the models are tested on, e.g. under noise"
    )
    repeats: int = Field(10, ge=3, le=100, description="cross-validations with other seeds")
    models: tuple[ModelName, ...] = Field(
        ("cnn",), min_length=1, description="models; the first is compared with the paper"
    )


def measure(inputs: Inputs, settings: Settings, model: str) -> Outcome:
    """Return the error of `model` on each data set: of each fit, the median, and the interval."""
    from ajgdata.evaluate.crossval import ExtraTestSet, cross_validate
    from ajgdata.evaluate.resampling import grasp_errors, repeat_seed, robust_error

    own = inputs.data()
    tests = {name: inputs.data(name) for name in settings.test_on}
    extra = {name: ExtraTestSet(d.feature, d.value, d.group) for name, d in tests.items()}
    squared: dict[str, list[np.ndarray]] = {name: [] for name in tests}
    chance: dict[str, list[float]] = {name: [] for name in tests}
    folds = min(inputs.folds, len(np.unique(own.group)))
    begun = time.process_time()
    for repeat in range(settings.repeats):
        split = inputs.split | {"folds": folds, "seed": repeat_seed(inputs.seed, repeat)}
        found = cross_validate(
            own.feature, own.value, own.group, model=model, extra_tests=extra, **split
        )
        for name, rows in squared.items():
            predictions = found.extra_tests[name].predictions
            rows.append(grasp_errors(predictions, tests[name].group, inputs.period_deg))
            chance[name].append(found.extra_tests[name].scores.chance["rmse"])
    spent = time.process_time() - begun
    scores: list[tuple[str, str, str, str, float]] = []
    for name, rows in squared.items():
        error = robust_error(np.array(rows), inputs.seed)
        named = model, part_of(name), "rmse"
        scores += [(*named, f"fit {n}", value) for n, value in enumerate(error.per_fit)]
        scores += [(*named, key, getattr(error, key)) for key in ("median", "low", "high")]
        scores.append((*named, "chance", float(np.mean(chance[name]))))
        ends = zip(("5 %", "50 %", "95 %"), error.grasps, strict=True)
        scores += [(*named, f"grasps, {key}", value) for key, value in ends]
    counts = {name: [len(np.unique(d.group)), len(d.group)] for name, d in tests.items()}
    cost = [(model, "cost of repeated fits", "train_and_predict_s", "measured", spent)]
    title = "Repeated fits"
    return Outcome((score_table(scores, title),), (score_table(cost, title),), {"counts": counts})


def part_of(name: str) -> str:
    """Return the part of the scores that is of a data set."""
    return f"repeated fits on:{name}"


def robust_score(result: Result, name: str, statistic: str) -> float:
    """Return a statistic of the RMSE on a data set."""
    rows = result.tables[SCORES].where(part=part_of(name), statistic=statistic)
    return float(rows.numbers("value")[0])


def shown(results: TaskResults, result: Result, name: str) -> str:
    """Return `20 mm (95 % interval 17 to 22)`."""
    median, low, high = (robust_score(result, name, key) for key in ("median", "low", "high"))
    ends = f"{number(low)} to {number(high)}"
    return f"{with_unit(number(median), results.shown_unit)} (95 % interval {ends})"


def fits_of(result: Result, name: str) -> np.ndarray:
    """Return the RMSE (fits,) of each fit on a data set."""
    table = result.tables[SCORES].where(part=part_of(name))
    rows = zip(table.column("statistic"), table.numbers("value"), strict=True)
    return np.array([value for statistic, value in rows if str(statistic).startswith("fit ")])


def finding(results: TaskResults) -> str:
    """Return the median of the first model on the first data set, and the range of its fits."""
    result, name = results.results[0], results.settings.test_on[0]
    fits = fits_of(result, name)
    ends = f"{number(min(fits))} to {with_unit(number(max(fits)), results.shown_unit)}"
    title = results.others[name].title
    return f"{result.label} on {title}: {shown(results, result, name)}; single fits {ends}"


def figure(results: TaskResults) -> Figure:
    """Return the RMSE of each fit, and the median with its interval, by data set and model."""
    from ajgdata.report.canvas import WIDTH_IN, line_style, new_figure
    from ajgdata.report.labels import reference_line

    about = "RMSE of each cross-validation (dots), median with 95 % interval (line)"
    drawn = new_figure((WIDTH_IN, 3.0), finding(results), about, [results.source])
    axes = drawn.subplots()
    lines = [(name, result) for name in results.settings.test_on for result in results.results]
    for place, (name, result) in enumerate(lines):
        style = line_style(results.results.index(result))
        fits = fits_of(result, name)
        axes.plot(fits, np.full(len(fits), place), "o", color=style["color"], ms=3, alpha=0.4)
        median, low, high = (robust_score(result, name, key) for key in ("median", "low", "high"))
        axes.plot([low, high], [place, place], color=style["color"], lw=2)
        axes.plot(median, place, color=style["color"], marker=style["marker"], ms=6)
    labels = [f"{results.others[name].title}\n{result.label}" for name, result in lines]
    axes.set_yticks(range(len(lines)), labels)
    axes.set(xlabel=f"RMSE ({results.shown_unit})", ylim=(-0.6, len(lines) - 0.4))
    axes.set_xlim(left=0)
    if results.paper is not None and results.paper.value is not None:
        paper = results.paper.value
        reference_line(axes, "paper", paper, f"the paper: {number(paper)}", "x")
    return drawn


def figures(results: TaskResults) -> list[Illustration]:
    """Return the figure of all fits."""
    caption = Caption(
        "RMSE on recordings that the models were not trained for, in repeated cross-validations"
        f" with other folds and random states ({results.source}). Dots: single cross-validations."
        " Line and mark: median, with its 95 % bootstrap interval over grasps and fits.",
        f"{sentence(finding(results))}.",
    )
    return [Illustration(results.named(), caption, partial(figure, results))]


def tables(results: TaskResults) -> list[ShownTable]:
    """Return the median, its interval, the range of fits, and the errors of single grasps."""
    heads = ("Tested on", "Model", "RMSE, median of fits (95 % interval)|", "Least fit|",
             "Largest fit|", "One grasp, median (5th to 95th percentile)|", "Grasps|",
             "Recordings|")  # fmt: skip
    rows = []
    for name in results.settings.test_on:
        for result in results.results:
            fits = fits_of(result, name)
            low, middle, high = (
                number(robust_score(result, name, f"grasps, {key}"))
                for key in ("5 %", "50 %", "95 %")
            )
            grasps, recordings = result.about["counts"][name]
            rows.append(
                (
                    results.others[name].title, result.label, shown(results, result, name),
                    number(min(fits)), number(max(fits)), f"{middle} ({low} to {high})",
                    str(grasps), str(recordings),
                )
            )  # fmt: skip
    unit = results.shown_unit or "the unit of the label"
    caption = (
        f"{results.settings.repeats} cross-validations with other folds and other random states of"
        " the models, which are trained on the task's own data set only. The interval is a"
        f" bootstrap over grasps and fits. Errors in {unit}."
    )
    return [ShownTable(caption, heads, tuple(rows))]


def paper_comparison(results: TaskResults, lookup: Lookup) -> Iterator[PaperComparison]:
    """Yield the median over fits of the first model on the first data set, and other models."""
    paper = results.paper
    if paper is None or paper.value is None:
        return
    name = results.settings.test_on[0]
    first, *others = results.results
    median, low, high, chance = (
        robust_score(first, name, key) for key in ("median", "low", "high", "chance")
    )
    text = [shown(results, first, name)]
    text += [f"{one.label}: {shown(results, one, name)}" for one in others]
    yield PaperComparison(
        paper,
        results.dataset,
        results.task,
        results.source,
        "; ".join(text),
        first.label,
        compare(median, Interval(low, high), paper.value, chance=chance, perfect=0.0),
        marks=(Mark("ours", first.label, median, low, high),),
        note=feature_note(results, lookup, name),
    )


def feature_note(results: TaskResults, lookup: Lookup, name: str) -> str:
    """Return the errors with features that let less noise in, if they were measured."""
    from ajgdata.experiments.feature_quantity.shown import label_of_model
    from ajgdata.experiments.stft_settings import error_of

    measured = lookup("feature_quantity", results.dataset, results.task)
    if measured is None or name not in measured.settings.test_on:
        return ""
    (result,) = measured.results
    labels = {str(row["part"]): str(row["label"]) for row in result.tables["features"].rows}
    listed = []
    for model in measured.settings.models:
        scores = result.tables[SCORES].where(model=model)
        errors = [
            f"{number(error_of(measured, scores.where(part=f'{part} on:{name}'))[0])}"
            f" ({labels[part]})"
            for part in LESS_NOISE
            if part in labels
        ]
        listed += [f"{label_of_model(measured, model)} {', '.join(errors)}"] if errors else []
    unit = f" in {results.shown_unit}" if results.shown_unit else ""
    text = f"With features that let less noise in, RMSE{unit}: {'; '.join(listed)}."
    return text if listed else ""


EXPERIMENT = Experiment(
    name="repeated_fits",
    order=70,
    title="Repeated fits",
    settings=Settings,
    measure=measure,
    figures=figures,
    tables=tables,
    paper_comparison=paper_comparison,
    by_model=True,
    kinds=("regression",),
)
