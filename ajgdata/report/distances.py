"""Distances within and between categories, and between objects -> figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.cluster.hierarchy import dendrogram, linkage
from scipy.spatial.distance import squareform

from ajgdata.report.canvas import GREY, WIDTH_IN, new_figure, styled
from ajgdata.report.embedded import SPACES, Distances
from ajgdata.report.format import Caption, Score, Source, mean_sd, number, words
from ajgdata.report.latents import category_colours

Real = NDArray[np.floating]
#: Light to dark: near things are dark.
SHADES = "Blues_r"


class Tree(NamedTuple):
    """Which objects lie together: `order` of the leaves, and the links of scipy's dendrogram."""

    order: list[int]
    links: Real


def tree(distance: Real, names: Sequence[str]) -> Tree | None:
    """Average linkage of a distance matrix (o, o), whose diagonal does not matter.

    Neighbouring leaves are as near as the tree allows, and the name of the first leaf comes before
    that of the last in the alphabet: the order of the objects does not matter. Distances that are
    not known (NaN) count as the largest. None for less than two objects.
    """
    if len(names) < 2:
        return None
    sorting = np.argsort(np.asarray(names), kind="stable")
    sorted_ = np.asarray(distance, float)[np.ix_(sorting, sorting)]
    # Both halves are the same but for round-off, and links of equal length go by the alphabet.
    condensed = squareform((sorted_ + sorted_.T) / 2, checks=False)
    known = condensed[np.isfinite(condensed)]
    condensed = np.where(np.isfinite(condensed), condensed, known.max() if len(known) else 1.0)
    links = linkage(condensed, "average", optimal_ordering=True)
    leaves = dendrogram(links, no_plot=True)["leaves"]
    if leaves[0] > leaves[-1]:
        links[:, :2] = links[:, 1::-1]
        leaves = dendrogram(links, no_plot=True)["leaves"]
    return Tree([int(sorting[leaf]) for leaf in leaves], links)


@styled
def category_figure(spaces: Sequence[Distances], title: str, source: Source) -> Figure:
    """A matrix of categories for each space (columns), of all pairs and of different things."""
    first = spaces[0]
    side = max(1.9, 0.72 * len(first.categories))
    figure = new_figure(
        (WIDTH_IN, 2 * side + 2.1),
        title,
        "mean distance of validation pairs of different grasps ± sd over runs",
        [source],
    )
    panels = figure.subplots(2, len(spaces), squeeze=False)
    for column, one in enumerate(spaces):
        name = SPACES.get(one.space, one.space)
        _matrix(panels[0, column], one.categories, one.mean, one.sd)
        panels[0, column].set_title(f"{name}: all pairs")
        _matrix(panels[1, column], one.categories, one.other, one.other_sd)
        panels[1, column].set_title(f"{name}: different things only")
    return figure


def _matrix(axes: Axes, names: Sequence[str], mean: Real, sd: Real) -> None:
    """Cells with their numbers; a cell without pairs is left white."""
    largest = float(np.nanmax(mean)) if np.isfinite(mean).any() else 1.0
    axes.imshow(mean, cmap=SHADES, vmin=0, vmax=1.15 * (largest or 1.0))
    axes.grid(False)
    axes.spines[:].set_visible(False)
    axes.set_xticks(range(len(names)), [words(name) for name in names])
    axes.set_yticks(range(len(names)), [words(name) for name in names])
    for (row, column), value in np.ndenumerate(mean):
        dark = np.isfinite(value) and value < 0.55 * largest
        axes.text(
            column,
            row,
            mean_sd(Score(float(value), float(sd[row, column]))).replace(" ± ", "\n± "),
            ha="center",
            va="center",
            fontsize=7.5,
            fontweight="bold" if row == column else "normal",
            color="white" if dark else "#222222",
        )


@styled
def object_figure(one: Distances, title: str, source: Source) -> Figure:
    """Matrix of objects in the order of the tree beside it; names in the colour of the category."""
    n = len(one.objects)
    found = tree(one.object_mean, one.objects)
    order = found.order if found else list(range(n))
    label = 0.075 * max(map(len, one.objects))
    side = max(2.0, 0.27 * n)
    size = side + 2 * label + 2.6, side + label + 1.1
    name = SPACES.get(one.space, one.space)
    subtitle = f"{name}: mean distance of validation pairs of different grasps"
    figure = new_figure(size, title, subtitle, [source])
    branches, axes = figure.subplots(1, 2, width_ratios=[1.2, side])
    branches.set_axis_off()
    if found:
        _branches(branches, found)
    image = axes.imshow(one.object_mean[np.ix_(order, order)], cmap=SHADES, aspect="auto")
    axes.grid(False)
    axes.spines[:].set_visible(False)
    names = [words(one.objects[i]) for i in order]
    axes.set_xticks(range(n), names, rotation=90)
    axes.set_yticks(range(n), names)
    axes.tick_params(length=0)
    colours = category_colours(one.object_category)
    for axis in (axes.xaxis, axes.yaxis):
        for i, text in zip(order, axis.get_ticklabels(), strict=True):
            text.set_color(colours[one.object_category[i]])
    bar = figure.colorbar(image, ax=axes, label="distance", pad=0.02, shrink=0.8)
    bar.outline.set_visible(False)
    return figure


def _branches(axes: Axes, found: Tree) -> None:
    """The tree, its leaves at the rows of the matrix: scipy puts leaf k at 10 k + 5."""
    drawn: dict[str, Any] = dendrogram(found.links, no_plot=True)
    for place, height in zip(drawn["icoord"], drawn["dcoord"], strict=True):
        axes.plot(height, (np.asarray(place) - 5) / 10, color=GREY, lw=1)
    axes.set_ylim(len(found.order) - 0.5, -0.5)
    axes.set_xlim(1.05 * max(map(max, drawn["dcoord"])) or 1.0, 0)


def category_caption(spaces: Sequence[Distances]) -> Caption:
    """Caption of `category_figure`."""
    told = "; ".join(f"{SPACES.get(one.space, one.space)}: {apart_text(one)}" for one in spaces)
    return Caption(
        f"Rows and columns are categories; the diagonal (bold) is within a category. "
        "Top: pairs of different grasps, of the same thing or not. Bottom: pairs of different "
        f"things only. Spaces have units of their own. {told}.",
        f"Matrices of mean distances between categories. {told}.",
    )


def apart_text(one: Distances) -> str:
    """Of each category: within against between."""
    return ", ".join(
        f"{words(name)} {number(one.mean[i, i])} within "
        f"{'<' if apart else 'not <'} {number(one.between(i))} between"
        for i, (name, apart) in enumerate(one.apart().items())
        if math.isfinite(one.between(i))
    )


def object_caption(one: Distances) -> Caption:
    """Caption of `object_figure`."""
    found = tree(one.object_mean, one.objects)
    names = [words(one.objects[i]) for i in (found.order if found else range(len(one.objects)))]
    return Caption(
        "Dark: near. The diagonal is the distance between different grasps of one "
        "thing. The tree joins what is nearest on average (average linkage). Names have the "
        "colour of their category.",
        f"Distance matrix of {len(names)} objects with a dendrogram, in its order: "
        f"{', '.join(names)}.",
    )
