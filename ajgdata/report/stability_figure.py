"""Figure of the study of stability: energy against steps, and distance to limits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.report.canvas import GREY, WIDTH_IN, line_style, new_figure, power, power_ticks
from ajgdata.report.format import Caption, number, value
from ajgdata.report.report_data import Illustration
from ajgdata.report.study_tables import MAX_ROWS, holds, ordered_rows
from ajgdata.types.table import Table

HEIGHT_IN = 5.2
SLOPE: dict[str, Any] = {"color": GREY, "ls": ":", "lw": 1.2}
BACKGROUND: dict[str, Any] = {"color": "#c9c9c9", "lw": 0.8, "zorder": 1}
LEGEND: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (-0.2, -0.17), "fontsize": 7}
#: Place of an unchanged energy, because a logarithmic axis has no zero.
SMALLEST_CHANGE = 1e-17


def stability_figure(
    limits: Table, unreached: Table, long_runs: Table, energy: Table, distances: Table
) -> Illustration:
    """Return the figure of the study, named like its first table."""
    title = _title(long_runs, limits, unreached)
    text = (
        "Left: relative change of the discrete energy after a pulse (absolute value), for the cases"
        " whose energy grew most; the dotted lines are half an ulp per step."
        f" Right: relative L2 distance of a response (0.1 to 6 kHz) to that of its limit; the first"
        f" {MAX_ROWS} limits are named, and the dotted line has order 1."
    )
    ends = [
        f"{row['title']}: {value(row['distance'])} (order {value(row['measured_order'])})"
        for row in limits.rows
    ]
    caption = Caption(text, f"{title}. {'; '.join(ends)}.")
    subtitle = _subtitle(long_runs, limits)
    draw = partial(_draw, title, subtitle, limits, long_runs, energy, distances)
    return Illustration(limits.name, caption, draw, title)


def _title(long_runs: Table, limits: Table, unreached: Table) -> str:
    """Return the conclusion: growth of energy in long runs, and number of limits reached."""
    worst = max(long_runs.rows, key=lambda row: row["growth"])
    reached = sum(holds(row) is True for row in limits.rows)
    count = len(limits.rows) + len(unreached.rows)
    energy = "Energy does not grow"
    if worst["growth"] > 0:
        energy = f"Energy grows by up to {value(100 * worst['growth'])} %"
    steps = f"{_count(worst['steps'])} steps ({worst['precision']})"
    return f"{energy} in {steps}; {reached} of {count} limits are reached"


def _subtitle(long_runs: Table, limits: Table) -> str:
    """Return the number of cases, their largest gains per step, and the range of orders."""
    cases = len(long_runs.split_by("case"))
    orders = np.abs(limits.numbers("measured_order"))
    orders = orders[np.isfinite(orders)]
    low = number(float(orders.min()), 4)
    high = number(float(orders.max()), 4)
    gains = [
        f"{value(float(rows.numbers('gain').max()))} ({precision})"
        for precision, rows in long_runs.split_by("precision").items()
    ]
    return (
        f"{cases} worst cases, largest gain per step {' and '.join(gains)};"
        f" orders from {low} to {high} (theory: 1)"
    )


def _count(steps: int) -> str:
    """Return a number of steps, as a power of ten if it is one.

    >>> _count(10**6), _count(2_000)
    ('10⁶', '2,000')
    """
    exponent = math.log10(steps)
    if exponent == round(exponent):
        return power(steps)
    return f"{steps:,}"


def _draw(
    title: str, subtitle: str, limits: Table, long_runs: Table, energy: Table, distances: Table
) -> Figure:
    """Draw both panels."""
    figure = new_figure((WIDTH_IN, HEIGHT_IN), title, subtitle, ("simulated",))
    left, right = figure.subplots(1, 2)
    _draw_energy(left, energy, long_runs)
    named = [row["title"] for row in ordered_rows(limits)[:MAX_ROWS]]
    _draw_distances(right, distances, named)
    for axis in (left.xaxis, left.yaxis, right.xaxis, right.yaxis):
        power_ticks(axis)
    return figure


def _draw_energy(axes: Axes, energy: Table, long_runs: Table) -> None:
    """Draw the change of energy of each case in each precision."""
    precisions = list(energy.split_by("precision"))
    for index, (case, rows) in enumerate(energy.split_by("case").items()):
        for precision, run in rows.split_by("precision").items():
            style = line_style(index) | {"ls": "-" if precision == precisions[0] else "--"}
            change = np.maximum(np.abs(run.numbers("change")[1:]), SMALLEST_CHANGE)
            axes.plot(run.numbers("step")[1:], change, label=f"{case}, {precision}", **style)
    steps = np.array([energy.numbers("step")[1:].min(), energy.numbers("step").max()])
    steps[0] = max(steps[0], steps[1] * 1e-4)
    for allowed in sorted(set(long_runs.column("allowed"))):
        axes.plot(steps, allowed * steps, **SLOPE)
    axes.set(xscale="log", yscale="log", xlabel="step", ylabel="relative change of energy")
    axes.set_title("Energy of the worst cases", fontsize=9)
    axes.legend(**LEGEND)


def _draw_distances(axes: Axes, distances: Table, named: Sequence[str]) -> None:
    """Draw the distance to each limit that has an order.

    Limits in `named` have a colour and a label, all others are grey.
    """
    lines = {
        title: (rows.numbers("small"), rows.numbers("distance"))
        for title, rows in distances.split_by("title").items()
        if rows.rows[0]["order"] is not None
    }
    for title, line in lines.items():
        if title not in named:
            axes.plot(*line, **BACKGROUND)
    coloured = [title for title in named if title in lines]
    for index, title in enumerate(coloured):
        axes.plot(*lines[title], label=title.partition(":")[0], **line_style(index))
    smallest = min(small.min() for small, _ in lines.values())
    largest = max(distance.max() for _, distance in lines.values())
    ends = np.array([smallest, 1.0])
    axes.plot(ends, 3 * largest * ends, label="order 1", **SLOPE)
    axes.set(xscale="log", yscale="log", xlabel="small parameter over its first value")
    axes.set_ylabel("distance to the limit")
    axes.set_title("Distance to the limit", fontsize=9)
    axes.legend(**LEGEND)
