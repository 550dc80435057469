"""Confusion matrices: shares of predicted classes, and how they are drawn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation_results import class_shares
from ajgdata.report.format import words

#: Shares above this value are dark: their numbers are white.
DARK = 0.55
#: Smaller shares have no number.
SMALLEST_NUMBERED = 0.005


def share_matrix(task: TaskResults, classes: Sequence[str]) -> np.ndarray:
    """Return the share (n, n) of each predicted class (column) in each true class (row).

    Args:
        task: Results of a classification; the shares are of the model that the task is about.
        classes: The n classes of the task in the order of rows and columns.
    """
    shares = {(row["true"], row["predicted"]): row["share"] for row in class_shares(task).rows}
    return np.array([[shares[true, predicted] for predicted in classes] for true in classes])


def draw_matrix(axes: Axes, shares: np.ndarray, classes: Sequence[str], rotation: float) -> None:
    """Draw shares (n, n) in per cent, with the classes at both axes.

    Args:
        axes: Empty axes.
        shares: Shares of predicted classes (columns) per true class (rows).
        classes: The n classes.
        rotation: Angle of the names of predicted classes in degrees.
    """
    names = [words(name) for name in classes]
    axes.imshow(shares, cmap="Blues", vmin=0, vmax=1, aspect="equal")
    axes.grid(False)
    axes.spines[:].set_visible(False)
    axes.set_xticks(range(len(names)), names, rotation=rotation, rotation_mode="xtick")
    axes.set_yticks(range(len(names)), names)
    axes.tick_params(length=0)
    for row, column in np.argwhere(shares >= SMALLEST_NUMBERED):
        share = shares[row, column]
        colour = "white" if share > DARK else "#222222"
        text = f"{100 * share:.0f}"
        axes.text(column, row, text, color=colour, ha="center", va="center", fontsize=8)
