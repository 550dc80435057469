"""Mean spectra of a data set -> figure and words."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, new_figure, styled
from ajgdata.report.format import Caption, number, words
from ajgdata.report.report_data import DatasetSummary, Spectra

#: Where the mean is further below its peak, differences are of next to nothing.
HEARD_DB = 40


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


def _widest(overall: np.ndarray, each: np.ndarray) -> int:
    """Return the bin in which the means differ most, of those no more than 40 dB below the peak."""
    heard = overall >= overall.max() - HEARD_DB
    return int(np.argmax(np.where(heard, np.ptp(each, axis=0), -1.0)))


def spectra_finding(dataset: DatasetSummary) -> str:
    """Return where the means of classes or bins differ most, and by how much.

    Raises ValueError if the data set has no spectra.
    """
    frequency, overall, each = _decibels(*_spectra_of(dataset))
    grouping, at = (
        words(dataset.spectra.grouping if dataset.spectra else "class"),
        _widest(overall, each),
    )
    if len(each) < 2:
        return f"Mean spectrum of one {grouping}"
    apart = float(np.ptp(each[:, at]))
    return (
        f"Means per {grouping} differ most at {number(frequency[at], 2)} Hz, by "
        f"{number(apart, 2)} dB"
    )


def _spectra_of(dataset: DatasetSummary) -> tuple[Spectra, bool]:
    """Return the spectra, and whether they are of magnitude, not power."""
    if dataset.spectra is None or not len(dataset.spectra.labels):
        raise ValueError(f"data set {dataset.name} has no spectra")
    return dataset.spectra, dataset.features.quantity != "power"


@styled
def spectra_figure(dataset: DatasetSummary) -> Figure:
    """Mean feature over frequency, and how each class or target bin differs from it.

    Raises ValueError if the data set has no spectra.
    """
    spectra, magnitude = _spectra_of(dataset)
    frequency, overall, each = _decibels(spectra, magnitude)
    n, grouping = len(spectra.labels), words(spectra.grouping)
    height = 0.5 + 0.19 * max(n, 4)
    figure = new_figure(
        (WIDTH_IN, 3.3 + height),
        spectra_finding(dataset),
        f"{dataset.title}: {dataset.n_recordings:,} recordings; line: mean of all, band: range of "
        f"the means per {grouping}",
        [dataset.source],
    )
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[1.7, height])
    low, high = each.min(axis=0), each.max(axis=0)
    band: dict[str, Any] = {"color": COLOURS[4], "alpha": 0.45, "lw": 0}
    upper.fill_between(frequency, low, high, label=f"range of the means per {grouping}", **band)
    upper.plot(frequency, overall, color=COLOURS[0], lw=1.1, label="mean of all")
    upper.set(ylabel="level (dB)", xscale="log", xlim=(frequency[0], frequency[-1]))
    at = _widest(overall, each)
    for axes in (upper, lower) if n > 1 else ():
        axes.axvline(frequency[at], color=GREY, ls="--", lw=1.1)
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
    axes.set_yticks(np.arange(n) + 0.5, [words(label) for label in spectra.labels])
    axes.tick_params(axis="y", length=0)
    axes.invert_yaxis()
    axes.set(xlabel="frequency (Hz)", ylabel=words(spectra.grouping))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda hz, _: number(hz)))
    return mesh


def spectra_caption(dataset: DatasetSummary) -> Caption:
    """Return the caption of `spectra_figure`."""
    grouping = words(dataset.spectra.grouping) if dataset.spectra else "class"
    names = ", ".join(dataset.spectra.labels) if dataset.spectra else ""
    return Caption(
        f"What the models see of {dataset.title} ({dataset.source}). Top: mean over the rows "
        "below (each counts the same), in dB against its highest value, with the range of the "
        f"rows. Bottom: how the mean of each {grouping} differs from it.",
        f"{spectra_finding(dataset)}. Mean spectrum, and its deviation in dB, for each {grouping}: "
        f"{names}.",
    )
