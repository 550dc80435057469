"""Figure of the omissions: change of the feature against the time saved."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.figure import Figure

from ajgdata.report.canvas import GREY, WIDTH_IN, line_style, new_figure, power_ticks
from ajgdata.report.format import Caption, number
from ajgdata.report.report_data import Illustration
from ajgdata.studies import LEFT_OUT
from ajgdata.types.table import Table

HEIGHT_IN = 4.2
#: Place of a change of exactly zero, because a logarithmic axis has no zero.
DRAWN_ZERO = 1e-6


def omissions_figure(table: Table) -> Illustration:
    """Return the figure of the omissions, named like its table."""
    used = table.where(verdict=LEFT_OUT)
    title = "The simulation leaves nothing out"
    if used.rows:
        saved = 100 * used.numbers("saved")
        change = used.numbers("feature")
        title = (
            f"The simulation uses {len(used.rows)} of {len(table.rows)} omissions: they save up to"
            f" {number(saved.max(), 2)} % of the time and change the feature by up to"
            f" {number(change.max(), 2)}"
        )
    text = (
        "Each point is a part that is left out in a class of scenes. Filled: the simulation"
        " leaves the part out; open: the part is solved."
    )
    points = "; ".join(
        f"{row['part']}, {row['kind']}: {number(100 * float(row['saved']), 2)} %,"
        f" {number(float(row['feature']), 2)}"
        for row in used.rows
    )
    draw = partial(_draw, title, table)
    return Illustration(table.name, Caption(text, f"{title}. {points}."), draw, title)


def _draw(title: str, table: Table) -> Figure:
    figure = new_figure((WIDTH_IN, HEIGHT_IN), title, "change against time saved", ("simulated",))
    axes = figure.subplots()
    for index, (part, rows) in enumerate(table.split_by("part").items()):
        saved = 100 * rows.numbers("saved")
        change = np.maximum(rows.numbers("feature"), DRAWN_ZERO)
        is_used = np.array([verdict == LEFT_OUT for verdict in rows.column("verdict")])
        style = line_style(index) | {"ls": ""}
        axes.plot(saved[~is_used], change[~is_used], **style | {"mfc": "none"})
        axes.plot(saved[is_used], change[is_used], label=part, **style)
    axes.axvline(0, color=GREY, ls=":", lw=1.2)
    axes.set_yscale("log")
    power_ticks(axes.yaxis)
    axes.set_xlabel("time saved (%)")
    axes.set_ylabel("relative change of the feature")
    figure.legend(loc="outside lower center", ncols=3)
    return figure
