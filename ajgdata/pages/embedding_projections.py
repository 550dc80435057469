"""Embedding projections: recordings in the plane, with an ellipse of two sigma for each object."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse as Patch

from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.embedding import scores_by
from ajgdata.experiments.embedding_projections import PLANE
from ajgdata.pages.selection import alternative, first_on, paper_sentence
from ajgdata.report.canvas import COLOURS, WIDTH_IN, new_figure
from ajgdata.report.format import Caption, mean_sd, number, words
from ajgdata.report.report_data import Illustration
from ajgdata.types.table import Table, table_of

PAGE = "embedding_projections"
#: Semi-axes of an ellipse in standard deviations (paper).
SIGMAS = 2.0
#: Size of the axes (inches).
AXES_IN = (6.6, 4.0)
#: Width of a letter and height of a line in the names of objects (inches).
LETTER_IN = 0.075
LINE_IN = 0.16
COLUMNS = {
    "object": "Object",
    "category": "Category",
    "points": "Training recordings",
    "x": "Centre, x",
    "y": "Centre, y",
    "major": "Long semi-axis",
    "minor": "Short semi-axis",
    "angle_deg": "Angle of the long semi-axis, deg",
}


class Ellipse(NamedTuple):
    """Centre (x, y), semi-axes, and the angle of the long semi-axis from the x axis in degrees."""

    x: float
    y: float
    major: float
    minor: float
    angle_deg: float


class Rectangle(NamedTuple):
    """A rectangle in the units of the axes."""

    left: float
    right: float
    bottom: float
    top: float

    @property
    def x(self) -> float:
        """Return the middle between left and right."""
        return (self.left + self.right) / 2

    @property
    def y(self) -> float:
        """Return the middle between bottom and top."""
        return (self.bottom + self.top) / 2

    def overlaps(self, other: Rectangle) -> bool:
        """Return whether the rectangles have a common area."""
        is_apart_x = self.right <= other.left or other.right <= self.left
        is_apart_y = self.top <= other.bottom or other.top <= self.bottom
        return not (is_apart_x or is_apart_y)


def box_of(ellipse: Ellipse) -> Rectangle:
    """Return the smallest rectangle around an ellipse, with sides along the axes."""
    angle = np.radians(ellipse.angle_deg)
    width = float(np.hypot(ellipse.major * np.cos(angle), ellipse.minor * np.sin(angle)))
    height = float(np.hypot(ellipse.major * np.sin(angle), ellipse.minor * np.cos(angle)))
    return Rectangle(ellipse.x - width, ellipse.x + width, ellipse.y - height, ellipse.y + height)


class Plane(NamedTuple):
    """Training recordings of one fold in two dimensions.

    Attributes:
        points: Positions (n, 2).
        objects: Object (n,) of each recording.
        categories: Category of each object.
        is_latent: Whether the encoder itself has two dimensions; otherwise this is a projection.
    """

    points: np.ndarray
    objects: np.ndarray
    categories: Mapping[str, str]
    is_latent: bool


def figures(results: Sequence[TaskResults]) -> Iterator[Illustration]:
    """Yield the ellipses of the objects in the latent, if an embedding was trained."""
    task = first_on(results, PAGE, "embedding_projections")
    if task is None:
        return
    plane = latent_plane(task)
    ellipses = object_ellipses(plane)
    title = conclusion(task)
    text = (
        f"{task.dataset_title}, {task.source}. Training recordings of one fold in"
        f" {'a latent of two dimensions' if plane.is_latent else 'a projection of the latent'}."
        f" Ellipses: normal distribution of each object at {number(SIGMAS)} standard deviations."
        f" Axes have no unit. {paper_sentence([task.paper])}"
    )
    listed = [
        f"{words(name)} ({plane.categories[name]}): centre {number(own.x, 2)}, {number(own.y, 2)};"
        f" semi-axes {number(own.major, 2)}, {number(own.minor, 2)}"
        for name, own in ellipses.items()
    ]
    yield Illustration(
        f"{task.dataset}--{task.task}--ellipses",
        Caption(text, alternative(title, listed)),
        partial(draw_figure, task, plane, ellipses, title),
        title,
        ellipse_table(plane, ellipses),
    )


def latent_plane(task: TaskResults) -> Plane:
    """Return the training recordings in a latent of two dimensions, else in a projection."""
    tables = task.results[0].tables
    methods = tables["points"].where(space="latent").split_by("method")
    method = PLANE if PLANE in methods else next(iter(methods))
    points = np.stack([methods[method].numbers("x"), methods[method].numbers("y")], axis=1)
    recordings = tables["recordings"]
    is_training = np.array(recordings.column("training"), dtype=bool)
    objects = np.array(recordings.column(task.settings.instance), dtype=str)
    column = task.settings.category or task.settings.target
    categories = dict(zip(objects.tolist(), map(str, recordings.column(column)), strict=True))
    return Plane(points[is_training], objects[is_training], categories, method == PLANE)


def ellipse_of(points: np.ndarray) -> Ellipse:
    """Return the ellipse of SIGMAS standard deviations of points (n, 2).

    The semi-axes are along the eigenvectors of the covariance of the points.
    """
    centre = points.mean(axis=0)
    values, vectors = np.linalg.eigh(np.cov(points.T))
    minor, major = SIGMAS * np.sqrt(np.maximum(values, 0.0))
    angle = np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1])) % 180
    return Ellipse(float(centre[0]), float(centre[1]), float(major), float(minor), float(angle))


def object_ellipses(plane: Plane) -> dict[str, Ellipse]:
    """Return the ellipse of each object with at least three training recordings, by category."""
    names = sorted({*plane.objects.tolist()}, key=lambda name: (plane.categories[name], name))
    return {
        name: ellipse_of(plane.points[plane.objects == name])
        for name in names
        if np.sum(plane.objects == name) > 2
    }


def ellipse_table(plane: Plane, ellipses: Mapping[str, Ellipse]) -> Table:
    """Return centre, semi-axes and angle of each ellipse."""
    rows = [
        {
            "object": words(name),
            "category": plane.categories[name],
            "points": int(np.sum(plane.objects == name)),
            **ellipse._asdict(),
        }
        for name, ellipse in ellipses.items()
    ]
    return table_of("ellipses", "Ellipses of two standard deviations", rows, **COLUMNS)


def conclusion(task: TaskResults) -> str:
    """Return the silhouette of the objects in the latent and in raw features."""
    table = task.results[0].tables["silhouettes"]
    scores = scores_by(table, ("space", "label"), "silhouette")
    column = task.settings.instance
    latent = mean_sd(scores["latent", column])
    raw = mean_sd(scores["raw", column])
    dimension = f"{task.settings.shown}-D"
    return f"Silhouette of objects: {latent} in the {dimension} latent, {raw} in raw features"


def draw_figure(
    task: TaskResults, plane: Plane, ellipses: Mapping[str, Ellipse], title: str
) -> Figure:
    """Draw points and ellipses in the colour of the category, with the names of the objects."""
    plane_name = "latent of two dimensions" if plane.is_latent else "projection of the latent"
    subtitle = f"{task.dataset_title}: {plane_name}, training recordings of one fold"
    figure = new_figure((WIDTH_IN, 5.4), title, subtitle, [task.source])
    axes = figure.subplots()
    categories = sorted({*plane.categories.values()})
    colours = {name: COLOURS[index % len(COLOURS)] for index, name in enumerate(categories)}
    for name, ellipse in ellipses.items():
        own = plane.points[plane.objects == name]
        colour = colours[plane.categories[name]]
        axes.plot(*own.T, ".", color=colour, ms=3, alpha=0.35, rasterized=True)
        _draw_ellipse(axes, ellipse, colour)
    axes.margins(0.1)
    axes.autoscale_view()
    _name_objects(axes, ellipses, {name: colours[plane.categories[name]] for name in ellipses})
    axes.set(xticks=[], yticks=[], xlabel="dimension 1", ylabel="dimension 2")
    handles = [Line2D([], [], color=colours[name], lw=2, label=words(name)) for name in categories]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    return figure


def _draw_ellipse(axes: Axes, ellipse: Ellipse, colour: str) -> None:

    patch = Patch(
        (ellipse.x, ellipse.y),
        2 * ellipse.major,
        2 * ellipse.minor,
        angle=ellipse.angle_deg,
        fc="none",
        ec=colour,
        lw=1.4,
    )
    axes.add_patch(patch)


def _name_objects(axes: Axes, ellipses: Mapping[str, Ellipse], colours: Mapping[str, str]) -> None:
    """Write the name of each object next to its ellipse, where it covers no other ellipse or name.

    Positions are tried at the right, left, above and below; the size of a name is estimated.
    """
    low_x, high_x = axes.get_xlim()
    low_y, high_y = axes.get_ylim()
    letter = LETTER_IN / AXES_IN[0] * (high_x - low_x)
    line = LINE_IN / AXES_IN[1] * (high_y - low_y)
    boxes = {name: box_of(ellipse) for name, ellipse in ellipses.items()}
    covered = [*boxes.values()]
    for name, box in boxes.items():
        width = letter * len(name)
        places = (
            Rectangle(box.right, box.right + width, box.y - line / 2, box.y + line / 2),
            Rectangle(box.left - width, box.left, box.y - line / 2, box.y + line / 2),
            Rectangle(box.x - width / 2, box.x + width / 2, box.top, box.top + line),
            Rectangle(box.x - width / 2, box.x + width / 2, box.bottom - line, box.bottom),
        )
        free = [place for place in places if not any(place.overlaps(other) for other in covered)]
        chosen = next(iter(free), places[0])
        covered.append(chosen)
        axes.text(
            chosen.x,
            chosen.y,
            words(name),
            color=colours[name],
            fontsize=8,
            ha="center",
            va="center",
        )
