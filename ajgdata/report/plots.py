"""What figures share: looks of lines, columns as numbers, plain ticks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator
from numpy.typing import NDArray

from ajgdata.report.canvas import COLOURS
from ajgdata.report.format import value
from ajgdata.types.table import Table

GRIDS_MM = (0.5, 1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10)
MARKERS = "osD^vP*"
#: More points than this are drawn as pixels also in vector files.
MAX_VECTOR_POINTS = 3000


def look(index: int) -> dict[str, Any]:
    """Colour and marker of the `index`-th of several lines; they repeat late, and apart."""
    return {
        "color": COLOURS[index % len(COLOURS)],
        "marker": MARKERS[index // len(COLOURS) % len(MARKERS)],
        "ms": 4.5,
        "lw": 1.2,
    }


def parted(table: Table, key: str) -> dict[str, list[dict[str, Any]]]:
    """Rows by the value of one column, in order of first appearance."""
    parts: dict[str, list[dict[str, Any]]] = {}
    for row in table.rows:
        parts.setdefault(str(row[key]), []).append(row)
    return parts


def numbers(table: Table, key: str) -> NDArray[np.floating]:
    """A column as numbers; gaps are NaN."""
    return np.array([np.nan if v is None else float(v) for v in table.column(key)])


def plain_ticks(axis: Axis, at: Sequence[float] = ()) -> None:
    """Numbers instead of powers at the ticks of a logarithmic axis, and only at `at` if given."""
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
