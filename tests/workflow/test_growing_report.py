"""The first page is there before the report is, grows with the results, and leaves nothing."""

import os
import shutil
import subprocess
import sys
from contextlib import suppress
from dataclasses import replace

import pytest

from ajgdata.paths import Paths
from ajgdata.pipeline import growing
from ajgdata.store.files import write_bytes

END = "results/report/index.html"
TASKS = [("tones", "pitch")]


@pytest.fixture
def unreported(project):
    """The finished project without its report; what its one experiment found is beside."""
    shutil.rmtree(project.paths.report.parent)
    (found,) = (project.paths.results / "tasks" / "tones" / "pitch").glob("*[!t].json")
    return project, found


def page_of(project):
    return project.paths.report.read_text()


def test_the_page_says_what_it_waits_for_and_then_what_came_out(unreported):
    project, found = unreported
    away = found.rename(found.with_suffix(".away"))
    growing.begin(project.paths, ["tones"], TASKS)
    assert "<b>0</b> of 1 experiments" in page_of(project)
    assert "Still being computed" in page_of(project) and "Results so far" not in page_of(project)
    away.rename(found)
    growing.grow(project.paths)
    assert "<b>0</b> of 1" in page_of(project)  # a moment ago is soon enough
    os.utime(project.paths.growing, (0, 0))
    growing.grow(project.paths)
    page = page_of(project)
    assert "<b>1</b> of 1 experiments" in page and "Still being computed" not in page
    assert "Results so far" in page and "accuracy" in page
    growing.stop(project.paths)
    assert "The run stopped before its report was made" in page_of(project)


def test_a_run_that_was_killed_or_whose_report_failed_leaves_the_report_to_be_made(unreported):
    project, _ = unreported
    growing.begin(project.paths, ["tones"], TASKS)
    assert set(project.planned(END)) == {"report"}
    growing.stop(project.paths)
    page = page_of(project)
    assert set(project.planned(END)) == {"report"}
    assert page_of(project) == page


def test_an_older_report_stays_until_the_new_one_is_made(project):
    before = page_of(project)
    growing.begin(project.paths, ["tones"], TASKS)
    growing.grow(project.paths)
    growing.stop(project.paths)
    assert page_of(project) == before and not project.paths.growing.exists()


def test_each_run_has_a_note_of_its_own_and_none_touches_a_report(unreported):
    project, _ = unreported
    whole, alone = project.paths, replace(project.paths, run="tones")
    growing.begin(whole, ["tones"], TASKS)
    growing.begin(alone, ["tones"], TASKS)
    assert "<b>1</b> of 1" in alone.report.read_text() and "<b>1</b> of 1" in page_of(project)
    write_bytes(alone.report, b"the report")
    growing.stop(alone)
    assert alone.report.read_text() == "the report"
    assert "stopped" not in page_of(project) and whole.growing.is_file()
    os.utime(whole.growing, (0, 0))
    growing.grow(Paths(project.root))
    assert whole.growing.stat().st_mtime > 0 and alone.report.read_text() == "the report"
    growing.stop(whole)
    assert "The run stopped" in page_of(project)
    growing.begin(whole, ["tones"], TASKS)
    assert "The run stopped" not in page_of(project)


def test_what_a_failed_run_left_is_no_report_after_touching(unreported):
    project, _ = unreported
    growing.begin(project.paths, ["tones"], TASKS)
    growing.stop(project.paths)
    project.snakemake("--touch", END)
    assert not project.paths.report.exists()
    assert set(project.planned(END)) == {"report"}


def test_a_spoilt_result_spoils_neither_the_job_nor_the_run(unreported, capsys):
    project, found = unreported
    found.write_text("{")
    growing.begin(project.paths, ["tones"], TASKS)
    growing.grow(project.paths)
    assert found.name in capsys.readouterr().err


def test_a_run_shows_it_and_replaces_it_by_the_whole_report(unreported):
    project, _ = unreported
    run = [sys.executable, "-m", "snakemake", *project.arguments(END)]
    said, seen = project.root / "said.txt", ""
    with said.open("w") as stream, subprocess.Popen(run, stdout=stream, stderr=stream) as job:
        while job.poll() is None and "experiments are there" not in seen:
            with suppress(FileNotFoundError):
                seen = page_of(project)
    assert job.returncode == 0, said.read_text()
    assert "<b>1</b> of 1 experiments are there" in seen
    assert "experiments are there" not in page_of(project) and "took <b>" in page_of(project)
    assert not project.paths.growing.exists()
    assert project.planned(END) == {}
