"""k-NN on embeddings, drawn: against the dimension of the space, and against time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator

from ajgdata.experiments.base import (
    TaskResults,
)
from ajgdata.experiments.embedding import (
    look,
    space_name,
)
from ajgdata.experiments.embedding_knn import (
    Neighbours,
    accuracy_range,
    at_shown,
    dimensions_of,
    neighbours_of,
)
from ajgdata.report.canvas import GREY, WIDTH_IN, new_figure, pareto_front
from ajgdata.report.format import Caption, mean_sd, number
from ajgdata.report.labels import REFERENCES, label_end, reference_line
from ajgdata.report.projections import ordered

SHORTEST = 1e-4


def finding(results: TaskResults) -> str:
    """Return what k-NN reaches on the latent and on raw features, or in all spaces if one of these
    is missing."""
    latent, raw = at_shown(results, "latent"), at_shown(results, "raw")
    chance = f"(chance {number(100 * results.results[0].about['chance'])} %)"
    if latent is None or raw is None:
        spaces = ordered(list(dict.fromkeys(row.space for row in neighbours_of(results))))
        listed = ", ".join(f"{accuracy_range(results, s)} on {space_name(s)}" for s in spaces)
        return f"k-NN reaches {listed} {chance}"
    return (
        f"k-NN reaches {_percent(latent)} on a latent of {latent.dimension} dimensions, "
        f"{_percent(raw)} on raw features {chance}"
    )


def _percent(row: Neighbours) -> str:
    return mean_sd(row.score, "%", 100)


def figure(results: TaskResults) -> Figure:
    """Return the accuracy of k-NN against the dimension, and against the time of one fold."""

    rows = neighbours_of(results)
    drawn = new_figure(
        (WIDTH_IN, 3.9),
        finding(results),
        f"{results.title}: validation accuracy, mean ± sd over folds and initialisations; grey "
        "line: beaten by nothing in both accuracy and time",
        [results.source],
    )
    left, right = drawn.subplots(1, 2, sharey=True)
    for space in ordered([row.space for row in rows]):
        _against_dimension(left, neighbours_of(results, space))
        _against_time(right, neighbours_of(results, space), results.settings.shown)
    _front(right, rows)
    chance = 100 * results.results[0].about["chance"]
    reference_line(left, "chance", chance, "chance")
    right.axhline(chance, label="chance", **REFERENCES["chance"])
    for axes in (left, right):
        axes.set_xscale("log")
        axes.margins(x=0.1)
        axes.set_ylim(bottom=0)
        axes.xaxis.set_minor_formatter(NullFormatter())
    dimensions = dimensions_of(rows)
    left.set_xticks(dimensions, map(str, dimensions))
    left.xaxis.set_minor_locator(NullLocator())
    left.set(xlabel="dimension", ylabel="accuracy (%)")
    right.xaxis.set_major_formatter(FuncFormatter(lambda s, _: number(s)))
    right.set_xlabel("s of one fold: space, points, k-NN")
    return drawn


def _against_dimension(axes: Axes, rows: list[Neighbours]) -> None:
    """Draw a line with error bars, named at its end; what has no dimension is a band."""
    style, label = look(rows[0].space), space_name(rows[0].space)
    mean = [100 * row.score.mean for row in rows]
    sd = [100 * np.nan_to_num(row.score.sd) for row in rows]
    if rows[0].dimension is None:
        axes.axhspan(mean[0] - sd[0], mean[0] + sd[0], color=style["color"], alpha=0.12, lw=0)
        axes.axhline(mean[0], color=style["color"], lw=1.2, ls=(0, (5, 3)), label=label)
        label_end(axes, None, mean[0], label, style["color"])
        return
    dimension = [row.dimension or 0 for row in rows]
    axes.errorbar(dimension, mean, sd, ms=4.5, capsize=2.5, label=label, **style)
    label_end(axes, dimension[-1], mean[-1], label, style["color"])


def _against_time(axes: Axes, rows: list[Neighbours], shown: int) -> None:
    """Draw a marker for each dimension; that of the settings, or else the last, is named."""
    style = look(rows[0].space)
    named = next((row for row in rows if row.dimension in (None, shown)), rows[-1])
    for row in rows:
        place = max(row.seconds, SHORTEST), 100 * row.score.mean
        sd = 100 * np.nan_to_num(row.score.sd)
        axes.errorbar(*place, sd, ms=4.5, elinewidth=0.8, capsize=0, **style)
        if row is named:
            name = space_name(row.space) + (f", {row.dimension}-D" if row.dimension else "")
            label_end(axes, *place, name, style["color"])


def _front(axes: Axes, rows: Sequence[Neighbours]) -> None:
    """Draw a line through what nothing else beats in both accuracy and time."""
    seconds = np.array([max(row.seconds, SHORTEST) for row in rows])
    accuracy = np.array([100 * row.score.mean for row in rows])
    best = np.flatnonzero(pareto_front(seconds, -accuracy))
    best = best[np.lexsort((accuracy[best], seconds[best]))]
    axes.plot(seconds[best], accuracy[best], color=GREY, lw=1, zorder=1, label="Pareto front")


def gain_text(results: TaskResults) -> str:
    """Return by how much the latent is better than raw features, or nothing."""
    latent, raw = at_shown(results, "latent"), at_shown(results, "raw")
    if latent is None or raw is None:
        return ""
    points = 100 * (latent.score.mean - raw.score.mean)
    relative = points / raw.score.mean if raw.score.mean > 0 else float("nan")
    sense = "higher" if points >= 0 else "lower"
    return (
        f"k-NN on the latent reaches {mean_sd(latent.score, '%', 100)} at {latent.dimension} "
        f"dimensions, on raw features {mean_sd(raw.score, '%', 100)}: {number(abs(points))} "
        f"percentage points, or {number(abs(relative))} %, {sense}"
    )


def caption(results: TaskResults) -> Caption:
    """Return the caption of `figure`."""
    listed = "; ".join(
        f"{space_name(space)}: "
        + ", ".join(
            (f"{row.dimension}: " if row.dimension else "") + mean_sd(row.score, "%", 100)
            for row in neighbours_of(results, space)
        )
        for space in ordered([row.space for row in neighbours_of(results)])
    )
    return Caption(
        f"{gain_text(results)}. Settings fix this dimension beforehand; which dimension is best is "
        f"exploratory ({accuracy_range(results, 'latent')} over all). Left: against the "
        "dimension of the space; dashed with its band: raw features. Right: against the time of "
        "one fold, each space named at the same dimension; grey: what nothing else beats. PCA "
        "and UMAP "
        "learn from training points alone, and nothing of what they are of; the latent was told "
        "which of them are alike. The time of a latent is its share of a training of all "
        "dimensions together. The times belong to the machine that made this page.",
        f"{finding(results)}. Accuracy by space and dimension: {listed}.",
    )
