"""Words at what they name, instead of a legend: at the end of a line, or beside a point.

Labels are put in their final place when the layout of a figure stands: `settle` keeps them clear of
one another. Each has the colour of what it names, dark enough to be read.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache
from itertools import product
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.text import Annotation, Text
from matplotlib.textpath import text_to_path
from matplotlib.transforms import Bbox

GREY = "#6b6b6b"
LABEL_PT = 8
#: Pixels make letters wider than their outlines, by no more than this.
HINTING = 1.04
#: Contrast with white that text of this size needs (WCAG 2.2, 1.4.3).
CONTRAST = 4.5
#: Lines that are no measurement: their colour and dashes.
REFERENCES: dict[str, dict[str, Any]] = {
    "chance": {"color": GREY, "ls": ":", "lw": 1.2},
    "paper": {"color": "black", "ls": (0, (7, 2, 1, 2)), "lw": 1.2},
    "ideal": {"color": GREY, "ls": (0, (5, 3)), "lw": 1.1},
}
#: Where no line ends: in `5 ± 2 mm`; and what stands there while lines are made.
_UNBROKEN, _KEPT = re.compile(r" (?=±|%)|(?<=±) |(?<=\d) (?=[^\W\d]{1,2}\b)"), "\N{NO-BREAK SPACE}"
Reference = Literal["chance", "paper", "ideal"]


def ink(colour: str) -> str:
    """Return `colour`, darkened until text in it can be read on white."""
    rgb = np.array(to_rgb(colour))
    while 1.05 / (_luminance(rgb) + 0.05) < CONTRAST:
        rgb = 0.95 * rgb
    return to_hex(tuple(rgb.tolist()))


def _luminance(rgb: np.ndarray) -> float:
    """Return the relative luminance of an sRGB colour (3,), 0 to 1 (WCAG 2.2)."""
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


@lru_cache(maxsize=4096)
def width_in(text: str, size_pt: float, weight: str = "normal") -> float:
    """Return how wide a line of text is in the figures' font, in inches; as pixels at most."""
    font = FontProperties(family="DejaVu Sans", weight=weight, size=size_pt)
    outline = text_to_path.get_text_width_height_descent(text, font, ismath=False)[0]
    return HINTING * float(outline) / 72


def wrapped(text: str, width: float, size_pt: float, weight: str = "normal") -> list[str]:
    """Return the lines that `text` takes, none wider than `width` (in) unless a single word is."""
    lines, space = [""], width_in(" ", size_pt, weight)
    used = 0.0
    for word in _UNBROKEN.sub(_KEPT, text).split(" "):
        long = width_in(word, size_pt, weight)
        if lines[-1] and used + space + long > width:
            lines.append(word)
            used = long
        else:
            used += long + (space if lines[-1] else 0.0)
            lines[-1] = f"{lines[-1]} {word}".strip(" ")
    return [line.replace(_KEPT, " ") for line in lines]


def balanced(text: str, width: float, size_pt: float, weight: str = "normal") -> list[str]:
    """Return the lines of `wrapped`, as many, but of lengths that are as even as can be."""
    lines = wrapped(text, width, size_pt, weight)
    narrower = lines
    while len(narrower) == len(lines) > 1:
        lines, width = narrower, 0.97 * width
        narrower = wrapped(text, width, size_pt, weight)
    return lines


def spread_out(wanted: np.ndarray, heights: np.ndarray, low: float, high: float) -> np.ndarray:
    """Return middles (n,) of labels of `heights` (n,), none over another, as near as can be (least
    squares) to those `wanted` (n,), and between `low` and `high` if there is room."""
    from scipy.optimize import isotonic_regression

    if not len(wanted):
        return np.asarray(wanted, float)
    order = np.argsort(wanted, kind="stable")
    tall = heights[order]
    # Measured from the lowest place that those below leave, places may be equal but not fall.
    stacked = np.cumsum(tall) - tall / 2
    places = isotonic_regression(np.asarray(wanted, float)[order] - stacked).x
    places = np.clip(places, low, max(low, high - tall.sum())) + stacked
    found = np.empty(len(wanted))
    found[order] = places
    return found


class EndLabel(Annotation):
    """The name of a line, right of the axes at the height of the line's end."""


class PointLabel(Annotation):
    """The name of a point, on whichever side of it there is room; its bar reaches up and down."""

    reach: float = 0.0


def label_end(axes: Axes, x: float | None, y: float, text: str, colour: str) -> EndLabel:
    """Write `text` right of the axes, with a thin line from the point (x, y) in data.

    Without `x` the line begins at the axes' edge.
    """
    start: Any = ("axes fraction", "data") if x is None else "data"
    label = EndLabel(
        text, (1.0 if x is None else x, y), xytext=(1.02, y), xycoords=start,
        textcoords=("axes fraction", "data"), ha="left", va="center", fontsize=LABEL_PT,
        color=ink(colour), annotation_clip=False, clip_on=False,
        arrowprops={"arrowstyle": "-", "color": colour, "lw": 0.6, "alpha": 0.7, "shrinkA": 0,
                    "shrinkB": 0, "relpos": (0, 0.5)},
    )  # fmt: skip
    axes.add_artist(label)
    return label


def label_point(
    axes: Axes, x: float, y: float, text: str, colour: str, reach: float = 0.0, **style: Any
) -> PointLabel:
    """Write `text` beside the point (x, y) in data, whose error bar has a length of 2 `reach`."""
    style = {"fontsize": LABEL_PT, "color": ink(colour), **style}
    label = PointLabel(text, (x, y), xytext=(6, 0), textcoords="offset points", va="center",
                       ha="left", annotation_clip=False, clip_on=False, **style)  # fmt: skip
    label.set_in_layout(False)
    label.reach = reach
    axes.add_artist(label)
    return label


def reference_line(axes: Axes, kind: Reference, at: float, text: str, axis: str = "y") -> None:
    """Draw what a result is seen against (chance, the paper's value) and name it at its end.

    On the `axis` x the line is upright, and named above.
    """
    style = REFERENCES[kind]
    if axis == "y":
        axes.axhline(at, label=kind, zorder=1.5, **style)
        label_end(axes, None, at, text, style["color"])
        return
    axes.axvline(at, label=kind, zorder=1.5, **style)
    axes.annotate(
        text, (at, 1), (0, 2), xycoords=("data", "axes fraction"), textcoords="offset points",
        ha="center", va="bottom", fontsize=LABEL_PT, color=ink(style["color"]),
    )  # fmt: skip


def settle(figure: Figure) -> None:
    """Put the labels of a figure, whose layout stands, where they do not cover one another."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    renderer = FigureCanvasAgg(figure).get_renderer()
    for axes in figure.axes:
        ends = [child for child in axes.get_children() if isinstance(child, EndLabel)]
        _settle_ends(axes, ends, renderer)
        points = [child for child in axes.get_children() if isinstance(child, PointLabel)]
        _settle_points(axes, points, renderer)


def _settle_ends(axes: Axes, labels: Sequence[EndLabel], renderer: RendererBase) -> None:
    """Move labels up and down, and no further than the axes reach if they have room there."""
    if not labels:
        return
    heights = np.array([1.06 * _text_box(label, renderer).height for label in labels])
    wanted = np.array([axes.transData.transform((1.0, label.xyann[1]))[1] for label in labels])
    box, reach = axes.bbox, heights.max() / 2
    places = spread_out(wanted, heights, box.y0 - reach, box.y1 + reach)
    back = axes.transData.inverted()
    for label, place in zip(labels, places, strict=True):
        label.xyann = (label.xyann[0], float(back.transform((box.x1, place))[1]))


def _text_box(label: Annotation, renderer: RendererBase) -> Bbox:
    """Return the box of the text alone, in pixels, without its line."""
    label.update_positions(renderer)
    return Text.get_window_extent(label, renderer)


#: Where a label may stand, best first: offset in points, and how it is aligned.
_SIDES = [
    ((6, 0), "left", "center"), ((-6, 0), "right", "center"),
    ((0, 6), "center", "bottom"), ((0, -6), "center", "top"),
    *(((5 * far * x, 5 * far * y), "left" if x > 0 else "right", "bottom" if y > 0 else "top")
      for far, x, y in product((1, 2.4), (1, -1), (1, -1))),
]  # fmt: skip


def _settle_points(axes: Axes, labels: Sequence[PointLabel], renderer: RendererBase) -> None:
    """Choose for one label after the other the side on which it covers least."""
    taken = [_point_box(axes, label) for label in labels]
    for label in labels:
        cost, boxes = [], []
        for offset, ha, va in _SIDES:
            label.set(ha=ha, va=va)
            label.xyann = offset
            boxes.append(_text_box(label, renderer))
            cost.append(_covered(boxes[-1], taken) + _outside(boxes[-1], axes))
        best = int(np.argmin(cost))
        offset, ha, va = _SIDES[best]
        label.set(ha=ha, va=va)
        label.xyann = offset
        taken.append(boxes[best])


def _point_box(axes: Axes, label: PointLabel) -> Bbox:
    """Return the box of a marker and its error bar, in pixels."""
    x, y = label.xy
    ends = axes.transData.transform([(x, y - label.reach), (x, y), (x, y + label.reach)])
    low, high = np.nanmin(ends, axis=0) - 6, np.nanmax(ends, axis=0) + 6
    return Bbox([low, high])


def _covered(box: Bbox, taken: Sequence[Bbox]) -> float:
    """Return how much of other boxes a box covers, in square pixels."""
    both = (Bbox.intersection(box, other) for other in taken)
    return sum(one.width * one.height for one in both if one is not None)


def _outside(box: Bbox, axes: Axes) -> float:
    """Return how much of a box lies outside the axes, and counts the more: it may be cut off."""
    inside = Bbox.intersection(box, axes.bbox)
    area = inside.width * inside.height if inside is not None else 0.0
    return 3.0 * max(box.width * box.height - area, 0.0)
