"""A dry run, a summary and a lint leave every byte where it was."""

import contextlib
import hashlib
import io
import shutil

import pytest
from conftest import ROOT, add_recording
from snakemake.cli import main as snakemake_main

#: Snakemake leaves files of its own open.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
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


#: Snakemake's own, whatever the workflow does: a log of what is no dry run, opened before it reads
#: the workflow, and file times that only `--trust-io-cache` after a dry run uses.
SNAKEMAKES_OWN = {(".snakemake", "log"), (".snakemake", "iocache")}


def snapshot(root):
    """Every file with its bytes and time, and every folder but the empty ones of `.snakemake`."""
    content = {}
    for path in sorted(root.rglob("*")):
        inside = path.relative_to(root).parts
        if path.is_file() and inside[:2] not in SNAKEMAKES_OWN:
            digest = hashlib.sha256(path.read_bytes()).hexdigest()
            content[inside] = (path.stat().st_mtime_ns, digest)
        elif inside[0] != ".snakemake":
            content[inside] = None
    return content


def fresh(project):
    for made in ("results", ".snakemake"):
        shutil.rmtree(project.root / made)


@pytest.mark.parametrize("state", [fresh, add_recording])
def test_looking_changes_nothing(project, state):
    state(project)
    before = snapshot(project.root)
    for arguments in SEEN:
        snakemake(project, *arguments)
        assert snapshot(project.root) == before, arguments
