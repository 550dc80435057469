"""Granulate: energy that returns through each medium, relative to the empty gripper."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial

from matplotlib.figure import Figure

from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.reflected_energy import by_class
from ajgdata.pages.selection import alternative, first_on, paper_sentence, published
from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, new_figure
from ajgdata.report.comparison import PaperFigure
from ajgdata.report.format import Caption, Score, mean_sd, number, sentence, words
from ajgdata.report.report_data import Illustration
from ajgdata.types.table import Table, table_of

PAGE = "media"
#: Medium of the published value: "coffee loses more than 80 %".
PUBLISHED_MEDIUM = "coffee"
COLUMNS = {
    "medium": "Medium",
    "energy": "Energy relative to the empty gripper, %",
    "low": "Low end of the 95 % interval, %",
    "high": "High end of the 95 % interval, %",
    "loss": "Loss, %",
}


def figures(results: Sequence[TaskResults]) -> Iterator[Illustration]:
    """Yield the energy of each medium, if it was measured."""
    task = first_on(results, PAGE, "reflected_energy")
    if task is None or not energies_of(task):
        return
    table = energy_table(task)
    title = conclusion(table, task.paper)
    text = (
        f"{task.dataset_title}, {task.source}. Bars: energy of the recordings, in per cent of the"
        f" energy with the reference {words(task.settings.reference)}, with its 95 % interval over"
        f" grasps. {paper_sentence([task.paper])}"
    )
    listed = [f"{name}: {mean_sd(score, '%')}" for name, score in energies_of(task).items()]
    yield Illustration(
        f"{task.dataset}--energy-by-medium",
        Caption(text, alternative(title, listed)),
        partial(draw_figure, task, title),
        title,
        table,
        replaces=(task.named(),),
    )


def energies_of(task: TaskResults) -> dict[str, Score]:
    """Return the energy of each medium but the reference in per cent, the highest first.

    The interval is unknown if a medium has too few grasps.
    """
    table = by_class(task)
    values, lows, highs = (100 * table.numbers(key) for key in ("value", "low", "high"))
    return {
        words(label): Score(float(value), math.nan, (), float(low), float(high))
        for label, value, low, high in zip(table.column("label"), values, lows, highs, strict=True)
    }


def energy_table(task: TaskResults) -> Table:
    """Return the energy and the loss of each medium but the reference in per cent."""
    rows = [
        {
            "medium": name,
            "energy": score.mean,
            "low": score.low,
            "high": score.high,
            "loss": 100 - score.mean,
        }
        for name, score in energies_of(task).items()
    ]
    return table_of("energy-by-medium", "Energy by medium", rows, **COLUMNS)


def conclusion(table: Table, paper: PaperFigure | None) -> str:
    """Return the loss of each medium, the largest first, and the published value."""
    losses = [f"{row['medium']} {number(row['loss'], 2)} %" for row in reversed(table.rows)]
    text = f"Energy lost: {', '.join(losses)}"
    return f"{text} (published: {published(paper)})" if paper else text


def published_limit(paper: PaperFigure | None) -> float | None:
    """Return the energy (%) below which the paper's medium is; None without a number.

    The paper reports the loss: a loss of more than 80 % is an energy below 20 %.
    """
    if paper is None or paper.value is None:
        return None
    return 100 - paper.value


def draw_figure(task: TaskResults, title: str) -> Figure:
    """Draw a bar for each medium, with the published limit in the row of its medium."""
    reference = words(task.settings.reference)
    energies = energies_of(task)
    media = [reference, *energies]
    limit = published_limit(task.paper)
    figure = new_figure(
        (WIDTH_IN, 1.3 + 0.42 * len(media)), title, task.dataset_title, [task.source]
    )
    axes = figure.subplots()
    axes.barh([0], [100], height=0.55, color="#d0d0d0")
    axes.text(99, 0, "reference: 100 %", ha="right", va="center", fontsize=8)
    for place, (name, score) in enumerate(energies.items(), start=1):
        axes.barh([place], [score.mean], height=0.55, color=COLOURS[0])
        axes.errorbar([score.mean], [place], xerr=score.bars(), color="black", capsize=2.5, lw=1.0)
        label_at = score.high if score.has_interval else score.mean
        axes.text(label_at + 1.5, place, mean_sd(score, "%"), va="center", fontsize=8)
        if name == PUBLISHED_MEDIUM and limit is not None:
            below = place + 0.42
            axes.plot([0, limit], [below, below], color=COLOURS[1], lw=2.0, marker="|", ms=7)
            note = f"published: below {number(limit)} %"
            axes.text(limit + 1.5, below, note, color=COLOURS[1], va="center", fontsize=8)
    axes.set_yticks(range(len(media)), [sentence(name) for name in media])
    axes.set_ylim(len(media) - 0.3, -0.5)
    axes.set(xlim=(0, 102), xlabel=f"energy relative to {reference} (%)")
    axes.grid(False, axis="y")
    axes.axvline(0, color=GREY, lw=0.8)
    return figure
