"""Time of stages: what benchmark files say, without counting what ran side by side twice."""

import math
import os

import numpy as np
import pytest

from ajgdata.paths import Paths
from ajgdata.pipeline.stages import Stopwatch, busy_s, stages_of
from ajgdata.report.job_times import SHOWN, JobTime, seconds_of, stages_caption, stages_figure
from ajgdata.store.benchmarks import Job, read_benchmarks
from ajgdata.types import DataError

HEAD = "s\th:m:s\tmax_rss\tmax_vms\tmax_uss\tmax_pss\tio_in\tio_out\tmean_load\tcpu_time\n"


@pytest.fixture
def paths(tmp_path):
    """Two data sets; jobs of 10, 4, 2, 1 s that end at 110, 112, 113, 200 s, and a short one; some
    of a task and an embedding that a report on task t does not rest on."""
    made = Paths(tmp_path)
    for name, wall, ended in (
        ("acquire/a.s1", 10, 110),
        ("experiment/a.t.cross_validation-knn", 4, 112),
        ("experiment/b.t.cross_validation-knn", 2, 113),
        ("experiment/a.other.cross_validation-knn", 8, 113),
        ("experiment/a.other.sorting", 8, 113),
        ("train/a.t.knn", 3, 80),
        ("embed/a.grasps", 6, 90),
        ("collect", 1, 200),
        ("report", 99, 300),
    ):
        file = made.benchmarks / f"{name}.tsv"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(f"{HEAD}{wall}\t0:00:10\t120\t1\t1\t100\t0\t0\t50\t{wall / 2}\n")
        os.utime(file, (ended, ended))
    short = made.benchmarks / "merge" / "a.tsv"
    short.parent.mkdir()
    short.write_text(f"{HEAD}0.1\t0:00:00\tNA\tNA\tNA\tNA\tNA\tNA\tNA\tNA\n")
    os.utime(short, (50, 50))
    for name in ("a", "b"):
        made.dataset(name).parent.mkdir(parents=True)
        made.dataset(name).write_text(f"name: {name}\n")
    return made


def job(begun: float, ended: float) -> Job:
    return Job("r", (), ended - begun, 0.0, 0.0, ended)


def test_benchmark_files_are_read_in_their_units(paths):
    jobs = {(one.rule, one.parts): one for one in read_benchmarks(paths.benchmarks, paths.logs)}
    one = jobs["experiment", ("a", "t", "cross_validation-knn")]
    assert (one.wall_s, one.cpu_s, one.ended_s) == (4, 2, 112)
    assert one.peak_mb == pytest.approx(104.8576)  # 100 MiB, what is shared once
    assert math.isnan(jobs["merge", ("a",)].cpu_s)
    assert jobs["collect", ()].wall_s == 1
    log = paths.logs / "merge/a.log"
    log.parent.mkdir(parents=True)
    log.write_text("1.00 s of processor time\n2.50 s of processor time\n")
    merge = next(j for j in read_benchmarks(paths.benchmarks, paths.logs) if j.rule == "merge")
    assert merge.cpu_s == 2.5  # its own last word
    (paths.benchmarks / "x.tsv").write_text("a\tb\n1\t2\n")
    with pytest.raises(DataError, match="no benchmark file of Snakemake's"):
        read_benchmarks(paths.benchmarks, paths.logs)


@pytest.mark.parametrize(
    ("spans", "length"),
    [
        ([], 0),
        ([(0, 1)], 1),
        ([(0, 2), (1, 3)], 3),
        ([(0, 5), (1, 2), (4, 6), (8, 9)], 7),
        ([(1, 2), (0, 5)], 5),
    ],
)
def test_jobs_side_by_side_count_once(spans, length):
    assert busy_s([job(*span) for span in spans]) == pytest.approx(length)


def test_a_report_counts_the_jobs_that_it_rests_on(paths):
    so_far = JobTime("report", (), 3.0, 2.5, 400.0)
    ask = {"datasets": ["a"], "tasks": [("a", "t")], "report": so_far}
    part = stages_of(paths, **ask, whole=False)
    table = {row.stage: row for row in part.table()}
    assert {name: row.wall_s for name, row in table.items()} == {
        "recording": 10, "Cross-validation": 4, "features": 0.1, "report": 3,
    }  # fmt: skip
    assert next(row.stage for row in part.table()) == "recording"
    # 100..110 and 108..112 s overlap by 2 s; the merge and the report stand alone
    assert part.busy_s == pytest.approx(12 + 0.1 + 3)
    assert part.total().wall_s == pytest.approx(17.1)
    assert part.total().peak_mb == 400
    assert math.isnan(table["features"].peak_mb)
    assert [one.parts for one in part.of_tasks()] == [("a", "t", "cross_validation-knn")]
    whole = stages_of(paths, **ask, whole=True)
    assert whole.of_tasks() == part.of_tasks()  # a final model is no experiment
    more = {row.stage: row.wall_s for row in whole.table() if row.stage not in table}
    assert more == {"table of results": 1, "embeddings": 6, "final models": 3}
    assert whole.busy_s == pytest.approx(part.busy_s + 1 + 6 + 3)


def test_the_figure_writes_what_the_table_lists(paths):
    ask = {"datasets": ["a"], "tasks": [("a", "t")], "report": Stopwatch().so_far()}
    stages = stages_of(paths, **ask, whole=True)
    figure = stages_figure(stages, ("simulated",))
    names, shown, seconds = seconds_of(stages)
    np.testing.assert_allclose(seconds.sum(), stages.total().wall_s)
    assert [t.get_text() for t in figure.axes[0].get_yticklabels()] == names
    assert len(shown) <= SHOWN and seconds.shape == (len(names), len(shown))
    told, longest = stages_caption(stages).alt, stages.table()[0]
    assert told.lower().startswith(f"{longest.stage} takes {longest.wall_s:g} of ".lower())
    assert "recording 10 s" in told
