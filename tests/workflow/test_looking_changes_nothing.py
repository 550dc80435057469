"""A dry run, a summary, a lint and `ajgdata status` leave every byte where it was, and the dry run
announces exactly what the next run does."""

import contextlib
import csv
import hashlib
import io
import re
import shutil
from pathlib import Path

import pytest
from conftest import ROOT, write_tone
from snakemake.cli import main as snakemake_main

from ajgdata.cli.project import workflow_status
from ajgdata.paths import RECORDINGS_FILE
from ajgdata.types import DataError

#: Snakemake leaves files of its own open.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
REPORT, STORE = "results/report/index.html", "results/features/tones.nc"
SEEN = [["--dry-run"], ["--summary"], ["--lint"], ["--list-rules"], ["--dag"], ["--list-untracked"]]


def snakemake(project, *arguments):
    """What Snakemake says; in this process, which is quicker than a new one."""
    command = ["--snakefile", str(ROOT / "Snakefile"), "--directory", str(project.root)]
    command += ["--configfile", str(project.root / "settings.yaml"), "--cores", "1", *arguments]
    said = io.StringIO()
    with (
        contextlib.redirect_stdout(said),
        contextlib.redirect_stderr(said),
        pytest.raises(SystemExit) as stopped,
    ):
        snakemake_main(command)
    assert not stopped.value.code, said.getvalue()
    return said.getvalue()


def jobs(said):
    """Names of jobs in what Snakemake says: the messages of their rules."""
    return sorted(re.findall(r"^Job \d+: (.+)$", said, flags=re.M))


#: Snakemake's own, whatever the workflow does: a log of what is no dry run, opened before it reads
#: the workflow, and file times that only `--trust-io-cache` after a dry run uses.
SNAKEMAKES_OWN = {(".snakemake", "log"), (".snakemake", "iocache")}


def snapshot(root, besides=SNAKEMAKES_OWN):
    """Every file with its bytes and time, and every folder but the empty ones of `.snakemake`."""
    content = {}
    for path in sorted(root.rglob("*")):
        inside = path.relative_to(root).parts
        if path.is_file() and inside[:2] not in besides:
            digest = hashlib.sha256(path.read_bytes()).hexdigest()
            content[inside] = (path.stat().st_mtime_ns, digest)
        elif inside[0] != ".snakemake":
            content[inside] = None
    return content


def edit_rows(project, session, change):
    path = project.folder(session) / RECORDINGS_FILE
    rows = change(list(csv.DictReader(io.StringIO(path.read_text()))))
    with path.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, rows[0])
        writer.writeheader()
        writer.writerows(rows)


def new_recording(project):
    write_tone(project.folder("day1") / "audio/new.wav", 500, seed=7)
    new = {"recording_id": "new", "file": "audio/new.wav", "grasp_id": "new", "sha256": ""}
    edit_rows(project, "day1", lambda rows: [*rows, rows[0] | new])


def removed_session(project):
    shutil.rmtree(project.folder("day2"))


def fresh(project):
    for made in ("results", ".snakemake"):
        shutil.rmtree(project.root / made)


FEATURES = "Spectra of session {} of tones"
MERGE, END = "Features and labels of tones", ["Report on tones"]
TRIED = ["Measuring cross_validation-knn of pitch of tones"]
CHANGES = [
    (new_recording, [FEATURES.format("day1"), MERGE, *TRIED, *END]),
    (removed_session, [MERGE, *TRIED, *END]),
]


@pytest.mark.parametrize("state", [fresh, new_recording])
def test_looking_changes_nothing(project, state):
    state(project)
    before = snapshot(project.root)
    for arguments in SEEN:
        snakemake(project, *arguments)
        assert snapshot(project.root) == before, arguments
    before = snapshot(project.root, besides=())
    settings = str(project.root / "settings.yaml")
    current, groups = workflow_status(project.paths, ["--configfile", settings])
    assert snapshot(project.root, besides=()) == before
    assert bool(current) is (state is not fresh)
    assert "features" in {one.rule for one in groups}


@pytest.mark.parametrize(("change", "wanted"), CHANGES)
def test_a_dry_run_announces_what_the_run_does(project, change, wanted):
    """The run touches what it would make: its jobs are those of a real one."""
    change(project)
    announced = jobs(snakemake(project, REPORT, "--dry-run"))
    assert announced == sorted(wanted)
    assert jobs(snakemake(project, REPORT, "--touch")) == announced
    assert jobs(snakemake(project, REPORT, "--dry-run")) == []


def test_status_says_what_snakemake_complains_of(project):
    with pytest.raises(DataError, match="no such data set"):
        workflow_status(project.paths, ["--config", "datasets=[absent]"])
    assert Path.cwd() != project.root
