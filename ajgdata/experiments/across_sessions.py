"""Across sessions: models on a session that they have not met, what helps there and what it needs.

The corrections are in `evaluate.new_session` and `evaluate.reference_correction`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field

from ajgdata.evaluate.sessions import session_of
from ajgdata.experiments.base import (
    METRIC_NAMES,
    SCORES,
    Experiment,
    Inputs,
    Outcome,
    Result,
    TaskResults,
    score_table,
)
from ajgdata.report.blocks import Illustration, ResultRow
from ajgdata.report.format import Caption, Score, mean_sd, number, with_unit
from ajgdata.types import ModelName, Name, NotPossibleError, Strict
from ajgdata.types.table import Table, Value, table_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ajgdata.evaluate.new_session import Point, SessionData

#: Of more sessions so many are tested, evenly spaced in their order.
MOST_SESSIONS = 8
TITLE = "In a new session"
#: Chance is drawn if it is no further off than this share of what else is.
NEAR = 1.3
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


NEEDS = ("labelled", "unlabelled", "references")


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


class Line(NamedTuple):
    """One remedy of one model: the metric as it is shown, over the sessions where the remedy is
    possible, how many these are, and what the model as it is makes of the same; what it needs of
    the new session, recordings of the mean session; and the time of correcting and training."""

    model: str
    remedy: str
    score: Score
    sessions: int
    plain: float
    chance: float
    needs: str
    cpu_s: float


def lines_of(results: TaskResults, result: Result) -> list[Line]:
    """Return the remedies of a model, in the order of what they need."""
    from ajgdata.evaluate.new_session import NONE

    rows = result.tables["measured"].where(metric=results.metric)
    scores, cost = result.tables[SCORES], result.cost[SCORES]
    as_it_is = _by_session(rows.where(remedy=NONE))
    lines = []
    for remedy, table in rows.parted("remedy").items():
        told = scores.where(part=f"sessions: {remedy}", metric=results.metric)
        value = dict(zip(told.column("statistic"), told.numbers("value"), strict=True))
        possible = dict.fromkeys(table.column("session"))
        plain = results.scale * float(np.mean([as_it_is[name] for name in possible]))
        score = Score(results.scale * value["mean"], results.scale * value["sd"])
        (cpu_s,) = cost.where(part=f"{COST} {remedy}").numbers("value")
        chance = results.scale * value["chance"]
        lines.append(
            Line(
                result.label, remedy, score, len(possible), plain, chance, _needs(table),
                float(cpu_s),
            )
        )  # fmt: skip
    return lines


def _by_session(table: Table) -> dict[Value, float]:
    """Return the mean value of each session, over draws."""
    return {
        name: float(one.numbers("value").mean()) for name, one in table.parted("session").items()
    }


def _needs(table: Table) -> str:
    """Return `64 labelled`, `12 unlabelled`, `6 of nothing`, or `nothing`."""
    words = {"labelled": "labelled", "unlabelled": "unlabelled", "references": "of nothing"}
    mean = {key: float(table.numbers(key).mean()) for key in NEEDS}
    return ", ".join(f"{number(mean[key])} {words[key]}" for key in NEEDS if mean[key]) or "nothing"


def best_line(results: TaskResults) -> tuple[Line, Line]:
    """Return the first model as it is, and of its remedies that need no labels (of all, if none
    does) the one that mends most of what the model errs by in the same sessions."""
    first, *others = lines_of(results, results.results[0])
    free = [line for line in others if "labelled" not in line.needs.split()] or others
    sign = 1 if results.kind == "classification" else -1
    return first, max(free, key=lambda line: sign * (line.score.mean - line.plain))


def finding(results: TaskResults) -> str:
    """Return what becomes of the first model in a new session, and what helps without labels."""
    plain, best = best_line(results)
    before, after = (
        with_unit(number(value, 2), results.shown_unit) for value in (best.plain, best.score.mean)
    )
    name, few = METRIC_NAMES[results.metric], _few(results, best)
    return (
        f"{plain.model} in a new session{few}: {name} {before}; without its labels {after} at best"
    )


def _few(results: TaskResults, line: Line) -> str:
    """Return ` (3 of 8 sessions)` for a remedy that is not possible in all."""
    every = results.results[0].about["sessions"]
    return f" ({line.sessions} of {every} sessions)" if line.sessions < every else ""


def figure(results: TaskResults) -> Figure:
    """Return the metric of each remedy and model, with what the remedy needs and takes."""
    from ajgdata.report.canvas import WIDTH_IN, model_style, new_figure
    from ajgdata.report.labels import LABEL_PT, reference_line

    every = [lines_of(results, result) for result in results.results]
    sessions, chance = results.results[0].about["sessions"], every[0][0].chance
    drawn = new_figure(
        (WIDTH_IN, 1.4 + 0.36 * len(every[0])),
        finding(results),
        f"{results.title}: mean ± sd over {sessions} sessions that were not met; chance is "
        f"{with_unit(number(chance), results.shown_unit)}; at the right what a remedy needs of the "
        f"new session, and the time of {every[0][0].model}",
        [results.source],
    )
    axes = drawn.subplots()
    for i, lines in enumerate(every):
        style: dict[str, Any] = {**model_style(i), "ls": "", "capsize": 2.5}
        at = np.arange(len(lines)) + 0.16 * (i - (len(every) - 1) / 2)
        _dots(axes, lines, at, style)
    drawn.legend(loc="outside lower center", ncols=len(every))
    names = [f"{line.remedy}{_few(results, line)}" for line in every[0]]
    axes.set_yticks(range(len(every[0])), names)
    axes.invert_yaxis()
    axes.set_xlabel(f"{METRIC_NAMES[results.metric]} ({results.shown_unit})")
    axes.grid(False, axis="y")
    axes.set_xlim(left=0)
    if chance < NEAR * axes.get_xlim()[1]:
        reference_line(axes, "chance", chance, "chance", axis="x")
    for row, line in enumerate(every[0]):
        needs = f"{line.needs}; {number(1e3 * line.cpu_s, 2)} ms"
        axes.annotate(needs, (1, row), (6, 0), xycoords=("axes fraction", "data"), va="center",
                      textcoords="offset points", fontsize=LABEL_PT)  # fmt: skip
    return drawn


def _dots(axes: Axes, lines: Sequence[Line], at: np.ndarray, style: dict[str, Any]) -> None:
    mean = [line.score.mean for line in lines]
    sd = np.nan_to_num([line.score.sd for line in lines])
    axes.errorbar(mean, at, xerr=sd, label=lines[0].model, **style)


def caption(results: TaskResults) -> Caption:
    """Return the caption of `figure`."""
    listed = "; ".join(
        f"{line.model}, {line.remedy}{_few(results, line)} ({line.needs}): {_told(results, line)}"
        for result in results.results
        for line in lines_of(results, result)
    )
    missing = results.results[0].about["too_many_grasps"]
    few = f" Of a class there are too few grasps for {', '.join(map(str, missing))} of each."
    return Caption(
        f"Models of {results.title}, {results.source}, in sessions that they have not met. "
        "Remedies see grasps of the new session that are set aside: without labels (mean and "
        "deviation of bins), or with them; or recordings of nothing. "
        "What is tested is the same for all; a remedy that some sessions do not allow is shown for "
        "the others, beside the model as it is in these. Times: correcting and training, of one "
        "processor."
        f"{few if missing else ''}",
        f"{finding(results)}. {listed}.",
    )


def _told(results: TaskResults, line: Line) -> str:
    told = mean_sd(line.score, results.shown_unit)
    if not _few(results, line):
        return told
    return f"{told} (as it is, there: {with_unit(number(line.plain, 2), results.shown_unit)})"


def rows(results: TaskResults) -> list[ResultRow]:
    """Return every remedy of every model."""
    name = METRIC_NAMES[results.metric]
    return [
        ResultRow(
            line.model, f"{name} in a new session, {line.remedy}{_few(results, line)}",
            results.with_chance_note(_told(results, line), line.score.mean, line.chance),
            mean_sd(Score(line.chance, 0.0), results.shown_unit),
            part=f"needs {line.needs} of the session",
        )
        for result in results.results
        for line in lines_of(results, result)
    ]  # fmt: skip


def figures(results: TaskResults) -> list[Illustration]:
    """Return the figure of all remedies and models."""
    return [Illustration(results.named(), caption(results), lambda: figure(results))]


EXPERIMENT = Experiment(
    name="across_sessions",
    order=61,
    title=TITLE,
    settings=Settings,
    measure=measure,
    figures=figures,
    rows=rows,
    by_model=True,
)
