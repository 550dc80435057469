"""Figure of a data set: its mean spectra."""

from __future__ import annotations

import math

import numpy as np

from ajgdata.report.format import Caption, Score, number, words
from ajgdata.report.marks import FigureContent, Point, illustration
from ajgdata.report.report_data import DatasetSummary, Illustration, Spectra

#: Frequencies at which the mean spectrum is further below its peak are too quiet to compare.
AUDIBLE_DB = 40
#: Lowest level below the peak, also of empty bins.
SILENT_DB = 120


def spectra_figure(dataset: DatasetSummary, spectra: Spectra) -> Illustration:
    """Return the mean spectrum of each class or range of the target, in dB of the highest value.

    The title has the frequency with the largest difference.
    """
    factor = 10.0 if dataset.features.is_power else 20.0
    frequency, level = levels_db(spectra, factor)
    grouping = words(spectra.grouping)
    title = f"Mean spectrum of one {grouping}"
    if len(level) > 1:
        is_audible = level.mean(axis=0) >= level.mean(axis=0).max() - AUDIBLE_DB
        spread = np.where(is_audible, np.ptp(level, axis=0), -1.0)
        at = int(np.argmax(spread))
        where = f"{number(frequency[at], 2)} Hz, by {number(float(spread[at]), 2)} dB"
        title = f"Means per {grouping} differ most at {where}"
    content = FigureContent(
        title,
        f"{dataset.title}, {dataset.n_recordings:,} recordings",
        (dataset.source,),
        tuple(
            Point("", words(label), float(hz), Score(float(db), math.nan))
            for label, levels in zip(spectra.labels, level, strict=True)
            for hz, db in zip(frequency, levels, strict=True)
        ),
        ("level", "dB"),
        ("frequency", "Hz"),
    )
    text = f"Mean spectrum of each {grouping} of {dataset.title} ({dataset.source}), in dB of the "
    drawn = illustration(dataset.spectra_name, "lines", content, f"{text}highest value.")
    alt = f"{title}. Mean spectrum in dB for each {grouping}: {', '.join(spectra.labels)}."
    return drawn._replace(caption=Caption(drawn.caption.text, alt))


def levels_db(spectra: Spectra, factor: float) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies (f,) above 0 Hz, and levels (n, f) in dB of the highest level.

    `factor` is 20 for magnitudes and 10 for powers.
    """
    audible = spectra.frequency_hz > 0
    mean = np.asarray(spectra.mean, float)[:, audible]
    least = 10 ** (-SILENT_DB / factor)
    level = factor * np.log10(np.maximum(mean / (mean.max() or 1.0), least))
    return spectra.frequency_hz[audible], level
