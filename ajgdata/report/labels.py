"""Names in figures: legends beside the axes, words at points, and reference lines."""

from __future__ import annotations

import re
import textwrap
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import same_color, to_hex, to_rgb
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.textpath import text_to_path

GREY = "#6b6b6b"
LABEL_PT = 8
#: Contrast with white that text of this size needs (WCAG 2.2, 1.4.3).
CONTRAST = 4.5
#: Lines that are no measurement: their colour and dashes.
REFERENCES: dict[str, dict[str, Any]] = {
    "chance": {"color": GREY, "ls": ":", "lw": 1.2},
    "paper": {"color": "black", "ls": (0, (7, 2, 1, 2)), "lw": 1.2},
    "ideal": {"color": GREY, "ls": (0, (5, 3)), "lw": 1.1},
}
#: Spaces at which no line ends: before and after "±", and before "%" and short units.
_UNBROKEN = re.compile(r" (?=±|%)|(?<=±) |(?<=\d) (?=[^\W\d]{1,2}\b)")
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
    """Return the width of a line of text in the font of the figures, in inches."""
    font = FontProperties(family="DejaVu Sans", weight=weight, size=size_pt)
    return float(text_to_path.get_text_width_height_descent(text, font, ismath=False)[0]) / 72


def wrapped(text: str, width: float, size_pt: float, weight: str = "normal") -> list[str]:
    """Return the lines of `text`, each about `width` (in) wide at most; `5 ± 2 mm` stays whole."""
    full = width_in(text, size_pt, weight)
    count = int(0.95 * width * len(text) / full) if full > width else len(text)
    text = _UNBROKEN.sub("\N{NO-BREAK SPACE}", text)
    lines = textwrap.wrap(text, max(1, count), break_long_words=False, break_on_hyphens=False)
    return [line.replace("\N{NO-BREAK SPACE}", " ") for line in lines] or [""]


def label_end(axes: Axes, x: float | None, y: float, text: str, colour: str) -> None:
    """Name the line or marker of `colour` whose last point is (x, y), in data, in a legend.

    The legend is right of the axes, in the order of the calls. Without `x` only `y` counts.
    """

    def distance(line: Line2D) -> float:
        points = np.asarray(line.get_xydata(), float)
        if not len(points):
            return np.inf
        away = abs(points[-1] - (points[-1, 0] if x is None else x, y)).sum()
        return float(away) if np.isfinite(away) else np.inf

    lines = [line for line in axes.lines if same_color(line.get_color(), colour)]
    nearest = min(reversed(lines), key=distance, default=Line2D([], [], color=colour))
    add_to_legend(axes, nearest, text)


def add_to_legend(axes: Axes, handle: Artist, text: str) -> None:
    """Add an entry to the legend right of the axes."""
    old = axes.get_legend()
    handles = [*filter(None, old.legend_handles), handle] if old else [handle]
    texts = [*(one.get_text() for one in old.get_texts()), text] if old else [text]
    axes.legend(handles, texts, loc="upper left", bbox_to_anchor=(1.0, 1.0), labelspacing=0.3)


def reference_line(axes: Axes, kind: Reference, at: float, text: str, axis: str = "y") -> None:
    """Draw a reference for the results (chance, the published value) and name it in the legend.

    On the `axis` x the line is upright, and named above.
    """
    style = REFERENCES[kind]
    if axis == "y":
        add_to_legend(axes, axes.axhline(at, label=kind, zorder=1.5, **style), text)
        return
    axes.axvline(at, label=kind, zorder=1.5, **style)
    axes.annotate(
        text, (at, 1), (0, 2), xycoords=("data", "axes fraction"), textcoords="offset points",
        ha="center", va="bottom", fontsize=LABEL_PT, color=style["color"],
    )  # fmt: skip
