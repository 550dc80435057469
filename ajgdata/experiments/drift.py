"""Drift: accuracy of models of day 1 in sessions in which one quantity has changed, and alarms.

There is one model per session of day 1, trained on the others, so each is also tested on a session
of day 1. Corrections are measured by `across_sessions`.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from pydantic import Field

from ajgdata.evaluate.task_data import TaskData, session_of
from ajgdata.experiments.base import Experiment, Inputs, Outcome, TaskResults, score_table
from ajgdata.experiments.plots import Plot
from ajgdata.types import ModelName, Name, NotPossibleError, Strict
from ajgdata.types.table import Table, table_of

TITLE, DAY_1 = "Drift", "day 1"
#: Shares of recordings: predicted correctly, and detected as a novel object.
MEASURES = ("accuracy", "unlike_share")
SESSION_COLUMNS = {
    "session": "Session", "fold": "Fold", "accuracy": "Accuracy",
    "unlike_share": "Detected as novel", "chance": "Chance",
}  # fmt: skip
ALARM_COLUMNS = {
    "session": "Session", "number": "Reference", "observed": "Ratio to the limit",
    "rings": "Alarms",
}  # fmt: skip
Row = dict[str, Any]


class Series(Strict):
    """Sessions in which one quantity has changed, by how much."""

    quantity: str = Field(description="what has changed, e.g. temperature of the air")
    unit: str = Field("", description="of its values")
    day_1: float = Field(description="its value on day 1")
    sessions: dict[Name, float] = Field(min_length=1, description="its value, by session")


class Settings(Strict):
    """Models of day 1 on a gripper that has changed since."""

    day_1: tuple[Name, ...] = Field(min_length=2, description="sessions that models are trained on")
    changes: tuple[Series, ...] = Field(min_length=1, description="what has changed, and where")
    models: tuple[ModelName, ...] = Field(
        ("cnn", "linear_plain"), min_length=1, description="models that are tested"
    )


class Sessions(NamedTuple):
    """Recordings of objects, and features (r, f) of references, by session."""

    held: dict[str, TaskData]
    references: dict[str, np.ndarray]

    def joined(self, names: Sequence[str]) -> TaskData:
        """Return the recordings of objects of several sessions."""
        parts = [self.held[name] for name in names]
        return TaskData(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def measure(inputs: Inputs, settings: Settings, model: str) -> Outcome:
    """Return the accuracy of models of day 1 in each session, and the alarms by references."""
    from threadpoolctl import threadpool_limits

    later = [name for change in settings.changes for name in change.sessions]
    found = read_sessions(inputs, [*settings.day_1, *later])
    begun = time.process_time()
    with threadpool_limits(limits=1):
        rows = list(_predicted(inputs, settings.day_1, later, model, found))
    spent = time.process_time() - begun
    scores = (
        (model, f"drift: {row['session'] or DAY_1}", metric, f"fold {row['fold']}", row[metric])
        for row in rows
        for metric in MEASURES
    )
    cost = [(model, "cost of drift", "train_and_predict_cpu_s", "measured", spent)]
    return Outcome(
        (
            score_table(scores, TITLE),
            table_of("sessions", TITLE, rows, **SESSION_COLUMNS),
            table_of("alarms", "Alarms", alarms(settings.day_1, later, found), **ALARM_COLUMNS),
        ),
        (score_table(cost, TITLE),),
    )


def read_sessions(inputs: Inputs, names: Sequence[str]) -> Sessions:
    """Return the recordings of sessions by name.

    Raises NotPossibleError for a session without recordings of objects, or without references.
    """
    data, columns = inputs.data(), inputs.store.columns
    if "object" not in columns:
        raise NotPossibleError("there is no column 'object', empty for the empty gripper")
    empty = columns["object"].values.astype(str) == ""
    of_all, of_data = session_of(columns["recording"].values), session_of(data.name)
    held = {name: data.where(of_data == name) for name in names}
    references = {name: inputs.store.feature[empty & (of_all == name)] for name in names}
    for name in names:
        if not len(held[name].value):
            raise NotPossibleError(f"session {name!r} has no recording of an object")
        if not len(references[name]):
            raise NotPossibleError(f"session {name!r} has no reference: record the empty gripper")
    return Sessions(held, references)


def _predicted(
    inputs: Inputs, day_1: Sequence[str], later: Sequence[str], model: str, found: Sessions
) -> Iterator[Row]:
    """Yield MEASURES of each model in its held-out session of day 1 ("") and each later one."""
    from ajgdata.evaluate.novelty import Guard, alarm
    from ajgdata.models import fit_named_model

    for fold, held_out in enumerate(day_1):
        known = found.joined([name for name in day_1 if name != held_out])
        x, y, group = known.feature, known.value, known.group
        if missing := sorted({*found.held[held_out].value.tolist()} - {*y.tolist()}):
            raise NotPossibleError(f"only session {held_out!r} of day 1 has {missing[0]!r}")
        fitted = fit_named_model(
            model, inputs.kind, x, y, group, seed=inputs.seed, limits=inputs.most_recordings
        )
        threshold = alarm(x, group, group, seed=inputs.seed).threshold
        guard = replace(Guard.of(x, group), threshold=threshold)
        for name in (held_out, *later):
            tested = found.held[name]
            yield {
                "session": "" if name == held_out else name,
                "fold": fold,
                "accuracy": float(np.mean(fitted.predict(tested.feature) == tested.value)),
                "unlike_share": float(np.mean(guard.novelty(tested.feature) > 1)),
                "chance": float(np.unique(y, return_counts=True)[1].max() / len(y)),
            }


def alarms(day_1: Sequence[str], later: Sequence[str], found: Sessions) -> Iterator[Row]:
    """Yield after each reference the smallest ratio to the limit of the last few: above 1 the
    alarm rings. Each session of day 1 ("") is compared with the others."""
    from ajgdata.live.drift import DriftWatch

    for name in (*day_1, *later):
        known = [found.references[one] for one in day_1 if one != name]
        watch = DriftWatch(np.concatenate(known))
        for number, reference in enumerate(found.references[name]):
            observed = watch.observe(reference)
            if number + 1 >= watch.in_a_row:
                row = {"session": "" if name in day_1 else name, "number": number}
                yield row | {"observed": observed, "rings": float(observed > 1)}


def by_change(results: TaskResults, name: str, title: str) -> Table:
    """Return a table with the quantity that changed and its value; day 1 is part of each."""
    rows = []
    for result in results.results:
        by_session = result.tables[name].parted("session")
        for change in results.settings.changes:
            quantity = f"{change.quantity} ({change.unit})" if change.unit else change.quantity
            for session, value in {"": change.day_1, **change.sessions}.items():
                place = {"model": result.label, "quantity": quantity, "to": value}
                if session in by_session:  # alarms need several references
                    rows += [place | row for row in by_session[session].rows]
    own = {one.key: one.title for one in results.results[0].tables[name].columns}
    return table_of(name, title, rows, model="Model", quantity="Changed", to="Value", **own)


ACCURACY = Plot(
    "lines",
    partial(by_change, name="sessions", title=TITLE),
    "models of day 1 in sessions in which one quantity has changed; day 1 is one of the values",
    value="accuracy",
    x="to",
    panel="quantity",
    chance="chance",
    over="models",
    headline="trend",
    better="high",
    percent=True,
    listed=True,
)
NOVEL = replace(
    ACCURACY,
    about="share of recordings of known objects that a model in use reports as novel",
    value="unlike_share",
    chance="",
    better="low",
    listed=False,
    name="novel",
    folded="Recordings reported as novel",
)
ALARMS = replace(
    NOVEL,
    table=partial(by_change, name="alarms", title="Alarms"),
    about="share of empty-gripper references after which the alarm rings; needs no model",
    value="rings",
    over="references",
    better="high",
    name="alarms",
    folded="",
)
EXPERIMENT = Experiment(
    name="drift",
    order=62,
    title=TITLE,
    settings=Settings,
    measure=measure,
    plots=(ACCURACY, ALARMS, NOVEL),
    by_model=True,
    kinds=("classification",),
)
