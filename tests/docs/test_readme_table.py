"""The README's table comes from the metrics of a run."""

import re

from ajgdata.pipeline.exports import COLUMNS
from ajgdata.store.files import csv_bytes
from tools.readme_table import KEY, readme_table

SIZE = ("size", "size", "cnn", "grouped", "rmse")
NOISE = ("size", "noise", "cnn", "repeated fits on:size_80dba", "rmse")
VALUES = {
    SIZE: {"mean": 0.7249, "chance": 6.4163, "grasp low": 0.6, "grasp high": 0.9},
    NOISE: {"median": 20.6, "low": 17.2, "high": 22.4, "chance": 6.4163},
}


def metrics():
    """Return the content of a `metrics.csv` with two of the five results."""
    about = {"source": "simulated", "unit": "", "seed": 0, "commit": "c0ffee1234567"}
    rows = [
        dict(zip(KEY, (*key, statistic), strict=True)) | about | {"value": value}
        for key, values in VALUES.items()
        for statistic, value in values.items()
    ]
    return csv_bytes(COLUMNS, rows)


def test_five_results_next_to_the_published_values():
    lines = readme_table(metrics()).splitlines()
    assert lines[3:5] == [
        "| Edge length of a cube, RMSE | 0.725 mm (0.6 to 0.9) | 2.7 mm | 6.42 mm | better |",
        "| Edge length in noise of 80 dB(A), training at 45 dB(A), RMSE | 20.6 mm (17.2 to 22.4),"
        " not better than chance | 3.5 mm | 6.42 mm | worse |",
    ]
    assert len(lines[3:-3]) == 5 and lines[5].endswith("| — | 85.6 % | — | — |")
    assert re.fullmatch(r"Commit c0ffee1234; SHA-256 of `metrics.csv`: [0-9a-f]{10}\.", lines[-2])
