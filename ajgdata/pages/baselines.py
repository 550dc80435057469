"""Model comparison of the paper: accuracy and training time of each model, sorted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import chain

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation_results import SHORTEST_S, ModelResult, models_of
from ajgdata.pages.models import figures as cost_figures
from ajgdata.pages.selection import alternative, first_on, paper_sentence, shown_value
from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, new_figure, plain_ticks
from ajgdata.report.comparison import PaperFigure
from ajgdata.report.format import Caption, column_title, mean_sd, number
from ajgdata.report.report_data import Illustration
from ajgdata.types import CROSS_VALIDATION
from ajgdata.types.registry import BASELINE, PAPER_MODEL
from ajgdata.types.table import Table, table_of

PAGE = "baselines"
#: Published result of each of the paper's models that has a number, by the name of the model.
PUBLISHED_RESULTS = {PAPER_MODEL: "ycb", BASELINE: "baselines"}
ROW_IN = 0.3
TIME_TICKS_S = (0.001, 0.01, 0.1, 1, 10, 100, 1000)


def figures(results: Sequence[TaskResults]) -> Iterator[Illustration]:
    """Yield accuracy and training time of the paper's comparison, then all tasks."""
    task = first_on(results, PAGE, CROSS_VALIDATION)
    if task is not None and task.task_settings.kind == "classification":
        yield accuracy_figure(task, published_accuracies(results))
    yield from cost_figures(results)


def accuracy_figure(task: TaskResults, known: Mapping[str, PaperFigure]) -> Illustration:
    """Return accuracy and training time of each model of a task.

    Args:
        task: Results of the models.
        known: Published accuracy by the name of the model.
    """
    ranked = by_accuracy(task)
    table = accuracy_table(ranked, known)
    title = conclusion(ranked, known)
    text = (
        f"{task.dataset_title}, {task.source}. Left: accuracy on held-out grasps with its 95 %"
        " interval over grasps; diamonds: published values. Right: CPU time to train all folds."
        f" {paper_sentence([*known.values()])}"
    )
    listed = []
    for model in ranked:
        accuracy = mean_sd(model.with_interval(), task.shown_unit, task.scale)
        paper = known.get(model.result.model)
        shown = f", published {paper.value} %" if paper else ""
        seconds = number(model.cost.train_cpu_s)
        listed.append(f"{model.label}: {accuracy}{shown}, trained in {seconds} s")
    return Illustration(
        f"{task.dataset}--models-by-accuracy",
        Caption(text, alternative(title, listed)),
        partial(draw_figure, ranked, known, title),
        title,
        table,
    )


def published_accuracies(results: Sequence[TaskResults]) -> dict[str, PaperFigure]:
    """Return the published accuracy of the paper's models that have a number, by model."""
    papers = chain.from_iterable(task.papers.values() for task in results)
    by_id = {paper.id: paper for paper in papers if paper.value is not None}
    return {model: by_id[id_] for model, id_ in PUBLISHED_RESULTS.items() if id_ in by_id}


def by_accuracy(task: TaskResults) -> list[ModelResult]:
    """Return the models of a task, the most accurate first."""
    return sorted(models_of(task), key=lambda model: -model.score().mean)


def accuracy_table(ranked: Sequence[ModelResult], known: Mapping[str, PaperFigure]) -> Table:
    """Return accuracy, interval, published accuracy and training time of each model."""
    task = ranked[0].task
    rows = []
    for model in ranked:
        score = model.with_interval()
        paper = known.get(model.result.model)
        rows.append(
            {
                "model": model.label,
                "accuracy": task.scale * score.mean,
                "low": task.scale * score.low,
                "high": task.scale * score.high,
                "published": paper.value if paper else None,
                "train_cpu_s": model.cost.train_cpu_s,
            }
        )
    unit = task.shown_unit
    columns = {
        "model": "Model",
        "accuracy": column_title("Accuracy", unit),
        "low": column_title("Low end of the 95 % interval", unit),
        "high": column_title("High end of the 95 % interval", unit),
        "published": column_title("Published accuracy", unit),
        "train_cpu_s": "CPU time to train all folds, s",
    }
    return table_of("models-by-accuracy", "Models by accuracy", rows, **columns)


def conclusion(ranked: Sequence[ModelResult], known: Mapping[str, PaperFigure]) -> str:
    """Return the accuracy of the best model and of the published ones, with their numbers."""
    task = ranked[0].task
    best = ranked[0]
    listed = [best, *(m for m in ranked if m is not best and m.result.model in known)]
    texts = []
    for model in listed:
        paper = known.get(model.result.model)
        shown = f" (published {number(paper.value)} %)" if paper and paper.value else ""
        texts.append(f"{model.label} {shown_value(task, model.score().mean)}{shown}")
    return f"Best of {len(ranked)}: {', '.join(texts)}"


def draw_figure(
    ranked: Sequence[ModelResult], known: Mapping[str, PaperFigure], title: str
) -> Figure:
    """Draw accuracy (left) and training time (right), one row for each model."""
    task = ranked[0].task
    size_in = (WIDTH_IN, 1.3 + ROW_IN * len(ranked))
    figure = new_figure(size_in, title, task.dataset_title, [task.source])
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1.5, 1))
    _draw_accuracies(left, ranked, known)
    _draw_times(right, ranked)
    left.set_yticks(range(len(ranked)), [model.label for model in ranked])
    left.set_ylim(len(ranked) - 0.4, -0.6)
    return figure


def _draw_accuracies(
    axes: Axes, ranked: Sequence[ModelResult], known: Mapping[str, PaperFigure]
) -> None:
    """Draw accuracy and interval of each model, and the published values as diamonds."""
    task = ranked[0].task
    for row, model in enumerate(ranked):
        score = model.with_interval()
        value = task.scale * score.mean
        bars = score.bars(task.scale)
        axes.errorbar([value], [row], xerr=bars, color=COLOURS[0], marker="o", capsize=2.5)
        paper = known.get(model.result.model)
        published = paper.value if paper is not None else None
        is_published_right = published is None or published > value
        if is_published_right:
            _write(axes, value - bars[0][0], row, number(value), "black", is_right=False)
        else:
            _write(axes, value + bars[1][0], row, number(value), "black", is_right=True)
        if published is not None:
            axes.plot([published], [row], "D", color=COLOURS[1], ms=6)
            text = f"published {number(published)}"
            _write(axes, published, row, text, COLOURS[1], is_right=is_published_right)
    chance = task.scale * ranked[0].chance()
    axes.axvline(chance, color=GREY, ls=":", lw=1.0)
    axes.text(chance + 1, -0.55, "chance", color=GREY, fontsize=8, va="top")
    axes.set(xlim=(0, 118), xlabel=f"{task.metric_title} ({task.shown_unit})")
    axes.set_xticks(range(0, 101, 20))
    axes.grid(False, axis="y")


def _write(axes: Axes, x: float, y: float, text: str, colour: str, *, is_right: bool) -> None:
    """Write a label at the right or at the left of a mark."""
    axes.annotate(
        text,
        (x, y),
        (7 if is_right else -7, 0),
        textcoords="offset points",
        color=colour,
        fontsize=8,
        ha="left" if is_right else "right",
        va="center",
    )


def _draw_times(axes: Axes, ranked: Sequence[ModelResult]) -> None:
    """Draw the training time of each model on a logarithmic axis."""
    times = [max(model.cost.train_cpu_s, SHORTEST_S) for model in ranked]
    rows = range(len(ranked))
    shortest = min(times) / 2
    axes.hlines(rows, shortest, times, color="#c8c8c8", lw=1.2)
    axes.plot(times, rows, "o", color=COLOURS[2])
    for row, seconds in zip(rows, times, strict=True):
        _write(axes, seconds, row, f"{number(seconds, 2)} s", "black", is_right=True)
    axes.set(xscale="log", xlim=(shortest, 6 * max(times)))
    axes.set_xlabel("CPU time to train all folds (s)")
    plain_ticks(axes.xaxis, TIME_TICKS_S)
    axes.grid(False, axis="y")
