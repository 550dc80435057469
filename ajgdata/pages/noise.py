"""Cube size in noise: error of each model against the noise level, trained in quiet."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

from ajgdata.evaluate.parts import GROUPED, elsewhere
from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation_results import ModelResult, models_of
from ajgdata.report.comparison import PaperFigure
from ajgdata.report.format import Caption, Score, mean_sd, number, with_unit
from ajgdata.report.report_data import Illustration
from ajgdata.types import CROSS_VALIDATION
from ajgdata.types.table import Table, table_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE = "noise"
REPEATED_FITS = "repeated_fits"


def figures(results: Sequence[TaskResults]) -> Iterator[Illustration]:
    """Yield the error against the noise level, if models of the page were tested at two levels."""
    results = [task for task in results if task.page == PAGE]
    models = [model for task in results for model in models_in_noise(task)]
    if not models:
        return
    first = models[0].task
    models = [model for model in models if model.task.shown_unit == first.shown_unit]
    finding = conclusion(models[0])
    listed = "; ".join(
        f"{model.label} at {number(level)} {unit_of(first)}: {mean_sd(score, first.shown_unit)}"
        for model in models
        for level, score in scores(model).items()
    )
    text = (
        f"{first.dataset_title}, {first.source}. {trained(first)}. Lines: {first.metric_title} on "
        f"held-out grasps with its 95 % interval over grasps, of one cross-validation. "
        f"{repeated_fits_sentence(results)}{paper_sentence(results)}"
    )
    yield Illustration(
        f"{first.dataset}--against-noise",
        Caption(text, f"{finding}. {listed}."),
        partial(draw_figure, models, finding, published_values(results)),
        finding,
        score_table(models),
    )


def score_table(models: Sequence[ModelResult]) -> Table:
    """Return the values of the figure: a row for each model and noise level."""
    first = models[0].task
    unit = first.shown_unit
    rows = [
        {
            "model": model.label,
            "level": level,
            "value": score.mean,
            "sd": score.sd,
            "low": score.low,
            "high": score.high,
        }
        for model in models
        for level, score in scores(model).items()
    ]
    columns = {
        "model": "Model",
        "level": f"Noise level, {unit_of(first)}",
        "value": f"{first.metric_title}, {unit}",
        "sd": f"Standard deviation over folds, {unit}",
        "low": f"Low end of the 95 % interval, {unit}",
        "high": f"High end of the 95 % interval, {unit}",
    }
    return table_of(
        "against-noise", f"{first.metric_title} against the noise level", rows, **columns
    )


def repeated_fits_sentence(results: Sequence[TaskResults]) -> str:
    """Return why the error of repeated fits differs; empty if models were fitted once."""
    if not any(task.experiment == REPEATED_FITS for task in results):
        return ""
    return (
        "Other initial weights change the error in noise. The section “Repeated fits” shows the "
        "median of several fits, which is compared with the paper. "
    )


def models_in_noise(task: TaskResults) -> list[ModelResult]:
    """Return the models of a task that were tested at two noise levels or more."""
    if task.experiment != CROSS_VALIDATION or task.level is None:
        return []
    return [model for model in models_of(task) if len(scores(model)) > 1]


def trained(task: TaskResults) -> str:
    """Return the level at which the models of a task are trained, as a sentence without a stop."""
    level = levels(task)[GROUPED]
    return f"Models are trained at {number(level)} {unit_of(task)}"


def levels(task: TaskResults) -> Mapping[str, float]:
    """Return the noise level of each part of a task whose level is known, the lowest first.

    Of several parts at one level, the first is used, which is that of the training data.
    """
    parts = {GROUPED: task.level}
    parts |= {elsewhere(name): other.level for name, other in task.other_sets.items()}
    known: dict[float, str] = {}
    for part, level in parts.items():
        if level is not None:
            known.setdefault(level.value, part)
    return {known[level]: level for level in sorted(known)}


def unit_of(task: TaskResults) -> str:
    """Return the unit of noise levels for people."""
    return "dB(A)" if task.level is not None and task.level.unit == "dBA" else "dB"


def scores(model: ModelResult) -> Mapping[float, Score]:
    """Return the values of a model with their intervals, as shown, by noise level."""
    scale = model.task.scale
    errors = {}
    for part, level in levels(model.task).items():
        if model.has(part):
            score = model.with_interval(part)
            errors[level] = Score(
                scale * score.mean, scale * score.sd, (), scale * score.low, scale * score.high
            )
    return errors


def conclusion(model: ModelResult) -> str:
    """Return the value of a model at the lowest and at the highest level, with chance."""
    unit = model.task.shown_unit
    by_level = scores(model)
    ends = ", ".join(
        f"{with_unit(number(by_level[level].mean), unit)} at {number(level)} {unit_of(model.task)}"
        for level in (min(by_level), max(by_level))
    )
    chance = with_unit(number(model.task.scale * model.chance()), unit)
    return f"{model.label}: {model.task.metric_title} {ends} (chance {chance})"


def published_values(results: Sequence[TaskResults]) -> tuple[float, ...]:
    """Return noise level and error of the published value, one after the other; empty without."""
    for task in results:
        paper = paper_of(task)
        if paper is not None and paper.value is not None:
            level = task.other_sets[task.settings.test_on[0]].level
            if level is not None:
                return (level.value, float(paper.value))
    return ()


def paper_of(task: TaskResults) -> PaperFigure | None:
    """Return the published error in noise, which is compared with repeated fits."""
    return task.paper if task.experiment == REPEATED_FITS else None


def paper_sentence(results: Sequence[TaskResults]) -> str:
    """Return the published value as a sentence; empty without."""
    papers = [paper for paper in map(paper_of, results) if paper is not None]
    return f"The paper, on its real gripper: {papers[0].text}." if papers else ""


def draw_figure(models: Sequence[ModelResult], title: str, published: tuple[float, ...]) -> Figure:
    """Draw a line per model over the noise level."""
    from ajgdata.report.marks import Picture, Point, draw

    task = models[0].task
    points = [
        Point("", model.label, level, score)
        for model in models
        for level, score in scores(model).items()
    ]
    picture = Picture(
        title=title,
        subtitle=f"{task.dataset_title}. {trained(task)}",
        sources=(task.source,),
        points=tuple(points),
        axis=(task.metric_title, task.shown_unit),
        place=("noise level", unit_of(task)),
        chance=(("", task.scale * models[0].chance()),),
        published=published,
        limits=(0.0, float("inf")),
    )
    return draw("lines", picture)
