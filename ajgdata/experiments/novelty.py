"""Unlike anything seen: whether an object that a model never met is noticed, and how often a known
one raises the alarm.

One class is left out at a time; so are some grasps of each other class. How strange a recording is
is measured by its distance to the nearest grasp, with the alarm that is shipped with a model
(`evaluate.novelty`), and, to compare, by the uncertainty of models: one less the probability of
their best class. Both alarms are conformal quantiles over grasps held out of the rest.

Intervals of what is detected are over classes, those of false alarms over grasps, since several
rounds test the same grasps.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field

from ajgdata.evaluate.agreement import GRASP_INTERVAL
from ajgdata.evaluate.task_data import TaskData
from ajgdata.experiments.base import (
    Experiment,
    Inputs,
    Outcome,
    TaskResults,
    score_table,
)
from ajgdata.experiments.plots import Plot
from ajgdata.types import ModelName, NotPossibleError, Strict
from ajgdata.types.table import Table, table_of

DISTANCE = "distance"
TITLE = "Unlike anything seen"
#: Of the stated rates, the one that is shown by class.
SHOWN = 0.05


SHARE_COLUMNS = {
    "judge": "Told by", "stated": "Stated", "metric": "Share of", "share": "Share",
    "low": "95 % from", "high": "to",
}  # fmt: skip
NOTHING_COLUMNS = {
    "fold": "Fold", "recognised": "Nothing recognised", "mistaken": "Taken for nothing",
}  # fmt: skip


class Round(NamedTuple):
    """One round at one stated rate: whether recordings of the class that was left out were flagged
    (m,), whether held-out recordings of the others were (n,), and the groups of these (n,)."""

    left_out: str
    stated: float
    new: np.ndarray
    known: np.ndarray
    group: np.ndarray

    def row(self, judge: str) -> dict[str, Any]:
        """Return the shares of the round."""
        shares = {"detected": float(self.new.mean()), "false_alarm": float(self.known.mean())}
        return {"judge": judge, "stated": self.stated, "left_out": self.left_out, **shares}


def _shares(judge: str, stated: float, tests: list[Round], seed: int) -> Iterator[dict[str, Any]]:
    """Yield what is detected, the mean over classes, and false alarms of all tests, with intervals
    over independent classes and grasps."""
    from ajgdata.evaluate.intervals import mean_interval

    detected = np.array([test.new.mean() for test in tests])
    known = np.concatenate([test.known for test in tests]).astype(float)
    group = np.concatenate([test.group for test in tests])
    over_classes = mean_interval(detected, np.arange(len(tests)), is_share=True, seed=seed)
    over_grasps = mean_interval(known, group, is_share=True, seed=seed)
    for metric, share, interval in (
        ("detected", detected.mean(), over_classes),
        ("false_alarm", known.mean(), over_grasps),
    ):
        row = {"judge": judge, "stated": stated, "metric": metric, "share": float(share)}
        yield row | {"low": interval.low, "high": interval.high}


class Settings(Strict):
    """Whether objects never met are noticed: one class is left out at a time."""

    false_alarms: tuple[Annotated[float, Field(gt=0, lt=1)], ...] = Field(
        (0.01, 0.05, 0.1, 0.2),
        min_length=1,
        description="shares of grasps of known classes that may raise the alarm",
    )
    models: tuple[ModelName, ...] = Field(
        ("cnn", "linear_plain"), description="models whose doubt is compared with the distance"
    )
    inner_folds: int = Field(3, ge=2, description="folds of the training part, for their alarms")


def measure(inputs: Inputs, settings: Settings, model: str) -> Outcome:
    """Return the shares of recordings of unknown and known classes that raise the alarm."""
    from threadpoolctl import threadpool_limits

    data = inputs.data()
    grasps = _grasps(inputs, data)
    if len(classes := np.unique(data.value)) < 3:
        raise NotPossibleError("one class is left out and two must be left: record at least three")
    rounds: list[dict[str, Any]] = []
    shares: list[dict[str, Any]] = []
    spent: dict[str, float] = {}
    with threadpool_limits(limits=1):
        for judge in (DISTANCE, *settings.models):
            begun = time.process_time()
            tests = [
                test
                for n, left_out in enumerate(classes.tolist())
                for test in _round(inputs, settings, data, grasps, judge, n, left_out)
            ]
            rounds += [test.row(judge) for test in tests]
            for stated in settings.false_alarms:
                own = [test for test in tests if test.stated == stated]
                shares += _shares(judge, stated, own, inputs.seed)
            spent[judge] = time.process_time() - begun
        nothing = list(_nothing(inputs, data, grasps))
    columns = {"judge": "Told by", "stated": "Stated", "left_out": "Left out"}
    columns |= {"detected": "Unknown noticed", "false_alarm": "Known alarmed"}
    tables = [
        score_table(_scores(rounds, shares, nothing), TITLE),
        table_of("rounds", TITLE, rounds, **columns),
        table_of("shares", TITLE, shares, **SHARE_COLUMNS),
    ]
    if nothing:
        tables.append(table_of("nothing", "Nothing held", nothing, **NOTHING_COLUMNS))
    cost = [(_named(j), "cost of novelty", "train_cpu_s", "measured", s) for j, s in spent.items()]
    return Outcome(tuple(tables), (score_table(cost, TITLE),))


def _named(judge: str) -> str:
    """Return the model of a score; the distance is of none."""
    return "" if judge == DISTANCE else judge


def _grasps(inputs: Inputs, data: TaskData) -> np.ndarray:
    columns = inputs.store.columns
    names, grasps = columns["recording"].values.tolist(), columns["grasp_id"].values.tolist()
    grasp_of = dict(zip(names, grasps, strict=True))
    return np.array([grasp_of[name] for name in data.name.tolist()])


def _round(
    inputs: Inputs,
    settings: Settings,
    data: TaskData,
    grasps: np.ndarray,
    judge: str,
    n: int,
    left_out: str,
) -> Iterator[Round]:
    """Yield for each stated rate what is flagged of the class `left_out`, and of held-out grasps of
    the others: round `n` holds out fold `n`, and the first again after the last."""
    from ajgdata.evaluate.novelty import threshold_at
    from ajgdata.evaluate.splits import grouped_folds

    others = np.flatnonzero(data.value != left_out)
    y, group = data.value[others], data.group[others]
    split = inputs.kind, min(inputs.folds, len(np.unique(group))), inputs.seed
    parts = grouped_folds(y, group, *split)
    train, test = (others[part] for part in parts[n % len(parts)])
    held = _held_out(inputs, settings, data, grasps, judge, train)
    new = np.flatnonzero(data.value == left_out)
    distance = _strange(inputs, data, grasps, judge, train, np.concatenate([new, test]))
    for stated in settings.false_alarms:
        flagged = distance > threshold_at(held, data.group[train], stated)
        yield Round(left_out, stated, flagged[: len(new)], flagged[len(new) :], data.group[test])


def _held_out(
    inputs: Inputs,
    settings: Settings,
    data: TaskData,
    grasps: np.ndarray,
    judge: str,
    train: np.ndarray,
) -> np.ndarray:
    """Return how strange the recordings `train` (m,) are to those of other inner folds: (m,)."""
    from ajgdata.evaluate.novelty import held_out_distances
    from ajgdata.evaluate.splits import grouped_folds

    groups = data.group[train]
    if judge == DISTANCE:
        return held_out_distances(data.feature[train], grasps[train], groups, seed=inputs.seed)
    held, count = np.empty(len(train)), min(settings.inner_folds, len(np.unique(groups)))
    for fit, rows in grouped_folds(data.value[train], groups, inputs.kind, count, inputs.seed):
        held[rows] = _strange(inputs, data, grasps, judge, train[fit], train[rows])
    return held


def _strange(
    inputs: Inputs,
    data: TaskData,
    grasps: np.ndarray,
    judge: str,
    fit: np.ndarray,
    rows: np.ndarray,
) -> np.ndarray:
    """Return how strange recordings `rows` (m,) are to who knows those of `fit`: (m,)."""
    from ajgdata.evaluate.novelty import Guard
    from ajgdata.models import fit_named_model

    if judge == DISTANCE:
        return Guard.of(data.feature[fit], grasps[fit]).distance(data.feature[rows])
    fitted = fit_named_model(
        judge, inputs.kind, data.feature[fit], data.value[fit], data.group[fit],
        seed=inputs.seed, limits=inputs.most_recordings,
    )  # fmt: skip
    if not hasattr(fitted, "predict_proba"):
        raise NotPossibleError(f"model {judge!r} has no probabilities: choose another")
    return 1 - fitted.predict_proba(data.feature[rows]).max(axis=1)


def _nothing(inputs: Inputs, data: TaskData, grasps: np.ndarray) -> Iterator[dict[str, Any]]:
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
        held = number_of % folds == fold
        guard = Guard.of(data.feature[train], grasps[train]).with_references(empty[~held])
        yield {
            "fold": fold,
            "recognised": float(guard.is_nothing(empty[held]).mean()),
            "mistaken": float(guard.is_nothing(data.feature[test]).mean()),
        }


def _scores(
    rounds: Iterable[dict[str, Any]],
    shares: Iterable[dict[str, Any]],
    nothing: Iterable[dict[str, Any]],
) -> Iterator[tuple[str, str, str, str, float]]:
    def part(row: dict[str, Any]) -> str:
        how = "distance" if row["judge"] == DISTANCE else "doubt"
        return f"novelty:{how} {100 * row['stated']:g} %"

    for row in rounds:
        for metric in ("detected", "false_alarm"):
            statistic = f"without {row['left_out']}"
            yield _named(row["judge"]), part(row), metric, statistic, row[metric]
    for row in shares:
        values = (row["share"], row["low"], row["high"])
        for statistic, value in zip(("mean", *GRASP_INTERVAL), values, strict=True):
            yield _named(row["judge"]), part(row), row["metric"], statistic, value
    for row in nothing:
        for metric in ("recognised", "mistaken"):
            yield "", "novelty:nothing", metric, f"fold {row['fold']}", row[metric]


def shown_rate(results: TaskResults) -> float:
    """Return the stated rate that is shown by class."""
    return min(results.settings.false_alarms, key=lambda rate: abs(rate - SHOWN))


def by_class(results: TaskResults) -> Table:
    """Return the rounds at the stated rate that is shown by class."""
    return results.results[0].tables["rounds"].where(stated=shown_rate(results))


SHARES = Plot(
    "lines",
    "shares",
    "share of recordings that raise the alarm, of objects that are not in the training data and "
    "of known objects, against the stated rate of false alarms",
    value="share",
    x="stated",
    series=("judge",),
    interval=("low", "high"),
    where={"metric": "detected"},
    headline="trend",
    better="high",
    percent=True,
)
FALSE_ALARMS = replace(
    SHARES,
    about="share of held-out grasps of known objects that raise the alarm, against the stated rate",
    where={"metric": "false_alarm"},
    ideal=True,
    name="false-alarms",
)
CLASSES = Plot(
    "rows",
    by_class,
    "share of recordings that raise the alarm, for each class that was left out",
    value="detected",
    x="left_out",
    series=("judge",),
    over="rounds",
    headline="range",
    percent=True,
    name="classes",
)
NOTHING = Plot(
    "rows",
    "nothing",
    "share of held-out empty-gripper references that are recognised as such",
    value="recognised",
    x="model",
    series=(),
    headline="range",
    percent=True,
    name="references",
    folded="Empty gripper",
)


EXPERIMENT = Experiment(
    name="novelty",
    order=45,
    title=TITLE,
    settings=Settings,
    measure=measure,
    plots=(SHARES, FALSE_ALARMS, CLASSES, NOTHING),
    own_page=True,
    kinds=("classification",),
)
