"""Figures of the ablations' tables."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, new_figure, styled
from ajgdata.report.plots import look, numbers, parted, plain_ticks
from ajgdata.types.table import Table


@styled
def grippers_figure(table: Table) -> Figure:
    """Error of the direction against how far a gripper is from its own mirror image."""
    figure = new_figure(
        (WIDTH_IN, 3.2), "Direction of the bar", "ridge, mean ± sd over folds", ["simulated"]
    )
    left, right = figure.subplots(1, 2)
    misfit = numbers(table, "misfit")
    left.errorbar(misfit, numbers(table, "rmse"), numbers(table, "sd"), fmt="o", color=COLOURS[0])
    for x, y, name in zip(misfit, numbers(table, "rmse"), table.column("gripper"), strict=True):
        left.annotate(str(name), (x, y), (4, 4), textcoords="offset points", fontsize=6.5)
    left.set(xlabel="misfit of the mirror plane (mm)", ylabel="RMSE (°)")
    left.set_ylim(bottom=0)
    left.set_xlim(0, 2 * misfit.max())
    for index, (key, label) in enumerate({"cosine": "kept", "sine": "flipped"}.items()):
        shown = {**look(index), "ls": "none"}
        right.plot(misfit, numbers(table, key), label=f"{label} by the mirror", **shown)
    right.axhline(0, color=GREY, lw=1.1, ls=":")
    right.set(xlabel="misfit of the mirror plane (mm)", ylabel="R²")
    right.set_ylim(top=1)
    right.legend(loc="lower right")
    return figure


@styled
def scatter_figure(table: Table) -> Figure:
    """How far grasps of one material and different materials lie apart, and what is told."""
    parts = parted(table, "dataset")
    figure = new_figure(
        (WIDTH_IN, 3.2),
        "Hard materials against the scatter of grasps",
        "metal, wood and plastic of one shape",
        ["simulated"],
    )
    left, right = figure.subplots(1, 2)
    for index, (name, rows) in enumerate(parts.items()):
        share = [row["share"] for row in rows]
        shown = look(index)
        left.plot(share, [row["within"] for row in rows], label=f"{name}, two grasps", **shown)
        hollow = {**shown, "mfc": "none", "ls": "--"}
        left.plot(share, [row["between"] for row in rows], label=f"{name}, materials", **hollow)
        told = [row["linear"] for row in rows]
        right.plot(share, told, label=name, **shown)
    left.set(xscale="log", yscale="log", ylabel="distance (relative L2)")
    right.axhline(1 / 3, color=GREY, lw=1.1, ls=":", label="chance")
    right.set(xscale="log", ylabel="accuracy, logistic regression", ylim=(0, 1.05))
    for axes in (left, right):
        axes.set_xlabel("share of the scatter of grasps")
        plain_ticks(axes.xaxis)
        axes.legend(loc="best")
    plain_ticks(left.yaxis)
    return figure


@styled
def levels_figure(table: Table) -> Figure:
    """Error against the level of noise, by what the model was trained on."""
    keys = [column.key for column in table.columns if column.key.startswith("rmse_")]
    levels = np.array([float(key.removeprefix("rmse_")) for key in keys])
    figure = new_figure(
        (WIDTH_IN, 3.6), "Edge length under noise", "grasps held out", ["simulated"]
    )
    axes = figure.subplots()
    for index, row in enumerate(table.rows):
        errors = [float(row[key] or 0) for key in keys]
        axes.plot(levels, errors, label=f"{row['model']}, {row['trained']}", **look(index))
    axes.set(yscale="log", xlabel="white noise outside (dB(A))", ylabel="RMSE (mm)")
    plain_ticks(axes.yaxis)
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure
