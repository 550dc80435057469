"""Figure of true and predicted classes over positions: one panel per session."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ajgdata.report.canvas import COLOURS, WIDTH_IN, new_figure
from ajgdata.report.format import Source, words

#: Panels side by side, and height of a panel (inches).
PANELS_PER_ROW = 3
PANEL_IN = 2.3
#: Areas of the marks of a true class and of a predicted class (points squared).
TRUE_AREA = 44
PREDICTED_AREA = 14


class SurfacePoint(NamedTuple):
    """A point of a surface with its position, its true class and its predicted class."""

    x: float
    y: float
    true: str
    predicted: str


def surface_map_figure(
    points: Mapping[str, Sequence[SurfacePoint]],
    axes_titles: Sequence[str],
    classes: Sequence[str],
    *,
    title: str,
    subtitle: str,
    source: Source,
) -> Figure:
    """Return a panel per session: a square has the colour of the true class, its dot the predicted.

    `points` are those of each session. `axes_titles` are the two columns with the positions, and
    `classes` all classes. More than seven classes repeat colours.
    """
    rows = math.ceil(len(points) / PANELS_PER_ROW)
    columns = min(PANELS_PER_ROW, len(points))
    size_in = (WIDTH_IN, 1.3 + PANEL_IN * rows)
    figure = new_figure(size_in, title, subtitle, [source])
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    colour_of = {name: COLOURS[place % len(COLOURS)] for place, name in enumerate(classes)}
    for axes, (session, own) in zip(grid, points.items(), strict=False):
        x = [point.x for point in own]
        y = [point.y for point in own]
        true = [colour_of[point.true] for point in own]
        predicted = [colour_of[point.predicted] for point in own]
        axes.scatter(x, y, TRUE_AREA, true, marker="s", linewidths=0)
        axes.scatter(x, y, PREDICTED_AREA, predicted, linewidths=0.6, edgecolors="white")
        axes.set(title=words(session), xlabel=words(axes_titles[0]))
        axes.margins(0.1)
    for axes in grid[::columns]:
        axes.set_ylabel(words(axes_titles[1]))
    for axes in grid[len(points) :]:
        axes.set_visible(False)
    handles = [Line2D([], [], marker="s", ls="", color=colour) for colour in colour_of.values()]
    figure.legend(handles, [words(name) for name in classes], loc="outside lower center", ncols=4)
    return figure
