"""Bar angle: predicted against true angle, with the mirror image of the bar.

The transducers of the default gripper are almost symmetric about a plane. An angle and its mirror
image then give almost the same sound, and a model cannot distinguish them. The stored predictions
show this: their error is small if the nearer of angle and mirror image counts.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.evaluate.fold_tests import SIGNIFICANCE_LEVEL, holm
from ajgdata.evaluate.mirror import (
    HALF_TURN_DEG,
    MirrorErrors,
    mirror_errors,
    mirror_image,
    mirror_p,
)
from ajgdata.evaluate.parts import GROUPED, RANDOM, WITHHELD
from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation_paper import split_name
from ajgdata.experiments.cross_validation_results import (
    TASK_PARTS,
    ModelResult,
    models_of,
    shown_model,
)
from ajgdata.pages.selection import paper_sentence
from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, new_figure
from ajgdata.report.comparison import Change, PaperFigure, Reason
from ajgdata.report.format import Caption, number, sentence
from ajgdata.report.navigation import experiment_link
from ajgdata.report.report_data import Illustration
from ajgdata.types import CROSS_VALIDATION
from ajgdata.types.table import Table, table_of

PAGE = "orientation"
CLAIM = "an angle and its mirror image give the same sound"
CHANGE = "error to the nearer of angle and mirror image"
PANEL_IN = 2.9


@dataclass(frozen=True)
class MirrorResult:
    """A model on a part of a task: its errors, and p of the mirror image, corrected (Holm)."""

    model: ModelResult
    part: str
    errors: MirrorErrors
    p: float

    @property
    def is_supported(self) -> bool:
        """Return whether the predictions confuse an angle with its mirror image."""
        return self.p < SIGNIFICANCE_LEVEL


def figures(results: Sequence[TaskResults]) -> Iterator[Illustration]:
    """Yield the predicted against the true angle of the first task with a published value."""
    tasks = compared_tasks(results)
    if not tasks:
        return
    task = tasks[0]
    measured = mirror_results(task)
    finding = conclusion(measured)
    table = error_table(measured)
    listed = "; ".join(
        f"{row['model']}, {row['part']}: RMSE {number(float(row['error']))}°, "
        f"{number(float(row['nearer_error']))}° to the nearer angle"
        for row in table.rows
    )
    text = (
        f"{task.dataset_title}, {task.source}. Marks: predictions on held-out grasps; blue: angles "
        f"that are withheld from training. Lines: the true angle (solid), and its mirror image at "
        f"the plane of the transducers, {number(float(task.mirror_deg or 0))}° (dashed). "
        f"{paper_sentence([*papers_of(task).values()])}"
    )
    yield Illustration(
        f"{task.dataset}--mirror-image",
        Caption(text, f"{finding}. {listed}."),
        partial(draw_figure, task, finding),
        finding,
        table,
        replaces=(task.named("predictions"),),
    )


def causes(results: Sequence[TaskResults]) -> Iterator[Reason]:
    """Yield the mirror image as a cause of the error, for each published error of an angle.

    A model supports the cause if its predictions are nearer to the angle or its mirror image than
    predictions that are exchanged between angles.
    """
    for task in compared_tasks(results):
        measured = mirror_results(task)
        for part, paper in papers_of(task).items():
            own = [result for result in measured if result.part == part]
            tests = tuple(
                Change(
                    CHANGE,
                    result.model.label,
                    result.errors.error,
                    result.errors.nearer_error,
                    result.is_supported,
                )
                for result in own
            )
            if tests:
                link = f"{experiment_link(task.page)}#{task.dataset}--mirror-image"
                yield Reason((paper.id,), CLAIM, link, tests, split_name(own[0].model, part))


def compared_tasks(results: Sequence[TaskResults]) -> list[TaskResults]:
    """Return the tasks of the page whose gripper has a mirror plane and that the paper has too."""
    return [
        task
        for task in results
        if task.page == PAGE
        and task.experiment == CROSS_VALIDATION
        and task.mirror_deg is not None
        and papers_of(task)
    ]


def papers_of(task: TaskResults) -> dict[str, PaperFigure]:
    """Return the published values of a task by part."""
    keys = {part: TASK_PARTS[part][0] for part in (GROUPED, RANDOM, WITHHELD)}
    return {part: task.papers[key] for part, key in keys.items() if key in task.papers}


@cache
def mirror_results(task: TaskResults) -> tuple[MirrorResult, ...]:
    """Return the errors of all models on all parts, with p corrected for all tests of the task.

    The figure and the causes need them, and the permutations of all models take seconds.
    """
    if task.mirror_deg is None:
        return ()
    tested = [
        (model, part) for part in papers_of(task) for model in models_of(task) if model.has(part)
    ]
    period_deg = task.task_settings.period_deg
    inputs = [(*model.mirror_inputs(part), task.mirror_deg, period_deg) for model, part in tested]
    corrected = holm([mirror_p(*values) for values in inputs])
    return tuple(
        MirrorResult(model, part, mirror_errors(*values), p)
        for (model, part), values, p in zip(tested, inputs, corrected, strict=True)
    )


def conclusion(measured: Sequence[MirrorResult]) -> str:
    """Return the cause with the model that shows it best; without support, errors only."""
    supported = [result for result in measured if result.is_supported]
    withheld = [result for result in supported if result.part == WITHHELD] or supported
    if not withheld:
        first = measured[0]
        return (
            f"{first.model.label}: RMSE {number(first.errors.error)}°, "
            f"{number(first.errors.nearer_error)}° to the nearer of angle and mirror image"
        )
    best = min(withheld, key=lambda result: result.errors.nearer_error)
    error = number(best.errors.error)
    nearer_error = number(best.errors.nearer_error)
    errors = f"{best.model.label} {error}°, to the nearer angle {nearer_error}°"
    return f"{sentence(CLAIM)} ({errors})"


def error_table(measured: Sequence[MirrorResult]) -> Table:
    """Return a row for each model and part."""
    rows = [
        {
            "model": result.model.label,
            "part": part_name(result.part),
            **result.errors._asdict(),
            "p_holm": result.p,
        }
        for result in measured
    ]
    return table_of(
        "mirror-image",
        "Errors to an angle and to its mirror image",
        rows,
        model="Model",
        part="Angles",
        error="RMSE, °",
        nearer_error="RMSE to the nearer of angle and mirror image, °",
        share="Share of predictions nearer to the mirror image",
        p_holm="p of exchanged predictions with the correction of Holm",
    )


def part_name(part: str) -> str:
    """Return the tested angles of a part and its split, for people."""
    names = {
        GROUPED: "training angles, grouped split",
        RANDOM: "training angles, random split",
        WITHHELD: "withheld angles",
    }
    return names[part]


def draw_figure(task: TaskResults, title: str) -> Figure:
    """Draw a panel per model, the model of the paper first."""
    first = shown_model(task)
    models = [first, *(m for m in models_of(task) if m.result.model != first.result.model)]
    figure = new_figure((WIDTH_IN, PANEL_IN), title, task.dataset_title, (task.source,))
    panels = figure.subplots(1, len(models), sharex=True, sharey=True, squeeze=False)[0]
    for axes, model in zip(panels, models, strict=True):
        draw_panel(axes, model, float(task.mirror_deg or 0))
    panels[0].set_ylabel("predicted angle, °")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def draw_panel(axes: Axes, model: ModelResult, plane_deg: float) -> None:
    """Draw the predictions of a model over the true angle, with the angle and its mirror image."""
    looks = {
        GROUPED: ("training angles", GREY, "x"),
        WITHHELD: ("withheld angles", COLOURS[0], "o"),
    }
    for part, (label, colour, marker) in looks.items():
        if model.has(part):
            true, predicted, _ = model.mirror_inputs(part)
            axes.plot(true, predicted, marker, color=colour, ms=3, alpha=0.3, label=label)
    angle = np.linspace(0.0, HALF_TURN_DEG, 721)
    image = mirror_image(angle, plane_deg)
    image[1:][np.abs(np.diff(image)) > HALF_TURN_DEG / 2] = np.nan  # no line from 0 to 180°
    axes.plot(angle, angle, "-", color=COLOURS[1], lw=1, label="true angle")
    axes.plot(angle, image, "--", color=COLOURS[1], lw=1, label="mirror image")
    axes.set(title=model.label, xlabel="true angle, °", xlim=(-5, 185), ylim=(-5, 185))
    axes.set_xticks(range(0, 181, 45))
    axes.set_yticks(range(0, 181, 45))
