"""The tutorial's commands, in its order, in a project of their own, with a card that is none."""

import os
import re
import runpy
import shlex
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np
import pytest
import yaml

from ajgdata.acquire import line, robot, sound_card
from ajgdata.cli import main
from ajgdata.paths import Paths
from ajgdata.pipeline import acquire_live
from ajgdata.store.features import read_store
from ajgdata.store.tables import read_measurements

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(sh|yaml)\n(.*?)^```", TEXT, flags=re.M | re.S)
#: What a project's folder holds before anything of one's own.
GIVEN = (
    "Snakefile",
    "workflow",
    "profiles",
    "tests",
    "docs",
    "config",
    "README.md",
    "tools",
    "pyproject.toml",
)


CARD = "USB Audio CODEC"
HELD = ("cube", "ball", "bar")


@pytest.fixture
def bench(monkeypatch):
    """A person, a gripper and its sound card: each object has a response, each grasp is another."""
    sys.path.insert(0, str(ROOT / "tests" / "unit"))
    try:
        from fake_card import FakeLine, fake_card
    finally:
        sys.path.pop(0)
    fake = FakeLine(noise=1e-4)
    drawn = np.random.default_rng(0)
    rings = {name: 0.15 * drawn.standard_normal(64) for name in ("", *HELD)}

    def hold(name=""):
        fake.response = rings[name] * np.exp(-np.arange(64) / drawn.uniform(9, 15))

    def move(self, step, **about):
        if step == "approach":
            hold(about["object"])
        return moved(self, step, **about)

    @contextmanager
    def opened(settings):
        assert settings.device == CARD
        yield fake_card(fake, **settings.model_dump())

    hold()
    moved = robot.ManualRobot.move
    monkeypatch.setattr(robot.ManualRobot, "move", move)
    monkeypatch.setattr("builtins.input", lambda: "")
    for module in (acquire_live, sound_card):
        monkeypatch.setattr(module, "open_card", opened)
    listed = {"name": CARD, "api": "ALSA", "inputs": 2, "outputs": 2, "rate_hz": 44_100}
    monkeypatch.setattr(line, "list_devices", lambda: [listed])
    monkeypatch.setattr(robot, "time", SimpleNamespace(sleep=lambda seconds: None))


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


@pytest.mark.slow
def test_the_tutorial(tmp_path, monkeypatch, capfd, bench):
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
            paths.dataset(declared["name"]).parent.mkdir()
            paths.dataset(declared["name"]).write_text(block)
            continue
        for command in block.splitlines():
            run(command)
            said[command] = capfd.readouterr().out
    assert CARD in said["ajgdata device list"]
    (checked,) = (text for command, text in said.items() if command.startswith("ajgdata device c"))
    assert "good         the card is ready: record" in checked
    (recorded,) = (text for command, text in said.items() if command.startswith("ajgdata record"))
    assert "mine/soundcard-01: 20 recorded, all grasps are recorded" in recorded
    assert "20 recordings checked: 0 errors, 0 warnings" in said["ajgdata check mine"]
    assert said["python docs/examples/make_takes.py takes"].startswith("18 recordings of 3 objects")
    assert "18 added" in said["ajgdata import takes --dataset earlier"]
    assert "note simulated:" in said["ajgdata import takes --dataset earlier"]
    assert "18 recordings checked: 0 errors, 0 warnings" in said["ajgdata check earlier"]
    store = read_store(paths.features("mine"))
    # 18 grasps and 2 references.
    assert store.feature.shape == (20, 1025)
    assert set(store.columns["label"].values.tolist()) == {"cube", "ball", "bar", ""}
    measurements = read_measurements(paths.experiment("mine", "label", "cross_validation", "plain"))
    about, tables = next(item for item in measurements if item[0]["model"] == "linear")
    assert about["parts"]["grouped"]["recordings"] == 18
    scores = tables[0].where(split="grouped", metric="accuracy")
    reached, chance = (scores.where(statistic=s).numbers("value")[0] for s in ("mean", "chance"))
    assert reached > 2 * chance
    status = next(text for command, text in said.items() if command.startswith("ajgdata status"))
    assert status.startswith("everything is up to date: ")
    ran = said["ajgdata run mine"].splitlines()
    assert ran[0].startswith("snakemake --config 'datasets=[mine]'")
    assert (paths.root / "mine-1.0.0" / "SHA256SUMS").is_file()
