"""Unlike anything seen: whether an object that a model never met is noticed, and how often a known
one raises the alarm.

One class is left out at a time; so are some grasps of each other class. How strange a recording is
is told by its distance to the nearest grasp (`evaluate.novelty`, as a model in use tells it), and,
to compare, by the doubt of models: one less the probability of their best class. Both alarms are
conformal quantiles over grasps held out of the rest.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from ajgdata.evaluate.task_data import TaskData
from ajgdata.experiments.base import (
    SCORES,
    Experiment,
    Inputs,
    Outcome,
    TaskResults,
    score_table,
)
from ajgdata.models import model_label
from ajgdata.report.blocks import Illustration, ShownTable
from ajgdata.report.comparison import mark_of
from ajgdata.report.format import Score, mean_sd, number
from ajgdata.report.panel import Highlight
from ajgdata.types import ModelName, NotPossibleError, Strict
from ajgdata.types.table import Table, table_of

DISTANCE = "distance"
TITLE = "Unlike anything seen"
#: Of the stated rates, the one that is shown by class.
SHOWN = 0.05


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
    spent: dict[str, float] = {}
    with threadpool_limits(limits=1):
        for judge in (DISTANCE, *settings.models):
            begun = time.process_time()
            for n, left_out in enumerate(classes.tolist()):
                rounds += _round(inputs, settings, data, grasps, judge, n, left_out)
            spent[judge] = time.process_time() - begun
        nothing = list(_nothing(inputs, data, grasps))
    columns = {"judge": "Told by", "stated": "Stated", "left_out": "Left out"}
    columns |= {"detected": "Unknown noticed", "false_alarm": "Known alarmed"}
    tables = [
        score_table(_scores(rounds, nothing), TITLE),
        table_of("rounds", TITLE, rounds, **columns),
    ]
    if nothing:
        heads = {
            "fold": "Fold",
            "recognised": "Nothing recognised",
            "mistaken": "Taken for nothing",
        }
        tables.append(table_of("nothing", "Nothing held", nothing, **heads))
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
) -> Iterator[dict[str, Any]]:
    """Yield for each stated rate what is flagged of the class `left_out`, and of held-out grasps of
    the others: round `n` holds out fold `n`, and the first again after the last."""
    from ajgdata.evaluate.conformal import grasp_weights, weighted_quantile
    from ajgdata.evaluate.novelty import FOLDS
    from ajgdata.evaluate.splits import grouped_folds

    others = np.flatnonzero(data.value != left_out)
    y, group = data.value[others], data.group[others]
    split = inputs.kind, min(inputs.folds, len(np.unique(group))), inputs.seed
    parts = grouped_folds(y, group, *split)
    train, test = (others[part] for part in parts[n % len(parts)])
    held = np.empty(len(train))
    folds = FOLDS if judge == DISTANCE else settings.inner_folds
    groups = data.group[train]
    count = len(np.unique(groups))
    for fit, rows in grouped_folds(
        data.value[train], groups, inputs.kind, min(folds, count), inputs.seed
    ):
        held[rows] = _strange(inputs, data, grasps, judge, train[fit], train[rows])
    new = np.flatnonzero(data.value == left_out)
    told = _strange(inputs, data, grasps, judge, train, np.concatenate([new, test]))
    for stated in settings.false_alarms:
        share = 1 - max(stated, 1 / (count + 1))
        alarm = weighted_quantile(held[:, np.newaxis], grasp_weights(groups), share)[0]
        flagged = told > alarm
        yield {
            "judge": judge,
            "stated": stated,
            "left_out": left_out,
            "detected": float(flagged[: len(new)].mean()),
            "false_alarm": float(flagged[len(new) :].mean()),
        }


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
    from ajgdata.models import fit_model, make_model

    if judge == DISTANCE:
        return Guard.of(data.feature[fit], grasps[fit]).distance(data.feature[rows])
    made: Any = make_model(judge, inputs.kind, inputs.seed)
    if not hasattr(made, "predict_proba"):
        raise NotPossibleError(f"model {judge!r} has no probabilities: choose another")
    fitted = fit_model(made, data.feature[fit], data.value[fit], data.group[fit])
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
    rounds: Iterable[dict[str, Any]], nothing: Iterable[dict[str, Any]]
) -> Iterator[tuple[str, str, str, str, float]]:
    for row in rounds:
        how = "distance" if row["judge"] == DISTANCE else "doubt"
        part = f"novelty:{how} {100 * row['stated']:g} %"
        for metric in ("detected", "false_alarm"):
            yield _named(row["judge"]), part, metric, f"without {row['left_out']}", row[metric]
    for row in nothing:
        for metric in ("recognised", "mistaken"):
            yield "", "novelty:nothing", metric, f"fold {row['fold']}", row[metric]


def share_of(rounds: Table, judge: str, stated: float, key: str) -> Score:
    """Return mean and sd over the classes that were left out, in per cent."""
    values = 100 * rounds.where(judge=judge, stated=stated).numbers(key)
    return Score(float(values.mean()), float(values.std(ddof=1)))


def label_of(results: TaskResults, judge: str) -> str:
    """Return what tells how strange a recording is, in words."""
    return "distance" if judge == DISTANCE else f"doubt of {model_label(judge, results.kind)}"


def judges_of(results: TaskResults) -> tuple[str, ...]:
    """Return what tells how strange a recording is, the distance first."""
    return (DISTANCE, *results.settings.models)


def shown_rate(results: TaskResults) -> float:
    """Return the stated rate that is shown by class."""
    return min(results.settings.false_alarms, key=lambda rate: abs(rate - SHOWN))


def figures(results: TaskResults) -> list[Illustration]:
    """Return the one figure."""
    from ajgdata.experiments.drawings.novelty import caption, figure

    return [Illustration(results.named(), caption(results), lambda: figure(results))]


def tables(results: TaskResults) -> Iterator[ShownTable]:
    """Yield what was noticed and alarmed, with run times; then nothing held, where it was tried."""
    found, (result,) = [], results.results
    rounds, spent = result.tables["rounds"], result.cost[SCORES]
    for judge in judges_of(results):
        seconds = spent.where(model=_named(judge)).numbers("value")[0]
        found += [
            (
                label_of(results, judge), f"{100 * rate:g} %",
                mean_sd(share_of(rounds, judge, rate, "detected"), "%"),
                mean_sd(share_of(rounds, judge, rate, "false_alarm"), "%"), number(seconds),
            )
            for rate in results.settings.false_alarms
        ]  # fmt: skip
    heads = ("Told by", "Stated|", "Unknown noticed|", "Known alarmed|", "Processor, s|")
    told = "Mean ± sd over the classes left out; time of all of them and all rates together."
    yield ShownTable(told, heads, tuple(found))
    if nothing := result.tables.get("nothing"):
        shares = [100 * nothing.numbers(key) for key in ("recognised", "mistaken")]
        cells = tuple(mean_sd(Score(s.mean(), s.std(ddof=1)), "%") for s in shares)
        told = "Nothing held: nearer to a recording of the empty gripper than to any grasp."
        yield ShownTable(told, ("Empty, recognised|", "Held, taken for nothing|"), (cells,))


def highlights(results: TaskResults) -> Iterator[Highlight]:
    """Yield what the distance notices of classes never met, beside what it may alarm falsely."""
    rounds, stated = results.results[0].tables["rounds"], shown_rate(results)
    marks = (
        mark_of("ours", "never met", share_of(rounds, DISTANCE, stated, "detected")),
        mark_of("other", "known", share_of(rounds, DISTANCE, stated, "false_alarm")),
    )
    yield Highlight("Never met", "noticed by distance", "%", marks)


EXPERIMENT = Experiment(
    name="novelty",
    order=45,
    title=TITLE,
    settings=Settings,
    measure=measure,
    figures=figures,
    tables=tables,
    highlights=highlights,
    own_page=True,
    kinds=("classification",),
)
