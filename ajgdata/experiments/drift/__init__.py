"""Drift: a model of day 1 on a gripper that has changed, what tells so, and what mends it.

`measured` makes the rows of the tables, `results` reads them back, `shown` draws and tells.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Annotated

import numpy as np
from pydantic import Field

from ajgdata.experiments.base import Experiment, Inputs, Outcome, score_table
from ajgdata.experiments.drift.results import MEASURES, NONE, SHOWN
from ajgdata.experiments.drift.shown import figures, highlights, rows, summary, tables
from ajgdata.types import ModelName, Name, Strict
from ajgdata.types.table import table_of

ScoreRow = tuple[str, str, str, str, float]


class Series(Strict):
    """Sessions in which one thing has changed, by how much."""

    quantity: str = Field(description="what has changed, e.g. temperature of the air")
    unit: str = Field("", description="of its values")
    day_1: float = Field(description="its value on day 1")
    sessions: dict[Name, float] = Field(min_length=1, description="its value, by session")


class Settings(Strict):
    """Models of day 1 on a gripper that has changed since."""

    day_1: tuple[Name, ...] = Field(min_length=2, description="sessions that models are trained on")
    changes: tuple[Series, ...] = Field(min_length=1, description="what has changed, and where")
    references: tuple[Annotated[int, Field(ge=1)], ...] = Field(
        (1, 2, 6), min_length=1, description="recordings of nothing that a correction may use"
    )
    grasps: tuple[Annotated[int, Field(ge=1)], ...] = Field(
        (1, 2, 4), min_length=1, description="calibration grasps of each class to train on instead"
    )
    draws: int = Field(2, ge=1, description="choices of calibration grasps")
    threshold: float = Field(0.6, gt=0, le=1, description="probability that sorts (paper)")
    models: tuple[ModelName, ...] = Field(
        ("cnn", "linear_plain"), min_length=1, description="models that are taken there"
    )


def measure(inputs: Inputs, settings: Settings, model: str) -> Outcome:
    """Return what models of day 1 say of each session, with and without what could mend them."""
    from threadpoolctl import threadpool_limits

    from ajgdata.experiments.drift import measured

    values = {s: (c.quantity, v) for c in settings.changes for s, v in c.sessions.items()}
    found = measured.sessions_of(inputs, settings.day_1, tuple(values))
    with threadpool_limits(limits=1):
        begun = time.process_time()
        trained = measured.trained_on_day_1(inputs, settings.day_1, model, found)
        train_s = (time.process_time() - begun) / len(trained)
        said = [
            row
            for fold, one in enumerate(trained)
            for row in measured.said(inputs, settings, found, one, fold)
        ]
        begun = time.process_time()
        mended = list(measured.mended(inputs, settings, model, found))
        mend_s = (time.process_time() - begun) / len(mended)
        spent = {
            "train_cpu_s": train_s,
            "train_with_grasps_cpu_s": mend_s,
            "change_cpu_ms": measured.change_ms(found, settings.day_1, tuple(values)),
        }
    alarms = measured.alarms(settings.day_1, tuple(values), found)
    listed = {"said": said, "mended": mended, "alarms": list(alarms)}
    for row in (row for each in listed.values() for row in each):
        row["quantity"], row["value"] = values.get(row["session"], ("", np.nan))
    made = [
        table_of(name, TITLE, each, **{key: key.replace("_", " ") for key in each[0]})
        for name, each in listed.items()
    ]
    scores = score_table(_scores(model, said, mended), TITLE)
    cost = [(model, "cost of drift", key, "measured", value) for key, value in spent.items()]
    labels = np.unique(inputs.data().value, return_counts=True)[1]
    about = {"chance": float(labels.max() / labels.sum())}
    return Outcome((scores, *made), (score_table(cost, TITLE),), about)


def _scores(model: str, said: list[dict], mended: list[dict]) -> Iterator[ScoreRow]:
    """Yield the measures of each session, as it is and corrected by all that its references tell,
    and the accuracy with calibration grasps."""
    most = max(row["references"] for row in said)
    for row in said:
        if (row["remedy"], row["references"]) in ((NONE, 0), (SHOWN, most)):
            corrected = "" if row["remedy"] == NONE else f", {SHOWN}"
            part = f"drift: {row['session'] if row['quantity'] else 'day 1'}{corrected}"
            for metric in MEASURES:
                yield model, part, metric, f"fold {row['fold']}", row[metric]
    for row in mended:
        part = f"drift: {row['session']}, {row['grasps']} grasps"
        yield model, part, "accuracy", f"draw {row['draw']}", row["accuracy"]


TITLE = "Drift"
EXPERIMENT = Experiment(
    name="drift",
    order=62,
    title=TITLE,
    settings=Settings,
    measure=measure,
    figures=figures,
    tables=tables,
    rows=rows,
    highlights=highlights,
    summary=summary,
    by_model=True,
    kinds=("classification",),
)
