"""A dry run, a summary and `ajgdata status` leave every byte where it was."""

import contextlib
import hashlib
import io
import shutil
from pathlib import Path

import pytest
from conftest import ROOT, add_recording
from snakemake.cli import main as snakemake_main

from ajgdata.cli.status import workflow_status
from ajgdata.types import DataError

#: Snakemake leaves files of its own open.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
SEEN = [["--dry-run"], ["--summary"], ["--list-rules"], ["--dag"], ["--list-untracked"]]


def snakemake(project, *arguments):
    """What Snakemake says; in this process, which is quicker than a new one."""
    command = ["--snakefile", str(ROOT / "workflow/Snakefile"), "--directory", str(project.root)]
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


def unchanged(_):
    pass


def fresh(project):
    for folder in ("results", ".snakemake"):
        shutil.rmtree(project.root / folder)


@pytest.mark.parametrize("state", [unchanged, fresh, add_recording])
def test_looking_changes_nothing(project, state):
    state(project)
    before = snapshot(project.root)
    for arguments in SEEN:
        snakemake(project, *arguments)
        assert snapshot(project.root) == before, arguments
    before = snapshot(project.root, besides=())
    settings = str(project.root / "settings.yaml")
    results = workflow_status(project.paths, [], ["--configfile", settings]).files
    assert snapshot(project.root, besides=()) == before
    (plan,) = {(row["status"], row["plan"]) for row in results if row["rule"] == "features"}
    assert (
        plan
        == {
            unchanged: ("ok", "no update"),
            fresh: ("missing", "update pending"),
            add_recording: ("updated input files", "update pending"),
        }[state]
    )


def test_status_says_what_snakemake_complains_of(project):
    with pytest.raises(DataError, match="no such data set"):
        workflow_status(project.paths, ["absent"])
    assert Path.cwd() != project.root
