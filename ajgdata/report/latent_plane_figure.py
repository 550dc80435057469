"""The two-dimensional latent -> a figure: points, and an ellipse for each object."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.report.ellipses import Ellipse, points_ellipse
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

    def ellipses(self, rows: NDArray[np.bool_]) -> dict[str, Ellipse]:
        """Return the ellipse of each object that has points among `rows` (n,)."""
        found = {}
        for name in self.objects():
            own = self.points[rows & (self.object == name)]
            if len(own):
                found[name] = points_ellipse(own, SIGMAS)
        return found

    def within(self) -> float:
        """Return the share of validation points in the training ellipse of their object, or NaN."""
        held_out = ~self.training
        if not held_out.any():
            return math.nan
        ellipses = self.ellipses(self.training)
        inside = np.zeros(len(self.points), bool)
        for name, ellipse in ellipses.items():
            own = held_out & (self.object == name)
            inside[own] = ellipse.inside(self.points[own])
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
    exponent = _exponent(plane.points)
    for axes, rows, part in zip(
        panels, (plane.training, ~plane.training), ("training", "validation"), strict=True
    ):
        _panel(axes, plane, rows, colours, exponent)
        axes.set_title(f"{part} points ({np.count_nonzero(rows)})")
        axes.set_xlabel(_axis_label(1, exponent))
    panels[0].set_ylabel(_axis_label(2, exponent))
    handles = [
        Line2D([], [], ls="", marker="o", color=colour, label=words(name) or "no category")
        for name, colour in colours.items()
    ]
    handles.append(Line2D([], [], color=GREY, label=f"{SIGMAS:g}σ of one object"))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    return figure


def _panel(
    axes: Axes, plane: Plane, rows: NDArray[np.bool_], colours: Mapping[str, str], exponent: int
) -> None:
    """Draw points, ellipses and names of the objects that have points among `rows`."""
    from ajgdata.report.labels import label_point

    categories, ellipses = plane.objects(), plane.ellipses(rows)
    for name, ellipse in ellipses.items():
        colour = colours[categories[name]]
        points = _shifted(plane.points[rows & (plane.object == name)], exponent)
        axes.plot(*points.T, "o", color=colour, ms=2.4, mew=0, alpha=0.6)
        axes.add_patch(_patch(ellipse, colour, exponent))
    for name, ellipse in ellipses.items():  # above all points
        x, y = _shifted(np.asarray(ellipse.centre), exponent).tolist()
        back = {"boxstyle": "square,pad=0.05", "fc": "white", "ec": "none", "alpha": 0.6}
        label_point(axes, x, y, words(name), colours[categories[name]], bbox=back)
    axes.set_aspect("equal", adjustable="box")
    axes.autoscale_view()


def _patch(ellipse: Ellipse, colour: str, exponent: int) -> EllipsePatch:
    """Return a line where the short axis is 0, nothing where both are: the points are there."""
    from matplotlib.patches import Ellipse as EllipsePatch

    long, short = _shifted(np.asarray(ellipse.half_axes), exponent)
    centre = _shifted(np.asarray(ellipse.centre), exponent)
    style: dict[str, Any] = {"fill": False, "ec": colour, "lw": 1.1}
    return EllipsePatch(tuple(centre), 2 * long, 2 * short, angle=ellipse.angle_deg, **style)


def _exponent(points: NDArray[np.floating]) -> int:
    """Return the power of ten that the axes leave out: any scale of a latent can be drawn."""
    largest = float(np.abs(points).max(initial=0.0))
    power = math.floor(math.log10(largest)) if largest > 0 else 0
    return power if not -3 <= power <= 3 else 0


def _shifted(values: NDArray[np.floating], exponent: int) -> NDArray[np.floating]:
    """Return `values` / 10^exponent in two steps: 10^-320 has no float64 inverse."""
    half = exponent // 2
    return values / 10.0**half / 10.0 ** (exponent - half)


def _axis_label(axis: int, exponent: int) -> str:
    return f"latent {axis}" + (f" (× 1e{exponent})" if exponent else "")


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
