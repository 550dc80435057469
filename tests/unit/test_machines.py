"""Differences between machines: which results are measured, and the range over variants."""

import pytest

from ajgdata.paths import Paths
from ajgdata.store.files import read_yaml
from ajgdata.store.report_files import MACHINE_SPREAD_FILE
from benchmarks.machines import (
    HERE,
    HERE_RUN,
    NETWORKS,
    ROWS,
    MeasuredRow,
    compared,
    markdown,
    step,
    with_spreads,
)

PROJECT = Paths(HERE)
ROW = MeasuredRow("ycb", "ycb", "object", "grouped mean")
NAME = "ycb/object/cross_validation/cnn"


def result(digest: str, value: float) -> dict:
    values = {"grouped mean": value, "grouped sd": 0.05}
    facts = {"scale": 100, "unit": "%", "recordings": {"grouped": 640}}
    return {NAME: {"digest": digest, "values": values, **facts}}


def test_the_range_is_over_all_variants_that_were_measured():
    runs = {HERE_RUN: result("a", 0.775), "A=1": result("b", 0.7625), "B=1": result("a", 0.775)}
    runs |= {"C=1": result("c", 0.78125), "D=1": {"steps": {}}}
    row = compared(ROW, runs)
    assert row == {
        "figure": "ycb",
        "experiment": NAME,
        "part": "grouped mean",
        "unit": "%",
        "value": 77.5,
        "smallest": 76.25,
        "largest": 78.125,
        "step": 100 / 640,
        "variants": 3,
        "changed_by": ["A=1", "C=1"],
    }
    (row,) = with_spreads({"rows": [row], "other_machines": []})["rows"]
    line = f"| ycb (%), `{NAME}`, grouped mean | 77.5 | 76.25 | 78.12 | 1.875 | 2 of 3 |"
    assert markdown({"rows": [row]}).splitlines()[2:] == [line]


def test_the_spread_is_the_range_one_recording_or_the_difference_to_another_computer():
    def spread(score: float, **elsewhere) -> float:
        runs = {HERE_RUN: result("a", 0.775), "A=1": result("b", score)}
        machines = [{"figure": "ycb", **elsewhere}] if elsewhere else []
        content = with_spreads({"rows": [compared(ROW, runs)], "other_machines": machines})
        return content["rows"][0]["spread"]

    assert spread(0.7625) == pytest.approx(1.25)
    assert spread(0.775) == pytest.approx(100 / 640)  # no variant changes the value
    assert spread(0.7625, value=70.0, compared_with=72.5) == pytest.approx(2.5)
    neighbours = ROW._replace(model="knn_plain")
    assert step(neighbours, result("a", 0.775)[NAME]) == 0


def test_every_trained_network_has_a_spread():
    """Training amplifies rounding, so no trained network is equal on all machines."""
    content = read_yaml(HERE / "reports" / MACHINE_SPREAD_FILE)
    networks = [row for row in content["rows"] if row["experiment"].split("/")[-1] in NETWORKS]
    assert len(networks) >= 10
    for row in networks:
        assert row["spread"] >= max(row["step"], row["largest"] - row["smallest"])
        assert row["spread"] > 0, row["figure"]
    assert content == with_spreads(content)


def test_the_page_has_the_table_of_the_last_measurement():
    content = read_yaml(HERE / "reports" / MACHINE_SPREAD_FILE)
    assert [row["figure"] for row in content["rows"]] == [row.figure for row in ROWS]
    page = (HERE / "docs/reproducibility.md").read_text(encoding="utf-8")
    assert markdown(content) in page and content["commit"][:8] in page
