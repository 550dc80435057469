"""Bar angle: predicted against true angle, with the line of the mirror image."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ajgdata.evaluate.metrics import wrapped
from ajgdata.evaluate.parts import GROUPED, WITHHELD
from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation_results import (
    PARTS,
    ModelResult,
    models_of,
    shown_model,
)
from ajgdata.pages.selection import alternative, first_on, paper_sentence, percent, shown_value
from ajgdata.report.format import Caption, number
from ajgdata.report.report_data import Illustration
from ajgdata.types import CROSS_VALIDATION
from ajgdata.types.table import Table, table_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ajgdata.gripper.grippers import Gripper

PAGE = "orientation"
#: A bar is the same after half a turn.
PERIOD_DEG = 180.0
#: Largest distance of a prediction from the mirror image: the step of the paper's angles.
STEP_DEG = 9.0
#: Share of predictions from which the mirror image is named in the title.
FREQUENT = 0.5
SHOWN_PARTS = {GROUPED: "training", WITHHELD: "withheld"}
PANELS_PER_ROW, PANEL_IN = 3, 2.5
COLUMNS = {
    "model": "Model",
    "values": "Values",
    "count": "Predictions",
    "rmse": "RMSE, °",
    "true_share": f"Share within {number(STEP_DEG)}° of the angle",
    "mirrored_share": f"Share within {number(STEP_DEG)}° of the mirror image only",
    "folded_rmse": "RMSE if the mirror image counts as correct, °",
}


def figures(results: Sequence[TaskResults]) -> Iterator[Illustration]:
    """Yield the predictions of each model, if angles were predicted."""
    task = first_on(results, PAGE, CROSS_VALIDATION)
    if task is None or task.unit != "°":
        return
    plane_deg = known_plane(task)
    table = mirror_table(task, plane_deg)
    title = conclusion(task, table)
    mirror = ""
    if plane_deg is not None:
        mirror = (
            f" Orange line: mirror image at the plane of {number(plane_deg)}°, which follows from"
            " the positions of the speaker and the microphone of the default gripper."
        )
    text = (
        f"{task.dataset_title}, {task.source}. Predictions of each model on held-out grasps."
        f"{mirror} {paper_sentence([*task.papers.values()])}"
    )
    yield Illustration(
        f"{task.dataset}--predicted-angles",
        Caption(text, alternative(title, [describe(row) for row in table.rows])),
        partial(draw_figure, task, plane_deg, title),
        title,
        table,
        replaces=(task.named("predictions"),),
    )


def known_plane(task: TaskResults) -> float | None:
    """Return the mirror plane of simulated recordings in degrees; None for a recorded task.

    The data set of the published value has the default gripper.
    """
    from ajgdata.gripper.grippers import Gripper

    return mirror_plane_deg(Gripper()) if task.source == "simulated" else None


def mirror_plane_deg(gripper: Gripper) -> float:
    """Return the plane that exchanges speaker and microphone, in degrees from the x axis.

    The mirror at angle a maps a place z = x + iy to exp(2ia) z*. It exchanges transducers at s and
    m, which have the same radius, if exp(2ia) has the phase of s m. By reciprocity, an object at
    the angle θ and one at 2a - θ then give the same sound (`docs/ablations.md`).
    """
    speaker = complex(*gripper.speaker_mm)
    microphone = complex(*gripper.microphone_mm)
    return math.degrees(cmath.phase(speaker * microphone)) / 2 % PERIOD_DEG


def mirror_image(angle_deg: np.ndarray, plane_deg: float) -> np.ndarray:
    """Return the mirror images (n,) of angles (n,) of a bar, from 0 to 180 degrees.

    >>> mirror_image(np.array([10.0, 170.0]), 90.0).tolist()
    [170.0, 10.0]
    """
    return (2 * plane_deg - angle_deg) % PERIOD_DEG


def mirror_table(task: TaskResults, plane_deg: float | None) -> Table:
    """Return error and share of mirrored predictions of each model and part.

    Without a mirror plane, the columns of the mirror image are empty.
    """
    rows = []
    for model in models_of(task):
        for part, name in SHOWN_PARTS.items():
            if not model.has(part):
                continue
            true, predicted = model.predictions(part)
            distance = np.abs(wrapped(predicted - true, PERIOD_DEG))
            is_true = distance <= STEP_DEG
            row = {
                "model": model.label,
                "values": name,
                "count": len(true),
                "rmse": model.score(part).mean,
                "true_share": is_true.mean(),
                "mirrored_share": np.nan,
                "folded_rmse": np.nan,
            }
            if plane_deg is not None:
                mirrored = mirror_image(true, plane_deg)
                to_mirror = np.abs(wrapped(predicted - mirrored, PERIOD_DEG))
                nearest = np.minimum(distance, to_mirror)
                row["mirrored_share"] = ((to_mirror <= STEP_DEG) & ~is_true).mean()
                row["folded_rmse"] = np.sqrt(np.mean(nearest**2))
            rows.append(row)
    return table_of("predicted-angles", "Predicted angles", rows, **COLUMNS)


def describe(row: Mapping[str, float]) -> str:
    """Return a row of the table in words."""
    text = f"{row['model']}, {row['values']} angles: RMSE {number(row['rmse'])}°"
    if row["mirrored_share"] is None:
        return text
    return (
        f"{text}, {percent(row['true_share'])} within {number(STEP_DEG)}° of the angle,"
        f" {percent(row['mirrored_share'])} within {number(STEP_DEG)}° of its mirror image only"
    )


def conclusion(task: TaskResults, table: Table) -> str:
    """Return the error of the paper's model, and the model that predicts mirror images, if any."""
    model = shown_model(task)
    withheld = table.where(values=SHOWN_PARTS[WITHHELD])
    mirrored = [row for row in withheld.rows if (row["mirrored_share"] or 0) >= FREQUENT]
    paper = task.papers.get(PARTS[WITHHELD][0])
    known = f" (published {paper.published})" if paper else ""
    if not mirrored:
        part = WITHHELD if model.has(WITHHELD) else GROUPED
        error = shown_value(task, model.score(part).mean)
        return f"{model.label}: {task.metric_title} {error} on {SHOWN_PARTS[part]} angles{known}"
    first = max(mirrored, key=lambda row: row["mirrored_share"])
    error = shown_value(task, model.score(WITHHELD).mean)
    share = percent(first["mirrored_share"])
    return (
        f"Mirror images sound alike: {first['model']} predicts {share} mirrored;"
        f" {model.label} {error}{known}"
    )


def draw_figure(task: TaskResults, plane_deg: float | None, title: str) -> Figure:
    """Draw a panel for each model."""
    from ajgdata.report.canvas import WIDTH_IN, new_figure

    models = models_of(task)
    n_columns = min(PANELS_PER_ROW, len(models))
    n_rows = math.ceil(len(models) / n_columns)
    figure = new_figure(
        (WIDTH_IN, 1.15 + PANEL_IN * n_rows), title, task.dataset_title, [task.source]
    )
    grid = figure.subplots(n_rows, n_columns, sharex=True, sharey=True, squeeze=False)
    for axes in grid.ravel()[len(models) :]:
        axes.set_visible(False)
    for axes, model in zip(grid.ravel(), models, strict=False):
        _draw_panel(axes, model, plane_deg)
    grid[0, 0].set_ylabel("predicted angle (°)")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return figure


def _draw_panel(axes: Axes, model: ModelResult, plane_deg: float | None) -> None:
    """Draw the predictions of a model with the lines of correct and of mirrored predictions."""
    from ajgdata.report.canvas import COLOURS, GREY

    ends = np.array([0.0, PERIOD_DEG])
    axes.plot(ends, ends, color=GREY, lw=1.0, label="correct")
    if plane_deg is not None:
        for turn in (-1, 0, 1):
            image = 2 * plane_deg - ends + turn * PERIOD_DEG
            label = "mirror image" if turn == 0 else None
            axes.plot(ends, image, color=COLOURS[1], lw=1.4, ls=(0, (5, 2)), label=label)
    looks: dict[str, dict[str, Any]] = {
        GROUPED: {"color": COLOURS[0], "marker": "o"},
        WITHHELD: {"color": "black", "marker": "x"},
    }
    for part, look in looks.items():
        if model.has(part):
            true, predicted = model.predictions(part)
            style: dict[str, Any] = {"ls": "", "ms": 3.5, "alpha": 0.5, "rasterized": True}
            axes.plot(true, predicted, label=f"{SHOWN_PARTS[part]} angles", **style, **look)
    is_compared = model.result.model == shown_model(model.task).result.model
    lines = [f"{model.label}, RMSE"]
    for part, name in SHOWN_PARTS.items():
        if model.has(part):
            paper = model.task.papers.get(PARTS[part][0])
            known = f" (published {paper.published})" if paper and is_compared else ""
            lines.append(f"{name}: {number(model.score(part).mean)}°{known}")
    axes.set_title("\n".join(lines), fontsize=8)
    ticks = np.arange(0, PERIOD_DEG + 1, 45)
    axes.set(xlim=(-6, 186), ylim=(-6, 186), xticks=ticks, yticks=ticks, xlabel="true angle (°)")
    axes.set_aspect("equal")
