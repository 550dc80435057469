"""Distances in embeddings, drawn: matrices of categories, and of things beside their tree."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.cluster.hierarchy import dendrogram, leaves_list, linkage
from scipy.spatial.distance import squareform

from ajgdata.experiments.base import (
    TaskResults,
)
from ajgdata.experiments.embedding import space_name
from ajgdata.experiments.embedding_distances import Distances, Real, distances_of, mean_sd_of
from ajgdata.report.canvas import GREY, WIDTH_IN, new_figure
from ajgdata.report.format import Caption, Score, mean_sd, number, words
from ajgdata.report.labels import width_in
from ajgdata.report.projections import category_colours

#: Light to dark: near things are dark.
SHADES = "Blues_r"


def category_finding(results: TaskResults) -> str:
    """Return of each space how many categories lie nearer within than to others."""
    told = []
    for one in distances_of(results):
        apart = one.apart()
        told.append(f"{sum(apart.values())} of {len(apart)} in {space_name(one.space)}")
    return f"Categories whose members lie nearer to one another than to others: {', '.join(told)}"


def object_finding(one: Distances) -> str:
    """Return which two things lie nearest to one another in a space."""
    between = np.where(np.eye(len(one.objects), dtype=bool), np.nan, one.object_mean)
    if not np.isfinite(between).any():
        return f"One thing in {space_name(one.space)}"
    i, j = np.unravel_index(int(np.nanargmin(between)), between.shape)
    pair = " and ".join(sorted(words(one.objects[k]) for k in (int(i), int(j))))
    return f"Nearest of different things in {space_name(one.space)}: {pair}"


def category_figure(results: TaskResults) -> Figure:
    """Return a matrix of categories for each space (columns), of all pairs and different things."""
    spaces = distances_of(results)
    side = max(1.9, 0.72 * len(spaces[0].categories))
    drawn = new_figure(
        (WIDTH_IN, 2 * side + 2.1),
        category_finding(results),
        f"{results.title}: mean distance of validation pairs of different grasps ± sd over runs; "
        "dark: near",
        [results.source],
    )
    panels = drawn.subplots(2, len(spaces), squeeze=False)
    for column, one in enumerate(spaces):
        _matrix(panels[0, column], one.categories, one.runs)
        panels[0, column].set_title(f"{space_name(one.space)}: all pairs")
        _matrix(panels[1, column], one.categories, one.different)
        panels[1, column].set_title(f"{space_name(one.space)}: different things only")
    return drawn


def _matrix(axes: Axes, names: Sequence[str], runs: Real) -> None:
    """Draw cells with their numbers; a cell without pairs is left white."""
    mean, sd = mean_sd_of(runs)
    largest = float(np.nanmax(mean)) if np.isfinite(mean).any() else 1.0
    axes.imshow(mean, cmap=SHADES, vmin=0, vmax=1.15 * (largest or 1.0))
    axes.grid(False)
    axes.spines[:].set_visible(False)
    axes.set_xticks(range(len(names)), [words(name) for name in names])
    axes.set_yticks(range(len(names)), [words(name) for name in names])
    for (row, column), value in np.ndenumerate(mean):
        dark = np.isfinite(value) and value < 0.55 * largest
        text = mean_sd(Score(float(value), float(sd[row, column]))).replace(" ± ", "\n± ")
        axes.text(
            column, row, text, ha="center", va="center", fontsize=8,
            fontweight="bold" if row == column else "normal",
            color="white" if dark else "#222222",
        )  # fmt: skip


def object_figure(results: TaskResults, one: Distances) -> Figure:
    """Return the matrix of things in the order of the tree beside it, coloured by category."""
    n, order = len(one.objects), leaves(one)
    label = max(width_in(words(name), 8) for name in one.objects)
    side = max(2.0, 0.2 * n)
    subtitle = f"{results.title}: mean distance of validation pairs of different grasps; dark: near"
    size_in = side + label + 3.0, side + label + 1.1
    drawn = new_figure(size_in, object_finding(one), subtitle, [results.source])
    branches, axes = drawn.subplots(1, 2, width_ratios=[1.2, side])
    branches.set_axis_off()
    if n > 1:
        dendrogram(
            links(one),
            ax=branches,
            orientation="left",
            no_labels=True,
            color_threshold=0,
            above_threshold_color=GREY,
        )
        branches.invert_yaxis()
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
    bar = drawn.colorbar(image, ax=axes, label="distance", pad=0.02, shrink=0.8)
    bar.outline.set_visible(False)
    return drawn


def links(one: Distances) -> Real:
    """Return scipy's average linkage of the things; unknown distances count as the largest."""
    condensed = squareform((one.object_mean + one.object_mean.T) / 2, checks=False)
    known = condensed[np.isfinite(condensed)]
    largest = known.max() if len(known) else 1.0
    return linkage(np.nan_to_num(condensed, nan=largest), "average", optimal_ordering=True)


def leaves(one: Distances) -> list[int]:
    """Return the things in the order of the tree, which puts near ones side by side."""
    return leaves_list(links(one)).tolist() if len(one.objects) > 1 else [0]


def category_caption(results: TaskResults) -> Caption:
    """Return the caption of `category_figure`."""
    told = "; ".join(f"{space_name(one.space)}: {apart_text(one)}" for one in distances_of(results))
    return Caption(
        "Rows and columns are categories; the diagonal (bold) is within a category. "
        "Top: pairs of different grasps, of the same thing or not. Bottom: pairs of different "
        f"things only. Spaces have units of their own. {told}.",
        f"{category_finding(results)}. Mean distances: {told}.",
    )


def apart_text(one: Distances) -> str:
    """Return of each category the distance within it against that between it and others."""
    return ", ".join(
        f"{words(name)} {number(one.mean[i, i])} within "
        f"{'<' if apart else 'not <'} {number(one.between(i))} between"
        for i, (name, apart) in enumerate(one.apart().items())
        if math.isfinite(one.between(i))
    )


def object_caption(one: Distances) -> Caption:
    """Return the caption of `object_figure`."""
    names = [words(one.objects[i]) for i in leaves(one)]
    return Caption(
        "Dark: near. The diagonal is the distance between different grasps of one "
        "thing. The tree joins what is nearest on average (average linkage). Names have the "
        "colour of their category.",
        f"{object_finding(one)}. Distance matrix of {len(names)} objects with a "
        "dendrogram, in its order: "
        f"{', '.join(names)}.",
    )
