"""The tutorial's commands, in its order, in a project of their own."""

import os
import re
import runpy
import shlex
import subprocess
import sys
from pathlib import Path
from unittest.mock import patch

import pytest
import yaml

from ajgdata.cli import main
from ajgdata.paths import Paths
from ajgdata.store.features import read_store
from ajgdata.store.tables import read_tables

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(sh|yaml)\n(.*?)^```", TEXT, flags=re.M | re.S)
#: What a project's folder holds before anything of one's own.
GIVEN = ("Snakefile", "workflow", "profiles", "tests", "docs", "environment.yml")


def run(command: str) -> None:
    """A line of the shell, in this process where it does not start the workflow."""
    program, *arguments = shlex.split(command)
    if program == "snakemake":
        environment = os.environ | {"PYTHONPATH": str(ROOT)}
        subprocess.run([sys.executable, "-m", "snakemake", *arguments], env=environment, check=True)
    elif program == "ajgdata":
        with patch.object(sys, "argv", [program, *arguments]), pytest.raises(SystemExit) as ended:
            main()
        assert ended.value.code in (0, None), command
    elif arguments[0] == "-c":
        exec(compile(arguments[1], command, "exec"), {})
    else:
        with patch.object(sys, "argv", arguments):
            runpy.run_path(arguments[0], run_name="__main__")


def test_the_tutorial(tmp_path, monkeypatch, capfd):
    paths = Paths(tmp_path / "project")
    paths.datasets.mkdir(parents=True)
    for name in GIVEN:
        (paths.root / name).symlink_to(ROOT / name)
    monkeypatch.chdir(paths.root)
    monkeypatch.delenv("AJGDATA_ROOT", raising=False)
    said = {}
    for kind, block in BLOCKS:
        if kind == "yaml":
            declared = yaml.safe_load(block)
            assert paths.dataset(declared["name"]).is_file()  # the import made the first one
            paths.dataset(declared["name"]).write_text(block)
            continue
        for command in block.splitlines():
            run(command)
            said[command] = capfd.readouterr().out
    assert said["python docs/examples/make_takes.py takes"].startswith("18 recordings of 3 objects")
    assert "19 recordings checked: 0 errors, 0 warnings" in said["ajgdata validate takes"]
    assert "18 added" in said["ajgdata import takes --dataset mine"]
    assert "18 recordings checked: 0 errors, 0 warnings" in said["ajgdata validate mine"]
    assert "18 of 18 grasps of 3 objects in 1 sessions" in said["ajgdata info mine"]
    store = read_store(paths.features("mine"))
    assert store.feature.shape == (18, 1025)
    assert set(store.columns["label"].values.tolist()) == {"cube", "ball", "bar"}
    about, tables = read_tables(paths.experiment("mine", "label", "cross_validation-linear"))
    assert about["parts"]["grouped"]["recordings"] == 18
    scores = tables[0].where(part="grouped", metric="accuracy")
    reached, chance = (scores.where(statistic=s).numbers("value")[0] for s in ("mean", "chance"))
    assert reached > 2 * chance
    status = next(text for command, text in said.items() if command.startswith("ajgdata status"))
    assert "train would run (missing)" in status
    assert "features would run" not in status
    assert (paths.root / "mine-1.0.0" / "SHA256SUMS").is_file()


def test_every_command_of_the_tutorial_is_found():
    assert sum(kind == "sh" for kind, _ in BLOCKS) == len(re.findall(r"^```sh", TEXT, flags=re.M))
    assert len(re.findall(r"^```", TEXT, flags=re.M)) == 2 * len(BLOCKS)
