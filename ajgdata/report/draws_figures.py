"""Figures of the drawn grippers: the paper among them, what moves a row, what the nearest share."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.report.blocks import TableFigure
from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, line_style, new_figure
from ajgdata.report.format import Caption, number, with_unit
from ajgdata.report.labels import LABEL_PT, REFERENCES, ink, reference_line
from ajgdata.types.table import Table

#: Ends of the bars, in deciles, from the widest to the narrowest, and how thick they are.
BARS = ((0, 100, 1.2), (10, 90, 4.0), (30, 70, 8.0))
#: Below this p a parameter differs by more than chance.
SURE = 0.05


def rows_finding(table: Table) -> str:
    """Return in how many rows some drawn gripper gives the paper's figure, or exceeds it where it
    may."""
    low, high, paper = (table.numbers(key) for key in ("q0", "q100", "paper"))
    sense = np.array(table.column("sense"))
    given = ((paper >= low) | (sense == "at least")) & ((paper <= high) | (sense == "at most"))
    return (
        f"In {int(np.sum(given))} of {len(paper)} rows the paper's figure is within what the drawn"
        " grippers give"
    )


def rows_figure(table: Table) -> Figure:
    """Return a strip of deciles for each row, with the paper's figure."""
    about = (
        "thin: all draws, thicker: middle 80 %, thickest: middle 40 %, white: median; diamond:"
        " the default gripper; upright: the paper; reduced versions of its rows"
    )
    count = len(table.rows)
    figure = new_figure((WIDTH_IN, 0.5 + 0.5 * count), rows_finding(table), about, ["simulated"])
    panels = figure.subplots(count, 1, squeeze=False)[:, 0]
    for axes, row in zip(panels, table.rows, strict=True):
        _strip(axes, row)
    return figure


def _strip(axes: Axes, row: dict) -> None:
    for low, high, width in BARS:
        ends = [row[f"q{low}"], row[f"q{high}"]]
        axes.plot(ends, [0, 0], color=COLOURS[0], lw=width, solid_capstyle="butt")
    axes.plot(row["q50"], 0, "o", color="white", ms=4, mec=COLOURS[0])
    if row["default"] is not None:
        axes.plot(row["default"], 0, "d", color=COLOURS[1], ms=6, zorder=4)
    axes.axvline(row["paper"], label="paper", zorder=3, **REFERENCES["paper"])
    near, unit = row["sense"] == "near", str(row["unit"])
    said = with_unit(number(row["paper"]), unit)
    axes.annotate(
        f"paper {said if near else str(row['sense']) + ' ' + said}", (1.02, 0.5),
        xycoords="axes fraction", va="center", fontsize=LABEL_PT, color=ink("#000000"),
    )  # fmt: skip
    axes.set(yticks=[0], yticklabels=[str(row["row"])], ylim=(-1, 1))
    axes.tick_params(axis="y", length=0)
    axes.margins(x=0.04)


def rows_caption(table: Table) -> Caption:
    """Return the caption of `rows_figure`."""
    return Caption(
        "Each row of the paper as the drawn grippers give it: how far all draws reach, the middle"
        " 80 and 40 % and the median, and where the paper's figure lies. Each row is a reduced"
        " version with fewer grasps.",
        f"{rows_finding(table)}. One strip of deciles a row, each in its own unit, with the paper's"
        " figure as an upright line.",
    )


def sensitivity_finding(table: Table) -> str:
    """Return which parameter moves most rows."""
    settings = [str(one) for one in table.column("setting")]
    most = max(dict.fromkeys(settings), key=settings.count)
    rows = len(table.parted("row"))
    return f"{most} moves {settings.count(most)} of {rows} rows for which a parameter can be told"


def sensitivity_figure(table: Table) -> Figure:
    """Return the total index of each parameter that is told, by row."""
    rows = list(table.parted("row"))
    settings = sorted({str(one) for one in table.column("setting")})
    about = "share of the row's variance that an emulator lays to it, alone and with others"
    size = (WIDTH_IN, 1.6 + 0.22 * len(settings))
    figure = new_figure(size, sensitivity_finding(table), about, ["simulated"])
    axes = figure.subplots()
    for one in table.rows:
        x, y = rows.index(one["row"]), settings.index(str(one["setting"]))
        share = float(np.clip(one["share"], 0, 1))
        axes.plot(x, y, "o", ms=3 + 13 * np.sqrt(share), color=COLOURS[0], alpha=0.75)
        axes.annotate(
            f"{100 * share:.0f} %", (x, y), (9, 0), textcoords="offset points", va="center",
            fontsize=LABEL_PT, color=ink(GREY),
        )  # fmt: skip
    axes.set_yticks(range(len(settings)), settings)
    axes.set_xticks(range(len(rows)), rows, rotation=30, ha="right")
    axes.set(xlim=(-0.5, len(rows) - 0.2), ylim=(len(settings) - 0.5, -0.5))
    return figure


def sensitivity_caption(table: Table) -> Caption:
    """Return the caption of `sensitivity_figure`."""
    return Caption(
        "Total Sobol indices of the parameters that move each row by more than chance, times what"
        " the emulator of the draws explains of the row (R²).",
        f"{sensitivity_finding(table)}. Parameters against rows, a dot for each index.",
    )


def posterior_finding(table: Table) -> str:
    """Return in which parameters the draws nearest to the paper differ from all."""
    sure = [str(row["setting"]) for row in table.rows if row["p"] < SURE]
    if not sure:
        return "The draws nearest to the paper share no parameter by more than chance"
    return f"The draws nearest to the paper differ from all in {', '.join(sure)}"


def posterior_figure(table: Table) -> Figure:
    """Return mean and spread of each parameter among the nearest draws, against all."""
    about = "mean ± standard deviation among the nearest, in standard deviations of the range"
    size = (WIDTH_IN, 1.0 + 0.24 * len(table.rows))
    figure = new_figure(size, posterior_finding(table), about, ["simulated"])
    axes = figure.subplots()
    for place, row in enumerate(table.rows):
        style = {**line_style(0 if row["p"] < SURE else 6), "ls": "none"}
        axes.errorbar(row["shift"], place, xerr=row["spread"], capsize=2, **style)
    axes.set_yticks(range(len(table.rows)), [str(one) for one in table.column("setting")])
    axes.set(xlabel="shift (standard deviations of the range)", ylim=(len(table.rows) - 0.5, -1))
    reference_line(axes, "ideal", 0.0, "all draws", axis="x")
    return figure


def posterior_caption(table: Table) -> Caption:
    """Return the caption of `posterior_figure`."""
    return Caption(
        "How the draws that are nearest to the paper in all rows at once differ from all draws, by"
        " parameter: what the paper would say of it, within this simulation. Blue: more than"
        " chance, of as many parameters as were looked at.",
        f"{posterior_finding(table)}. Shift and spread by parameter.",
    )


DRAWS = (
    TableFigure("draws_rows", "draws_rows", rows_caption, rows_figure),
    TableFigure("draws_sensitivity", "draws_sensitivity", sensitivity_caption, sensitivity_figure),
    TableFigure("draws_posterior", "draws_posterior", posterior_caption, posterior_figure),
)
