"""Odd places, clocks, locales and masks: the same results."""

import os
import shutil
import subprocess
import sys

import pytest
import world
from conftest import snakemake

pytestmark = pytest.mark.torture
PROMISE = "The same results wherever, whenever and for whomever"
YEAR_S = 365 * 86_400


def made(root, umask="022", **environment) -> str:
    """Run the workflow; returns what it said if it failed."""
    done = snakemake(root, env={**os.environ, **environment}, umask=int(umask, 8)).ended()
    return "" if done.code == 0 else done.said[-600:]


def turkish(folder) -> dict[str, str]:
    """Settings for a Turkish locale, in which the lower I has no dot, and 1.5 is 1,5."""
    subprocess.run(
        ["localedef", "-i", "tr_TR", "-f", "UTF-8", "--no-archive", folder / "tr_TR.UTF-8"],
        check=False, capture_output=True,
    )  # fmt: skip
    settings = {"LOCPATH": str(folder), "LC_ALL": "tr_TR.UTF-8", "LANG": "tr_TR.UTF-8"}
    asked = [sys.executable, "-c", "import locale; print(locale.setlocale(locale.LC_ALL, ''))"]
    known = subprocess.run(asked, env={**os.environ, **settings}, check=False, capture_output=True)
    if known.returncode:
        pytest.skip("no Turkish locale here, and none can be made")
    return settings


@pytest.mark.parametrize(
    "environment",
    [{"TZ": "Pacific/Kiritimati"}, "Turkish", {"LC_ALL": "C", "umask": "077"}],
    ids=["time zone 14 h ahead", "Turkish locale", "locale C, umask 077"],
)
def test_other_environments(deeds, place, tally, workflow, environment, tmp_path, request):
    root = place(workflow[0].start)
    said = made(root, **(turkish(tmp_path) if environment == "Turkish" else environment))
    wrong = [said] if said else world.differing(root, workflow[0].whole)
    tally.add(PROMISE, request.node.callspec.id, wrong)
    assert not wrong


def test_a_long_and_odd_path(deeds, place, tally, workflow, tmp_path):
    root = tmp_path / 'a b\'s "ü" 音' / ("x" * 200)
    shutil.copytree(workflow[0].start, root)
    said = made(root)
    wrong = [said] if said else world.differing(root, workflow[0].whole)
    tally.add(PROMISE, "path with spaces, quotes, Unicode and 200 characters", wrong)
    assert not wrong


@pytest.mark.parametrize("where", ["a link", "another file system"])
def test_data_elsewhere(deeds, place, tally, workflow, tmp_path, where):
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
