"""Odd places, clocks, locales and masks: the same results."""

import os
import shutil
import subprocess
import sys
import time

import pytest
import world
from conftest import ROOT
from test_killed import workflow  # noqa: F401

pytestmark = pytest.mark.torture
PROMISE = "The same results wherever, whenever and for whomever"
YEAR_S = 365 * 86_400


def made(root, **environment) -> str:
    """Run the workflow; returns what it said if it failed."""
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(ROOT / "Snakefile")]
    command += ["--directory", str(root), "--configfile", str(root / "settings.yaml")]
    done = subprocess.run(
        [*command, "--cores", "2", "results/metrics.json"],
        env={**os.environ, **environment}, capture_output=True, text=True, check=False, cwd=root,
        umask=int(environment.get("UMASK", "022"), 8),
    )  # fmt: skip
    return "" if done.returncode == 0 else (done.stdout + done.stderr)[-600:]


@pytest.mark.parametrize(
    "environment",
    [
        {"TZ": "Pacific/Kiritimati", "LC_ALL": "tr_TR.UTF-8", "LANG": "tr_TR.UTF-8"},
        {"LC_ALL": "C", "UMASK": "077"},
    ],
    ids=["far east, Turkish", "locale C, umask 077"],
)
def test_other_environments(deeds, place, tally, workflow, environment, request):  # noqa: F811
    root = place(workflow[0].start)
    said = made(root, **environment)
    wrong = [said] if said else world.differing(root, workflow[0].whole)
    tally.add(PROMISE, request.node.callspec.id, wrong)
    assert not wrong


def test_a_long_and_odd_path(deeds, place, tally, workflow, tmp_path):  # noqa: F811
    root = tmp_path / 'a b\'s "ü" 音' / ("x" * 200)
    shutil.copytree(workflow[0].start, root)
    said = made(root)
    wrong = [said] if said else world.differing(root, workflow[0].whole)
    tally.add(PROMISE, "path with spaces, quotes, Unicode and 200 characters", wrong)
    assert not wrong


@pytest.mark.parametrize("where", ["a link", "another file system"])
def test_data_elsewhere(deeds, place, tally, workflow, tmp_path, where):  # noqa: F811
    root = place(workflow[0].start)
    other = tmp_path / "elsewhere"
    other.mkdir()
    is_mounted = where != "a link"
    if (
        is_mounted
        and subprocess.run(
            ["mount", "-t", "tmpfs", "none", str(other)], check=False, capture_output=True
        ).returncode
    ):
        pytest.skip("no file system can be mounted here")
    try:
        shutil.move(root / "data", other / "data")
        (root / "data").symlink_to(other / "data")
        (other / "cache").mkdir()
        shutil.rmtree(root / ".ajgdata", ignore_errors=True)
        (root / ".ajgdata").symlink_to(other / "cache")
        said = made(root)
        wrong = [said] if said else world.differing(root, workflow[0].whole)
        tally.add(PROMISE, f"data and cache behind {where}", wrong)
        assert not wrong
    finally:
        if is_mounted:
            subprocess.run(["umount", "-l", str(other)], check=True)


def test_a_clock_that_was_set_back(deeds, place, tally, workflow):  # noqa: F811
    """Everything is of next year when a label changes: the change counts all the same."""
    root = place(workflow[0].end)
    for path in world.files_of(root).values():
        os.utime(path, (time.time() + YEAR_S,) * 2)
    for table in (root / "data/knock/sessions").glob("*/recordings.csv"):
        table.write_text(table.read_text().replace(",Wood", ",Metal"))
        os.utime(table, (time.time() - YEAR_S,) * 2)
    said = made(root)
    wrong = [said] if said else []
    if not said and "Metal" not in (root / "results/metrics.json").read_text():
        wrong.append("the label that changed is not in the results")
    tally.add(PROMISE, "clock set back by a year, then a label changed", wrong)
    assert not wrong
