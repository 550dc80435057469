"""k-NN on the latent: accuracy against its dimension, with the value on raw features as a line."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.embedding import SPACES, scores_by
from ajgdata.pages.direct_labels import LineLabel, label_right
from ajgdata.pages.selection import alternative, first_on, paper_sentence
from ajgdata.report.canvas import GREY, WIDTH_IN, line_style, new_figure
from ajgdata.report.format import Caption, Score, mean_sd, number
from ajgdata.report.report_data import Illustration
from ajgdata.types.table import Table, table_of

PAGE = "embedding_knn"
#: Dimension of the latent at which the paper reports its gain.
PUBLISHED_DIMENSION = 8
COLUMNS = {
    "space": "Space",
    "dimension": "Dimension",
    "accuracy": "Mean accuracy, %",
    "sd": "Standard deviation over folds and initialisations, %",
}

#: Score by space and dimension; the dimension of raw features is None.
ScoresBySpace = Mapping[tuple[str, int | None], Score]


def figures(results: Sequence[TaskResults]) -> Iterator[Illustration]:
    """Yield the accuracy against the dimension, if an embedding was trained."""
    task = first_on(results, PAGE, "embedding_knn")
    if task is None:
        return
    scores = scores_by(task.results[0].tables["knn"], ("space", "dimension"), "accuracy")
    title = conclusion(task, scores)
    text = (
        f"{task.dataset_title}, {task.source}. Accuracy of k-NN on validation recordings, with its"
        " standard deviation over folds and initialisations. PCA and UMAP use no labels."
        " Star: published gain, relative to our value on raw features."
        f" {paper_sentence([task.paper])}"
    )
    listed = [
        f"{SPACES[space]}{f' with {dimension} dimensions' if dimension else ''}:"
        f" {mean_sd(score, '%', 100)}"
        for (space, dimension), score in scores.items()
    ]
    yield Illustration(
        f"{task.dataset}--{task.task}--accuracy-against-dimension",
        Caption(text, alternative(title, listed)),
        partial(draw_figure, task, scores, title),
        title,
        accuracy_table(scores),
        replaces=(task.named(),),
    )


def accuracy_table(scores: ScoresBySpace) -> Table:
    """Return the accuracy in each space by dimension."""
    rows = [
        {
            "space": SPACES[space],
            "dimension": dimension,
            "accuracy": 100 * score.mean,
            "sd": 100 * score.sd,
        }
        for (space, dimension), score in scores.items()
    ]
    return table_of("accuracy-against-dimension", "Accuracy by dimension", rows, **COLUMNS)


def published_accuracy(task: TaskResults, raw: Score) -> float | None:
    """Return the accuracy (%) that is higher than ours on raw features by the published gain."""
    if task.paper is None or task.paper.value is None:
        return None
    return 100 * raw.mean * (1 + task.paper.value / 100)


def conclusion(task: TaskResults, scores: ScoresBySpace) -> str:
    """Return the accuracy on the latent and on raw features, and both gains."""
    shown = task.settings.shown
    latent = scores["latent", shown]
    raw = scores["raw", None]
    text = (
        f"k-NN: {number(100 * latent.mean)} % with {shown} dimensions,"
        f" {number(100 * raw.mean)} % on raw features"
    )
    if task.paper is None or task.paper.value is None or not raw.mean > 0:
        return text
    gain = 100 * (latent.mean / raw.mean - 1)
    return f"{text} ({signed(gain)} %; published {signed(task.paper.value)} %)"


def signed(value: float) -> str:
    """Return a number with its sign: `+25.1` or `−3`."""
    return f"{'+' if value > 0 else '−'}{number(abs(value))}"


def draw_figure(task: TaskResults, scores: ScoresBySpace, title: str) -> Figure:
    """Draw a line for each space, the value on raw features, and the published gain."""
    figure = new_figure((WIDTH_IN, 3.8), title, task.dataset_title, [task.source])
    axes = figure.subplots()
    labels = _draw_spaces(axes, scores)
    raw = scores["raw", None]
    axes.axhline(100 * raw.mean, color="black", ls="--", lw=1.2)
    labels.append(LineLabel("raw features", 100 * raw.mean, "black"))
    chance = 100 * float(task.results[0].about["chance"])
    axes.axhline(chance, color=GREY, ls=":", lw=1.0)
    labels.append(LineLabel("chance", chance, GREY))
    known = published_accuracy(task, raw)
    if known is not None and task.paper is not None:
        axes.plot([PUBLISHED_DIMENSION], [known], "*", color="black", ms=12)
        axes.annotate(
            f"published: +{number(float(task.paper.value or 0))} % over raw features",
            (PUBLISHED_DIMENSION, known),
            (0, 26),
            textcoords="offset points",
            fontsize=8,
            ha="center",
            arrowprops={"arrowstyle": "-", "lw": 0.7},
        )
    places = sorted({dimension for _, dimension in scores if dimension is not None})
    axes.set_xscale("log", base=2)
    axes.set_xticks(places, [str(place) for place in places])
    axes.minorticks_off()
    axes.set(ylim=(0, 100), xlabel="dimension of the latent", ylabel="accuracy of k-NN (%)")
    label_right(axes, labels)
    return figure


def _draw_spaces(axes: Axes, scores: ScoresBySpace) -> list[LineLabel]:
    """Draw the line of each space with dimensions; return the labels of the lines."""
    labels = []
    spaces = dict.fromkeys(space for space, dimension in scores if dimension is not None)
    for index, name in enumerate(sorted(spaces, key=lambda space: space != "latent")):
        own = {
            dimension: score
            for (space, dimension), score in scores.items()
            if space == name and dimension is not None
        }
        places = sorted(own)
        means = np.array([100 * own[place].mean for place in places])
        deviations = np.array([100 * own[place].sd for place in places])
        style = line_style(index)
        axes.errorbar(places, means, deviations, capsize=2, elinewidth=0.7, **style)
        labels.append(LineLabel(SPACES[name], float(means[-1]), style["color"]))
    return labels
