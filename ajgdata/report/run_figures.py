"""What changed between two runs -> figures: the largest changes, and B against A."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.report.blocks import Illustration
from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, new_figure, plain_ticks
from ajgdata.report.comparison import REACH
from ajgdata.report.format import Caption, Source, mean_sd, number, words
from ajgdata.report.run_difference import Change, Direction
from ajgdata.report.run_tables import RunComparison, in_sd, summary

#: Rows of the figure of changes, and standard deviations at which a longer one is cut.
ROWS, FARTHEST = 14, 8.0
NAMED = 4  #: as many points as get their name
#: Colour and mark by what a change is: told apart without colour, too.
LOOKS: dict[Direction, tuple[str, str]] = {
    "better": (COLOURS[0], "^"), "worse": (COLOURS[1], "v"), "": (GREY, "o"),
}  # fmt: skip
#: Ticks of errors.
TICKS = [round(mantissa * 10**power, 9) for power in range(-4, 5) for mantissa in (1, 2, 5)]
#: Metrics that are drawn against each other: (metric, unit, name on axes).
AXES = (("accuracy", "%", "accuracy, %"), ("rmse", "mm", "RMSE, mm"), ("rmse", "°", "RMSE, °"))


def illustrations(found: RunComparison) -> list[Illustration]:
    """Return the figures of a comparison, not drawn yet; those that would be empty are left out."""
    told = summary(found)
    drawn = []
    known = [one for one in found.leading() if not math.isnan(one.ratio)]
    changes = ([one for one in known if one.direction] or known)[:ROWS]
    if changes:
        text = (
            "The largest changes in units of their spread, with one standard deviation to either "
            f"side; within {number(REACH)} (shaded) they cannot be told from it. At the right: "
            "A → B. What says the same again (mae and r2 beside rmse, say) is left out."
        )
        counts = Counter(one.direction for one in known if one.beyond)
        title = f"{counts['better']} better and {counts['worse']} worse beyond {number(REACH)} sd"
        largest = changes[0]
        alt = f"{told} The largest: {_name(largest)}, {_from_to(largest)}."
        drawn.append(
            Illustration("changes", Caption(text, alt), partial(changes_figure, changes, title))
        )
    if found.numbers.changed and (panels := _panels(found)):
        text = (
            "Each number of both runs, A across and B up, with standard deviations; on the line "
            "nothing changed. Named: what changed most, beyond its spread."
        )
        drawn.append(
            Illustration("both-runs", Caption(text, told), partial(scatter_figure, panels))
        )
    return drawn


def changes_figure(changes: Sequence[Change], title: str) -> Figure:
    """Return the intervals of `changes`, whose spread is known, one a row."""
    height = 1.1 + 0.27 * len(changes)
    told = f"the {len(changes)} largest changes from A to B, in units of their spread"
    figure = new_figure((WIDTH_IN, height), title, told, _sources(changes))
    axes = figure.subplots()
    reach = min(FARTHEST, max(3.0, *(min(one.ratio, FARTHEST) for one in changes))) + 0.7
    axes.axvspan(-REACH, REACH, color="#eeeeee", zorder=0)
    axes.axvline(0, color=GREY, lw=1)
    for row, one in enumerate(changes):
        colour, mark = LOOKS[one.direction]
        sign = {"better": 1.0, "worse": -1.0}.get(one.direction, math.copysign(1, one.difference))
        at = sign * min(one.ratio, FARTHEST)
        axes.plot([at - 1, at + 1], [row, row], color=colour, lw=2, solid_capstyle="butt")
        axes.plot(at, row, mark, color=colour, ms=7, mec="white", mew=0.6)
        if one.ratio > FARTHEST:  # further away than is drawn
            side = "left" if sign < 0 else "right"
            place = at - 1.1 * sign, row
            axes.annotate(in_sd(one), place, ha=side, va="center", color=colour, fontsize=7.5)
    axes.set(xlim=(-reach, reach), ylim=(len(changes) - 0.4, -0.6))
    axes.set_xlabel("worse  ←  standard deviations of the difference  →  better")
    axes.set_yticks(range(len(changes)), [_name(one) for one in changes])
    axes.grid(visible=False, axis="y")
    values = axes.secondary_yaxis("right")
    values.set_yticks(range(len(changes)), [_from_to(one) for one in changes])
    for axis in (axes, values):
        axis.tick_params(axis="y", length=0)
    values.spines["right"].set_visible(False)
    return figure


def scatter_figure(panels: Sequence[tuple[str, Sequence[Change]]]) -> Figure:
    """Return B against A, a panel for each metric and unit, by its name on the axes."""
    listed = [one for _, some in panels for one in some]
    width = WIDTH_IN if len(panels) > 1 else 0.6 * WIDTH_IN
    title = "Both runs, number by number"
    figure = new_figure((width, 3.6), title, "", _sources(listed))
    drawn = figure.subplots(1, len(panels), squeeze=False)[0]
    for axes, (name, some) in zip(drawn, panels, strict=True):
        _scatter(axes, name, some)
    return figure


def _scatter(axes: Axes, name: str, some: Sequence[Change]) -> None:
    a, b, sd_a, sd_b = (
        np.array([one.scale * value for one, value in zip(some, values, strict=True)])
        for values in (
            [one.a.score.mean for one in some], [one.b.score.mean for one in some],
            [np.nan_to_num(one.a.score.sd) for one in some],
            [np.nan_to_num(one.b.score.sd) for one in some],
        )
    )  # fmt: skip
    low, high = min(a.min(), b.min()), max(a.max(), b.max())
    if name.startswith("RMSE") and low > 0:
        axes.set(xscale="log", yscale="log")
        low, high = low / 1.25, high * 1.25
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_view_interval(low, high, ignore=True)
            plain_ticks(axis, TICKS)
    else:
        margin = 0.06 * (high - low or 1.0)
        low, high = low - margin, high + margin
    axes.plot([low, high], [low, high], color=GREY, lw=1, zorder=1)
    axes.errorbar(a, b, sd_b, sd_a, fmt="none", ecolor="#c8c8c8", elinewidth=0.8, zorder=2)
    for one, x, y in zip(some, a, b, strict=True):
        colour, mark = LOOKS[one.direction if one.beyond else ""]
        axes.plot(x, y, mark, color=colour, ms=6 if one.beyond else 4, mec="white", mew=0.5)
    axes.set(xlim=(low, high), ylim=(low, high), aspect="equal")
    axes.set(xlabel=f"A: {name}", ylabel=f"B: {name}")
    taken: list[float] = []  # heights of names, as shares of the panel's
    for one in sorted((one for one in some if one.beyond), key=lambda one: -one.ratio):
        place = one.scale * one.a.score.mean, one.scale * one.b.score.mean
        across, up = axes.transAxes.inverted().transform(axes.transData.transform(place))
        if len(taken) == NAMED or any(abs(up - other) < 0.07 for other in taken):
            continue
        taken.append(up)
        axes.annotate(
            _name(one, short=True), place, (-7, 0) if across > 0.5 else (7, 0),
            textcoords="offset points", ha="right" if across > 0.5 else "left", va="center",
            fontsize=7,
        )  # fmt: skip


def _panels(found: RunComparison) -> list[tuple[str, list[Change]]]:
    """Return the metrics of the first kind that both runs have, by their name on axes."""
    panels = []
    for metric, unit, name in AXES:
        shared = (*found.numbers.equal, *found.numbers.changed)
        some = [one for one in shared if one.key.metric == metric and one.unit == unit]
        if some:
            panels.append((name, some))
    return panels


def _sources(changes: Sequence[Change]) -> list[Source]:
    known: tuple[Source, ...] = ("simulated", "recorded")
    return [source for source in known if any(one.b.source == source for one in changes)]


def _name(one: Change, short: bool = False) -> str:
    key = one.key
    place = key.dataset if key.dataset == key.task else f"{key.dataset}/{key.task}"
    parts = [place, key.model, key.part] + ([] if short else [words(key.metric)])
    return " · ".join(filter(None, parts))


def _from_to(one: Change) -> str:
    first = mean_sd(one.a.score, "", one.scale).partition(" ")[0]
    return f"{first} → {mean_sd(one.b.score, one.unit, one.scale)}"
