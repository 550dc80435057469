"""Benchmark files of Snakemake: units, wildcards, and the cost by rule."""

import math

import pytest

from ajgdata.pipeline import machine
from ajgdata.store.benchmarks import read_costs

HEAD = "s\th:m:s\tmax_rss\tmax_vms\tmax_uss\tmax_pss\tio_in\tio_out\tmean_load\tcpu_time\n"


@pytest.fixture
def folder(tmp_path):
    """Benchmarks of four jobs; Snakemake measured nothing of the shortest."""
    for name, row in (
        ("experiment/a/t/cross_validation.knn", "4\t0:00:04\t120\t1\t1\t100\t0\t0\t50\t2"),
        ("experiment/b/t/cross_validation.knn", "6\t0:00:06\t120\t1\t1\t-\t0\t0\t50\t3"),
        ("collect", "1\t0:00:01\t10\t1\t1\t10\t0\t0\t50\t1.5"),
        ("merge/a", "0.1\t0:00:00\tNA\tNA\tNA\tNA\tNA\tNA\tNA\tNA"),
    ):
        file = tmp_path / f"{name}.tsv"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(f"{HEAD}{row}\n")
    return tmp_path


def test_the_cost_by_rule_leaves_out_what_was_not_measured(folder):
    rows = {row.rule: row for row in read_costs(folder, lambda name: True)}
    assert list(rows) == ["experiment", "collect", "merge", "all"]  # the longest first
    assert rows["experiment"][1:4] == (2, 10, 5)
    assert rows["experiment"].peak_mb == pytest.approx(125.82912)  # without the shared set: all
    assert rows["collect"].peak_mb == pytest.approx(10.48576)  # MiB
    assert rows["all"][1:4] == (4, pytest.approx(11.1), 6.5)
    assert math.isnan(rows["merge"].peak_mb)


def test_a_machine_of_speed_two_needs_half_a_second(monkeypatch):
    monkeypatch.setattr(machine, "calibrate", lambda: 0.5)
    assert "2.00 times the reference speed (calibration 0.50 s)" in machine.machine_line()
