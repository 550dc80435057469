"""Sorting by sound with held-out recordings, in random order until no class is probable enough."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from pydantic import Field

from ajgdata.evaluate.agreement import ACCEPTED, Interval, compare
from ajgdata.evaluate.parts import GROUPED, part_columns
from ajgdata.experiments.base import (
    Experiment,
    Inputs,
    Lookup,
    Outcome,
    TaskResults,
)
from ajgdata.experiments.plots import PERCENTILES, Plot
from ajgdata.experiments.scores import ScoreKey, ScoreRow, score_table
from ajgdata.report.comparison import Mark, PaperComparison
from ajgdata.report.format import number, with_unit
from ajgdata.types import ModelName, Strict
from ajgdata.types.table import Table, table_of

Row = dict[str, Any]
RUNS = 500  #: simulated runs of sorting, each with its own seed
PLAIN = "plain"  #: probabilities as the model gives them; the others are scaled by a temperature
#: Results of a run, the main result first: its metric, and its name.
RUN_METRICS = {
    "before_error": ("sorted_before_error", "before the first error"),
    "sorts": ("sorts_in_a_row", "by the paper's rule"),
}


class Settings(Strict):
    """Sorting by sound, offline: objects in random order until none is probable enough."""

    threshold: float = Field(0.6, gt=0, le=1, description="probability that is enough (paper)")
    models: tuple[ModelName, ...] = Field(("cnn",), min_length=1, description="models that sort")


def measure(inputs: Inputs, settings: Settings, model: str) -> Outcome:
    """Return the calibration of `model`, and runs of sorting the objects of the task."""
    from ajgdata.evaluate.calibration import calibration_error, reliability
    from ajgdata.evaluate.in_use import calibrated
    from ajgdata.evaluate.sorting import decisions, run_of, shares, stream

    data = inputs.data()
    result = calibrated(
        data.feature, data.value, data.group, model=model, folds=inputs.folds, seed=inputs.seed
    )
    label = np.searchsorted(result.classes, data.value)
    scores: list[ScoreRow] = []
    bins, conditions, runs = list[Row](), list[Row](), list[Row]()
    for name, probability in ((PLAIN, result.plain), ("scaled", result.scaled)):
        reliable = reliability(probability.max(axis=1), probability.argmax(axis=1) == label)
        bins += [{"part": name, **dataclasses.asdict(interval)} for interval in reliable]
        taken = decisions(probability, settings.threshold)
        conditions.append({"part": name, **shares(probability, taken, label)})
        own_runs = [
            {"part": name, "run": n, **vars(run_of(taken, label, stream(label, inputs.seed + n)))}
            for n in range(RUNS)
        ]
        key = ScoreKey(model, *part_columns(GROUPED, inputs.dataset), condition=name)
        scores.append(ScoreRow("calibration_error", "pooled", calibration_error(reliable), key))
        scores += _scores(key, conditions[-1], own_runs)
        runs += own_runs
    part_column = {"part": "Probabilities"}
    fields = {key: key for key in bins[0]} | {"confidence": "Probability", "accuracy": "Correct"}
    of_grasps = {"accuracy": "Accuracy", "accepted": "Accepted", "right": "Correct of those"}
    of_runs = {"run": "Run", "sorts": "Objects sorted by the paper's rule"}
    of_runs |= {"before_error": "Objects before the first error", "mistakes": "In a wrong bin"}
    return Outcome(
        (
            score_table(scores, "Sorting"),
            table_of("reliability", "Reliability", bins, **fields | part_column),
            table_of("conditions", "Decisions", conditions, **part_column, **of_grasps),
            table_of("runs", "Simulated runs", runs, **part_column, **of_runs),
        )
    )


def _scores(key: ScoreKey, decided: Mapping[str, Any], runs: Sequence[Row]) -> Iterator[ScoreRow]:
    """Yield the scores of decisions, and of the runs that they lead to."""
    accepted = key._replace(condition=f"{key.condition}, {ACCEPTED}")
    yield ScoreRow("accuracy", "pooled", decided["accuracy"], key)
    yield ScoreRow("share", "pooled", decided["accepted"], accepted)
    yield ScoreRow("accuracy", "pooled", decided["right"], accepted)
    for run in runs:
        for name, (metric, _) in RUN_METRICS.items():
            yield ScoreRow(metric, f"run {run['run']}", run[name], key)


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield the runs of each model with its plain probabilities; the paper mentions no scaling.

    What is sorted before the first error is compared with the published count.
    """
    from ajgdata.evaluate.sorting import LONGEST_RUN

    paper = results.paper
    if paper is None or paper.value is None:
        return
    for result in results.results:
        (condition,) = result.tables["conditions"].where(part=PLAIN).rows
        runs = result.tables["runs"].where(part=PLAIN)
        low, middle, high = map(float, np.percentile(runs.numbers("before_error"), PERCENTILES))
        ours = Mark("ours", middle, low, high)
        if middle >= LONGEST_RUN:  # a longer run was not tried
            ours = ours._replace(value=np.inf, low=float(LONGEST_RUN))
        text = _text(runs, condition, paper.unit)
        if runs.numbers("sorts").max() >= LONGEST_RUN:
            text += f"; runs end at {number(LONGEST_RUN, 4)}"
        # A count has no perfect value, so the published value takes its place.
        spread = Interval(low, high)
        verdict = compare(middle, spread, paper.value, chance=0.0, perfect=paper.value)
        label = "held-out grasps"
        yield results.compared(paper, text, result.label, verdict, marks=(ours,), label=label)


def _text(runs: Table, condition: Row, unit: str) -> str:
    """Return both results of runs, with the share of accepted objects in a wrong bin."""
    parts = []
    for key, (_, name) in RUN_METRICS.items():
        low, middle, high = map(number, np.percentile(runs.numbers(key), PERCENTILES))
        parts.append(f"{with_unit(f'{middle} ({low} to {high})', unit)} {name}")
        unit = ""
    wrong = 1 - condition["right"] if condition["accepted"] else 0.0
    return f"{'; '.join(parts)}, {number(100 * wrong, 2)} % in a wrong bin"


def finding(results: TaskResults) -> str:
    """Return the runs of the first model with its plain probabilities."""
    first = results.results[0]
    runs = first.tables["runs"].where(part=PLAIN).numbers("before_error")
    low, middle, high = map(number, np.percentile(runs, PERCENTILES))
    return f"{first.label}: {middle} objects before the first error (90 % of runs: {low} to {high})"


LENGTHS = Plot(
    "histogram",
    "runs",
    "objects sorted before the first error, in simulated runs on held-out grasps in random order; "
    "a run ends when no class is probable enough",
    value="before_error",
    x="run",
    series=("model", "part"),
    over="runs",
    published="value",
    title=finding,
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
    percent=("accuracy", "confidence"),
    ideal=True,
    name="reliability",
)
EXPERIMENT = Experiment(
    name="sorting",
    order=40,
    title="Sorting",
    settings=Settings,
    measure=measure,
    plots=(LENGTHS, RELIABILITY),
    paper_comparison=paper_comparison,
    by_model=True,
    kinds=("classification",),
)
