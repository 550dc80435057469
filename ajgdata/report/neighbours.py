"""k-NN against the dimension of a space, and against run time -> a figure."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator

from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, new_figure, styled
from ajgdata.report.embedded import SPACES, Embedded, Neighbours, gain, ordered
from ajgdata.report.format import Caption, Source, mean_sd, number
from ajgdata.report.canvas import pareto_front

#: Colour and marker of a space in every figure.
LOOKS = {
    "latent": (COLOURS[0], "o"),
    "raw": (COLOURS[6], "s"),
    "pca": (COLOURS[5], "^"),
    "umap": (COLOURS[2], "D"),
    "pose_latent": (COLOURS[0], "o"),
    "gripper_latent": (COLOURS[1], "v"),
    "standardised": (COLOURS[5], "^"),
    "referenced": (COLOURS[2], "D"),
    "standardised_latent": (COLOURS[3], "P"),
    "referenced_latent": (COLOURS[4], "<"),
}
OTHER = (COLOURS[3], "X")
# A time measured as zero has no place on a log axis.
SHORTEST = 1e-4


@styled
def neighbours_figure(one: Embedded, title: str, source: Source) -> Figure:
    """Accuracy of k-NN against the dimension, and against the time of one fold."""
    subtitle = "validation accuracy of k-NN, mean ± sd over folds and initialisations"
    figure = new_figure((WIDTH_IN, 4.1), title, subtitle, [source])
    left, right = figure.subplots(1, 2, sharey=True)
    for space in ordered([row.space for row in one.neighbours]):
        _against_dimension(left, one.of_space(space))
        _against_time(right, one.of_space(space))
    _front(right, one.neighbours)
    for axes in (left, right):
        axes.axhline(100 * one.chance, color=GREY, ls=":", lw=1.1, label="chance")
        axes.set_xscale("log")
        axes.margins(x=0.1)
        axes.set_ylim(bottom=0)
        axes.xaxis.set_minor_formatter(NullFormatter())
    dimensions = sorted({row.dimension for row in one.neighbours if row.dimension})
    left.set_xticks(dimensions, map(str, dimensions))
    left.xaxis.set_minor_locator(NullLocator())
    left.set(xlabel="dimension", ylabel="accuracy (%)")
    right.xaxis.set_major_formatter(FuncFormatter(lambda s, _: number(s)))
    right.set_xlabel("time of one fold (s): space, validation points, k-NN")
    handles, labels = left.get_legend_handles_labels()
    shown = dict(zip(labels, handles, strict=True))
    figure.legend(shown.values(), shown.keys(), loc="outside lower center", ncols=len(shown))
    return figure


def _against_dimension(axes: Axes, rows: list[Neighbours]) -> None:
    """A line with error bars; what has no dimension is a band."""
    colour, marker = LOOKS.get(rows[0].space, OTHER)
    label = SPACES.get(rows[0].space, rows[0].space)
    if rows[0].dimension is None:
        mean, sd = 100 * rows[0].score.mean, 100 * np.nan_to_num(rows[0].score.sd)
        axes.axhspan(mean - sd, mean + sd, color=colour, alpha=0.12, lw=0)
        axes.axhline(mean, color=colour, lw=1.2, ls=(0, (5, 3)), label=label)
        return
    axes.errorbar(
        [row.dimension or 0 for row in rows],
        [100 * row.score.mean for row in rows],
        [100 * np.nan_to_num(row.score.sd) for row in rows],
        color=colour,
        marker=marker,
        ms=4.5,
        capsize=2.5,
        label=label,
    )


def _against_time(axes: Axes, rows: list[Neighbours]) -> None:
    """A marker for each dimension; the lowest, the highest and the best stand beside theirs."""
    best = max(rows, key=lambda row: row.score.mean)
    colour, marker = LOOKS.get(rows[0].space, OTHER)
    for row in rows:
        place = max(row.seconds, SHORTEST), 100 * row.score.mean
        axes.errorbar(
            *place, 100 * np.nan_to_num(row.score.sd), color=colour, marker=marker, ms=4.5,
            elinewidth=0.8, capsize=0,
        )  # fmt: skip
        if row.dimension is not None and row in (rows[0], rows[-1], best):
            axes.annotate(
                str(row.dimension), place, (3, 3), textcoords="offset points", fontsize=6.5,
                color=colour,
            )  # fmt: skip


def _front(axes: Axes, rows: tuple[Neighbours, ...]) -> None:
    """A line through what nothing else beats in both accuracy and time."""
    seconds = np.array([max(row.seconds, SHORTEST) for row in rows])
    accuracy = np.array([100 * row.score.mean for row in rows])
    best = np.flatnonzero(pareto_front(seconds, -accuracy))
    best = best[np.lexsort((accuracy[best], seconds[best]))]
    axes.plot(seconds[best], accuracy[best], color=GREY, lw=1, zorder=1, label="Pareto front")


def gain_text(one: Embedded) -> str:
    """`at best (8 dimensions) 61 ± 3 %, raw 47 ± 3 %: 14 points or 30 % higher`, or nothing."""
    best, raw = one.best("latent"), one.best("raw")
    if best is None or raw is None:
        return ""
    points, relative = gain(best, raw)
    sense = "higher" if points >= 0 else "lower"
    return (
        f"k-NN on the latent reaches {mean_sd(best.score, '%', 100)} at its best dimension, "
        f"{best.dimension}, on raw features {mean_sd(raw.score, '%', 100)}: "
        f"{number(abs(points))} percentage points, or {number(abs(relative))} %, {sense}"
    )


def neighbours_caption(one: Embedded) -> Caption:
    """Caption of `neighbours_figure`."""
    listed = "; ".join(
        f"{SPACES.get(space, space)}: "
        + ", ".join(
            (f"{row.dimension}: " if row.dimension else "") + mean_sd(row.score, "%", 100)
            for row in one.of_space(space)
        )
        for space in ordered([row.space for row in one.neighbours])
    )
    return Caption(
        f"{gain_text(one)}. The best of several dimensions was chosen on the points "
        "that it is scored on, which flatters it a little; the figure shows all. Left: against the "
        "dimension of the space; dashed with its band: raw features. Right: against the time of "
        "one fold, some with their dimension; grey: what nothing else beats. PCA and UMAP "
        "learn from training points alone, and nothing of what they are of; the latent was told "
        "which of them are alike. The time of a latent is its share of a training of all "
        "dimensions together. The times belong to the machine that made this page.",
        f"Accuracy of k-NN by space and dimension. {listed}.",
    )
