"""`ajgdata export`: a small project, trained and exported, and the example of ONNX Runtime."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from exported_models import RATE_HZ, tones
from typer.testing import CliRunner
from worlds import Project

from ajgdata.cli.main import app
from ajgdata.evaluate import in_use
from ajgdata.paths import Paths
from ajgdata.pipeline.train import train_model
from ajgdata.store.audio import file_sha256, write_pcm24
from ajgdata.store.features import read_store
from ajgdata.types import Recording, Target, TrainingSettings

pytest.importorskip("onnx")
pytest.importorskip("onnxscript")
pytest.importorskip("onnxruntime")
EXAMPLE = Path(__file__).resolve().parents[2] / "docs/examples/onnx_predict.py"
TARGETS = {"object": Target(kind="classification")}


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """24 tones, and 2 of noise in which nothing is held; a model trained on them."""
    project = Project(Paths(tmp_path_factory.mktemp("export") / "project"))
    targets = {name: target.model_dump(mode="json") for name, target in TARGETS.items()}
    project.declare(targets=targets, tasks={"what": {"target": "object"}})
    rows = []
    noise = 0.1 * np.random.default_rng(1).standard_normal((2, 400))
    for number, sound in enumerate([*tones(24), *noise]):
        path = project.folder() / "audio" / f"r{number:02}.wav"
        write_pcm24(path, sound, RATE_HZ)
        row = {"recording_id": path.stem, "file": f"audio/{path.name}", "sha256": file_sha256(path)}
        held = number < 24
        row |= {"grasp_id": f"g{number // 2}", "object": "abcd"[number % 4] if held else ""}
        rows.append(Recording(**row))
    project.write(rows)
    project.build("s1", targets=TARGETS)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(in_use, "CALIBRATION_FOLDS", 2)
        train_model(
            read_store(project.paths.features("d")),
            TrainingSettings(target="object", kind="classification", unit="", groups="grasp_id"),
            model="cnn",
            seed=0,
            folder=project.paths.model("d", "what", "cnn"),
        )
    return project


@pytest.fixture(scope="module")
def exported(trained, tmp_path_factory):
    """The folder with the model, exported by the command."""
    folder = tmp_path_factory.mktemp("exported")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(trained.root)
        words = ["export", "d", "what", "cnn", "--out", str(folder)]
        done = CliRunner().invoke(app, words, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    assert "d-what-cnn.onnx" in done.output
    return folder


def test_the_example_with_onnx_runtime(exported, trained, tmp_path):
    sound = trained.folder() / "audio/r01.wav"
    write_pcm24(tmp_path / "fast.wav", tones(1)[0], 16_000)

    def example(model, recording):
        command = [sys.executable, EXAMPLE, exported / model, recording]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        return done.stdout + done.stderr

    verdict, *lines = example("d-what-cnn.onnx", sound).splitlines()
    assert verdict.startswith("known (novelty 0.")
    assert lines[0].endswith("% b")
    assert example("d-what-cnn.onnx", trained.folder() / "audio/r25.wav").startswith("nothing ")
    said = example("d-what-cnn.onnx", tmp_path / "fast.wav")
    assert "sampled at 16000 Hz, the model needs 8000 Hz" in said
