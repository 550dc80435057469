"""Live sorting: number of sorts until the first refusal, in simulated runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from ajgdata.experiments.base import Result, TaskResults
from ajgdata.experiments.plots import PERCENTILES
from ajgdata.experiments.sorting import PLAIN
from ajgdata.pages.selection import alternative, first_on, paper_sentence
from ajgdata.report.canvas import COLOURS, DASHES, WIDTH_IN, new_figure
from ajgdata.report.format import Caption, number
from ajgdata.report.report_data import Illustration
from ajgdata.types.table import Table, table_of

PAGE = "sorting"
#: Column of the runs: objects that are sorted until no class is probable enough.
SORTS = "sorts"
#: Names of the probabilities that decide: as the model gives them (`PLAIN`), and calibrated.
OWN_LABEL = "model's own probabilities"
CALIBRATED_LABEL = "calibrated probabilities"
COLUMNS = {
    "probabilities": "Probabilities",
    "sorts": "Sorts until the first refusal",
    "share": "Share of runs with at least this number",
}


def figures(results: Sequence[TaskResults]) -> Iterator[Illustration]:
    """Yield the lengths of the runs of the first model, if sorting was simulated."""
    task = first_on(results, PAGE, "sorting")
    if task is None:
        return
    result = task.results[0]
    lengths = run_lengths(result)
    title = conclusion(task, lengths)
    count = max(len(values) for values in lengths.values())
    text = (
        f"{task.dataset_title}, {task.source}, {result.label}. {count} runs with held-out"
        " recordings in random order. A run ends when no class reaches a probability of"
        f" {number(100 * task.settings.threshold)} %: the object is refused."
        f" {paper_sentence([task.paper])}"
    )
    listed = []
    for name, values in lengths.items():
        low, middle, high = map(number, np.percentile(values, PERCENTILES))
        listed.append(f"{name}: median {middle}, 90 % of runs {low} to {high}")
    yield Illustration(
        f"{task.dataset}--sorts-until-refusal",
        Caption(text, alternative(title, listed)),
        partial(draw_figure, task, lengths, title),
        title,
        length_table(lengths),
    )


def run_lengths(result: Result) -> Mapping[str, np.ndarray]:
    """Return the number of sorts of each run (n,), ascending, by kind of probabilities."""
    runs = result.tables["runs"].split_by("part")
    return {
        OWN_LABEL if part == PLAIN else CALIBRATED_LABEL: np.sort(table.numbers(SORTS))
        for part, table in runs.items()
    }


def share_of_runs(lengths: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return numbers of sorts (m,) and the share of runs (m,) that have at least this number.

    >>> share_of_runs(np.array([0.0, 2.0, 2.0, 5.0]))
    (array([0., 2., 5.]), array([1.  , 0.75, 0.25]))
    """
    counts = np.unique(lengths)
    return counts, np.array([np.mean(lengths >= count) for count in counts])


def length_table(lengths: Mapping[str, np.ndarray]) -> Table:
    """Return the share of runs with at least each number of sorts."""
    rows = [
        {"probabilities": name, "sorts": int(count), "share": share}
        for name, values in lengths.items()
        for count, share in zip(*share_of_runs(values), strict=True)
    ]
    return table_of("sorts-until-refusal", "Sorts until the first refusal", rows, **COLUMNS)


def conclusion(task: TaskResults, lengths: Mapping[str, np.ndarray]) -> str:
    """Return the median of each kind of probabilities, with the published number."""
    medians = {name: number(float(np.median(values))) for name, values in lengths.items()}
    paper = task.paper
    known = f"; published {paper.correct}" if paper and paper.correct is not None else ""
    label = task.results[0].label
    own = f" (plain {medians[OWN_LABEL]})" if OWN_LABEL in medians else ""
    shown = medians.get(CALIBRATED_LABEL, medians.get(OWN_LABEL, ""))
    return f"{label}, calibrated: median {shown} sorts until the first refusal{own}{known}"


def draw_figure(task: TaskResults, lengths: Mapping[str, np.ndarray], title: str) -> Figure:
    """Draw the share of runs over the number of sorts, with the published number."""
    figure = new_figure((WIDTH_IN, 3.4), title, task.dataset_title, [task.source])
    axes = figure.subplots()
    paper = task.paper
    known = float(paper.correct) if paper is not None and paper.correct is not None else 0.0
    longest = max([known, *(values[-1] for values in lengths.values())])
    for index, (name, values) in enumerate(lengths.items()):
        counts, share = share_of_runs(values)
        colour = COLOURS[index]
        places = np.concatenate([counts, [counts[-1]]])
        shares = 100 * np.concatenate([share, [0.0]])
        axes.step(places, shares, color=colour, ls=DASHES[index])
        middle = float(np.median(values))
        axes.plot([middle], [50], marker="o", color=colour)
        height = 50 + 9 * index
        axes.annotate(
            f"{name}: median {number(middle)}",
            (middle, 50),
            (longest * 0.3, height),
            color=colour,
            fontsize=8,
            va="center",
            arrowprops={"arrowstyle": "-", "color": colour, "lw": 0.7, "relpos": (0, 0.5)},
        )
    if known:
        axes.axvline(known, color="black", ls="--", lw=1.1)
        axes.annotate(
            f"published: {number(known)}",
            (known, 96),
            (-4, 0),
            textcoords="offset points",
            fontsize=8,
            ha="right",
            va="top",
        )
    axes.set(
        xlim=(0, 1.05 * longest),
        ylim=(0, 102),
        xlabel="sorts until the first refusal",
        ylabel="runs with at least this number (%)",
    )
    return figure
