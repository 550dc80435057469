"""Figures of a whole report: results between chance and perfect, and mean spectra of data sets."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ajgdata.report.comparison import Mark, PaperComparison, Role
from ajgdata.report.format import Caption, Score, number, words
from ajgdata.report.marks import Picture, Point, illustration
from ajgdata.report.page import SKILL, spectra_name
from ajgdata.report.report_data import DatasetSummary, Illustration, Spectra

SERIES: dict[Role, str] = {"ours": "ours", "baseline": "best other model", "paper": "paper"}
PER_CENT = 100.0
#: Where the mean spectrum is further below its peak, differences are of next to nothing.
HEARD_DB = 40
#: Levels are not drawn further below the peak; this keeps empty bins finite.
SILENT_DB = 120


def skill_figure(comparisons: Sequence[PaperComparison]) -> Illustration | None:
    """Return our results, the best other model and the published values on one axis, on which 0 is
    chance and 1 is perfect; None if no result has both a number and a chance level."""
    points = [point for row in comparisons for point in _skill_points(row)]
    if not points:
        return None
    order = list(SERIES.values())
    picture = Picture(
        title="Our results and the published ones, between chance (0) and perfect (1)",
        subtitle="bars: 95 % interval over grasps",
        sources=tuple(dict.fromkeys(row.source for row in comparisons)),
        points=tuple(sorted(points, key=lambda point: order.index(point.series))),
        axis=("skill: 0 chance, 1 perfect", ""),
        chance=(("", 0.0),),
    )
    text = "Skill: (value - chance) / (perfect - chance). Perfect is an error of 0 or an accuracy "
    text += "of 100 %. The paper's values were measured on a real gripper."
    return illustration(SKILL, "rows", picture, text)


def _skill_points(row: PaperComparison) -> Iterator[Point]:
    """Yield a point per mark of a row, in the row of its experiment and label."""
    marks = {mark.role: mark for mark in row.marks}
    chance = marks.get("chance")
    if chance is None or "ours" not in marks:
        return
    if row.paper.value is not None:
        value = row.paper.value
        marks["paper"] = Mark("paper", value, value, value)
    perfect = PER_CENT if row.unit == "%" else 0.0
    experiment, part = row.paper.panel or words(row.paper.where), row.label or row.paper.row
    name = ", ".join(filter(None, (experiment, part)))

    def skill(value: float) -> float:
        return (value - chance.value) / (perfect - chance.value)

    for role, series in SERIES.items():
        if (mark := marks.get(role)) and math.isfinite(mark.value):
            low, high = sorted((skill(mark.low), skill(mark.high)))
            yield Point("", series, name, Score(skill(mark.value), 0.0, (), low, high))


def spectra_figure(dataset: DatasetSummary, spectra: Spectra) -> Illustration:
    """Return the mean feature of each class or target bin over frequency, and where they differ
    most, in dB of the highest value."""
    factor = 10.0 if dataset.features.quantity == "power" else 20.0
    frequency, level = levels_db(spectra, factor)
    grouping = words(spectra.grouping)
    title = f"Mean spectrum of one {grouping}"
    if len(level) > 1:
        heard = level.mean(axis=0) >= level.mean(axis=0).max() - HEARD_DB
        spread = np.where(heard, np.ptp(level, axis=0), -1.0)
        at = int(np.argmax(spread))
        where = f"{number(frequency[at], 2)} Hz, by {number(float(spread[at]), 2)} dB"
        title = f"Means per {grouping} differ most at {where}"
    picture = Picture(
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
    drawn = illustration(spectra_name(dataset.name), "lines", picture, f"{text}highest value.")
    alt = f"{title}. Mean spectrum in dB for each {grouping}: {', '.join(spectra.labels)}."
    return drawn._replace(caption=Caption(drawn.caption.text, alt))


def levels_db(spectra: Spectra, factor: float) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies (f,) above 0 and the level of each mean (n, f) in dB of the highest.

    `factor` is 20 for magnitudes, 10 for powers.
    """
    audible = spectra.frequency_hz > 0
    mean = np.asarray(spectra.mean, float)[:, audible]
    least = 10 ** (-SILENT_DB / factor)
    level = factor * np.log10(np.maximum(mean / (mean.max() or 1.0), least))
    return spectra.frequency_hz[audible], level
