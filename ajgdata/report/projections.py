"""Figure of recordings in two dimensions: one panel per projection, one colour per object."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ajgdata.report.canvas import WIDTH_IN, line_style, new_figure
from ajgdata.report.format import Source, words

#: Panels side by side.
PANELS_PER_ROW = 3
#: Height of a panel (inches).
PANEL_IN = 2.2


def projections_figure(
    planes: Mapping[str, np.ndarray],
    labels: np.ndarray,
    is_training: np.ndarray,
    subtitle: str,
    source: Source,
) -> Figure:
    """Return a panel per projection, with colour and marker for each object.

    Args:
        planes: Positions (n, 2) of the recordings in each projection, by the title of its panel.
        labels: Objects (n,) of the recordings.
        is_training: True (n,) for training recordings, which have filled marks; others are open.
        subtitle: Data set and embedding.
        source: Source of the recordings.
    """
    objects = list(dict.fromkeys(labels.tolist()))
    n_rows = math.ceil(len(planes) / PANELS_PER_ROW)
    size_in = (WIDTH_IN, 1.5 + PANEL_IN * n_rows)
    figure = new_figure(size_in, "Recordings in the plane", subtitle, [source])
    grid = figure.subplots(n_rows, PANELS_PER_ROW, squeeze=False).ravel()
    for axes, (title, plane) in zip(grid, planes.items(), strict=False):
        for index, name in enumerate(objects):
            style = line_style(index)
            look = {"marker": style["marker"], "s": 12, "linewidths": 0.7, "rasterized": True}
            for part, face in ((is_training, style["color"]), (~is_training, "none")):
                x, y = plane[(labels == name) & part].T
                axes.scatter(x, y, color=style["color"], facecolor=face, **look)
        axes.set(title=title, xticks=[], yticks=[])
    for axes in grid[len(planes) :]:
        axes.set_visible(False)
    handles = [Line2D([], [], **line_style(index) | {"ls": ""}) for index in range(len(objects))]
    names = [words(name) for name in objects]
    figure.legend(handles, names, loc="outside lower center", ncols=4)
    return figure
