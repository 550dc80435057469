"""Mean spectra of a data set -> figure and words."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from ajgdata.report.canvas import GREY, WIDTH_IN, line_style, new_figure, styled
from ajgdata.report.format import Caption, number, words
from ajgdata.report.report_data import DatasetSummary, Spectra

#: Where the mean is further below its peak, differences are of next to nothing.
HEARD_DB = 40
#: Levels are not drawn further below the peak; this keeps empty bins finite.
SILENT_DB = 120


def levels_db(spectra: Spectra, factor: float) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies (f,) above 0 and the level of each mean (n, f) in dB of the highest.

    `factor` is 20 for magnitudes, 10 for powers.
    """
    audible = spectra.frequency_hz > 0
    mean = np.asarray(spectra.mean, float)[:, audible]
    least = 10 ** (-SILENT_DB / factor)
    level = factor * np.log10(np.maximum(mean / (mean.max() or 1.0), least))
    return spectra.frequency_hz[audible], level


def _levels(dataset: DatasetSummary) -> tuple[np.ndarray, np.ndarray, int]:
    """Return frequencies, levels, and the bin in which the levels differ most."""
    assert dataset.spectra is not None
    factor = 10.0 if dataset.features.quantity == "power" else 20.0
    frequency, level = levels_db(dataset.spectra, factor)
    heard = level.mean(axis=0) >= level.mean(axis=0).max() - HEARD_DB
    return frequency, level, int(np.argmax(np.where(heard, np.ptp(level, axis=0), -1.0)))


def spectra_finding(dataset: DatasetSummary) -> str:
    """Return where the means of classes or bins differ most, and by how much."""
    frequency, level, at = _levels(dataset)
    grouping = words(dataset.spectra.grouping if dataset.spectra else "class")
    if len(level) < 2:
        return f"Mean spectrum of one {grouping}"
    place = f"{number(frequency[at], 2)} Hz, by {number(float(np.ptp(level[:, at])), 2)} dB"
    return f"Means per {grouping} differ most at {place}"


@styled
def spectra_figure(dataset: DatasetSummary) -> Figure:
    """Return the mean feature of each class or target bin over frequency."""
    assert dataset.spectra is not None
    frequency, level, at = _levels(dataset)
    subtitle = f"{dataset.title}, {dataset.n_recordings:,} recordings"
    size = (WIDTH_IN, 3.6)
    figure = new_figure(size, spectra_finding(dataset), subtitle, [dataset.source])
    axes = figure.subplots()
    for index, (label, one) in enumerate(zip(dataset.spectra.labels, level, strict=True)):
        style: dict[str, Any] = {**line_style(index), "marker": "", "lw": 0.9}
        axes.plot(frequency, one, label=words(label), **style)
    axes.axvline(frequency[at], color=GREY, ls="--", lw=0.9)
    axes.set(xlabel="frequency (Hz)", ylabel="level (dB)", xscale="log")
    axes.set_xlim(frequency[0], frequency[-1])
    axes.xaxis.set_major_formatter(FuncFormatter(lambda hz, _: number(hz)))
    figure.legend(loc="outside right center", title=words(dataset.spectra.grouping))
    return figure


def spectra_caption(dataset: DatasetSummary) -> Caption:
    """Return the caption of `spectra_figure`."""
    grouping = words(dataset.spectra.grouping) if dataset.spectra else "class"
    names = ", ".join(dataset.spectra.labels) if dataset.spectra else ""
    return Caption(
        f"Mean spectrum of each {grouping} of {dataset.title} ({dataset.source}), in dB of the "
        "highest value. Dashed: where the means differ most.",
        f"{spectra_finding(dataset)}. Mean spectrum in dB for each {grouping}: {names}.",
    )
