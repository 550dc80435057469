"""`python -m tools.scatter_structure FILE:COLUMN ...`: print the scatter between grasps.

FILE is a feature file, and COLUMN contains the classes. In each session, two classes and up to five
grasps of each class are drawn five times, with one recording per grasp, so data sets of different
sizes are comparable. Prints the median, lowest and highest value of the draws.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from ajgdata.evaluate.scatter import Scatter, within_class_scatter
from ajgdata.store.features import FeatureRows, read_store

BANDS_HZ = ((100.0, 1_000.0), (1_000.0, 10_000.0))
DRAWS = 5  #: per session
CLASSES = 2  #: per draw
GRASPS = 5  #: per class


def draws(table: FeatureRows, column: str, band_hz: tuple[float, float]) -> list[Scatter]:
    """Return the scatter of the level (dB) in a band for each draw of each session."""
    generator = np.random.default_rng(0)
    low, high = band_hz
    used = (table.frequency_hz >= low) & (table.frequency_hz < high)
    level_db = 20 * np.log10(np.maximum(table.feature[:, used], np.finfo(float).tiny))
    classes = table.columns[column].values.astype(str)
    grasps = table.columns["grasp_id"].values.astype(str)
    sessions = table.columns["session_id"].values.astype(str)
    scatters = []
    for session in np.unique(sessions):
        for _ in range(DRAWS):
            chosen = generator.choice(np.unique(classes), CLASSES, replace=False)
            rows = []
            for name in chosen:
                rows_of_class = np.flatnonzero((classes == name) & (sessions == session))
                _, first = np.unique(grasps[rows_of_class], return_index=True)
                rows.append(rows_of_class[first[:GRASPS]])
            drawn = np.concatenate(rows)
            scatters.append(within_class_scatter(level_db[drawn], classes[drawn]))
    return scatters


def summary(values: list[float]) -> str:
    """Return median, lowest and highest value."""
    return f"{np.median(values):.1f} ({min(values):.1f} to {max(values):.1f})"


def main() -> None:
    """Print one line per feature file and band."""
    for argument in sys.argv[1:]:
        file, _, column = argument.rpartition(":")
        table = read_store(Path(file))
        for band_hz in BANDS_HZ:
            scatters = draws(table, column, band_hz)
            dimension = summary([scatter.dimension for scatter in scatters])
            rms = summary([scatter.rms for scatter in scatters])
            low, high = (f"{edge / 1e3:g}" for edge in band_hz)
            print(f"{file}, {low}–{high} kHz: dimension {dimension}, {rms} dB rms")


if __name__ == "__main__":
    main()
