"""Unlike anything seen: whether an object that is not in the training data is noticed, and how
often a known one raises the alarm.

One class is left out at a time; so are some grasps of each other class. Distance and alarm are
those that are shipped with a model (`evaluate.novelty`): the distance to the nearest grasp, and a
conformal quantile over grasps held out of the rest.

Intervals of what is detected are over classes, those of false alarms over grasps, since several
rounds test the same grasps.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field

from ajgdata.evaluate.agreement import GRASP_INTERVAL
from ajgdata.evaluate.task_data import TaskData
from ajgdata.experiments.base import Experiment, Inputs, Outcome, ScoreRow, score_table
from ajgdata.experiments.plots import Plot
from ajgdata.types import NotPossibleError, Strict
from ajgdata.types.table import table_of

TITLE = "Unlike anything seen"
#: Of the stated rates, the one that is shown by class.
SHOWN = 0.05
METRICS = ("detected", "false_alarm")


class Settings(Strict):
    """Whether objects that are not in the training data are noticed: one class is left out at a
    time."""

    false_alarms: tuple[Annotated[float, Field(gt=0, lt=1)], ...] = Field(
        (0.01, 0.05, 0.1, 0.2),
        min_length=1,
        description="shares of grasps of known classes that may raise the alarm",
    )


class Round(NamedTuple):
    """One round at one stated rate: whether recordings of the class that was left out were flagged
    (m,), whether held-out recordings of the others were (n,), and the groups of these (n,)."""

    left_out: str
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
        raise NotPossibleError("one class is left out and two must be left: record at least three")
    begun = time.process_time()
    with threadpool_limits(limits=1):
        tests = [
            test
            for n, left_out in enumerate(classes.tolist())
            for test in _round(inputs, settings, data, grasp, n, left_out)
        ]
        cpu_s = time.process_time() - begun
        empty = list(_empty_gripper(inputs, data, grasp))
    rounds = [
        {"stated": test.stated, "left_out": test.left_out}
        | {"detected": float(test.new.mean()), "false_alarm": float(test.known.mean())}
        for test in tests
    ]
    shares = [
        row
        for stated in settings.false_alarms
        for row in _shares(stated, [test for test in tests if test.stated == stated], inputs.seed)
    ]
    of_rounds = {"left_out": "Left out", "detected": "Detected", "false_alarm": "False alarm"}
    of_shares = {"metric": "Share of", "share": "Share", "low": "95 % from", "high": "to"}
    tables = [
        score_table(_scores(rounds, shares, empty), TITLE),
        table_of("rounds", TITLE, rounds, stated="Stated", **of_rounds),
        table_of("shares", TITLE, shares, stated="Stated", **of_shares),
    ]
    if empty:
        of_empty = {"recognised": "Nothing recognised", "mistaken": "Taken for nothing"}
        tables.append(table_of("nothing", "Nothing held", empty, fold="Fold", **of_empty))
    cost = score_table([("", "cost of novelty", "train_cpu_s", "measured", cpu_s)], TITLE)
    return Outcome(tuple(tables), (cost,))


def _grasps(inputs: Inputs, data: TaskData) -> np.ndarray:
    """Return the grasp of each recording of `data` (n,)."""
    columns = inputs.store.columns
    names, grasps = columns["recording"].values.tolist(), columns["grasp_id"].values.tolist()
    grasp_of = dict(zip(names, grasps, strict=True))
    return np.array([grasp_of[name] for name in data.name.tolist()])


def _round(
    inputs: Inputs, settings: Settings, data: TaskData, grasp: np.ndarray, n: int, left_out: str
) -> Iterator[Round]:
    """Yield for each stated rate what is flagged of the class `left_out`, and of held-out grasps of
    the others: round `n` holds out fold `n`, and the first again after the last."""
    from ajgdata.evaluate.novelty import Guard, held_out_distances, threshold_at
    from ajgdata.evaluate.splits import grouped_folds

    others = np.flatnonzero(data.value != left_out)
    y, group = data.value[others], data.group[others]
    split = inputs.kind, min(inputs.folds, len(np.unique(group))), inputs.seed
    parts = grouped_folds(y, group, *split)
    train, test = (others[part] for part in parts[n % len(parts)])
    x, known = data.feature, data.group[train]
    held_out = held_out_distances(x[train], grasp[train], known, seed=inputs.seed)
    new = np.flatnonzero(data.value == left_out)
    distance = Guard.of(x[train], grasp[train]).distance(x[np.concatenate([new, test])])
    for stated in settings.false_alarms:
        flagged = distance > threshold_at(held_out, known, stated)
        yield Round(left_out, stated, flagged[: len(new)], flagged[len(new) :], data.group[test])


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


def _empty_gripper(inputs: Inputs, data: TaskData, grasp: np.ndarray) -> Iterator[dict[str, Any]]:
    """Yield for each fold the share of held-out references that are recognised as such, and of
    held-out grasps that are taken for nothing; none where fewer than two references are known."""
    from ajgdata.evaluate.novelty import Guard
    from ajgdata.evaluate.splits import grouped_folds

    columns = inputs.store.columns
    is_empty = (columns["object"].values == "") & (columns[inputs.target].values == "")
    empty, names = inputs.store.feature[is_empty], columns["grasp_id"].values[is_empty]
    number_of = np.unique(names, return_inverse=True)[1]
    folds = min(inputs.folds, len(np.unique(names)), len(np.unique(data.group)))
    if folds < 2:
        return
    parts = grouped_folds(data.value, data.group, inputs.kind, folds, inputs.seed)
    for fold, (train, test) in enumerate(parts):
        held_out = number_of % folds == fold
        guard = Guard.of(data.feature[train], grasp[train]).with_references(empty[~held_out])
        yield {
            "fold": fold,
            "recognised": float(guard.is_nothing(empty[held_out]).mean()),
            "mistaken": float(guard.is_nothing(data.feature[test]).mean()),
        }


def _scores(
    rounds: list[dict[str, Any]], shares: list[dict[str, Any]], empty: list[dict[str, Any]]
) -> Iterator[ScoreRow]:
    def part(row: dict[str, Any]) -> str:
        return f"novelty:distance {100 * row['stated']:g} %"

    for row in rounds:
        for metric in METRICS:
            yield "", part(row), metric, f"without {row['left_out']}", row[metric]
    for row in shares:
        values = (row["share"], row["low"], row["high"])
        for statistic, value in zip(("mean", *GRASP_INTERVAL), values, strict=True):
            yield "", part(row), row["metric"], statistic, value
    for row in empty:
        for metric in ("recognised", "mistaken"):
            yield "", "novelty:nothing", metric, f"fold {row['fold']}", row[metric]


SHARES = Plot(
    "lines",
    "shares",
    "share of recordings that raise the alarm, of objects that are not in the training data "
    "(detected) and of held-out grasps of known objects (false alarm), against the stated rate",
    value="share",
    x="stated",
    series=("metric",),
    interval=("low", "high"),
    percent=True,
    ideal=True,
)
CLASSES = Plot(
    "rows",
    "rounds",
    f"share of recordings that raise the alarm at a stated rate of {SHOWN:.0%}, for each class "
    "that was left out",
    value="detected",
    x="left_out",
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
