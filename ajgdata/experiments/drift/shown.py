"""Drift in figures, tables and words."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

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
from ajgdata.report.format import Caption, Score, mean_sd, number, with_unit
from ajgdata.report.panel import Highlight

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


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


def figure(results: TaskResults) -> Figure:
    """Return accuracy against each thing that changes, as it is and corrected."""
    from ajgdata.report.canvas import WIDTH_IN, new_figure

    drawn = new_figure(
        (WIDTH_IN, 3.6),
        finding(results),
        f"{results.title}: mean ± sd over models that each lack a session of day 1 (upright line); "
        f"hollow: corrected by {max(results.settings.references)} recordings of nothing",
        [results.source],
    )
    changes = results.settings.changes
    panels = drawn.subplots(1, len(changes), sharey=True, squeeze=False)[0]
    for axes, one in zip(panels, changes, strict=True):
        _panel(axes, results, one, axes is panels[-1])
    panels[0].set(ylabel="accuracy (%)", ylim=(0, 104))
    return drawn


def _panel(axes: Axes, results: TaskResults, change: Any, last: bool) -> None:
    """Draw the models against one change; those of the `last` panel are named at their ends."""
    from ajgdata.report.canvas import model_line
    from ajgdata.report.labels import REFERENCES, label_end, reference_line

    chance = 100 * float(results.results[0].about["chance"])
    for i, result in enumerate(results.results):
        home, *later = states_of(result)
        states = [home._replace(value=change.day_1)]
        states += [state for state in later if state.quantity == change.quantity]
        states.sort(key=lambda state: state.value)
        x = [state.value for state in states]
        style: dict[str, Any] = {**model_line(i), "capsize": 2.5, "ms": 4.5}
        for best in (True, False):
            y = np.array([(s.best if best else s.plain)["accuracy"][:2] for s in states]).T
            how = {**style, "mfc": "white", "lw": 0.7} if best else style
            axes.errorbar(x, y[0], np.nan_to_num(y[1]), **how)
            if last:
                name = f"{result.label}, corrected" if best else result.label
                label_end(axes, x[-1], float(y[0][-1]), name, style["color"])
    if last:
        reference_line(axes, "chance", chance, "chance")
    else:
        axes.axhline(chance, label="chance", **REFERENCES["chance"])
    axes.axvline(change.day_1, zorder=1, **REFERENCES["ideal"])
    unit = f" ({change.unit})" if change.unit else ""
    axes.set_xlabel(f"{change.quantity}{unit}")


def alarm_figure(results: TaskResults) -> Figure:
    """Return accuracy against how far references are from day 1, a point for each session."""
    from ajgdata.report.canvas import COLOURS, MARKERS, WIDTH_IN, new_figure
    from ajgdata.report.labels import REFERENCES, label_point, reference_line

    drawn = new_figure(
        (WIDTH_IN, 3.6),
        alarm_finding(results),
        f"{results.title}: median over the references of a session, over the limit of the alarm; "
        "one point a session",
        [results.source],
    )
    panels = drawn.subplots(1, len(results.results), sharey=True, squeeze=False)[0]
    for axes, result in zip(panels, results.results, strict=True):
        states = states_of(result)
        for n, quantity in enumerate(dict.fromkeys(state.quantity for state in states)):
            mine = [state for state in states if state.quantity == quantity]
            style = {"color": COLOURS[n], "marker": MARKERS[n], "ls": ""}
            axes.plot(
                [s.ratio for s in mine], [s.plain["accuracy"].mean for s in mine],
                label=quantity or DAY_1, **style,
            )  # fmt: skip
            far = max(mine, key=lambda state: state.ratio)
            label = place(results, far)
            label_point(axes, far.ratio, far.plain["accuracy"].mean, label, COLOURS[n])
        reference_line(axes, "ideal", 1.0, "alarm", axis="x")
        chance = 100 * float(result.about["chance"])
        axes.axhline(chance, label="chance", **REFERENCES["chance"])
        axes.set_xlabel("distance of references from day 1, limit = 1")
        axes.text(0.98, 0.03, result.label, transform=axes.transAxes, ha="right", va="bottom")
        axes.set_xlim(left=0)
    panels[0].set(ylabel="accuracy (%)", ylim=(0, 108))
    return drawn


def cost_figure(results: TaskResults) -> Figure:
    """Return mean accuracy against recordings after the change, a panel for each model."""
    from ajgdata.report.canvas import WIDTH_IN, line_style, new_figure
    from ajgdata.report.labels import label_end, reference_line

    drawn = new_figure(
        (WIDTH_IN, 3.6),
        cost_finding(results),
        f"{results.title}: mean over {len(states_of(results.results[0])) - 1} later sessions",
        [results.source],
    )
    panels = drawn.subplots(1, len(results.results), sharey=True, squeeze=False)[0]
    for axes, result in zip(panels, results.results, strict=True):
        for n, line in enumerate(means_of(result)):
            style = line_style(n)
            axes.plot(line.recordings, line.accuracy, label=line.label, **style)
            if axes is panels[-1]:
                end = float(line.accuracy[-1])
                label_end(axes, float(line.recordings[-1]), end, line.label, style["color"])
        if axes is panels[-1]:
            reference_line(axes, "chance", 100 * float(result.about["chance"]), "chance")
        axes.set(xlabel="recordings after the change", title=result.label)
    panels[0].set(ylabel="accuracy (%)", ylim=(0, 104))
    return drawn


def captions(results: TaskResults) -> tuple[Caption, Caption, Caption]:
    """Return the captions of `figure`, `alarm_figure` and `cost_figure`."""
    listed = "; ".join(
        f"{result.label} at {place(results, state)}: {_accuracy(state.plain)}, "
        f"corrected {_accuracy(state.best)}"
        for result in results.results
        for state in states_of(result)
    )
    alarms = "; ".join(
        f"{place(results, state)}: {number(state.ratio)}" for state in states_of(results.results[0])
    )
    rate = results.results[0].tables["alarms"].rows[-1]
    means = "; ".join(
        f"{result.label}, {line.label}: "
        + ", ".join(
            f"{number(accuracy)} % with {count}"
            for count, accuracy in zip(line.recordings, line.accuracy, strict=True)
        )
        for result in results.results
        for line in means_of(result)
    )
    of = f"{results.title}, {results.source}: "
    return (
        Caption(
            f"{of}models of day 1 on the same gripper later. Confidence is scaled as it suits day "
            "1. The correction undoes what became of references: the stretch of the spectrum, then "
            "a gain of each bin.",
            f"{finding(results)}. {listed}.",
        ),
        Caption(
            f"{of}the alarm needs no object and no model. It rings when {rate['in_a_row']} "
            "references in a row lie beyond 1: if nothing has changed, in at most "
            f"{number(100 * rate['false_alarm'], 2)} % of cases.",
            f"{alarm_finding(results)}. Distance of references over the limit: {alarms}.",
        ),
        Caption(
            f"{of}references take no object and no label, and train nothing; calibration grasps "
            "are labelled, and a model is trained with them.",
            f"{cost_finding(results)}. {means}.",
        ),
    )


def _accuracy(measures: dict[str, Score]) -> str:
    return mean_sd(measures["accuracy"], "%")


def figures(results: TaskResults) -> list[Illustration]:
    """Return accuracy against change, against the alarm, and against what a correction costs."""
    parts = (((), figure), (("alarm",), alarm_figure), (("cost",), cost_figure))
    return [
        Illustration(results.named(*name), caption, partial(draw, results))
        for (name, draw), caption in zip(parts, captions(results), strict=True)
    ]


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
