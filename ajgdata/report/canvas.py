"""Style of all figures, and figure files whose bytes are equal each time.

Figures are drawn without pyplot, and all settings are in this module, so that neither a user's
matplotlibrc nor an earlier figure can change them.
"""

from __future__ import annotations

import io
import math
import re
import textwrap
from collections.abc import Callable, Iterable, Sequence
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec

import matplotlib.style
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter, NullLocator

from ajgdata.paths import FIGURE_FORMATS
from ajgdata.report.format import NO_BREAK, Source, sentence, value
from ajgdata.report.report_data import Illustration
from ajgdata.store.files import write_bytes

P = ParamSpec("P")

#: Palette of Okabe & Ito for all common kinds of colour vision; without yellow, which is too pale
#: for lines on white.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
SOURCE_COLOURS: dict[Source, str] = {"simulated": "#0072B2", "recorded": "#B34700"}
#: Resolution of pixels in a vector file.
SVG_DPI = 130
MARKERS = "os^DvPX"
GREY = "#6b6b6b"
#: Dashes of lines, which then differ without colour, too.
DASHES = ("-", (0, (5, 1.5)), (0, (1.2, 1.2)), (0, (5, 1.5, 1, 1.5)))
WIDTH_IN = 7.2
#: Title: size, height of a line, and letters per inch.
TITLE_PT = 11.0
TITLE_LINE_IN = 0.19
TITLE_LETTERS_PER_IN = 9.0
#: Subtitle: size, height of a line, and letters per inch.
SUBTITLE_PT = 8.5
SUBTITLE_LINE_IN = 0.15
SUBTITLE_LETTERS_PER_IN = 13.0
#: Height of a head with one line of title and subtitle, which the size of a figure includes.
HEAD_IN = 0.53
#: Distance of two badges.
BADGE_IN = 0.88

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
    "svg.fonttype": "path",  # readers may not have the font
    "svg.hashsalt": "ajgdata",
    "text.parse_math": False,  # a label may contain a dollar sign
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
}
#: Metadata that would write the date or the program into a file.
_METADATA: dict[str, dict[str, Any]] = {
    "svg": {"Date": None},
    "png": {"Software": None},
    "pdf": {"CreationDate": None},
}


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Return `draw` with STYLE, and with a layout that later saving does not change."""

    @wraps(draw)
    def wrapper(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with matplotlib.style.context(["default", STYLE]):
            figure = draw(*args, **kwargs)
            engine = figure.get_layout_engine()
            if engine is not None and figure.axes:
                engine.execute(figure)  # takes half of the time of drawing
            figure.set_layout_engine(None)  # with "none", each save would draw twice
        return figure

    return wrapper


def draw(illustration: Illustration) -> Figure:
    """Return the figure of an illustration, drawn in STYLE."""
    return styled(illustration.draw)()


def new_figure(
    size_in: tuple[float, float], title: str, subtitle: str, sources: Iterable[Source]
) -> Figure:
    """Return a figure with a head: the title, the sources of the data in boxes, and the subtitle.

    `size_in` is width and height with one line of title and subtitle (inches). Further lines make
    the figure higher.
    """
    width = size_in[0]
    badges = sorted(set(sources))
    left = 0.08 + BADGE_IN * len(badges)
    # A number, its deviation and the next word stay in one line.
    unbroken = re.sub(r"(?<=[\d±]) ", NO_BREAK, sentence(title))
    wrapped = textwrap.wrap(unbroken, int(TITLE_LETTERS_PER_IN * (width - 0.2))) or [""]
    lines = [line.replace(NO_BREAK, " ") for line in wrapped]
    below = textwrap.wrap(subtitle, int(SUBTITLE_LETTERS_PER_IN * (width - left - 0.12))) or [""]
    extra = TITLE_LINE_IN * (len(lines) - 1) + SUBTITLE_LINE_IN * (len(below) - 1)
    height = size_in[1] + extra
    layout = ConstrainedLayoutEngine(rect=(0, 0, 1, 1 - (HEAD_IN + extra) / height))
    figure = Figure(figsize=(width, height), layout=layout)

    def write(x: float, from_top: float, text: str, **style: Any) -> None:
        figure.text(x / width, 1 - from_top / height, text, va="top", **style)

    for i, line in enumerate(lines):
        top = 0.07 + TITLE_LINE_IN * i
        write(0.08, top, line, fontsize=TITLE_PT, fontweight="bold")
    top = 0.14 + TITLE_LINE_IN * len(lines)
    for i, source in enumerate(badges):
        box = {"boxstyle": "round,pad=0.25", "color": SOURCE_COLOURS[source]}
        style = {"fontsize": 8, "fontweight": "bold", "color": "white"}
        write(0.12 + BADGE_IN * i, top, source, bbox=box, **style)
    for i, line in enumerate(below):
        write(left, top - 0.005 + SUBTITLE_LINE_IN * i, line, fontsize=SUBTITLE_PT)
    return figure


def line_style(index: int) -> dict[str, Any]:
    """Return colour, marker and dashes of a line by its index.

    They repeat after different numbers of lines, so that few lines are equal.
    """
    return {
        "color": COLOURS[index % len(COLOURS)],
        "marker": MARKERS[(index + index // len(COLOURS)) % len(MARKERS)],
        "ls": DASHES[index % len(DASHES)],
        "ms": 4.5,
        "lw": 1.2,
    }


def plain_ticks(axis: Axis, at: Sequence[float] = ()) -> None:
    """Write numbers at the ticks of a logarithmic axis; `at` selects the ticks."""
    if at:
        low, high = axis.get_view_interval()
        axis.set_ticks([tick for tick in at if low <= tick <= high])
        axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda number, _: value(float(number))))
    axis.set_minor_formatter(NullFormatter())


def power_ticks(axis: Axis) -> None:
    """Write powers of ten at the ticks of a logarithmic axis."""
    axis.set_major_locator(LogLocator(numticks=7))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda tick, _: power(float(tick))))


def power(tick: float) -> str:
    """Return a power of ten with a superscript exponent.

    >>> power(1e-6)
    '10⁻⁶'
    """
    raised = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
    return f"10{str(round(math.log10(tick))).translate(raised)}"


def encode(figure: Figure, suffix: str) -> bytes:
    """Return the bytes of a figure as a `svg`, `png` or `pdf` file; they are equal each time."""
    buffer = io.BytesIO()
    with matplotlib.style.context(["default", STYLE]):
        dpi = SVG_DPI if suffix == "svg" else STYLE["savefig.dpi"]
        figure.savefig(buffer, format=suffix, dpi=dpi, metadata=_METADATA[suffix])
    return buffer.getvalue()


def save_figure(figure: Figure, stem: Path, formats: Sequence[str] = FIGURE_FORMATS) -> list[Path]:
    """Write a file of each format next to `stem`; return the files in the order of `formats`."""
    files = [stem.with_name(f"{stem.name}.{suffix}") for suffix in formats]
    for suffix, file in zip(formats, files, strict=True):
        write_bytes(file, encode(figure, suffix))
    return files
