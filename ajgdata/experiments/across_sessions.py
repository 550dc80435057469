"""Across sessions: models in held-out sessions, and what corrections need of the session.

The corrections are in `evaluate.few_grasps`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Annotated

import numpy as np
from pydantic import Field

from ajgdata.evaluate.task_data import session_of
from ajgdata.experiments.base import Experiment, Inputs, Outcome, TaskResults, score_table
from ajgdata.experiments.plots import Plot
from ajgdata.report.format import number
from ajgdata.types import ModelName, Name, NotPossibleError, Strict
from ajgdata.types.table import Table, table_of

#: Of more sessions so many are tested, evenly spaced in their order.
MOST_SESSIONS = 8
TITLE = "In a new session"
#: Recordings of the new session that a correction uses.
NEEDS = ("labelled", "unlabelled")
COLUMNS = {
    "session": "Session", "draw": "Draw", "remedy": "Remedy", "labelled": "Labelled",
    "unlabelled": "Unlabelled", "metric": "Metric", "value": "Value",
    "chance": "Chance",
}  # fmt: skip


class Settings(Strict):
    """Models in held-out sessions, and corrections by recordings of the session."""

    train_on: tuple[Name, ...] = Field(
        (), description="sessions of the training, the others are tested; default: each session is "
        f"tested (of more than {MOST_SESSIONS}, some), by models of all others"
    )  # fmt: skip
    grasps: tuple[Annotated[int, Field(ge=1)], ...] = Field(
        (1, 2, 4), min_length=1, description="labelled grasps of each class, or value, as a remedy"
    )
    draws: int = Field(2, ge=1, description="choices of the grasps that are set aside for remedies")
    models: tuple[ModelName, ...] = Field(
        ("linear_plain", "knn_plain"), min_length=1, description="models that are taken there"
    )


def measure(inputs: Inputs, settings: Settings, model: str) -> Outcome:
    """Return the errors of `model` in each new session, with each correction."""
    from ajgdata.evaluate.few_grasps import on_new_sessions

    known = inputs.data()
    sessions = session_of(known.name)
    rows = list(
        on_new_sessions(
            known, sessions, tested=_tested(sessions, settings.train_on),
            train_on=settings.train_on, sizes=settings.grasps, draws=settings.draws,
            model=model, kind=inputs.kind, seed=inputs.seed, period=inputs.period_deg,
            limits=inputs.most_recordings,
        )
    )  # fmt: skip
    measured = table_of("measured", TITLE, rows, **COLUMNS)
    return Outcome((score_table(_scores(model, measured), TITLE), measured))


def _tested(sessions: np.ndarray, train_on: Sequence[str]) -> list[str]:
    """Return the sessions that are tested. Raises NotPossibleError where there are none."""
    names = np.unique(sessions)
    if absent := sorted(set(train_on) - set(names.tolist())):
        raise NotPossibleError(f"train_on: session {absent[0]!r} has no recording of the task")
    if len(names) < 2:
        raise NotPossibleError("all recordings are of one session: two are needed")
    left = names[~np.isin(names, train_on)]
    if not len(left):
        raise NotPossibleError("train_on names every session: none is left to test")
    some = np.linspace(0, len(left) - 1, min(len(left), MOST_SESSIONS)).round().astype(int)
    return (left if train_on else left[np.unique(some)]).tolist()


def _scores(model: str, measured: Table) -> Iterator[tuple[str, str, str, str, float]]:
    """Yield each session's metrics, mean over draws, per correction; mean and deviation."""
    for remedy, part in measured.parted("remedy").items():
        for metric, rows in part.parted("metric").items():
            sessions = rows.parted("session").values()
            values = [float(one.numbers("value").mean()) for one in sessions]
            deviation = float(np.std(values, ddof=1)) if len(values) > 1 else float("nan")
            statistics = {f"fold {at}": value for at, value in enumerate(values)}
            statistics |= {"mean": float(np.mean(values)), "sd": deviation}
            statistics["chance"] = float(rows.numbers("chance").mean())
            for statistic, value in statistics.items():
                yield model, f"sessions: {remedy}", metric, statistic, value


def _needs(table: Table) -> str:
    """Return `64 labelled`, `12 unlabelled`, or `none`."""
    mean = {key: float(table.numbers(key).mean()) for key in NEEDS}
    return ", ".join(f"{number(count)} {key}" for key, count in mean.items() if count) or "none"


def by_session(results: TaskResults) -> Table:
    """Return the metric of each model with each correction, per session, mean over draws.

    If sessions allow every correction, only these count: all rows are then of the same recordings.
    """
    rows = []
    for result in results.results:
        measured = result.tables["measured"].where(metric=results.metric)
        allowed = [set(one.column("session")) for one in measured.parted("remedy").values()]
        common = set.intersection(*allowed) or set.union(*allowed)
        for remedy, table in measured.parted("remedy").items():
            row = {"model": result.label, "remedy": f"{remedy} ({_needs(table)})"}
            for session, draws in table.parted("session").items():
                if session in common:
                    means = {key: float(draws.numbers(key).mean()) for key in ("value", "chance")}
                    named = {"session": session, "metric": results.metric}
                    rows.append(row | named | means)
    columns = {"model": "Model", "remedy": "Correction (recordings of the session)"}
    columns |= {key: COLUMNS[key] for key in ("session", "metric", "value", "chance")}
    return table_of("by_session", TITLE, rows, **columns)


SESSIONS = Plot(
    "rows",
    by_session,
    "models in sessions that are not in the training data, by correction and by the recordings of "
    "the session that it needs; sessions that allow every correction, the same remaining grasps",
    x="remedy",
    over="sessions",
    chance="chance",
    listed=True,
)
EXPERIMENT = Experiment(
    name="across_sessions",
    order=61,
    title=TITLE,
    settings=Settings,
    measure=measure,
    plots=(SESSIONS,),
    by_model=True,
)
