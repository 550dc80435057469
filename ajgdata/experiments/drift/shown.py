"""Drift in figures, tables and words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ajgdata.experiments.base import SCORES, TaskResults
from ajgdata.experiments.drift.results import (
    DAY_1,
    LOSS,
    MEASURES,
    State,
    home_of,
    later_of,
    means_of,
    states_of,
)
from ajgdata.report.blocks import Illustration, ResultRow, ShownTable
from ajgdata.report.comparison import mark_of, range_of
from ajgdata.report.format import Score, mean_sd, number, with_unit
from ajgdata.report.panel import Highlight

if TYPE_CHECKING:
    from ajgdata.report.marks import Picture, Point


def place(results: TaskResults, state: State) -> str:
    """Return what has changed and by how much, or `day 1`."""
    if not state.quantity:
        return DAY_1
    unit = next(c.unit for c in results.settings.changes if c.quantity == state.quantity)
    return f"{state.quantity} {with_unit(number(state.value), unit)}"


def finding(results: TaskResults) -> str:
    """Return the range over all later sessions of the first model, plain and corrected."""
    first = results.results[0]
    later = later_of(first)
    return (
        f"{first.label}: {_percent(home_of(first).plain['accuracy'])} right on day 1, "
        f"{_range([s.plain['accuracy'] for s in later])} in {len(later)} later sessions, where its "
        f"confidence is {_range([s.plain['confidence'] for s in later])}; "
        f"{_range([s.best['accuracy'] for s in later])} if corrected by empty-gripper references"
    )


def _range(scores: Sequence[Score]) -> str:
    """Return `40 to 95 %`: the smallest and the largest mean."""
    low, high = (number(f(score.mean for score in scores)) for f in (min, max))
    return f"{low if low == high else f'{low} to {high}'} %"


def _percent(score: Score) -> str:
    return f"{number(score.mean)} %"


def alarm_finding(results: TaskResults) -> str:
    """Return how many of the sessions in which the first model lost accuracy raise the alarm."""
    first = results.results[0]
    home, *later = states_of(first)
    lost = [s for s in later if _loss(home, s) > LOSS]
    rung = sum(s.rung > 0 for s in lost)
    early = sum(s.rung > 0 for s in later) - rung
    return (
        f"The alarm rings in {rung} of {len(lost)} sessions in which {first.label} loses more than "
        f"{LOSS:g} %, in {early} of the {len(later) - len(lost)} others, and at {home.rung} of "
        f"{home.moments} moments of day 1"
    )


def _loss(home: State, state: State) -> float:
    return home.plain["accuracy"].mean - state.plain["accuracy"].mean


def cost_finding(results: TaskResults) -> str:
    """Return what the fewest references bring, by correction, next to all calibration grasps."""
    first = results.results[0]
    *corrections, grasps = means_of(first)
    count = int(corrections[0].recordings[1])
    brought = _range([Score(float(line.accuracy[1]), 0.0) for line in corrections])
    return (
        f"{first.label}, mean over all changes: {number(grasps.accuracy[0])} % uncorrected, "
        f"{brought} with {count} reference{'s' * (count > 1)} by {len(corrections)} corrections, "
        f"{number(grasps.accuracy[-1])} % with {grasps.recordings[-1]} recordings of the objects"
    )


def _sessions(results: TaskResults) -> Picture:
    """Return accuracy against each thing that changes, uncorrected and corrected."""
    from ajgdata.report.marks import Point

    points = []
    for change in results.settings.changes:
        panel = f"{change.quantity} ({change.unit})" if change.unit else change.quantity
        for result in results.results:
            home, *later = states_of(result)
            mine = [state for state in later if state.quantity == change.quantity]
            states = [home._replace(value=change.day_1), *mine]
            for name, key in ((result.label, "plain"), (f"{result.label}, corrected", "best")):
                points += [
                    Point(panel, name, state.value, getattr(state, key)["accuracy"])
                    for state in states
                ]
    return _picture(results, finding(results), points, ("value; day 1 is among them", ""))


def _recordings(results: TaskResults) -> Picture:
    """Return mean accuracy against recordings after the change, a panel for each model."""
    from ajgdata.report.marks import Point

    points = [
        Point(result.label, line.label, float(count), Score(float(accuracy), float("nan")))
        for result in results.results
        for line in means_of(result)
        for count, accuracy in zip(line.recordings, line.accuracy, strict=True)
    ]
    return _picture(results, cost_finding(results), points, ("recordings after the change", ""))


def _picture(
    results: TaskResults, title: str, points: list[Point], place_name: tuple[str, str]
) -> Picture:
    from ajgdata.report.marks import Picture

    chance = 100 * float(results.results[0].about["chance"])
    panels = dict.fromkeys(point.panel for point in points)
    return Picture(
        title=title,
        subtitle=f"{results.title}: models of day 1, mean ± sd over its sessions",
        sources=(results.source,),
        points=tuple(points),
        axis=("accuracy", "%"),
        place=place_name,
        chance=tuple((panel, chance) for panel in panels),
    )


def _accuracy(measures: dict[str, Score]) -> str:
    return mean_sd(measures["accuracy"], "%")


def figures(results: TaskResults) -> Iterator[Illustration]:
    """Yield accuracy against change, and against the recordings that a correction needs."""
    from ajgdata.report.marks import illustration

    alarm = results.results[0].tables["alarms"].rows[-1]
    yield illustration(
        results.named(), "lines", _sessions(results),
        f"{results.title}, {results.source}: models of day 1 on the same gripper later. The "
        "correction undoes the change of empty-gripper references. The alarm rings when "
        f"{alarm['in_a_row']} references in a row are beyond its limit: if nothing has changed, in "
        f"at most {number(100 * alarm['false_alarm'], 2)} % of cases.", "%",
    )  # fmt: skip
    yield illustration(
        results.named("cost"), "lines", _recordings(results),
        f"{results.title}, {results.source}: references need no object and no label, and train "
        "nothing; calibration grasps are labelled, and a model is trained with them.", "%",
    )  # fmt: skip


def summary(results: TaskResults) -> str:
    """Return the findings in a sentence each."""
    return f"{finding(results)}. {alarm_finding(results)}. {cost_finding(results)}."


def tables(results: TaskResults) -> list[ShownTable]:
    """Return every session with every model, and what the parts cost."""
    heads = ("Model", "Session", "Right|", "Sure|", "Calibration error|", "Sorted, and wrong|",
             "Unlike any|", "Corrected: right|", "Distance|", "Alarm|")  # fmt: skip
    lines = []
    for result in results.results:
        for state in states_of(result):
            told = [mean_sd(state.plain[key], "%") for key in MEASURES]
            alarm = f"{state.rung} of {state.moments}"
            told += [_accuracy(state.best), number(state.ratio), alarm]
            lines.append((result.label, place(results, state), *told))
    caption = (
        "Models of day 1 by session, mean ± sd over folds; sorted is what is more probable than "
        f"{100 * results.settings.threshold:g} %; unlike any is what a model in use would refuse."
    )
    spent = ("train_cpu_s", "train_with_grasps_cpu_s", "change_cpu_ms")
    cost = [
        (r.label, *(number(r.cost[SCORES].where(metric=key).numbers("value")[0]) for key in spent))
        for r in results.results
    ]
    costs = ("Model", "Training, s|", "With calibration grasps, s|", "Correcting a session, ms|")
    return [
        ShownTable(caption, heads, tuple(lines)),
        ShownTable("Processor time of one core.", costs, tuple(cost)),
    ]


def rows(results: TaskResults) -> list[ResultRow]:
    """Return every model on day 1, and in all later sessions, plain and corrected."""
    found = []
    for result in results.results:
        home, later = home_of(result), later_of(result)
        chance = with_unit(number(100 * result.about["chance"]), "%")
        cells = {
            "accuracy on day 1": _accuracy(home.plain),
            "accuracy in later sessions, range": _range([s.plain["accuracy"] for s in later]),
            "accuracy in later sessions, corrected by references, range": _range(
                [s.best["accuracy"] for s in later]
            ),
        }
        found += [
            ResultRow(result.label, metric, text, chance=chance) for metric, text in cells.items()
        ]
    return found


def highlights(results: TaskResults) -> list[Highlight]:
    """Return the first model in all later sessions: corrected by references, and uncorrected."""
    first = results.results[0]
    later = later_of(first)
    marks = (
        range_of("ours", "corrected", [state.best["accuracy"].mean for state in later]),
        range_of("other", "uncorrected", [state.plain["accuracy"].mean for state in later]),
        mark_of("chance", "chance", Score(100 * float(first.about["chance"]), 0.0)),
    )
    text = f"{first.label}, mean and range of {len(later)} later sessions"
    return [Highlight("Drift", text, "%", marks)]
