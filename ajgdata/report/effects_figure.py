"""Figure of the study of effects: what each change of the contact does to the feature."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.report.blocks import TableFigure
from ajgdata.report.canvas import GREY, WIDTH_IN, line_style, new_figure, plain_ticks
from ajgdata.report.format import Caption, number
from ajgdata.report.labels import reference_line
from ajgdata.types.table import Table

#: Changes below this (relative L2) are drawn at it.
LEAST = 1e-4


def effects_finding(table: Table) -> str:
    """Return how many changes exceed the tolerance, and which is the largest."""
    change, tolerance = table.numbers("change"), float(table.numbers("tolerance")[0])
    above = int(np.sum(change > tolerance))
    largest = table.rows[int(np.argmax(change))]
    return (
        f"{above} of {len(change)} changes of the contact move the feature by more than "
        f"{number(tolerance)}; most: {largest['effect']} ({largest['object']})"
    )


def effects_figure(table: Table) -> Figure:
    """Return the change of the feature by each effect, whole band and low, and two grasps' own."""
    effects = table.parted("effect")
    lines = sum(len(rows.rows) + 1 for rows in effects.values())
    figure = new_figure(
        (WIDTH_IN, 1.2 + 0.2 * lines),
        effects_finding(table),
        "filled: whole band, hollow: below 1.2 kHz, grey bar: two grasps",
        ["simulated"],
    )
    axes = figure.subplots()
    place, names = 0.0, []
    for index, (effect, rows) in enumerate(effects.items()):
        names.append((place, f"{effect}:"))
        places = place + 1 + np.arange(len(rows.rows))
        names += [(at, str(thing)) for at, thing in zip(places, rows.column("object"), strict=True)]
        _marks(axes, rows, places, index)
        place = float(places[-1]) + 1
    tolerance = float(table.numbers("tolerance")[0])
    reference_line(axes, "ideal", tolerance, "tolerance", axis="x")
    axes.set(xscale="log", xlabel="relative L2 change of the feature", ylim=(place, -0.7))
    axes.set_yticks(*zip(*names, strict=True))
    axes.tick_params(axis="y", length=0)
    plain_ticks(axes.xaxis)
    return figure


def _marks(axes: Axes, rows: Table, places: np.ndarray, index: int) -> None:
    style = {**line_style(index), "ls": "none", "clip_on": False}
    axes.plot(np.maximum(rows.numbers("change_low"), LEAST), places, mfc="none", **style)
    axes.plot(np.maximum(rows.numbers("change"), LEAST), places, **style)
    axes.plot(rows.numbers("scatter"), places, "|", color=GREY, ms=8, mew=2)


def effects_caption(table: Table) -> Caption:
    """Return the caption of `effects_figure`."""
    return Caption(
        "What one change of the scene does to the feature, object by object: in the whole band "
        "(filled), below 1.2 kHz (hollow). Grey bars: how far two grasps of the changed scene "
        "lie apart. Dashed: the tolerance below which a plan leaves an effect out.",
        f"{effects_finding(table)}. Change of the feature by effect and object, logarithmic.",
    )


EFFECTS = (TableFigure("effects", "effects", effects_caption, effects_figure),)
