"""Novel objects: how often an object that is not in the training data raises the alarm.

In each round one class is withheld, and some grasps of each other class. Distance and threshold are
those of a trained model (`evaluate.novelty`). Intervals of detected objects are over classes, those
of false alarms over grasps, because several rounds test the same grasps.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field

from ajgdata.evaluate.agreement import GRASP_INTERVAL
from ajgdata.evaluate.task_data import TaskData
from ajgdata.experiments.base import (
    Experiment,
    Inputs,
    Outcome,
    ScoreRow,
    TaskResults,
    score_table,
)
from ajgdata.experiments.plots import Plot
from ajgdata.report.format import number
from ajgdata.types import NotPossibleError, Strict
from ajgdata.types.table import table_of

TITLE = "Novel objects"
#: Of the stated rates, the one that is shown by class, and in the title.
SHOWN = 0.05
METRICS = ("detected", "false_alarm")


class Settings(Strict):
    """Rate of alarms for objects that are not in the training data: one class is withheld at a
    time."""

    false_alarms: tuple[Annotated[float, Field(gt=0, lt=1)], ...] = Field(
        (0.01, 0.05, 0.1, 0.2),
        min_length=1,
        description="shares of grasps of known classes that may raise the alarm",
    )


class Round(NamedTuple):
    """One round at one stated rate: whether recordings of the withheld class raised the alarm (m,),
    whether held-out recordings of the other classes did (n,), and their groups (n,)."""

    withheld: str
    stated: float
    new: np.ndarray
    known: np.ndarray
    group: np.ndarray


def measure(inputs: Inputs, settings: Settings, _: str) -> Outcome:
    """Return the shares of recordings of unknown and known classes that raise the alarm."""
    from threadpoolctl import threadpool_limits

    data = inputs.data()
    grasp = _grasps(inputs, data)
    if len(classes := np.unique(data.value)) < 3:
        raise NotPossibleError("one class is withheld and two must remain: record at least three")
    begun = time.process_time()
    with threadpool_limits(limits=1):
        tests = [
            test
            for n, withheld in enumerate(classes.tolist())
            for test in _round(inputs, settings, data, grasp, n, withheld)
        ]
    cpu_s = time.process_time() - begun
    rounds = [
        {"stated": test.stated, "withheld": test.withheld}
        | {"detected": float(test.new.mean()), "false_alarm": float(test.known.mean())}
        for test in tests
    ]
    shares = [
        row
        for stated in settings.false_alarms
        for row in _shares(stated, [test for test in tests if test.stated == stated], inputs.seed)
    ]
    of_rounds = {"withheld": "Withheld class", "detected": "Detected", "false_alarm": "False alarm"}
    of_shares = {"metric": "Share of", "share": "Share", "low": "95 % from", "high": "to"}
    tables = (
        score_table(_scores(rounds, shares), TITLE),
        table_of("rounds", TITLE, rounds, stated="Stated", **of_rounds),
        table_of("shares", TITLE, shares, stated="Stated", **of_shares),
    )
    cost = score_table([("", "cost of novelty", "train_cpu_s", "measured", cpu_s)], TITLE)
    return Outcome(tables, (cost,))


def _grasps(inputs: Inputs, data: TaskData) -> np.ndarray:
    """Return the grasp of each recording of `data` (n,)."""
    columns = inputs.store.columns
    names, grasps = columns["recording"].values.tolist(), columns["grasp_id"].values.tolist()
    grasp_of = dict(zip(names, grasps, strict=True))
    return np.array([grasp_of[name] for name in data.name.tolist()])


def _round(
    inputs: Inputs, settings: Settings, data: TaskData, grasp: np.ndarray, n: int, withheld: str
) -> Iterator[Round]:
    """Yield the round `n` of the class `withheld` for each stated rate; it holds out fold `n`, and
    the first again after the last."""
    from ajgdata.evaluate.novelty import Guard, held_out_distances, threshold_at
    from ajgdata.evaluate.splits import grouped_folds

    remaining = np.flatnonzero(data.value != withheld)
    y, group = data.value[remaining], data.group[remaining]
    split = inputs.kind, min(inputs.folds, len(np.unique(group))), inputs.seed
    parts = grouped_folds(y, group, *split)
    train, test = (remaining[part] for part in parts[n % len(parts)])
    x, known = data.feature, data.group[train]
    held_out = held_out_distances(x[train], grasp[train], known, seed=inputs.seed)
    new = np.flatnonzero(data.value == withheld)
    distance = Guard.of(x[train], grasp[train]).distance(x[np.concatenate([new, test])])
    for stated in settings.false_alarms:
        flagged = distance > threshold_at(held_out, known, stated)
        yield Round(withheld, stated, flagged[: len(new)], flagged[len(new) :], data.group[test])


def _shares(stated: float, tests: list[Round], seed: int) -> Iterator[dict[str, Any]]:
    """Yield what is detected, the mean over classes, and false alarms of all tests, with intervals
    over independent classes and grasps."""
    from ajgdata.evaluate.intervals import mean_interval

    detected = np.array([test.new.mean() for test in tests])
    known = np.concatenate([test.known for test in tests]).astype(float)
    group = np.concatenate([test.group for test in tests])
    units = np.arange(len(tests)), group
    for metric, values, unit in zip(METRICS, (detected, known), units, strict=True):
        low, high = mean_interval(values, unit, is_share=True, seed=seed)
        row = {"stated": stated, "metric": metric, "share": float(values.mean())}
        yield row | {"low": low, "high": high}


def _scores(rounds: list[dict[str, Any]], shares: list[dict[str, Any]]) -> Iterator[ScoreRow]:
    """Yield the rows of `results/metrics.csv`."""

    def part(row: dict[str, Any]) -> str:
        return f"novelty:distance {100 * row['stated']:g} %"

    for row in rounds:
        for metric in METRICS:
            yield "", part(row), metric, f"without {row['withheld']}", row[metric]
    for row in shares:
        values = (row["share"], row["low"], row["high"])
        for statistic, value in zip(("mean", *GRASP_INTERVAL), values, strict=True):
            yield "", part(row), row["metric"], statistic, value


def finding(results: TaskResults) -> str:
    """Return the shares at the stated rate SHOWN."""
    shares = results.results[0].tables["shares"].where(stated=SHOWN)
    values = {row["metric"]: number(100 * float(row["share"]), 2) for row in shares.rows}
    if not values:
        return "Novel objects: alarms against the stated rate"
    return f"Alarm for {values[METRICS[0]]} % of novel and {values[METRICS[1]]} % of known objects"


SHARES = Plot(
    "lines",
    "shares",
    "share of recordings that raise the alarm, of novel objects (detected) and of held-out grasps "
    "of known objects (false alarm), against the stated rate",
    value="share",
    x="stated",
    series=("metric",),
    interval=("low", "high"),
    percent=True,
    ideal=True,
    title=finding,
)
CLASSES = Plot(
    "rows",
    "rounds",
    f"share of recordings of each withheld class that raise the alarm at a stated rate of "
    f"{SHOWN:.0%}",
    value="detected",
    x="withheld",
    series=(),
    over="rounds",
    where={"stated": SHOWN},
    percent=True,
    name="classes",
)
EXPERIMENT = Experiment(
    name="novelty",
    order=45,
    title=TITLE,
    settings=Settings,
    measure=measure,
    plots=(SHARES, CLASSES),
    own_page=True,
    kinds=("classification",),
)
