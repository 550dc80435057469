"""A small project of synthetic tones, run once; each test changes a copy of it."""

import csv
import fcntl
import gc
import logging
import os
import shutil
import subprocess
import sys
import warnings
from collections import Counter
from pathlib import Path

import pytest
import yaml
from recorded import record_tones, write_noisy_tone
from snakemake.cli import main as snakemake_main
from snakemake_interface_logger_plugins.common import LogEvent

from ajgdata.paths import RECORDINGS_FILE, Paths
from ajgdata.store.audio import file_sha256
from ajgdata.store.sessions import read_recordings, write_recordings

ROOT = Path(__file__).resolve().parents[2]
SESSIONS = ("day1", "day2")
DECLARATION = {
    "name": "tones",
    "description": "Sines of two pitches, for tests.",
    "targets": {"pitch": {"kind": "classification"}},
    # One split, or every run of these tests would make ten.
    "tasks": {
        "pitch": {
            "target": "pitch",
            "folds": 3,
            "models": ["knn"],
        }
    },
}
EMBEDDING = {
    "instance": "pitch",
    "supervision": "Which tones are the same.",
    "target": "pitch",
    "dimensions": [2, 3],
    "shown": 3,
    "folds": 2,
    "inits": 1,
    "epochs": 1,
}


#: The workflow and all that its rules read.
WORKFLOW = ("Snakefile", "workflow", "profiles", "config")
#: The studies of the virtual gripper take minutes; tests ask for what they look at.
SETTINGS = {"pages": [], "publish": [], "quick": True}


class Announced(logging.Handler):
    """Collect the jobs that Snakemake announces, and what it complains of."""

    def __init__(self) -> None:
        super().__init__()
        self.jobs: Counter[tuple[str, ...]] = Counter()
        self.complaints: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        if getattr(record, "event", None) == LogEvent.JOB_INFO:
            self.jobs[record.rule_name, *record.wildcards.values()] += 1
        elif record.levelno >= logging.ERROR:
            self.complaints.append(record.getMessage())


def rules_of(jobs: Counter[tuple[str, ...]]) -> dict[str, int]:
    rules: Counter[str] = Counter()
    for (rule, *_), count in jobs.items():
        rules[rule] += count
    return dict(rules)


def snakemake_here(*arguments: str) -> int | str:
    """Call Snakemake in this process, for what starts no job; returns its exit code, or the line
    that it ends with."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # it leaves files to the interpreter
        try:
            snakemake_main(arguments)
        except SystemExit as ended:
            code = ended.code
        gc.collect()
    return code


@pytest.fixture(autouse=True)
def collected():
    """Free what Snakemake leaves to the interpreter, e.g. temporary folders, before the next test:
    a warning would fail a test that has nothing to do with it."""
    yield
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        gc.collect()


class Project:
    """A project folder and what Snakemake would do in it, with the Snakefile in `workflow`."""

    def __init__(self, root: Path, workflow: Path = ROOT) -> None:
        self.root = root
        self.paths = Paths(root)
        self.workflow = workflow
        if not (settings := root / "settings.yaml").exists():
            settings.write_text(yaml.safe_dump(SETTINGS))

    def arguments(self, *more: str) -> list[str]:
        given = ["--snakefile", str(self.workflow / "Snakefile"), "--directory", str(self.root)]
        given += ["--configfile", str(self.root / "settings.yaml"), "--cores", "2"]
        return [*given, "--max-jobs-per-timespan", "1000/1s", *more]  # runs end at once

    def snakemake(self, *arguments: str) -> str:
        """Run it as a person does, in processes of its own; returns what it says."""
        command = [sys.executable, "-m", "snakemake", *self.arguments(*arguments)]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout + done.stderr

    def jobs_of(self, *arguments: str) -> Counter[tuple[str, ...]]:
        """Count the jobs of a dry run by (rule, *wildcards): in this process, in half a second."""
        announced = Announced()
        logger = logging.getLogger("snakemake")  # above the one whose handlers Snakemake replaces
        logger.addHandler(announced)
        try:
            code = snakemake_here(*self.arguments("--dry-run", *arguments))
        finally:
            logger.removeHandler(announced)
        assert code == 0, announced.complaints
        return announced.jobs

    def planned(self, *arguments: str) -> dict[str, int]:
        """Count the jobs of a dry run by rule."""
        return rules_of(self.jobs_of(*arguments))

    def copied(self, target: Path) -> "Project":
        """Copy the project, with its times, to `target`."""
        shutil.copytree(self.root, target, symlinks=True)
        return Project(target)

    def folder(self, session: str) -> Path:
        return self.paths.session("tones", session)


def copy_workflow(folder: Path) -> Path:
    """Copy the workflow into a folder, as a clone of the same commit has it; return the folder."""
    for name in WORKFLOW:
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, target)
        else:
            shutil.copy(ROOT / name, target)
    return folder


def edit_table(project: Project, session: str, change) -> None:
    """Rewrite a session's recordings.csv with `change` applied to its list of rows."""
    path = project.folder(session) / RECORDINGS_FILE
    with path.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    rows = change(rows) or rows
    with path.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, rows[0])
        writer.writeheader()
        writer.writerows(rows)


def add_recording(project: Project) -> None:
    write_noisy_tone(project.folder("day1") / "audio/new.wav", 500, seed=7)
    new = {"recording_id": "new", "file": "audio/new.wav", "grasp_id": "new", "pitch": "low"}
    edit_table(project, "day1", lambda rows: [*rows, {**rows[0], **new, "sha256": ""}])


@pytest.fixture(scope="session")
def finished(tmp_path_factory) -> Project:
    """The project after one whole run, without the rule that runs tests: made by the process of
    pytest-xdist that needs it first, for all of them."""
    shared = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        shared = shared.parent
    with (shared / "tones.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (shared / "tones").exists():
            tones = make_tones(tmp_path_factory.mktemp("tones"))
            tones.root.rename(shared / "tones")
    return Project(shared / "tones")


def make_tones(root: Path) -> Project:
    """Two sessions of eight recordings; those of the second have their sha256."""
    project = Project(root)
    declaration = project.paths.dataset("tones")
    declaration.parent.mkdir(parents=True)
    declaration.write_text(yaml.safe_dump(DECLARATION))
    record_tones(project.paths, SESSIONS)
    folder = project.folder(SESSIONS[1])
    rows = read_recordings(folder)[0]
    hashes = [{"sha256": file_sha256(folder / row.file)} for row in rows]
    write_recordings(folder, [r.model_copy(update=h) for r, h in zip(rows, hashes, strict=True)])
    project.snakemake("results/report/index.html", "results/metrics.csv")
    return project


@pytest.fixture
def project(finished, tmp_path) -> Project:
    """A copy that a test may change; copying keeps times."""
    return finished.copied(tmp_path / "copy")
