"""The README's table comes from the metrics of a run."""

import re

import pytest

from ajgdata.evaluate.metrics import METRICS
from ajgdata.pipeline.collect import COLUMNS
from ajgdata.store.files import csv_bytes
from ajgdata.store.sessions import read_dataset
from tools import screenshots
from tools.readme_table import KEY, PROJECT, README, ROWS, readme_table, written

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
        "| Edge length of a cube, RMSE | 0.72 mm (0.6 to 0.9) | 2.7 mm | 6.4 mm | better |",
        "| Edge length in noise of 80 dB(A), training at 45 dB(A), RMSE | 21 mm (17 to 22), not"
        " better than chance | 3.5 mm | 6.4 mm | worse |",
    ]
    assert len(lines[3:-3]) == 5 and lines[5].endswith("| — | 85.6 % | — | — |")
    assert re.fullmatch(r"Run of commit c0ffee1234, results [0-9a-f]{10}\.", lines[-2])


def test_the_readme_has_this_table():
    lines = readme_table(metrics()).splitlines()
    current = written(README.read_text(encoding="utf-8")).splitlines()
    assert current[:3] == lines[:3]
    assert [line.split("|")[1] for line in current[3:8]] == [
        line.split("|")[1] for line in lines[3:8]
    ]
    assert re.fullmatch(r"Run of commit [0-9a-f]{10}, results [0-9a-f]{10}\.", current[-2])


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.title)
def test_rows_are_of_declared_tasks(row):
    spec = read_dataset(PROJECT, row.dataset)
    task = spec.tasks[row.task]
    tested = {f"repeated fits on:{name}" for name in task.test_on}
    assert row.part in {"grouped", *(["withheld"] if task.withhold else []), *tested}
    assert "cnn" in task.models
    metric = METRICS[spec.targets[task.target].kind][0]
    assert metric.upper() in row.title or metric in row.title


def test_screenshots_stay_where_there_is_no_browser_or_no_report(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(screenshots, "IMAGES", tmp_path)
    page = tmp_path / "index.html"
    screenshots.write_screenshots(page)
    assert f"left as they were, there is no {page}" in capsys.readouterr().out
    page.touch()
    monkeypatch.setenv("PATH", "")
    screenshots.write_screenshots(page)
    assert "not installed: apt-get install chromium chromium-driver" in capsys.readouterr().out
    assert list(tmp_path.iterdir()) == [page]


def test_pictures_of_the_docs_are_small():
    """Every clone has them, each version of them."""
    sizes = {file.name: file.stat().st_size for file in screenshots.IMAGES.iterdir()}
    assert sum(sizes.values()) <= screenshots.MAX_BYTES
