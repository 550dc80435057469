"""Across sessions: models on a session that they have not met, what helps there and what it needs.

The corrections are in `evaluate.new_session` and `evaluate.reference_correction`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Field

from ajgdata.evaluate.task_data import session_of
from ajgdata.experiments.base import (
    Experiment,
    Inputs,
    Outcome,
    TaskResults,
    score_table,
)
from ajgdata.experiments.plots import Plot
from ajgdata.report.format import number
from ajgdata.types import ModelName, Name, NotPossibleError, Strict
from ajgdata.types.table import Table, table_of

if TYPE_CHECKING:
    from ajgdata.evaluate.new_session import Point, SessionData

#: Of more sessions so many are tested, evenly spaced in their order.
MOST_SESSIONS = 8
TITLE = "In a new session"
#: Recordings of the new session that a correction uses.
NEEDS = ("labelled", "unlabelled", "references")
COST = "cost of"  #: begins the parts of the table of costs
COLUMNS = {
    "session": "Session", "draw": "Draw", "remedy": "Remedy", "labelled": "Labelled",
    "unlabelled": "Unlabelled", "references": "References", "metric": "Metric", "value": "Value",
    "chance": "Chance",
}  # fmt: skip


class Settings(Strict):
    """Models on sessions that they have not met, and what of the session helps them."""

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
    """Return the errors of `model` in each new session, with each remedy."""
    from ajgdata.evaluate.new_session import on_new_sessions

    data = _data(inputs)
    tested = _tested(data, settings.train_on)
    points = list(
        on_new_sessions(
            data, tested=tested, train_on=settings.train_on, sizes=settings.grasps,
            draws=settings.draws, model=model, kind=inputs.kind, seed=inputs.seed,
            period=inputs.period_deg, limits=inputs.most_recordings,
        )
    )  # fmt: skip
    rows = [
        {key: getattr(one, key) for key in ("session", "draw", "remedy", *NEEDS)}
        | {"metric": metric, "value": value, "chance": one.chance[metric]}
        for one in points
        for metric, value in one.scores.items()
    ]
    spent = _mean_by_remedy(points)
    cost = [(model, f"{COST} {name}", "cpu_s", "measured", value) for name, value in spent.items()]
    missing = [n for n in settings.grasps if n not in {one.grasps for one in points}]
    about = {"sessions": len(tested), "too_many_grasps": missing}
    return Outcome(
        (score_table(_scores(model, points), TITLE), table_of("measured", TITLE, rows, **COLUMNS)),
        (score_table(cost, TITLE),),
        about,
    )


def _data(inputs: Inputs) -> SessionData:
    """Return the recordings of the task by session, and those of nothing as references."""
    from ajgdata.evaluate.new_session import SessionData

    data, columns = inputs.data(), inputs.store.columns
    names = columns["recording"].values
    nothing = ~np.isin(names, inputs.all_data().name)
    if "object" in columns:
        nothing &= columns["object"].values.astype(str) == ""
    else:
        nothing[:] = False
    every, references = session_of(names), {}
    for session in np.unique(every[nothing]):
        references[str(session)] = inputs.store.feature[nothing & (every == session)]
    return SessionData(
        data.feature, data.value, data.group, session_of(data.name), inputs.store.frequency_hz,
        references, inputs.features.normalisation,
    )  # fmt: skip


def _tested(data: SessionData, train_on: Sequence[str]) -> list[str]:
    """Return the sessions that are tested. Raises NotPossibleError where there are none."""
    names = np.unique(data.session)
    if absent := sorted(set(train_on) - set(names.tolist())):
        raise NotPossibleError(f"train_on: session {absent[0]!r} has no recording of the task")
    if len(names) < 2:
        raise NotPossibleError("all recordings are of one session: two are needed")
    left = names[~np.isin(names, train_on)]
    if not len(left):
        raise NotPossibleError("train_on names every session: none is left to test")
    some = np.linspace(0, len(left) - 1, min(len(left), MOST_SESSIONS)).round().astype(int)
    return (left if train_on else left[np.unique(some)]).tolist()


def _mean_by_remedy(points: Sequence[Point]) -> dict[str, float]:
    names = dict.fromkeys(one.remedy for one in points)
    return {name: float(np.mean([p.cpu_s for p in points if p.remedy == name])) for name in names}


def _scores(model: str, points: Sequence[Point]) -> Iterator[tuple[str, str, str, str, float]]:
    """Yield each session's metrics, mean over draws, by remedy; mean and deviation over them."""
    for remedy in dict.fromkeys(one.remedy for one in points):
        own = [one for one in points if one.remedy == remedy]
        for metric in own[0].scores:
            sessions = dict.fromkeys(one.session for one in own)
            values = [
                float(np.mean([one.scores[metric] for one in own if one.session == session]))
                for session in sessions
            ]
            part = f"sessions: {remedy}"
            for at, value in enumerate(values):
                yield model, part, metric, f"fold {at}", value
            yield model, part, metric, "mean", float(np.mean(values))
            yield model, part, metric, "sd", _deviation(values)
            chance = float(np.mean([one.chance[metric] for one in own]))
            yield model, part, metric, "chance", chance


def _deviation(values: Sequence[float]) -> float:
    return float(np.std(values, ddof=1)) if len(values) > 1 else float("nan")


def _needs(table: Table) -> str:
    """Return `64 labelled`, `12 unlabelled`, `6 references`, or `none`."""
    words = {"labelled": "labelled", "unlabelled": "unlabelled", "references": "references"}
    mean = {key: float(table.numbers(key).mean()) for key in NEEDS}
    return ", ".join(f"{number(mean[key])} {words[key]}" for key in NEEDS if mean[key]) or "none"


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


def missing(results: TaskResults) -> str:
    """Return for which numbers of labelled grasps a class has too few; "" if for none."""
    counts = results.results[0].about["too_many_grasps"]
    listed = ", ".join(map(str, counts))
    return f"A class has too few grasps for {listed} labelled grasps of each." if counts else ""


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
    summary=missing,
    by_model=True,
)
