"""Small figures of error against run time: their one look, and that of the simulation.

They are as wide as a third of a page, and say what they found in their title.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import MaxNLocator

from ajgdata.gripper.scene import Numerics
from ajgdata.report.blocks import Illustration
from ajgdata.report.canvas import (
    COLOURS,
    GREY,
    SOURCE_COLOURS,
    model_style,
    pareto_front,
    plain_ticks,
)
from ajgdata.report.format import Caption, Source, number
from ajgdata.types.table import Table

SIZE_IN = (3.6, 2.5)
TITLE_PT, LABEL_PT = 9.5, 7.5
#: A bold letter of the title is about 0.6 em wide.
TITLE_LETTERS = 43
#: What a time in ms (s) on a logarithmic axis is marked with.
ONE_TWO_FIVE = tuple(step * 10.0**power for power in range(-4, 5) for step in (1, 2, 5))
ERRORS = (0.02, 0.05, 0.1, 0.2, 0.5, 1)
NEAR: dict[str, Any] = {"textcoords": "offset points", "fontsize": LABEL_PT}
SIMULATION = "cost-of-simulation"
#: The table of the study of accuracy, and the kernel that the default is compared with.
TABLE, PLAIN = "accuracy", {"scheme": "second", "dx_mm": 2.5}
SCHEMES = {"wide": "wide scheme", "second": "plain second order"}


def panel_figure(title: str, about: str, sources: Iterable[Source]) -> Figure:
    """Return an empty figure of SIZE_IN: badges of its sources, what it is about, what it found."""
    width, height = SIZE_IN
    lines = textwrap.wrap(title, TITLE_LETTERS)
    head_in = 0.3 + 0.165 * len(lines)
    layout = ConstrainedLayoutEngine(rect=(0, 0, 1, 1 - head_in / height))
    figure = Figure(figsize=SIZE_IN, layout=layout)
    left_in = 0.09
    for source in sorted(set(sources)):
        figure.text(
            left_in / width,
            1 - 0.07 / height,
            source,
            va="top",
            fontsize=7,
            fontweight="bold",
            color="white",
            bbox={"boxstyle": "round,pad=0.25", "color": SOURCE_COLOURS[source]},
        )
        left_in += 0.72
    place = left_in / width, 1 - 0.06 / height
    figure.text(*place, about, va="top", fontsize=LABEL_PT, color=GREY)
    words: dict[str, Any] = {"va": "top", "fontweight": "bold", "linespacing": 1.15}
    figure.text(0.05 / width, 1 - 0.25 / height, "\n".join(lines), fontsize=TITLE_PT, **words)
    return figure


def draw_front(axes: Axes, cost: np.ndarray, error: np.ndarray, **style: Any) -> np.ndarray:
    """Draw a line through the Pareto front of n points; return which are on it, by rising cost."""
    front = np.flatnonzero(pareto_front(cost, error))
    front = front[np.lexsort((-error[front], cost[front]))]
    axes.plot(cost[front], error[front], **{"color": "#9a9a9a", "lw": 1.0, "zorder": 1, **style})
    return front


def mark_default(axes: Axes, cost: float, error: float, label: str, **place: Any) -> None:
    """Draw a ring around what is used today and name it in bold."""
    axes.plot(cost, error, "o", mfc="none", mec="black", mew=1.5, ms=10, zorder=5, label="today")
    style = {"xytext": (8, 6), "ha": "left", "va": "bottom", **place}
    axes.annotate(label, (cost, error), fontweight="bold", **NEAR, **style)


def choice_figure(
    title: str,
    about: str,
    source: Source,
    names: Sequence[str],
    times: Sequence[float],
    errors: Mapping[str, Sequence[float]],
) -> Figure:
    """Return n settings by name over their times, n errors for each label; the first is today's.

    Filled points and the line: Pareto front of each label; its least error is named.
    """
    figure = panel_figure(title, about, [source])
    axes = figure.subplots()
    for index, (label, of) in enumerate(errors.items()):
        _draw_choice(axes, index, label, names, np.asarray(times), np.asarray(of))
    axes.set(xscale="log")
    axes.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    axes.margins(x=0.12, y=0.2)
    return figure


def _draw_choice(
    axes: Axes, index: int, label: str, names: Sequence[str], times: np.ndarray, errors: np.ndarray
) -> None:
    style = model_style(index)
    front = draw_front(axes, times, errors, color=style["color"], lw=1.2)
    axes.plot(times, errors, **style, ls="", ms=4, mfc="white", mew=0.9, label=label)
    axes.plot(times[front], errors[front], **style, ls="", ms=4.5)
    under: dict[str, Any] = {"ha": "center", "va": "top", "color": style["color"]}
    if (best := front[-1]) != 0:
        axes.annotate(names[best], (times[best], errors[best]), (0, -5), **under, **NEAR)
    today = "" if index else f"today {names[0]}"
    mark_default(axes, times[0], errors[0], today, xytext=(-2, -9), va="top")
    slowest = times.argmax()
    beside: dict[str, Any] = {"color": style["color"], "fontweight": "bold", "ha": "right"}
    axes.annotate(label, (times[slowest], errors[slowest]), (2, 7), **beside, **NEAR)


class Grid(NamedTuple):
    """One scheme on one grid: mean run time (ms) and error over objects, and those of each."""

    scheme: str
    dx_mm: float
    time_ms: float
    error: float
    times_ms: np.ndarray
    errors: np.ndarray

    @property
    def is_default(self) -> bool:
        """Return whether scenes are solved so unless they say otherwise."""
        return (self.scheme, self.dx_mm) == (Numerics().scheme, Numerics().dx_mm)

    @property
    def is_plain(self) -> bool:
        """Return whether this is the kernel that the default is compared with."""
        return {"scheme": self.scheme, "dx_mm": self.dx_mm} == PLAIN


def grids_of(table: Table) -> list[Grid]:
    """Return every scheme and grid of the study of accuracy, in the order of its table."""
    grids = []
    for scheme, some in table.parted("scheme").items():
        for dx_mm, rows in some.parted("dx_mm").items():
            times, errors = 1e3 * rows.numbers("time_s"), rows.numbers("error")
            means = float(times.mean()), float(errors.mean())
            grids.append(Grid(str(scheme), float(dx_mm), *means, times, errors))
    return grids


def simulation_panel(tables: Sequence[Table]) -> Illustration | None:
    """Return scheme × grid with today's default; None where the study of accuracy has no rows."""
    found = [table for table in tables if table.name == TABLE and table.rows]
    if not found:
        return None
    grids = grids_of(found[0])
    return Illustration(SIMULATION, _simulation_caption(grids), partial(simulation_figure, grids))


def _simulation_title(grids: Sequence[Grid]) -> str:
    default = next((grid for grid in grids if grid.is_default), None)
    plain = next((grid for grid in grids if grid.is_plain), None)
    if default is None or plain is None:
        return "A finer grid errs less and takes longer"
    error, time = 100 * default.error / plain.error, 100 * default.time_ms / plain.time_ms
    return (
        f"Today's grid: {error:.0f} % of the error of a plain {plain.dx_mm:g} mm grid "
        f"in {time:.0f} % of its time"
    )


def simulation_figure(grids: Sequence[Grid]) -> Figure:
    """Return error of the feature against run time, a line a scheme, the Pareto front in grey."""
    figure = panel_figure(_simulation_title(grids), "scheme × grid", ["simulated"])
    axes = figure.subplots()
    draw_front(axes, *_times_and_errors(grids), lw=4, color="#dcdcdc")
    for index, scheme in enumerate(dict.fromkeys(grid.scheme for grid in grids)):
        _draw_scheme(axes, [g for g in grids if g.scheme == scheme], COLOURS[index])
    axes.set(xscale="log", yscale="log", ylabel="error of the feature")
    axes.set(xlabel="run time of one grasp (ms); grid in mm")
    axes.margins(x=0.1, y=0.12)
    plain_ticks(axes.xaxis, ONE_TWO_FIVE)
    plain_ticks(axes.yaxis, ERRORS)
    return figure


def _times_and_errors(grids: Sequence[Grid]) -> tuple[np.ndarray, np.ndarray]:
    return np.array([g.time_ms for g in grids]), np.array([g.error for g in grids])


def _draw_scheme(axes: Axes, grids: Sequence[Grid], colour: str) -> None:
    """Draw means over objects as a line, single objects as dots, and write the grids beside."""
    for grid in grids:
        axes.plot(grid.times_ms, grid.errors, ".", color=colour, ms=3.5, alpha=0.45, mew=0)
    ordered = sorted(grids, key=lambda grid: grid.time_ms)
    axes.plot(*_times_and_errors(ordered), "o-", color=colour, ms=4, lw=1.3, label=grids[0].scheme)
    for grid in ordered:
        if grid.is_default:
            below = {"xytext": (-7, -5), "ha": "right", "va": "top"}
            mark_default(axes, grid.time_ms, grid.error, f"today\n{grid.dx_mm:g}", **below)
        else:
            place = grid.time_ms, grid.error
            axes.annotate(f"{grid.dx_mm:g}", place, (3, 3), color=colour, **NEAR)
    bold: dict[str, Any] = {"color": colour, "fontweight": "bold", **NEAR}
    name, first, last = SCHEMES.get(grids[0].scheme, grids[0].scheme), ordered[0], ordered[-1]
    if any(grid.is_default for grid in grids):  # the lower line
        axes.annotate(name, (last.time_ms, last.error), (0, -5), ha="right", va="top", **bold)
    else:
        axes.annotate(name, (first.time_ms, first.error), (18, 6), **bold)


def _simulation_caption(grids: Sequence[Grid]) -> Caption:
    """Return what each scheme and grid costs and errs."""
    listed = "; ".join(
        f"{SCHEMES.get(g.scheme, g.scheme)} at {g.dx_mm:g} mm{', today' * g.is_default}: error "
        f"{number(g.error, 2)} in {number(g.time_ms, 2)} ms"
        for g in grids
    )
    return Caption(
        "Error of the feature (relative L2, against a much finer grid) and run time of one grasp, "
        "means over objects; dots: single objects; ring: what is used unless a scene says "
        "otherwise. Broad grey line: Pareto front. Times belong to the machine of this run.",
        f"{_simulation_title(grids)}. {listed}.",
    )
