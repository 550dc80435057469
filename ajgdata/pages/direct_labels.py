"""Labels next to lines and marks, so that no legend is needed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from scipy.optimize import isotonic_regression

#: Distance of labels that are one above the other, as a share of the height of the axes.
LINE_HEIGHT = 0.075
FONT_PT = 8


class LineLabel(NamedTuple):
    """Text of a label, the value (y) of the line that it names, and its colour."""

    text: str
    value: float
    colour: str


def spread_out(places: Sequence[float], distance: float) -> np.ndarray:
    """Return the nearest places (n,) that are at least `distance` apart, in the same order.

    The sum of the squared shifts is as small as possible (isotonic regression).

    >>> spread_out([1.0, 1.0, 5.0], 2.0).tolist()
    [0.0, 2.0, 5.0]
    """
    targets = np.asarray(places, float)
    order = np.argsort(targets, kind="stable")
    steps = distance * np.arange(len(targets))
    spread = np.empty(len(targets))
    spread[order] = isotonic_regression(targets[order] - steps).x + steps
    return spread


def label_right(axes: Axes, labels: Sequence[LineLabel]) -> None:
    """Write labels at the right edge of axes, next to the ends of their lines.

    Args:
        axes: Axes with a linear y axis and its final limits.
        labels: Names of the lines.
    """
    low, high = axes.get_ylim()
    shares = [(label.value - low) / (high - low) for label in labels]
    for label, place in zip(labels, spread_out(shares, LINE_HEIGHT), strict=True):
        axes.text(
            1.015,
            place,
            label.text,
            transform=axes.transAxes,
            color=label.colour,
            fontsize=FONT_PT,
            va="center",
        )
