"""The tutorial's commands, in its order, in a project of their own."""

import os
import re
import subprocess
import sys
from pathlib import Path

import yaml

from ajgdata.paths import Paths
from ajgdata.store.features import read_store
from ajgdata.store.files import read_json

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(sh|yaml)\n(.*?)^```", TEXT, flags=re.M | re.S)
#: What a project's folder holds before anything of one's own.
GIVEN = ("Snakefile", "workflow", "profiles", "tests", "docs", "environment.yml")


def commands_beside_this_python(folder: Path) -> dict[str, str]:
    """An environment in which `python`, `snakemake` and `ajgdata` are those that run the tests."""
    folder.mkdir()
    calls = {
        "python": "",
        "snakemake": "-m snakemake",
        "ajgdata": "-c 'from ajgdata.cli import main; main()'",
    }
    for name, call in calls.items():
        path = folder / name
        path.write_text(f'#!/bin/sh\nexec {sys.executable} {call} "$@"\n')
        path.chmod(0o755)
    own = {"PATH": f"{folder}{os.pathsep}{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
    return {k: v for k, v in os.environ.items() if k != "AJGDATA_ROOT"} | own


def test_the_tutorial(tmp_path):
    paths = Paths(tmp_path / "project")
    paths.datasets.mkdir(parents=True)
    for name in GIVEN:
        (paths.root / name).symlink_to(ROOT / name)
    environment = commands_beside_this_python(tmp_path / "bin")
    said = {}
    for kind, block in BLOCKS:
        if kind == "yaml":
            declared = yaml.safe_load(block)
            assert paths.dataset(declared["name"]).is_file()  # the import made the first one
            paths.dataset(declared["name"]).write_text(block)
            continue
        for command in block.splitlines():
            done = subprocess.run(
                ["sh", "-c", command],
                cwd=paths.root,
                env=environment,
                check=False,
                capture_output=True,
                text=True,
            )
            assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
            said[command] = done.stdout
    assert said["python docs/examples/make_takes.py takes"].startswith("18 recordings of 3 objects")
    assert "19 recordings checked: 0 errors, 0 warnings" in said["ajgdata validate takes"]
    assert "18 added" in said["ajgdata import takes --dataset mine"]
    assert "18 recordings checked: 0 errors, 0 warnings" in said["ajgdata validate mine"]
    assert "18 of 18 grasps of 3 objects in 1 sessions" in said["ajgdata info mine"]
    store = read_store(paths.features("mine"))
    assert store.feature.shape == (18, 1025)
    assert set(store.columns["label"].values.tolist()) == {"cube", "ball", "bar"}
    metrics = read_json(paths.metrics("mine", "label", "linear"))
    assert metrics["grouped"]["recordings"] == 18
    assert metrics["grouped"]["mean"]["accuracy"] > 2 * metrics["grouped"]["chance"]["accuracy"]
    status = next(text for command, text in said.items() if command.startswith("ajgdata status"))
    assert "train would run (missing)" in status
    assert "features would run" not in status
    assert (paths.root / "mine-1.0.0" / "SHA256SUMS").is_file()


def test_every_command_of_the_tutorial_is_found():
    assert sum(kind == "sh" for kind, _ in BLOCKS) == len(re.findall(r"^```sh", TEXT, flags=re.M))
    assert len(re.findall(r"^```", TEXT, flags=re.M)) == 2 * len(BLOCKS)
