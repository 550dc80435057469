"""The two-dimensional latent -> a figure: points, and an ellipse for each object."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ajgdata.report.format import Caption, Source, number, words
from ajgdata.report.projections import category_colours

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Ellipse as EllipsePatch

SIGMAS = 2.0
SIZE_IN = (7.2, 5.0)
#: Share of a Gaussian within two standard deviations in the plane: 1 - exp(-2).
EXPECTED_WITHIN = -math.expm1(-(SIGMAS**2) / 2)


@dataclass(frozen=True, eq=False)
class Plane:
    """Latents of one encoder: `points` (n, 2), `object` and `category` (n,) text, `training` (n,).

    `category` may be empty text. Raises ValueError for lengths that differ.
    """

    points: NDArray[np.floating]
    object: NDArray[np.str_]
    category: NDArray[np.str_]
    training: NDArray[np.bool_]

    def __post_init__(self) -> None:
        shapes = {len(self.points), len(self.object), len(self.category), len(self.training)}
        if self.points.shape[1:] != (2,) or len(shapes) != 1:
            raise ValueError(f"points {self.points.shape} and their labels {shapes} do not match")

    def objects(self) -> dict[str, str]:
        """Return the category of each object: category by category, as the paper lists them."""
        pairs = sorted(set(zip(self.object.tolist(), self.category.tolist(), strict=True)))
        order = list(category_colours(self.category))
        return dict(sorted(pairs, key=lambda pair: order.index(pair[1])))

    def within(self) -> float:
        """Return the share of validation points within SIGMAS of their object's training points.

        The distance is Mahalanobis's. NaN without validation points.
        """
        held_out = ~self.training
        if not held_out.any():
            return math.nan
        inside = np.zeros(len(self.points), bool)
        for name in self.objects():
            trained, own = (self.points[part & (self.object == name)] for part in (
                self.training, held_out,
            ))  # fmt: skip
            if not (len(trained) and len(own)):
                continue
            mean, covariance = moments(trained)
            ridge = 1e-9 * np.trace(covariance) + np.finfo(float).tiny  # of points on a line
            with np.errstate(over="ignore"):
                scaled = np.linalg.solve(covariance + ridge * np.eye(2), (own - mean).T)
                distance = np.sum((own - mean) * scaled.T, axis=1)
            inside[held_out & (self.object == name)] = distance <= SIGMAS**2
        return float(inside[held_out].mean())

    def nearest(self) -> float:
        """Return the share of validation points that are nearest to the mean of their own object's
        training points, or NaN."""
        held_out = ~self.training
        names = [name for name in self.objects() if np.any(self.training & (self.object == name))]
        if not (held_out.any() and names):
            return math.nan
        means = [self.points[self.training & (self.object == n)].mean(axis=0) for n in names]
        away = np.hypot(*(self.points[held_out][:, None] - np.array(means)).transpose(2, 0, 1))
        return float(np.mean(np.array(names)[away.argmin(axis=1)] == self.object[held_out]))


def plane_figure(plane: Plane, title: str, source: Source) -> Figure:
    """Return training points on the left, validation points on the right, on the same axes."""
    from matplotlib.lines import Line2D

    from ajgdata.report.canvas import GREY, new_figure

    subtitle = f"{title}: every recording of one fold, and {SIGMAS:g}σ of each object"
    figure = new_figure(SIZE_IN, plane_finding(plane), subtitle, [source])
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    colours = category_colours(plane.category)
    for axes, rows, part in zip(
        panels, (plane.training, ~plane.training), ("training", "validation"), strict=True
    ):
        _panel(axes, plane, rows, colours)
        axes.set_title(f"{part} points ({np.count_nonzero(rows)})")
        axes.set_xlabel("latent 1")
    panels[0].set_ylabel("latent 2")
    handles = [
        Line2D([], [], ls="", marker="o", color=colour, label=words(name) or "no category")
        for name, colour in colours.items()
    ]
    handles.append(Line2D([], [], color=GREY, label=f"{SIGMAS:g}σ of one object"))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    return figure


def _panel(axes: Axes, plane: Plane, rows: NDArray[np.bool_], colours: Mapping[str, str]) -> None:
    """Draw points, ellipses and names of the objects that have points among `rows`."""
    from ajgdata.report.labels import label_point

    for name, category in plane.objects().items():
        points = plane.points[rows & (plane.object == name)]
        if not len(points):
            continue
        axes.plot(*points.T, "o", color=colours[category], ms=2.4, mew=0, alpha=0.6)
        axes.add_patch(_ellipse(points, colours[category]))
        back = {"boxstyle": "square,pad=0.05", "fc": "white", "ec": "none", "alpha": 0.6}
        x, y = points.mean(axis=0).tolist()
        label_point(axes, x, y, words(name), colours[category], bbox=back, zorder=4)
    axes.set_aspect("equal", adjustable="box")
    axes.autoscale_view()


def moments(points: NDArray[np.floating]) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    """Return mean (2,) and covariance (2, 2) of points (n, 2); one point has a covariance of 0."""
    covariance = np.cov(points.T) if len(points) > 1 else np.zeros((2, 2))
    return points.mean(axis=0), covariance


def _ellipse(points: NDArray[np.floating], colour: str) -> EllipsePatch:
    """Return the curve at SIGMAS standard deviations from the mean of points (n, 2)."""
    from matplotlib.patches import Ellipse as EllipsePatch

    (x, y), covariance = moments(points)
    variances, directions = np.linalg.eigh(covariance)
    short, long = 2 * SIGMAS * np.sqrt(np.maximum(variances, 0))
    angle = math.degrees(math.atan2(directions[1, 1], directions[0, 1]))
    return EllipsePatch((x, y), long, short, angle=angle, fill=False, ec=colour, lw=1.1)


def plane_finding(plane: Plane) -> str:
    """Return where the validation points lie, in a few words."""
    nearest, count = plane.nearest(), len(plane.objects())
    if math.isnan(nearest):
        return f"Training points of {count} objects in a latent of two dimensions"
    return (
        f"{number(100 * nearest)} % of new recordings lie nearest to their own object's training "
        f"points (chance {number(100 / count)} %)"
    )


def clusters_text(plane: Plane) -> str:
    """Return where the validation points lie, or nothing if there are none."""
    nearest, within = plane.nearest(), plane.within()
    if math.isnan(nearest):
        return ""
    return (
        f"{number(100 * nearest)} % lie nearest to the mean of their own object's training points "
        f"(chance {number(100 / len(plane.objects()))} %), and {number(100 * within)} % within "
        f"{SIGMAS:g}σ of them (a Gaussian that does not change: {number(100 * EXPECTED_WITHIN)} %)"
    )


def plane_caption(plane: Plane) -> Caption:
    """Return the caption of `plane_figure`."""
    said = clusters_text(plane)
    share = f" Of the validation points, {said}." if said else ""
    names = ", ".join(map(words, plane.objects()))
    return Caption(
        f"Left: training points of one fold. Right: the validation points of the same "
        f"encoder, which never saw them. Ellipses: mean and {SIGMAS:g} standard deviations of the "
        f"points of one object in the same panel.{share}",
        f"{plane_finding(plane)}. Two scatter plots of the two-dimensional latent with one "
        f"ellipse for each of {names}.{share}",
    )
