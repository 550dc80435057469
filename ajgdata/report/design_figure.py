"""Figure of designs: how well each is read, with what grasps leave open."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ajgdata.report.canvas import COLOURS, WIDTH_IN, new_figure
from ajgdata.report.format import number
from ajgdata.report.labels import reference_line
from ajgdata.types.table import Table


def design_finding(table: Table) -> str:
    """Return which design is first, and how sure that is."""
    best = table.rows[0]
    return f"{best['design']} is read best, in {number(best['first'], 2)} % of bootstrap samples"


def design_figure(table: Table) -> Figure:
    """Return the skill of each design with its 95 % interval, best at the top."""
    rows = [row for row in table.rows if row["skill"] is not None]
    about = "skill: 1 for no error, 0 for chance, mean over rows; 95 % of a bootstrap over grasps"
    size = (WIDTH_IN, 1.0 + 0.28 * len(rows))
    figure = new_figure(size, design_finding(table), about, ["simulated"])
    axes = figure.subplots()
    skill, low, high = (np.array([row[key] for row in rows]) for key in ("skill", "low", "high"))
    reach = np.maximum(0, [skill - low, high - skill])
    axes.errorbar(skill, range(len(rows)), xerr=reach, fmt="o", color=COLOURS[0], capsize=2)
    axes.set_yticks(range(len(rows)), [str(row["design"]) for row in rows])
    axes.set(xlabel="skill", ylim=(len(rows) - 0.5, -1))
    reference_line(axes, "chance", 0.0, "chance", axis="x")
    return figure
