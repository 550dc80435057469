"""Figure of the ablation `mirror`: the error at each angle, in three setups."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ajgdata.report.format import Caption, number, sentence
from ajgdata.types.table import Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Setups by the ends of the names of their columns.
SETUPS = {
    "default": "default",
    "unequal": "transducers at unequal radii",
    "eccentric": "bar 3 mm off its axis",
}
#: Beginnings of the names of columns: errors of either target.
DIRECTION, FROM_PLANE = "direction_", "from_plane_"


def finding(table: Table) -> str:
    """Return the error of the direction at withheld angles in each setup, and from the plane."""
    withheld = table.where(withheld=True)

    def rmse(column: str) -> str:
        return f"{number(float(np.sqrt(np.mean(withheld.numbers(column) ** 2))), 2)}°"

    listed = ", ".join(f"{rmse(DIRECTION + key)} {setup}" for key, setup in SETUPS.items())
    return f"Withheld angles: {listed}; angle from the mirror plane {rmse(FROM_PLANE + 'default')}"


def figure(table: Table) -> Figure:
    """Return errors of the direction and of the angle from the plane against the angle."""
    from ajgdata.report.canvas import WIDTH_IN, line_style, new_figure
    from ajgdata.report.labels import label_end

    about = "RMSE at each angle of the bar; large marks: the paper's 19 angles; hollow: withheld"
    drawn = new_figure((WIDTH_IN, 5.2), finding(table), about, ["simulated"])
    panels = drawn.subplots(2, 1, sharex=True)
    texts = ("direction", "angle from the mirror plane")
    for axes, prefix, text in zip(panels, (DIRECTION, FROM_PLANE), texts, strict=True):
        for index, (key, setup) in enumerate(SETUPS.items()):
            style = line_style(index)
            errors = table.numbers(f"{prefix}{key}")
            axes.plot(
                table.numbers("angle"), errors, label=setup, **(style | {"marker": "", "lw": 0.8})
            )
            _marks(axes, table, errors, style)
            label_end(axes, None, errors[-1], setup, str(style["color"]))
        axes.set_ylabel(f"RMSE of the\n{text} (°)")
        axes.set_ylim(bottom=0)
    panels[-1].set_xlabel("angle of the bar (°)")
    return drawn


def _marks(axes: Axes, table: Table, errors: np.ndarray, style: dict) -> None:
    """Draw a mark for each angle: large if it is the paper's, hollow if it is withheld."""
    angle, withheld = table.numbers("angle"), np.array(table.column("withheld"), bool)
    paper = np.array([grid == "paper" for grid in table.column("grid")])
    for is_paper, size in ((True, 5.0), (False, 2.5)):
        for is_withheld, face in ((False, style["color"]), (True, "white")):
            chosen = (paper == is_paper) & (withheld == is_withheld)
            look = {"marker": style["marker"], "ms": size, "mfc": face, "color": style["color"]}
            axes.plot(angle[chosen], errors[chosen], ls="none", **look)


def caption(table: Table) -> Caption:
    """Return the caption of `figure`."""
    return Caption(
        "Error of the bar's direction (top) and of its angle from the mirror plane (bottom) at each"
        " angle, simulated. Large marks are the paper's 19 angles, small marks those between;"
        " hollow marks are withheld from training.",
        f"{sentence(finding(table))}. Errors at 40 angles, three lines each.",
    )
