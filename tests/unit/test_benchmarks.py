"""Benchmark files of Snakemake: units, wildcards, and the cost by rule."""

import math

import pytest

from ajgdata.store.benchmarks import cost_by_rule, read_benchmarks
from ajgdata.types import DataError

HEAD = "s\th:m:s\tmax_rss\tmax_vms\tmax_uss\tmax_pss\tio_in\tio_out\tmean_load\tcpu_time\n"


@pytest.fixture
def folder(tmp_path):
    """Benchmarks of four jobs; Snakemake measured nothing of the shortest."""
    for name, row in (
        ("experiment/a.t.cross_validation-knn", "4\t0:00:04\t120\t1\t1\t100\t0\t0\t50\t2"),
        ("experiment/b.t.cross_validation-knn", "6\t0:00:06\t120\t1\t1\t-\t0\t0\t50\t3"),
        ("collect", "1\t0:00:01\t10\t1\t1\t10\t0\t0\t50\t1.5"),
        ("merge/a", "0.1\t0:00:00\tNA\tNA\tNA\tNA\tNA\tNA\tNA\tNA"),
    ):
        file = tmp_path / f"{name}.tsv"
        file.parent.mkdir(exist_ok=True)
        file.write_text(f"{HEAD}{row}\n")
    return tmp_path


def test_jobs_are_read_in_their_units(folder):
    jobs = {(one.rule, one.wildcards): one for one in read_benchmarks(folder)}
    one = jobs["experiment", ("a", "t", "cross_validation-knn")]
    assert (one.wall_s, one.cpu_s) == (4, 2)
    assert one.peak_mb == pytest.approx(104.8576)  # 100 MiB: shared memory counts once
    assert jobs["collect", ()].wall_s == 1
    assert math.isnan(jobs["merge", ("a",)].cpu_s)
    assert read_benchmarks(folder / "absent") == []


def test_another_table_is_one_line(folder):
    (folder / "x.tsv").write_text("a\tb\n1\t2\n")
    with pytest.raises(DataError, match="is not a benchmark file of Snakemake"):
        read_benchmarks(folder)


def test_the_cost_by_rule_leaves_out_what_was_not_measured(folder):
    rows = {row.rule: row for row in cost_by_rule(read_benchmarks(folder))}
    assert list(rows) == ["experiment", "collect", "merge", "all"]  # the longest first
    assert rows["experiment"][1:4] == (2, 10, 5)
    assert rows["experiment"].peak_mb == pytest.approx(125.82912)  # without the shared set: all
    assert rows["all"][1:4] == (4, pytest.approx(11.1), 6.5)
    assert math.isnan(rows["merge"].peak_mb)
    assert cost_by_rule([]) == []
