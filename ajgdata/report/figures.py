"""One result, or one data set -> a figure, which says *simulated* or *recorded*."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, PercentFormatter

from ajgdata.evaluate.metrics import confusion
from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, new_figure, styled
from ajgdata.report.content import DatasetSummary, Spectra, TaskResult
from ajgdata.report.format import number, words
from ajgdata.report.wording import chance, headline, metric_name, quantity, task_name

#: More points than this are drawn as pixels also in vector files.
MAX_VECTOR_POINTS = 3000


def group_by_true_value(
    y_true: np.ndarray, y_pred: np.ndarray, max_groups: int = 30
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean true value, mean and standard deviation (n - 1) of the predictions per true value.

    More than `max_groups` distinct values are put into `max_groups` bins of equal width. The
    deviation of a single prediction is 0.
    """
    values, index = np.unique(y_true, return_inverse=True)
    if len(values) > max_groups:
        edges = np.linspace(values[0], values[-1], max_groups + 1)[1:-1]
        index = np.unique(np.digitize(y_true, edges), return_inverse=True)[1]
    count = np.bincount(index)
    true = np.bincount(index, y_true) / count
    mean = np.bincount(index, y_pred) / count
    squares = np.bincount(index, (y_pred - mean[index]) ** 2)
    return true, mean, np.sqrt(squares / np.maximum(count - 1, 1))


def prediction_figure(result: TaskResult) -> Figure:
    """What was predicted against what is true, for either kind of task."""
    return (regression_figure if result.kind == "regression" else confusion_figure)(result)


def _result_figure(result: TaskResult, size_in: tuple[float, float]) -> Figure:
    title = f"{task_name(result)} · {result.model_label}"
    subtitle = f"{metric_name(result)} {headline(result)}   (chance {chance(result)})"
    return new_figure(size_in, title, subtitle, [result.source])


@styled
def regression_figure(result: TaskResult) -> Figure:
    """Predicted against true value: every prediction, mean ± sd per true value, identity."""
    y_true = np.asarray(result.predictions.y_true, float)
    y_pred = np.asarray(result.predictions.y_pred, float)
    figure = _result_figure(result, (6.2, 5.0))
    axes = figure.subplots()
    drawn = [y_true, y_pred]
    if result.unseen is not None:
        drawn += [result.unseen.y_true, result.unseen.y_pred]
    low, high = min(y.min() for y in drawn), max(y.max() for y in drawn)
    ends = np.array([low, high]) + 0.04 * (high - low or 1) * np.array([-1, 1])
    axes.plot(ends, ends, color=GREY, ls=(0, (5, 3)), lw=1.1, label="perfect")
    axes.axhline(y_true.mean(), color=GREY, ls=":", lw=1.1, label="chance: the mean")
    many = len(y_true) > MAX_VECTOR_POINTS
    points: dict[str, Any] = {
        "ms": 3,
        "mew": 0,
        "color": COLOURS[4],
        "alpha": 0.25 if many else 0.5,
    }
    axes.plot(y_true, y_pred, "o", rasterized=many, label="one recording", **points)
    bars: dict[str, Any] = {
        "ms": 5.5,
        "mec": "white",
        "mew": 0.8,
        "capsize": 2.5,
        "elinewidth": 1.2,
    }
    true, mean, sd = group_by_true_value(y_true, y_pred)
    axes.errorbar(true, mean, sd, fmt="o", color=COLOURS[0], label="mean ± sd", **bars)
    if result.unseen is not None:
        unseen = group_by_true_value(result.unseen.y_true, result.unseen.y_pred)
        axes.errorbar(*unseen, fmt="s", color=COLOURS[1], label="withheld values", **bars)
    unit = f" ({result.unit})" if result.unit else ""
    axes.set(xlabel=f"true {quantity(result)}{unit}", ylabel=f"predicted {quantity(result)}{unit}")
    axes.set(xlim=ends, ylim=ends, aspect="equal")
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1), borderaxespad=0)
    return figure


@styled
def confusion_figure(result: TaskResult) -> Figure:
    """Confusion matrix: colour is the share of the true class, numbers are counts."""
    p = result.predictions
    counts = confusion(p.y_true.astype(str), p.y_pred.astype(str), np.array(p.classes))
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    n = len(p.classes)
    side = n * (0.62 if n <= 8 else 0.34)
    label = 0.075 * max(map(len, p.classes))
    below = 0.75 * label if n > 4 else 0.15
    figure = _result_figure(result, (max(side + label + 1.7, 4.8), side + below + 1.15))
    axes = figure.subplots()
    image = axes.imshow(share, cmap="Blues", vmin=0, vmax=1)
    axes.grid(False)
    axes.spines[:].set_visible(False)
    axes.set_xticks(range(n), p.classes, rotation=45 if n > 4 else 0, rotation_mode="xtick")
    axes.set_yticks(range(n), p.classes)
    axes.set(xlabel="predicted", ylabel="true")
    style: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 8 if n <= 8 else 7}
    for row, column in np.argwhere(counts):
        fraction, text = share[row, column], f"{counts[row, column]}"
        text = f"{100 * fraction:.0f} %\n{text}" if n <= 8 else text
        axes.text(column, row, text, color="white" if fraction > 0.55 else "#222222", **style)
    bar = figure.colorbar(
        image, ax=axes, format=PercentFormatter(1, symbol=" %"), shrink=0.8, pad=0.02
    )
    bar.set_label("share of the true class; line: chance")
    bar.ax.axhline(result.chance, color=COLOURS[1], lw=2)
    bar.outline.set_visible(False)
    return figure


def _decibels(spectra: Spectra, magnitude: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frequencies > 0, mean over labels, and mean per label, in dB against the overall maximum."""
    audible = spectra.frequency_hz > 0
    mean = np.asarray(spectra.mean, float)[:, audible]
    overall = mean.mean(axis=0)
    peak = overall.max() or 1.0
    factor = 20.0 if magnitude else 10.0
    # 120 dB below the peak is silence; it keeps empty bins finite.
    floor = peak * 10 ** (-120 / factor)
    levels = [factor * np.log10(np.maximum(m, floor) / peak) for m in (overall, mean)]
    return spectra.frequency_hz[audible], levels[0], levels[1]


@styled
def spectra_figure(dataset: DatasetSummary) -> Figure:
    """Mean feature over frequency, and how each class or target bin differs from it.

    Raises ValueError if the data set has no spectra.
    """
    spectra = dataset.spectra
    if spectra is None or not len(spectra.labels):
        raise ValueError(f"data set {dataset.name} has no spectra")
    frequency, overall, each = _decibels(spectra, dataset.features.quantity == "magnitude")
    n = len(spectra.labels)
    height = 0.5 + 0.19 * max(n, 4)
    subtitle = f"{dataset.n_recordings:,} recordings, means per {words(spectra.grouping)}"
    figure = new_figure(
        (WIDTH_IN, 3.3 + height), f"{dataset.title} · mean spectra", subtitle, [dataset.source]
    )
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[1.7, height])
    upper.fill_between(
        frequency,
        each.min(axis=0),
        each.max(axis=0),
        color=COLOURS[4],
        alpha=0.45,
        lw=0,
        label=f"range of the means per {words(spectra.grouping)}",
    )
    upper.plot(frequency, overall, color=COLOURS[0], lw=1.1, label="mean of all")
    upper.set(ylabel="level (dB)", xscale="log", xlim=(frequency[0], frequency[-1]))
    upper.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2, borderaxespad=0)
    mesh = _difference_panel(lower, spectra, frequency, each - overall)
    figure.colorbar(mesh, ax=lower, label="difference (dB)", pad=0.02, extend="both")
    return figure


def _difference_panel(
    axes: Axes, spectra: Spectra, frequency_hz: np.ndarray, difference_db: np.ndarray
) -> QuadMesh:
    """One row of colour per label."""
    limit = max(float(np.quantile(np.abs(difference_db), 0.99)), 0.1)
    # One cell per bin, its edges halfway between bins: the log axis stretches the low ones.
    middle = (frequency_hz[1:] + frequency_hz[:-1]) / 2
    edges = np.concatenate([frequency_hz[:1], middle, frequency_hz[-1:]])
    n = len(spectra.labels)
    colours: dict[str, Any] = {"cmap": "PuOr_r", "vmin": -limit, "vmax": limit}
    mesh = axes.pcolormesh(edges, np.arange(n + 1), difference_db, rasterized=True, **colours)
    axes.grid(False)
    axes.set_yticks(np.arange(n) + 0.5, spectra.labels)
    axes.tick_params(axis="y", length=0)
    axes.invert_yaxis()
    axes.set(xlabel="frequency (Hz)", ylabel=words(spectra.grouping))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda hz, _: number(hz)))
    return mesh
