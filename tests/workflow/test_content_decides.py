"""Contents decide what a run computes again: times of files, folders and computers do not."""

import os
import shutil
import subprocess
import sys
import time

import pytest
from conftest import ROOT, Project, copy_workflow, edit_table, snakemake_here

from ajgdata.paths import CHANGES_FILE, RECORDINGS_FILE, SESSION_FILE
from ajgdata.pipeline.labelling import change_recording

END = ("results/report/index.html", "results/metrics.csv")
TASKS = {"experiment": 1, "collect": 1, "report": 1}
OLD_S = 1e9
FUTURE_S = 4e9


def relabel(project: Project) -> None:
    edit_table(project, "day1", lambda rows: rows[0].update(pitch="high"))


def set_times(project: Project, time_s: float) -> None:
    for path in project.root.rglob("*"):
        os.utime(path, (time_s, time_s))


def add_note(project: Project) -> None:
    path = project.folder("day1") / SESSION_FILE
    path.write_text(path.read_text() + "notes: wet granulate\n")
    os.utime(path, (OLD_S, OLD_S))


def relabel_with_old_time(project: Project) -> None:
    relabel(project)
    os.utime(project.folder("day1") / RECORDINGS_FILE, (OLD_S, OLD_S))


def relabel_before_results_from_the_future(project: Project) -> None:
    set_times(project, FUTURE_S)
    relabel(project)


def relabel_by_hand(project: Project) -> None:
    change_recording(project.paths, "tones", "day1/0", "label", column="pitch", value="high")
    os.utime(project.folder("day1") / CHANGES_FILE, (OLD_S, OLD_S))


def remove_session(project: Project) -> None:
    shutil.rmtree(project.folder("day2"))


@pytest.mark.parametrize(
    "change",
    [
        relabel_with_old_time,
        relabel_before_results_from_the_future,
        relabel_by_hand,
        add_note,
        remove_session,
    ],
)
def test_changed_contents_are_computed_again_whatever_the_times(project, change):
    change(project)
    assert project.planned(*END) == {"features": 1, **TASKS}


@pytest.mark.parametrize("time_s", [OLD_S, FUTURE_S])
def test_equal_contents_with_other_times_have_nothing_to_do(project, time_s):
    set_times(project, time_s)
    assert project.planned(*END) == {}


def test_a_note_on_a_recording_and_its_acceptance_have_nothing_to_do(project):
    change_recording(project.paths, "tones", "day1/0", "note", value="faint")
    change_recording(project.paths, "tones", "day1/0", "ok")
    assert project.planned(*END) == {}


@pytest.mark.parametrize("copy", [shutil.copy, shutil.copy2], ids=["cp -r", "cp -a"])
def test_a_copied_project_and_workflow_have_nothing_to_do(finished, tmp_path, monkeypatch, copy):
    """Without the times of the original (`cp -r`), and with them (`cp -a`)."""
    clone = copy_workflow(tmp_path / "clone")
    project = clone / "project"
    shutil.copytree(finished.root, project, symlinks=True, copy_function=copy)
    monkeypatch.chdir(clone)  # the profile is that of the clone
    assert Project(project, clone).planned(*END) == {}


def test_features_that_another_run_computed_are_evaluated_again(project):
    """A run with a narrow target writes features, and no results that follow from them."""
    relabel(project)
    project.snakemake("results/features/tones.nc")
    for path in project.paths.results.rglob("*"):
        if "features" not in path.parts:
            os.utime(path, (FUTURE_S, FUTURE_S))
    assert project.planned(*END) == TASKS


def test_no_parameter_contains_the_folder_of_the_workflow_or_of_the_project(finished):
    records = list((finished.root / ".snakemake" / "metadata").rglob("*"))
    texts = [path.read_text() for path in records if path.is_file()]
    assert any("build_feature_file" in text for text in texts)
    folders = str(ROOT), str(finished.root.parent)
    assert not any(folder in text for text in texts for folder in folders)


def test_a_table_that_cannot_be_read_ends_with_one_line(project):
    table = project.folder("day1") / RECORDINGS_FILE
    table.unlink()
    table.mkdir()
    end = snakemake_here(*project.arguments("--dry-run", *END))
    assert end == (
        "data/tones/sessions/day1/recordings.csv: cannot be read (Is a directory). "
        "Check the file and its permissions."
    )


@pytest.mark.slow
def test_a_run_whose_labels_change_meanwhile_fails_and_the_next_run_computes_again(project):
    """The label is corrected after the features were computed, during an experiment."""
    relabel(project)
    experiment = project.paths.experiment("tones", "pitch", "cross_validation", "plain")
    (log,) = (project.paths.results / "logs/experiment").rglob("*.log")
    log.unlink()
    target = str(experiment.relative_to(project.root))
    command = [sys.executable, "-m", "snakemake", *project.arguments(target)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as run:
        while not log.exists() and run.poll() is None:
            time.sleep(0.02)
        edit_table(project, "day1", lambda rows: rows[2].update(pitch="high"))
        _, printed = run.communicate()
    assert run.returncode == 1
    assert printed.rstrip().splitlines()[-1] == (
        "incomplete: tones: session day1 changed during the run; "
        "its results are outdated, `ajgdata run tones` computes them again"
    )
    assert project.planned(*END) == {"features": 1, **TASKS}
