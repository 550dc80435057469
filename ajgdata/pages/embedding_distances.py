"""Latent distances: mean distance of each pair of categories, in the latent and in raw features."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.embedding import SPACES, score_of, scores_by
from ajgdata.experiments.embedding_distances import Claim, claims_of, finding, reason
from ajgdata.pages.selection import alternative, first_on, paper_sentence
from ajgdata.report.canvas import WIDTH_IN, new_figure
from ajgdata.report.format import Caption, Score, mean_sd, number, words
from ajgdata.report.report_data import Illustration
from ajgdata.types.table import Table, table_of

PAGE = "embedding_distances"
#: Ratios at the ends of the colours: the mean distance between two categories is 1.
LOWEST_RATIO = 0.4
HIGHEST_RATIO = 1.4
#: Ratios below this are dark: their numbers are white.
DARK_RATIO = 0.72
COLUMNS = {
    "space": "Space",
    "first": "First category",
    "second": "Second category",
    "distance": "Mean distance",
    "sd": "Standard deviation over folds and initialisations",
    "ratio": "Distance over the mean distance between two categories",
}

#: Distance by pair of categories, in both orders.
Distances = Mapping[tuple[str, str], Score]


def figures(results: Sequence[TaskResults]) -> Iterator[Illustration]:
    """Yield the matrices of distances, if an embedding was trained."""
    task = first_on(results, PAGE, "embedding_distances")
    if task is None:
        return
    spaces = distances_by_space(task)
    claims = claims_of(task) if task.paper else []
    title = conclusion(task, claims)
    why = reason(claims) if claims else ""
    text = (
        f"{task.dataset_title}, {task.source}. Mean distance of validation recordings of different"
        " grasps, with its standard deviation over folds and initialisations. Colours: distance"
        " over the mean distance between two categories, in each"
        f" space. {paper_sentence([task.paper])}{f' {why}.' if why else ''}"
    )
    listed = [
        f"{SPACES[space]}, {words(first)} to {words(second)}: {mean_sd(score)}"
        for space, distances in spaces.items()
        for (first, second), score in distances.items()
        if first <= second
    ]
    yield Illustration(
        f"{task.dataset}--{task.task}--category-distances",
        Caption(text, alternative(title, listed)),
        partial(draw_figure, task, spaces, title),
        title,
        distance_table(spaces),
        replaces=(task.named(),),
    )


def distances_by_space(task: TaskResults) -> dict[str, Distances]:
    """Return mean and standard deviation over runs of each pair of categories, by space."""
    table = task.results[0].tables["categories"]
    spaces: dict[str, dict[tuple[str, str], Score]] = {}
    for (space, first, second), score in scores_by(
        table, ("space", "first", "second"), "distance"
    ).items():
        values = np.array(score.per_fold)
        known = score_of(values[np.isfinite(values)])
        spaces.setdefault(space, {})[first, second] = known
        spaces[space][second, first] = known
    return {**spaces}


def between_mean(distances: Distances) -> float:
    """Return the mean distance between two different categories; NaN with a single category."""
    means = [score.mean for (first, second), score in distances.items() if first != second]
    return float(np.mean(means)) if means else math.nan


def distance_table(spaces: Mapping[str, Distances]) -> Table:
    """Return the distance of each pair of categories in each space."""
    rows = [
        {
            "space": SPACES[space],
            "first": words(first),
            "second": words(second),
            "distance": score.mean,
            "sd": score.sd,
            "ratio": score.mean / between_mean(distances),
        }
        for space, distances in spaces.items()
        for (first, second), score in distances.items()
        if first <= second
    ]
    return table_of("category-distances", "Distances of categories", rows, **COLUMNS)


def conclusion(task: TaskResults, claims: Sequence[Claim]) -> str:
    """Return how many statements of the paper agree, and the first that does not."""
    if not claims:
        return finding(task)
    count = sum(claim.verdict == "agrees" for claim in claims)
    text = f"{count} of {len(claims)} published statements agree"
    differing = [claim for claim in claims if claim.verdict != "agrees"]
    return f"{text}; “{differing[0].text}”: {differing[0].verdict}" if differing else text


def draw_figure(task: TaskResults, spaces: Mapping[str, Distances], title: str) -> Figure:
    """Draw a matrix of distances for each space."""
    figure = new_figure(
        (WIDTH_IN, 4.0),
        title,
        f"{task.dataset_title}: mean distance of recordings of different grasps",
        [task.source],
    )
    grid = figure.subplots(1, len(spaces), squeeze=False)[0]
    for axes, (space, distances) in zip(grid, spaces.items(), strict=True):
        dimension = f", {task.settings.shown} dimensions" if space == "latent" else ""
        axes.set_title(f"{SPACES[space]}{dimension}", fontsize=9)
        _draw_matrix(axes, distances)
    return figure


def _draw_matrix(axes: Axes, distances: Distances) -> None:
    """Draw the distances of a space, with their standard deviations as text."""
    names = list(dict.fromkeys(first for first, _ in distances))
    scale = between_mean(distances)
    ratios = np.array([[distances[a, b].mean / scale for b in names] for a in names])
    axes.imshow(ratios, cmap="Blues_r", vmin=LOWEST_RATIO, vmax=HIGHEST_RATIO, aspect="equal")
    axes.grid(False)
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    titles = [words(name) for name in names]
    axes.set_xticks(range(len(names)), titles)
    axes.set_yticks(range(len(names)), titles, rotation=90, va="center")
    for row, first in enumerate(names):
        for column, second in enumerate(names):
            score = distances[first, second]
            colour = "white" if ratios[row, column] < DARK_RATIO else "#222222"
            text = f"{number(score.mean)}\n± {number(score.sd, 2)}"
            weight = "bold" if row == column else "normal"
            axes.text(
                column,
                row,
                text,
                color=colour,
                fontsize=9,
                fontweight=weight,
                ha="center",
                va="center",
            )
