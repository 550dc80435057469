"""One look for all figures, and the same bytes for the same figure.

Figures are made without pyplot, with every setting stated here: neither a user's matplotlibrc nor
an earlier figure can change them.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Sequence
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec

import matplotlib.style
import numpy as np
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator

from ajgdata.paths import FIGURE_FORMATS
from ajgdata.report.blocks import Illustration
from ajgdata.report.format import Source, value
from ajgdata.store.files import write_bytes

P = ParamSpec("P")

#: Okabe & Ito's palette, told apart with every common colour vision; yellow is left out, which is
#: too pale for lines on white.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
SOURCE_COLOURS: dict[Source, str] = {"simulated": "#0072B2", "recorded": "#B34700"}
#: More points than this are drawn as pixels also in vector files.
MAX_VECTOR_POINTS = 3000
MARKERS = "os^DvPX"
GREY = "#6b6b6b"
WIDTH_IN = 7.2
HEAD_IN = 0.53
BADGE_IN = 0.92

STYLE: dict[str, Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": "#444444",
    "axes.grid": True,
    "axes.labelsize": 9,
    "axes.titlesize": 9,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "figure.facecolor": "white",
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.6,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "legend.title_fontsize": 8,
    "lines.linewidth": 1.4,
    "pdf.fonttype": 42,
    "savefig.dpi": 200,
    "svg.fonttype": "path",  # the reader need not have the font
    "svg.hashsalt": "ajgdata",
    "text.parse_math": False,  # a label may hold a dollar sign
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
}
# Whatever would put a date, or the machine, into the file.
_METADATA: dict[str, dict[str, Any]] = {
    "svg": {"Date": None},
    "png": {"Software": None},
    "pdf": {"CreationDate": None},
}


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Return `draw` under STYLE and with a frozen layout: saving twice cannot move anything."""

    @wraps(draw)
    def wrapper(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with matplotlib.style.context(["default", STYLE]):
            figure = draw(*args, **kwargs)
            figure.draw_without_rendering()
            figure.set_layout_engine("none")
        return figure

    return wrapper


def draw(illustration: Illustration) -> Figure:
    """Return the figure of an illustration, drawn in the one style."""
    return styled(illustration.draw)()


def new_figure(
    size_in: tuple[float, float], title: str, subtitle: str, sources: Iterable[Source]
) -> Figure:
    """Return a figure whose head says what it is and, boxed, if data are simulated or recorded."""
    width, height = size_in
    layout = ConstrainedLayoutEngine(rect=(0, 0, 1, 1 - HEAD_IN / height))
    figure = Figure(figsize=size_in, layout=layout)
    badges = sorted(set(sources))
    for i, source in enumerate(badges):
        figure.text(
            (0.13 + BADGE_IN * i) / width,
            1 - 0.09 / height,
            source,
            va="top",
            fontsize=8.5,
            fontweight="bold",
            color="white",
            bbox={"boxstyle": "round,pad=0.35", "color": SOURCE_COLOURS[source]},
        )
    # A bold letter is about 0.65 em wide: shrink a long title until it ends within the figure.
    left_in = 0.1 + BADGE_IN * len(badges)
    size_pt = min(10.5, 72 * (width - left_in - 0.1) / (0.65 * max(len(title), 1)))
    place = left_in / width, 1 - 0.08 / height
    figure.text(*place, title, va="top", fontsize=size_pt, fontweight="bold")
    figure.text(0.08 / width, 1 - 0.33 / height, subtitle, va="top", fontsize=9)
    return figure


def model_style(index: int) -> dict[str, Any]:
    """Return colour and marker of the `index`-th of several models; both differ from the next."""
    return {"color": COLOURS[index % len(COLOURS)], "marker": MARKERS[index % len(MARKERS)]}


def line_style(index: int) -> dict[str, Any]:
    """Return colour and marker of the `index`-th of several lines; they repeat late, and apart."""
    return {
        "color": COLOURS[index % len(COLOURS)],
        "marker": MARKERS[index // len(COLOURS) % len(MARKERS)],
        "ms": 4.5,
        "lw": 1.2,
    }


def plain_ticks(axis: Axis, at: Sequence[float] = ()) -> None:
    """Write numbers, not powers, at ticks of a logarithmic axis, and only at `at` if given."""
    if at:
        low, high = axis.get_view_interval()
        axis.set_ticks([tick for tick in at if low <= tick <= high])
        axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda given, _: value(float(given))))
    axis.set_minor_formatter(NullFormatter())


def pareto_front(cost: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Return which of n points no other point beats: boolean (n,).

    A point is beaten by another that is no worse in both and better in one; equals stay.
    """
    cost, error = np.asarray(cost, float), np.asarray(error, float)
    no_worse = (cost[:, None] <= cost) & (error[:, None] <= error)
    better = (cost[:, None] < cost) | (error[:, None] < error)
    return ~np.any(no_worse & better, axis=0)


def encode(figure: Figure, suffix: str) -> bytes:
    """Return the figure as a `svg`, `png` or `pdf` file: the same bytes each time."""
    buffer = io.BytesIO()
    with matplotlib.style.context(["default", STYLE]):
        figure.savefig(buffer, format=suffix, metadata=_METADATA[suffix])
    return buffer.getvalue()


def save_figure(figure: Figure, stem: Path) -> list[Path]:
    """Write `stem`.svg, .png and .pdf, each in one step; return them in this order."""
    targets = {suffix: stem.with_name(f"{stem.name}.{suffix}") for suffix in FIGURE_FORMATS}
    for suffix, target in targets.items():
        write_bytes(target, encode(figure, suffix))
    return list(targets.values())
