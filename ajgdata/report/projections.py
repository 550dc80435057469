"""Spaces as points of a plane, and the colours by which recordings are told apart in them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.floating]

#: Names of spaces, in the order of legends.
SPACES = {
    "latent": "latent",
    "raw": "raw features",
    "pca": "PCA",
    "umap": "UMAP",
}
#: The method of a space that has two dimensions and is shown as it is.
PLANE = "plane"
#: Names of projections, in the order of panels.
METHODS = {"pca": "PCA", "umap": "UMAP", "tsne": "t-SNE", PLANE: "2-D"}
#: Distinct texts beyond these share colours; more than that no legend tells apart.
MANY = 20


@dataclass(frozen=True, eq=False)
class Projection:
    """A space as points of a plane: `points` (n, 2) of every recording by one encoder."""

    space: str
    method: str
    points: Real


@dataclass(frozen=True, eq=False)
class Projections:
    """All projections of one run, with what is known of each recording.

    `training` (n,): whether the encoder was trained on it. `columns`: text or numbers (n,) by
    name, the first of them the thing itself.
    """

    recording: NDArray[np.str_]
    training: NDArray[np.bool_]
    columns: Mapping[str, NDArray]
    projections: tuple[Projection, ...]


def ordered(spaces: Sequence[str]) -> list[str]:
    """Return distinct spaces in the order of SPACES, unknown ones last."""
    known = [space for space in SPACES if space in spaces]
    return known + sorted(set(spaces) - set(known))


def shown_columns(shown: Projections) -> list[str]:
    """Return the columns that can be coloured: numbers that differ, or some distinct texts."""
    found = []
    for name, values in shown.columns.items():
        if values.dtype.kind == "U":
            distinct = len({value for value in values.tolist() if value})
            if 1 < distinct <= MANY:
                found.append(name)
        elif len(np.unique(values[np.isfinite(values)])) > 1:
            found.append(name)
    return found


def category_colours(categories: Sequence[str] | NDArray[np.str_]) -> dict[str, str]:
    """Return a colour for each category that occurs: the paper's own first, in its order."""
    from ajgdata.report.canvas import COLOURS

    own = {"spherical": COLOURS[0], "cylindrical": COLOURS[1], "other": COLOURS[2]}
    present = set(map(str, categories))
    listed = [name for name in own if name in present]
    others = sorted(present - set(listed))
    free = [colour for colour in COLOURS if colour not in own.values()]
    named = {name: free[i % len(free)] for i, name in enumerate(others)}
    return {name: own[name] for name in listed} | named


def text_colours(values: NDArray[np.str_]) -> dict[str, str]:
    """Return a colour for each distinct text, in alphabetical order; categories keep theirs."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    present = sorted({str(value) for value in values if value})
    if len(present) <= 7:
        return category_colours(present)
    palette = [to_hex(colour) for colour in colormaps["tab20"](range(MANY))]
    # dark ones first, then their light neighbours: names that follow one another differ
    palette = palette[::2] + palette[1::2]
    return {name: palette[i % MANY] for i, name in enumerate(present)}
