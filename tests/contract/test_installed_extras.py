"""The wheel with each extra, alone in a new environment: what it promises works, the rest says how.

One environment is 0.3 to 1.3 GB, so each is deleted after its test.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import soundfile
import yaml

from tools.measure_extras import build_wheel, install

pytestmark = pytest.mark.slow
RATE_HZ = 44_100
#: Frequency of the tone of each object.
OBJECTS = {"ball": 1_000, "cube": 1_500, "bar": 2_200}
#: A command of each extra.
COMMANDS = {
    "workflow": ["run", "mine"],
    "simulate": ["scene", "virtual", "cube"],
    "publish": ["publish", "mine"],
    "export": ["export", "mine", "label"],
}
#: A simulated data set on a coarse grid: for this test, not for results.
VIRTUAL = {
    "name": "virtual",
    "targets": {"object": {"kind": "classification"}},
    "recipe": {
        "grasps_per_object": 2,
        "scene": {"numerics": {"dx_mm": 6, "max_time_s": 0.006}},
        "objects": [{"name": "cube", "shape": {"kind": "cube", "edge_mm": 20}}],
    },
}
LIGHT_USE = """
import ajgdata
with ajgdata.load_features("mine") as features:
    assert features.feature.shape == (18, 1025)
train, test = ajgdata.load_dataset("mine").folds("label")[0]
assert len(train.X) + len(test.X) == 18
predictor = ajgdata.load_predictor("mine", "label", "linear")
prediction = predictor.predict_file("../recordings/1_ball.wav")
assert prediction.value == "ball", prediction
arrays = dict(kind="classification", folds=3)
result = ajgdata.cross_validate(train.X, train.y, train.groups, model="linear", **arrays)
score = ajgdata.estimate_score(result, train.groups)
assert score.value > score.chance, score
try:
    ajgdata.cross_validate(train.X, train.y, train.groups, model="cnn", **arrays)
except Exception as error:
    print(error)
"""
TRAINING = """
import ajgdata
from ajgdata.paths import Paths
from ajgdata.pipeline.train import train_final_model
paths = Paths()
spec = ajgdata.load_dataset("mine").spec
train_final_model(
    paths.features("mine"), [], settings=spec.training("label"), task="label", model="cnn", seed=0,
    folder=paths.model("mine", "label", "cnn"), dataset="mine", audio=spec.audio,
    features=spec.features, paths=paths,
)
predictor = ajgdata.load_predictor("mine", "label", "cnn")
print(predictor.predict_file("../recordings/1_ball.wav").value)
"""
DASHBOARD = """
from urllib.request import urlopen
from ajgdata.live.dashboard import dashboard
from ajgdata.live.steps import Control
with dashboard(Control()) as served:
    print(urlopen(served.address).status)
"""


@dataclass
class Installed:
    """An environment, and a project in which its commands run."""

    python: Path
    project: Path

    def run(self, *command: str) -> subprocess.CompletedProcess[str]:
        changed = {"PYTHONPATH", "AJGDATA_ROOT", "VIRTUAL_ENV"}
        environment = {name: text for name, text in os.environ.items() if name not in changed}
        path = f"{self.python.parent}{os.pathsep}{environment['PATH']}"
        return subprocess.run(
            command,
            cwd=self.project,
            env=environment | {"PATH": path, "COLUMNS": "200"},
            check=False,
            capture_output=True,
            text=True,
        )

    def ajgdata(self, *arguments: str, code: int = 0) -> str:
        """Return what a command prints. Its exit code must be `code`."""
        done = self.run(str(self.python.with_name("ajgdata")), *arguments)
        assert done.returncode == code, done.stdout + done.stderr
        return done.stdout + done.stderr

    def program(self, text: str) -> str:
        """Return what a program prints."""
        done = self.run(str(self.python), "-c", text)
        assert done.returncode == 0, done.stderr
        return done.stdout

    def check_missing(self, extras: Sequence[str]) -> None:
        """Check that commands of extras print one line."""
        for extra in extras:
            text = self.ajgdata(*COMMANDS[extra], code=1)
            assert text.startswith("error ")
            assert text.endswith(f'is not installed. Run `pip install "ajgdata[{extra}]"`.\n')
            assert text.count("\n") == 1


def write_recordings(folder: Path) -> None:
    """Write six recordings per object: tones of slightly different frequencies, and noise."""
    folder.mkdir()
    random = np.random.default_rng(0)
    time_s = np.arange(RATE_HZ // 2) / RATE_HZ
    number = 0
    for name, frequency_hz in OBJECTS.items():
        for grasp in range(6):
            number += 1
            tone = np.sin(2 * np.pi * (frequency_hz + 10 * grasp) * time_s)
            samples = 0.3 * tone + 0.01 * random.normal(size=len(time_s))
            soundfile.write(folder / f"{number}_{name}.wav", samples, RATE_HZ, subtype="PCM_24")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    if not (Path(__file__).parents[2] / ".git").exists():
        pytest.skip("needs a clone")
    return build_wheel(tmp_path_factory.mktemp("wheel"))


@contextmanager
def environment(wheel: Path, extra: str, folder: Path) -> Iterator[Path]:
    """Yield the Python of a new environment, and delete the environment."""
    try:
        yield install(wheel, extra, folder / "environment")
    finally:
        shutil.rmtree(folder / "environment", ignore_errors=True)


@pytest.fixture(scope="module")
def finished(wheel, tmp_path_factory):
    """A project after `ajgdata run`, made with the extra `workflow` alone."""
    folder = tmp_path_factory.mktemp("workflow")
    write_recordings(folder / "recordings")
    with environment(wheel, "workflow", folder) as python:
        lab = Installed(python, folder)
        lab.ajgdata("new", "lab")
        lab.project = folder / "lab"
        lab.ajgdata("import", "../recordings", "--dataset", "mine")
        lab.ajgdata("check", "mine")
        declaration = lab.project / "datasets/virtual/dataset.yaml"
        declaration.parent.mkdir()
        declaration.write_text(yaml.safe_dump(VIRTUAL))
        lab.ajgdata("run", "mine", "--cores", "2")
        assert (lab.project / "results/runs/mine/report/index.html").is_file()
        assert "up to date" in lab.ajgdata("status", "mine")
        lab.check_missing(["simulate", "publish", "export"])
        text = lab.ajgdata("run", "virtual", code=1)
        line = 'virtual/dataset.yaml: recipe: numba is not installed. Run `pip install "ajgdata[sim'
        assert line in text
        assert "Traceback" not in text
    return lab.project


@pytest.fixture
def lab(request, wheel, finished, tmp_path):
    """The environment of an extra, with a copy of the finished project."""
    project = tmp_path / "lab"
    shutil.copytree(finished, project)
    shutil.copytree(finished.parent / "recordings", tmp_path / "recordings")
    with environment(wheel, request.param, tmp_path) as python:
        yield Installed(python, project)


only = pytest.mark.parametrize


@only("lab", [""], indirect=True)
def test_without_extras(lab):
    lab.ajgdata("doctor")
    assert "18 recordings checked" in lab.ajgdata("check", "mine")
    lab.ajgdata("import", "../recordings", "--dataset", "second")
    text = lab.program(LIGHT_USE)
    assert text == 'model cnn: torch is not installed. Run `pip install "ajgdata[cnn]"`.\n'
    lab.check_missing(list(COMMANDS))
    line = 'sounddevice is not installed. Run `pip install "ajgdata[live]"`.\n'
    assert lab.ajgdata("device", "list", code=1).endswith(line)


@only("lab", ["cnn"], indirect=True)
def test_cnn(lab):
    assert lab.program(TRAINING).split()[-1] == "ball"
    lab.program("from ajgdata.embed.projections import make_reducer; make_reducer('umap', 2, 0)")
    lab.check_missing(["workflow"])


@only("lab", ["simulate"], indirect=True)
def test_simulate(lab):
    assert "virtual-cube.svg" in lab.ajgdata("scene", "virtual", "cube")
    lab.ajgdata("simulate", "virtual", "--cores", "2")
    assert len(list(lab.project.glob("data/virtual/sessions/*/audio/*.wav"))) > 1
    lab.check_missing(["publish"])


@only("lab", ["publish"], indirect=True)
def test_publish(lab):
    lab.ajgdata("publish", "mine")
    assert (lab.project / "results/published/mine/metadata.parquet").is_file()
    lab.check_missing(["workflow"])


@only("lab", ["live"], indirect=True)
def test_live(lab):
    assert lab.program(DASHBOARD) == "200\n"
    done = lab.run(str(lab.python.with_name("ajgdata")), "device", "list")
    assert "ajgdata[live]" not in done.stderr  # PortAudio itself may be missing
    lab.check_missing(["workflow"])


@only("lab", ["export"], indirect=True)
def test_export(lab):
    lab.program(TRAINING)
    assert "mine-label-cnn.onnx" in lab.ajgdata("export", "mine", "label", "cnn")
    lab.check_missing(["workflow"])
