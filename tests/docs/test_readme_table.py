"""The README's table comes from the metrics of a run."""

import re
from pathlib import Path

import ajgdata
from ajgdata.store.metrics import FACTS, KEYS, write_metrics
from tools.readme_table import readme_table

ROOT = Path(__file__).resolve().parents[2]
SIZE = {"task": "size", "experiment": "cross_validation", "test_set": "size"}
NOISE = {"task": "noise", "experiment": "repeated_fits", "test_set": "size_80dba"}
VALUES = (
    (SIZE, {"mean": 0.7249, "chance": 6.4163, "grasp low": 0.6, "grasp high": 0.9}),
    (SIZE | {"split": "session"}, {"mean": 1.1, "chance": 6.5, "grasp low": 1, "grasp high": 2}),
    (NOISE, {"median": 20.6, "low": 17.2, "high": 22.4, "chance": 6.4163}),
)


def write_results(path):
    """Write a `metrics.csv` with two of the five results, and with unrelated rows."""
    about = dict.fromkeys((*KEYS, *FACTS), "") | {"source": "simulated", "commit": "c0ffee1234567"}
    about |= {
        "dataset": "size",
        "target_values": "training",
        "model": "cnn",
        "split": "grouped",
        "metric": "rmse",
    }
    rows = [
        about | key | {"statistic": statistic, "value": value}
        for key, values in VALUES
        for statistic, value in values.items()
    ]
    unrelated = ({"model": "knn"}, {"split": "random"}, {"target_values": "withheld"})
    rows += [about | SIZE | other | {"statistic": "mean", "value": 99} for other in unrelated]
    write_metrics(path, rows)


def test_five_results_next_to_the_published_values(tmp_path, monkeypatch):
    spread = {"size-known": 0.1}  # mm
    monkeypatch.setattr("ajgdata.pipeline.report_content.read_machine_spread", lambda paths: spread)
    write_results(tmp_path / "metrics.csv")
    lines = readme_table(tmp_path / "metrics.csv").splitlines()
    assert lines[3:5] == [
        "| Edge length of a cube, RMSE | 0.725 mm (0.6 to 0.9) | 1.1 mm | — | 6.42 mm |"
        " 2.7 mm | better |",
        "| Edge length in noise of 80 dB(A), training at 45 dB(A), RMSE | 20.6 mm (17.2 to 22.4),"
        " not better than chance | — | — | 6.42 mm | 3.5 mm | worse |",
    ]
    assert len(lines[3:-5]) == 5 and lines[5].endswith("| — | — | — | — | 85.6 % | — |")
    assert lines[-4].endswith("differ by ±0.1 mm (row by row).")
    assert re.fullmatch(r"Commit c0ffee1234; SHA-256 of `metrics.csv`: [0-9a-f]{10}\.", lines[-2])


def test_three_lines_of_the_documentation_give_its_values(tmp_path):
    write_results(tmp_path / "results" / "metrics.csv")
    (tmp_path / "datasets").mkdir()
    page = (ROOT / "docs/comparing.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^```python\n(.*?)^```", page, flags=re.M | re.S)
    names = {"ajgdata": ajgdata}
    block = block.replace("load_metrics()", "load_metrics(project=project)")
    exec(block, names | {"project": tmp_path}, names)
    table = names["table"]
    assert len(block.splitlines()) == 3
    size = table.loc["size", "size", "cross_validation", "grouped", "size", "training", "rmse"]
    assert size[["mean", "grasp low", "grasp high", "chance"]].tolist() == [
        0.7249,
        0.6,
        0.9,
        6.4163,
    ]
    noise = table.loc["size", "noise", "repeated_fits", "grouped", "size_80dba", "training", "rmse"]
    assert noise[["median", "low", "high"]].tolist() == [20.6, 17.2, 22.4]
