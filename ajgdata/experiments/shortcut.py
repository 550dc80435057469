"""Shortcut: does a model hear the object, or a sound that comes with the label?

The models of cross-validation are asked about recordings made with the speaker silent, which hold
nothing of the object (see `evaluate.shortcut_test`).
"""

from __future__ import annotations

import dataclasses

from pydantic import Field, model_validator

from ajgdata.experiments.base import Experiment, Inputs, Outcome, Result, TaskResults, score_table
from ajgdata.experiments.cross_validation import evaluate
from ajgdata.experiments.cross_validation_results import GROUPED, elsewhere
from ajgdata.experiments.plots import Plot, points_for
from ajgdata.report.format import mean_sd, number
from ajgdata.types import ModelName, Name, Strict
from ajgdata.types.table import Table, table_of

TEST_COLUMNS = {
    "data_set": "Data set", "measure": "Measure", "value": "Dependence", "null": "By chance",
    "permutations": "Permutations", "p": "p", "flagged": "Flagged",
}  # fmt: skip
ERROR_COLUMNS = {
    "data_set": "Tested on", "fold": "Fold", "metric": "Metric", "value": "Value",
    "chance": "Chance",
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
        {"data_set": name, "fold": fold, "metric": metric, "value": value}
        | {"chance": one.chance[metric]}
        for name, one in tested.items()
        for fold, value in enumerate(one.per_fold[metric])
    )
    told = ({"data_set": name, **dataclasses.asdict(test)} for name, test in tests.items())
    return Outcome(
        (
            score_table(scores, "Dependence of predictions from silence on the truth"),
            table_of("silence", "Tests of predictions from silence", told, **TEST_COLUMNS),
            table_of("errors", "Errors while something is played", errors, **ERROR_COLUMNS),
        )
    )


def errors_of(results: TaskResults) -> Table:
    """Return the errors per model, data set and fold; the own data set has its title."""
    rows = [
        {**row, "model": result.label, "data_set": row["data_set"] or results.dataset_title}
        for result in results.results
        for row in result.tables["errors"].rows
    ]
    return table_of("errors", "Errors", rows, model="Model", **ERROR_COLUMNS)


def tests_of(results: TaskResults) -> list[tuple[Result, dict]]:
    """Return the tests on silence, rows of the table `silence`, each with its model's result.

    p values are corrected for the tests of the task (Holm), and decide which model is flagged.
    """
    from ajgdata.evaluate.fold_tests import holm  # SciPy
    from ajgdata.evaluate.shortcut_test import LEVEL

    rows = [(result, row) for result in results.results for row in result.tables["silence"].rows]
    corrected = holm([float(row["p"]) for _, row in rows])
    return [
        (result, row | {"p": p, "flagged": p < LEVEL})
        for (result, row), p in zip(rows, corrected, strict=True)
    ]


def finding(results: TaskResults) -> str:
    """Return whether a model is flagged, and its error on each data set."""
    flagged = [result for result, row in tests_of(results) if row["flagged"]]
    shown = (flagged or list(results.results))[0]
    points = points_for(results, ERRORS, model=shown.label)
    errors = [f"{mean_sd(one.score, results.shown_unit)} on {one.x}" for one in points]
    learned = "learned a sound that is not the object's" if flagged else "is not flagged by silence"
    return f"{shown.label} {learned}: {results.metric_title} {', '.join(errors)}"


def verdicts(results: TaskResults) -> str:
    """Return a sentence per test: dependence, chance, corrected p, and whether it is flagged."""
    if not results.results:
        return ""
    lines = []
    for result, row in tests_of(results):
        verdict = "flagged" if row["flagged"] else "not flagged"
        lines.append(
            f"{result.label} on {results.others[row['data_set']].title}: {row['measure']} with the "
            f"truth {number(row['value'], 2)}, {number(row['null'], 2)} with labels exchanged, "
            f"p = {number(row['p'], 2)}: {verdict}."
        )
    return f"{' '.join(lines)} p is corrected for {len(lines)} tests (Holm)."


ERRORS = Plot(
    "rows",
    errors_of,
    "errors on held-out grasps of the own data set, and on the same grasps elsewhere",
    x="data_set",
    chance="chance",
    title=finding,
)
EXPERIMENT = Experiment(
    name="shortcut",
    title="Shortcut",
    settings=Settings,
    measure=measure,
    plots=(ERRORS,),
    summary=verdicts,
    by_model=True,
    order=15,
)
