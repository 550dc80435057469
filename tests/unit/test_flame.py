"""The chart of a run: who ran when, beside whom, and what each rule took."""

import math
import re
from xml.etree import ElementTree

from ajgdata.store.benchmarks import Job
from tools.flame import chart, last_run, rows_of, table

SVG = "{http://www.w3.org/2000/svg}"


def job(rule, begin, wall, cpu=1.0, parts=("a", "<b>")):
    return Job(rule, parts, wall, cpu, 100.0, begin + wall)


JOBS = [job("long", 0, 100), job("short", 0, 10), job("short", 10, 20, 3.0), job("end", 100, 20)]


def test_jobs_that_overlap_are_in_rows_of_their_own():
    assert rows_of(JOBS) == [0, 1, 1, 0]
    assert rows_of([job("a", 0, 10), job("b", 9.7, 10), job("c", 9.7, 1)]) == [0, 0, 1]


def test_a_pause_ends_a_run_and_a_long_job_is_none():
    before = [job("old", -5_000, 100), job("old", -4_900, 10)]
    assert last_run([*JOBS, *before], pause_s=600) == JOBS
    assert len(last_run([*JOBS, *before], pause_s=6_000)) == 6
    bridged = [job("a", 0, 3_000), job("b", 1, 1), job("c", 3_001, 1)]
    assert last_run(bridged, pause_s=600) == bridged


def test_the_chart_is_to_scale_and_names_every_job():
    found = ElementTree.fromstring(chart(JOBS))
    bars = [one for one in found.iter(f"{SVG}rect") if one.find(f"{SVG}title") is not None]
    wide = [float(bar.get("width")) for bar in bars]
    assert [round(one / wide[1], 1) for one in wide] == [10, 1, 2, 2]
    assert len({bar.get("fill") for bar in bars}) == 3
    titles = [bar.find(f"{SVG}title").text for bar in bars]
    assert titles[1] == "short a <b>: 10.0 s, 1.0 s of processor time"


def test_the_table_sums_by_rule_and_leaves_out_what_was_not_told():
    told = table([*JOBS, job("short", 200, 5, math.nan)]).splitlines()
    rows = {re.split(r" *\| *", line)[1]: re.split(r" *\| *", line)[2:7] for line in told[2:]}
    assert rows["short"] == ["3", "35.0", "4.0", "2.0", "1.0"]
    assert rows["all"][:3] == ["5", "155.0", "6.0"]
    assert list(rows) == ["short", "end", "long", "all"]
