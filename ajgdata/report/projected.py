"""Spaces side by side in two dimensions, coloured by what is known of the recordings."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from ajgdata.report.canvas import WIDTH_IN, new_figure, styled
from ajgdata.report.embedded import METHODS, SPACES, Pictured, ordered
from ajgdata.report.format import Caption, Source, words
from ajgdata.report.latents import category_colours
from ajgdata.report.canvas import MAX_VECTOR_POINTS

#: What is not known of a recording.
MISSING = "#c8c8c8"
NUMBERS = "viridis"
#: Distinct texts beyond these share colours; more than that no legend tells apart.
MANY = 20


def shown_columns(pictured: Pictured) -> list[str]:
    """Columns that tell recordings apart and can be coloured: numbers, or some distinct texts."""
    found = []
    for name, values in pictured.columns.items():
        if values.dtype.kind == "U":
            distinct = len({value for value in values.tolist() if value})
            if 1 < distinct <= MANY:
                found.append(name)
        elif len(np.unique(values[np.isfinite(values)])) > 1:
            found.append(name)
    return found


def text_colours(values: NDArray[np.str_]) -> dict[str, str]:
    """A colour for each distinct text, in alphabetical order; categories keep theirs."""
    present = sorted({str(value) for value in values if value})
    if len(present) <= 7:
        return category_colours(present)
    palette = [to_hex(colour) for colour in colormaps["tab20"](range(MANY))]
    # dark ones first, then their light neighbours: names that follow one another differ
    palette = palette[::2] + palette[1::2]
    return {name: palette[i % MANY] for i, name in enumerate(present)}


@styled
def projected_figure(pictured: Pictured, column: str, title: str, source: Source) -> Figure:
    """A row for each space, a column for each method; filled: training, ring: validation."""
    spaces = ordered([picture.space for picture in pictured.pictures])
    methods = [m for m in METHODS if any(p.method == m for p in pictured.pictures)]
    values = pictured.columns[column]
    figure = new_figure(
        (WIDTH_IN, 0.9 + 2.15 * len(spaces)),
        title,
        f"colour: {words(column)}; filled: training, rings: validation recordings",
        [source],
    )
    panels = figure.subplots(len(spaces), len(methods), squeeze=False)
    colours, legend = _coloured(values)
    pixels = len(values) * panels.size > MAX_VECTOR_POINTS
    for picture in pictured.pictures:
        if picture.method not in methods:  # a latent of two dimensions as it is
            continue
        axes = panels[spaces.index(picture.space), methods.index(picture.method)]
        _scatter(axes, picture.points, colours, pictured.training, pixels)
        axes.set_title(f"{SPACES.get(picture.space, picture.space)} · {METHODS[picture.method]}")
    if isinstance(legend, ScalarMappable):
        figure.colorbar(legend, ax=panels, label=words(column), shrink=0.7, pad=0.02)
    else:
        handles = [
            Line2D([], [], ls="", marker="o", ms=4, color=colour, label=words(name))
            for name, colour in legend.items()
        ]
        figure.legend(handles=handles, loc="outside right upper")
    return figure


def _coloured(values: NDArray) -> tuple[NDArray, ScalarMappable | dict[str, str]]:
    """A colour (n,) for each value, and what tells them."""
    if values.dtype.kind == "U":
        named = text_colours(values)
        return np.array([named.get(str(value), MISSING) for value in values]), named
    known = np.isfinite(values)
    low, high = float(values[known].min()), float(values[known].max())
    shades = ScalarMappable(Normalize(low, high), colormaps[NUMBERS])
    listed = [to_hex(c) for c in shades.to_rgba(np.where(known, values, low))]
    return np.where(known, listed, MISSING), shades


def _scatter(
    axes: Axes, points: NDArray, colours: NDArray, training: NDArray[np.bool_], pixels: bool
) -> None:
    rows = ~training
    seen, unseen = colours[training].tolist(), colours[rows].tolist()
    style: dict[str, Any] = {"s": 7, "rasterized": pixels}
    x, y = points.T
    axes.scatter(x[training], y[training], c=seen, lw=0, alpha=0.75, **style)
    axes.scatter(x[rows], y[rows], facecolors="none", edgecolors=unseen, lw=0.8, **style)
    axes.set(xticks=[], yticks=[])
    axes.spines[:].set_visible(True)
    axes.grid(False)
    axes.margins(0.06)


def projected_caption(pictured: Pictured, column: str) -> Caption:
    """Caption of `projected_figure`."""
    spaces = " and ".join(
        SPACES.get(s, s) for s in ordered([picture.space for picture in pictured.pictures])
    )
    text = (
        f"Each recording in two dimensions, from {spaces}, coloured by "
        f"{words(column)}. PCA and UMAP learn from the training points and then place the others; "
        "t-SNE cannot, and is fitted on all. Axes have no meaning; of t-SNE and UMAP neither do "
        "distances between clusters."
    )
    return Caption(
        text, f"Scatter plots of {spaces} by PCA, UMAP and t-SNE, coloured by {words(column)}."
    )
