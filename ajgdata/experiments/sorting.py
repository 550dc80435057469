"""Sorting by sound with held-out recordings, in random order until no class is probable enough."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from pydantic import Field

from ajgdata.evaluate.agreement import verdict_on_count
from ajgdata.experiments.base import (
    Experiment,
    Inputs,
    Lookup,
    Outcome,
    Result,
    ScoreRow,
    TaskResults,
    score_table,
)
from ajgdata.experiments.plots import PERCENTILES, Plot
from ajgdata.report.comparison import Mark, PaperComparison
from ajgdata.report.format import number, with_unit
from ajgdata.types import ModelName, Strict
from ajgdata.types.table import Table, table_of

Row = dict[str, Any]
RUNS = 500  #: simulated runs of sorting, each with its own seed
LONGEST_RUN = 1000  #: objects after which a run ends
PARTS = ("plain", "scaled")  #: probabilities as they are, and scaled by a temperature
#: Results of a run, the main result first: its metric, and its name.
RUN_METRICS = {
    "before_error": ("sorted_before_error", "before the first error"),
    "sorts": ("sorts_in_a_row", "by the paper's rule"),
}
SHARE_COLUMNS = {
    "accuracy": "Accuracy", "accepted": "Accepted", "right": "Correct of those",
    "wrong": "In a wrong bin", "mean_looks": "Looks",
}  # fmt: skip
RUN_COLUMNS = {"run": "Run", "sorts": "Objects sorted by the paper's rule"}
RUN_COLUMNS |= {"before_error": "Objects sorted before the first error"}
RUN_COLUMNS |= {"mistakes": "In a wrong bin"}


class Settings(Strict):
    """Sorting by sound, offline: objects in random order until none is probable enough."""

    threshold: float = Field(0.6, gt=0, le=1, description="probability that is enough (paper)")
    models: tuple[ModelName, ...] = Field(("cnn",), min_length=1, description="models that sort")


def measure(inputs: Inputs, settings: Settings, model: str) -> Outcome:
    """Return the calibration of `model`, and runs of sorting the objects of the task."""
    from ajgdata.evaluate.calibration import calibration_error, reliability
    from ajgdata.evaluate.in_use import calibrated
    from ajgdata.evaluate.sorting import look, run_of, stream

    data = inputs.data()
    found = calibrated(
        data.feature, data.value, data.group, model=model, folds=inputs.folds, seed=inputs.seed,
        limits=inputs.most_recordings,
    )  # fmt: skip
    label = np.searchsorted(found.classes, data.value)
    scores: list[ScoreRow] = []
    bins, conditions, runs = [], [], []
    for name, probability in zip(PARTS, (found.plain, found.scaled), strict=True):
        reliable = reliability(probability.max(axis=1), probability.argmax(axis=1) == label)
        bins += [{"part": name, **dataclasses.asdict(one)} for one in reliable]
        decided = look(probability[:, np.newaxis], settings.threshold)
        condition = {"part": name, **decided.shares(label)}
        orders = (stream(label, inputs.seed + n) for n in range(RUNS))
        own = [run_of(decided.taken, label, order) for order in orders]
        own_rows = [{"part": name, "run": n, **vars(one)} for n, one in enumerate(own)]
        part, error = f"sorting, {name}", calibration_error(reliable)
        scores += [(model, part, "calibration_error", "pooled", error)]
        scores += sorting_scores(model, part, condition, own_rows)
        conditions.append(condition)
        runs += own_rows
    columns = {"part": "Probabilities"}
    fields = {key: key for key in bins[0]} | {"confidence": "Probability", "accuracy": "Correct"}
    return Outcome(
        (
            score_table(scores, "Sorting"),
            table_of("reliability", "Reliability", bins, **fields | columns),
            table_of("conditions", "Decisions", conditions, **columns, **SHARE_COLUMNS),
            table_of("runs", "Simulated runs", runs, **columns, **RUN_COLUMNS),
        )
    )


def sorting_scores(
    model: str, part: str, condition: Mapping[str, Any], runs: Iterable[Row]
) -> Iterator[ScoreRow]:
    """Yield the scores of decisions, and of the runs that they lead to."""
    yield model, part, "accuracy", "pooled", condition["accuracy"]
    yield model, f"{part}, accepted", "share", "pooled", condition["accepted"]
    yield model, f"{part}, accepted", "accuracy", "pooled", condition["right"]
    for run in runs:
        for key, (metric, _) in RUN_METRICS.items():
            yield model, part, metric, f"run {run['run']}", run[key]


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield the runs of each model with its plain probabilities; the paper mentions no scaling."""
    for result in results.results:
        yield from run_comparison(results, result, LONGEST_RUN, "held-out grasps", part=PARTS[0])


def run_comparison(
    results: TaskResults, result: Result, longest: int, label: str, **which: Any
) -> Iterator[PaperComparison]:
    """Yield both results of the runs `which`, that end at `longest`; the first is compared."""
    paper = results.paper
    if paper is None or paper.value is None:
        return
    (condition,) = result.tables["conditions"].where(**which).rows
    runs = result.tables["runs"].where(**which)
    low, middle, high = map(float, np.percentile(runs.numbers("before_error"), PERCENTILES))
    ours = Mark("ours", middle, low, high)
    if middle >= longest:  # a longer run was not tried
        ours = ours._replace(value=np.inf, low=float(longest))
    yield results.compared(
        paper, _text(runs, condition, paper.unit, longest), result.label,
        verdict_on_count(middle, low, high, paper.value), marks=(ours,), label=label,
    )  # fmt: skip


def _text(runs: Table, condition: Row, unit: str, longest: int) -> str:
    """Return both results of runs, with the share of accepted objects in a wrong bin."""
    said = []
    for key, (_, name) in RUN_METRICS.items():
        low, middle, high = map(number, np.percentile(runs.numbers(key), PERCENTILES))
        said.append(f"{with_unit(f'{middle} ({low} to {high})', unit)} {name}")
        unit = ""
    wrong = 1 - condition["right"] if condition["accepted"] else 0.0
    ends = f"; runs end at {number(longest, 4)}" if runs.numbers("sorts").max() >= longest else ""
    return f"{'; '.join(said)}, {number(100 * wrong, 2)} % in a wrong bin{ends}"


LENGTHS = Plot(
    "histogram",
    "runs",
    "objects sorted before the first error, in simulated runs on held-out grasps in random order; "
    "a run ends when no class is probable enough",
    value="before_error",
    x="run",
    series=("model", "part"),
    over="runs",
    better="high",
    published="value",
)
RULE = replace(
    LENGTHS,
    about=f"objects sorted by the paper's rule in the same runs, {LONGEST_RUN:,} at most",
    value="sorts",
    name="rule",
    folded="Sorted by the paper's rule",
)
RELIABILITY = Plot(
    "lines",
    "reliability",
    "share of correct predictions against their probability, as the model gives it (plain) and "
    "scaled by a temperature from other grasps",
    value="accuracy",
    x="confidence",
    series=("model", "part"),
    over="bins",
    better="high",
    percent=True,
    ideal=True,
    name="reliability",
)
EXPERIMENT = Experiment(
    name="sorting",
    order=40,
    title="Sorting",
    settings=Settings,
    measure=measure,
    plots=(LENGTHS, RULE, RELIABILITY),
    paper_comparison=paper_comparison,
    by_model=True,
    kinds=("classification",),
)
