"""Each change redoes exactly what depends on it. Jobs are those that a dry run announces."""

import os
import subprocess
import sys
import time

import numpy as np
import pytest
import yaml
from conftest import (
    DECLARATION,
    EMBEDDING,
    Project,
    add_recording,
    copy_workflow,
    edit_table,
    rules_of,
)
from recorded import write_noisy_tone

import ajgdata
from ajgdata.paths import RECORDINGS_FILE, Paths
from ajgdata.pipeline.studies import REQUESTED_STUDIES, STUDIES
from ajgdata.store import code_hash
from ajgdata.store.features import read_store
from ajgdata.store.models import read_about
from ajgdata.store.sessions import write_session
from ajgdata.store.tables import read_measurements
from ajgdata.types import Recording, Session

#: What follows from a changed store.
PITCH = DECLARATION["tasks"]["pitch"]
TASKS = {"experiment": 1, "collect": 1, "report": 1}
END = ("results/report/index.html", "results/metrics.csv")
#: Enough of a run where only the features are looked at.
STORE = ("results/features/tones.nc",)


def redeclare(project, **changes):
    project.paths.dataset("tones").write_text(yaml.safe_dump({**DECLARATION, **changes}))


def test_an_unchanged_or_touched_project_has_nothing_to_do(project):
    for path in project.folder("day1").rglob("*"):
        os.utime(path)
    os.utime(project.paths.dataset("tones"))
    assert project.planned(*END) == {}


@pytest.mark.parametrize("model", ["knn", "svm"])
def test_one_model_needs_only_the_features(project, model):
    """Also a model that the task does not list."""
    folder = str(Paths().model("tones", "pitch", model))
    assert project.planned(folder) == {"train": 1}
    add_recording(project)
    assert project.planned(folder) == {"features": 1, "train": 1}


def test_tasks_with_equal_settings_share_a_training(project):
    """The job of the second task copies the model of the first."""
    redeclare(project, tasks={"first": PITCH | {"folds": 2}, "pitch": PITCH})
    folder = str(Paths().model("tones", "pitch", "knn"))
    assert project.jobs_of(folder) == {
        ("train", "tones", "first", "knn"): 1,
        ("train", "tones", "pitch", "knn"): 1,
    }


def test_copies_with_noise_redo_the_task_and_need_the_data_set_of_the_noise(project):
    noise = project.paths.dataset("hum")
    noise.parent.mkdir()
    noise.write_text(yaml.safe_dump({"name": "hum"}))
    folder = project.paths.session("hum", "s1")
    write_noisy_tone(folder / "audio/0.wav", 700, seed=99)
    recording = Recording(recording_id="0", file="audio/0.wav", grasp_id="0")
    write_session(folder, Session(session_id="s1", source="import"), [recording])
    model = str(Paths().model("tones", "pitch", "knn"))
    augment = {"copies": 2, "noise": {"source": "hum", "snr_db": [0, 20]}}
    redeclare(project, tasks={"pitch": PITCH | {"augment": augment}})
    jobs = project.jobs_of(*END, model)
    assert jobs["features", "hum"] == 1 and ("features", "tones") not in jobs
    assert rules_of(jobs) == TASKS | {"features": 1, "train": 1}
    project.snakemake(*END, model)
    assert project.planned(*END, model) == {}
    assert read_about(project.root / model)["copies"] == 32  # two of each of 16 recordings
    augment["noise"]["snr_db"] = [0, 10]
    redeclare(project, tasks={"pitch": PITCH | {"augment": augment}})
    assert project.planned(*END, model) == TASKS | {"train": 1}


def remove_recording(project):
    (project.folder("day2") / "audio/0.wav").unlink()
    edit_table(project, "day2", lambda rows: rows[1:])


def edit_recording(project):
    """Edit a file in place: no run looks at it until its session is computed again."""
    write_noisy_tone(project.folder("day2") / "audio/3.wav", 1234, seed=8)


def relabel(project):
    edit_table(project, "day1", lambda rows: rows[0].update(pitch="high"))


def accept_edited_recording(project):
    edit_recording(project)
    edit_table(project, "day2", lambda rows: rows[3].update(sha256=""))


def add_session(project):
    day1 = project.folder("day1")
    day3 = project.folder("day3")
    (day3 / "audio").mkdir(parents=True)
    write_noisy_tone(day3 / "audio/0.wav", 555, seed=9)
    (day3 / "session.yaml").write_text("session_id: day3\nsource: import\n")
    header, first = (day1 / RECORDINGS_FILE).read_text().splitlines()[:2]
    (day3 / RECORDINGS_FILE).write_text(f"{header}\n{first}\n")


@pytest.mark.parametrize(
    "change",
    [add_recording, relabel, remove_recording, accept_edited_recording, add_session],
)
def test_a_change_redoes_its_data_set(project, change):
    change(project)
    assert project.planned(*END) == {"features": 1, **TASKS}


def test_only_what_is_new_is_read_and_edits_are_left_out(project):
    before = read_store(project.paths.features("tones"))
    for change in (add_recording, remove_recording, edit_recording):
        change(project)
    project.snakemake(*STORE)
    log = project.root / "results/logs/features/tones.log"
    assert log.read_text().splitlines()[0] == "1 recordings read, 14 features reused"
    after = read_store(project.paths.features("tones"))
    names = after.columns["recording"].values.tolist()
    assert set(before.columns["recording"].values) ^ set(names) == {"day1/new", "day2/0", "day2/3"}
    for name, feature in zip(before.columns["recording"].values, before.feature, strict=True):
        if name in names:
            np.testing.assert_array_equal(after.feature[names.index(name)], feature)
    assert "changed" in project.paths.quarantine("tones").read_text()
    assert project.planned(*END) == TASKS


@pytest.mark.parametrize(
    ("changes", "jobs"),
    [
        ({"title": "Other"}, {"report": 1}),
        ({"features": {"hop": 256}}, {"features": 1, **TASKS}),
        ({"audio": {"microphone": "mean"}}, {"features": 1, **TASKS}),
        ({"tasks": {"pitch": PITCH | {"folds": 2}}}, TASKS),
        ({"tasks": {"pitch": PITCH | {"models": ["knn", "linear"]}}}, TASKS),
        (
            {"embeddings": {"tones": EMBEDDING}},
            {"embed": 1, **TASKS, "experiment": 3},
        ),
    ],
    ids=["title", "hop", "microphone", "folds", "model", "embedding"],
)
def test_a_setting_redoes_what_it_concerns(project, changes, jobs):
    redeclare(project, **changes)
    assert project.planned(*END) == jobs


@pytest.mark.parametrize("setting", ["seed=1", "device=auto"])
def test_seed_and_device_redo_the_evaluation(project, setting):
    assert project.planned(*END, "--config", setting) == TASKS


def test_a_new_version_of_scikit_learn_reruns_the_models(project, monkeypatch):
    def newer(name):
        return "99.0" if name == "scikit-learn" else installed_version(name)

    installed_version = code_hash.installed_version
    monkeypatch.setattr(code_hash, "installed_version", newer)
    code_hash.code_hash.cache_clear()
    try:
        assert project.planned(*END) == TASKS
    finally:
        code_hash.code_hash.cache_clear()


def test_an_edited_report_file_makes_the_pages_anew_and_nothing_else(project):
    style = project.paths.reports / "templates/style.css"
    style.parent.mkdir(parents=True)
    style.write_text("p { color: red }")
    assert project.planned(*END) == {"report": 1}


@pytest.mark.slow
def test_a_broken_template_withholds_no_numbers(project):
    template = project.paths.reports / "templates/index.html.j2"
    template.parent.mkdir(parents=True)
    template.write_text("{% if %}")
    relabel(project)
    before = project.paths.metrics_table.read_bytes()
    command = [sys.executable, "-m", "snakemake", *project.arguments(*END)]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 1 and "index.html.j2" in done.stderr
    assert project.paths.metrics_table.read_bytes() != before
    assert project.planned(*END) == {"report": 1}


def test_same_inputs_give_the_same_bytes(project):
    store = project.paths.features("tones")
    tables = project.paths.experiment("tones", "pitch", "cross_validation", "plain")
    before = store.read_bytes(), tables.read_bytes()
    time.sleep(1.1)  # HDF5 would store whole seconds
    project.snakemake(str(tables.relative_to(project.root)), "--forceall")
    assert (store.read_bytes(), tables.read_bytes()) == before
    assert read_measurements(tables)[0][1][0].where(metric="accuracy", statistic="mean").rows


def test_failed_features_are_computed_again(project):
    relabel(project)
    store = project.paths.features("tones")
    before = store.read_bytes()
    command = [sys.executable, "-m", "snakemake", *project.arguments(*STORE)]
    limited = ["prlimit", "--fsize=20000", *command]  # no larger file can be written
    assert subprocess.run(limited, check=False, capture_output=True).returncode == 1
    assert store.read_bytes() == before
    assert project.planned(*STORE) == {"features": 1}


@pytest.mark.slow
def test_a_whole_run_goes_on_beside_a_broken_session_and_results_of_what_was_declared(
    project, tmp_path
):
    """With a page on the gripper and trained models."""
    few = {"models": ["linear"]}  # 7 recordings: too few for k-NN
    redeclare(project, tasks={"other": DECLARATION["tasks"]["pitch"] | few})
    edit_table(project, "day2", lambda rows: rows[0].update(quality="reject"))
    (project.folder("day1") / "session.yaml").write_text("session_id: [")
    ask = ("--config", "pages=[accuracy]")
    expected = {
        "features": 1,
        **TASKS,
        "study": 1,
        "train": 1,
    }
    assert project.planned(*ask) == {**expected, "complete": 1, "all": 1}
    command = [sys.executable, "-m", "snakemake", *project.arguments(*ask)]
    for _ in range(2):  # a session that cannot be read is reported by each run
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        assert done.returncode == 1
        last = done.stderr.rstrip().splitlines()[-1]
        assert last.startswith("incomplete: 1 session of tones could not be read, see ")
    assert "1 data set: 7 recordings used\n" in done.stdout
    assert "left out  2 recordings: " in done.stdout
    assert "unreadable tones/day1/*: bad_session: session.yaml: not valid YAML" in done.stdout
    assert "1 measurement: 1 made, 0 skipped\n" in done.stdout
    assert project.planned(*ask) == {"complete": 1, "all": 1}
    clone = copy_workflow(tmp_path / "clone")
    planned = Project(project.root, clone).planned(*ask)
    assert planned == {"complete": 1, "all": 1}  # also for the study
    quarantine = project.paths.quarantine("tones").read_text()
    assert "bad_session" in quarantine and "not valid YAML" in quarantine
    sessions = read_store(project.paths.features("tones")).columns["session_id"].values
    assert set(sessions) == {"day2"}
    page = project.paths.report.with_name("datasets.html")
    assert "not valid YAML" in page.read_text()
    edit_table(project, "day2", lambda rows: rows[1].update(pitch="low"))
    assert project.planned(*END, *ask) == {"features": 1, **TASKS}
    assert project.planned(*END, *ask, "quick=False").items() >= {"study": 1}.items()


def test_each_study_is_a_job_of_its_own(project):
    jobs = project.jobs_of(*END, "--config", f"pages=[{','.join(STUDIES)}]")
    assert jobs == {
        **{("study", study): 1 for study in REQUESTED_STUDIES},
        ("report",): 1,
    }
    jobs = project.planned("everything", "--config", f"pages=[{','.join(STUDIES)}]")
    assert jobs["study"] == len(STUDIES)


@pytest.mark.slow
def test_the_first_target_makes_the_results_of_the_paper_and_deletes_no_others(project):
    other = PITCH | {"models": ["linear"]}
    redeclare(project, tasks={"pitch": PITCH | {"paper": "ycb"}, "other": other})
    beyond = "experiment", "tones", "other", "cross_validation", "plain"
    assert beyond not in project.jobs_of() and "train" not in project.planned()
    project.snakemake()
    page = project.paths.report
    assert "experiments (1)" in page.read_text() and "snakemake everything" in page.read_text()
    assert "other" not in set(ajgdata.load_metrics(project=project.root)["task"])
    assert project.jobs_of("everything")[beyond] == 1
    project.snakemake("everything")
    assert project.planned("everything") == {}
    assert project.planned() == {"complete": 1, "all": 1}  # the report was written again
    metrics = project.paths.metrics_table.read_bytes()
    assert b",other," in metrics
    style = project.paths.reports / "templates/style.css"
    style.parent.mkdir(parents=True)
    style.write_text("p { color: red }")
    assert project.planned() == {"report": 1, "complete": 1, "all": 1}
    project.snakemake()
    assert project.paths.metrics_table.read_bytes() == metrics
    assert "Not computed yet" not in page.read_text()
    assert "Results beyond the paper (1) are of an earlier run" in page.read_text()


@pytest.mark.slow
def test_what_was_skipped_reaches_the_console_and_the_exit_code(project):
    tasks = {"pitch": DECLARATION["tasks"]["pitch"] | {"folds": 99, "groups": "pitch"}}
    redeclare(project, tasks=tasks)
    command = [sys.executable, "-m", "snakemake", *project.arguments()]
    for _ in range(2):  # the second run has nothing else to do
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        assert done.returncode == 1
        last = done.stderr.rstrip().splitlines()[-1]
        assert last.startswith("incomplete: tones/pitch skipped (reasons above), everything else")
        assert "Error" not in done.stderr
        assert "job execution failed" not in done.stderr
    assert not list((project.root / ".snakemake" / "locks").glob("*"))
    assert "1 measurement: 0 made, 1 skipped (tones/pitch; reasons above)\n" in done.stdout
    assert "skipped   tones/pitch, cross_validation of knn" in done.stdout
    assert "report: results/report/index.html\n" in done.stdout
    assert "Skipped measurements" in project.paths.report.with_name("run.html").read_text()
    tasks["pitch"]["optional"] = True
    redeclare(project, tasks=tasks)
    assert not project.planned().keys() & {"features", "experiment", "train"}
    assert "optional  tones/pitch" in project.snakemake()
    assert project.planned() == {}


def test_a_run_of_one_data_set_alone_has_results_of_its_own(project):
    own = Paths(project.root, "tones")
    files = [str(path.relative_to(project.root)) for path in (own.metrics_table, own.report)]
    alone = ("--config", "datasets=[tones]", "alone=True")
    assert project.planned(*files, *alone) == {"collect": 1, "report": 1}
