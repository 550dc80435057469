"""The feature `embedding` from import to another project: the network is a file of the user."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest
import yaml
from recorded import make_features, run_experiments
from sounds import RATE_HZ, write_wav

from ajgdata.loading import load_predictor
from ajgdata.paths import Paths
from ajgdata.pipeline.plan import plan
from ajgdata.pipeline.train import train_model
from ajgdata.store.features import read_store
from ajgdata.store.sessions import read_dataset
from ajgdata.store.tables import read_measurements
from ajgdata.types import DataError

onnx = pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")

LENGTH = RATE_HZ // 10
TONES_HZ = {"ball": 1_000, "cube": 1_500}


def write_network(path) -> str:
    """Write a network whose components are the powers of both tones; return its checksum."""
    helper = onnx.helper
    number = onnx.TensorProto.FLOAT
    phase = 2 * np.pi * np.arange(LENGTH)[:, np.newaxis] / RATE_HZ * [*TONES_HZ.values()]
    waves = np.hstack([np.sin(phase), np.cos(phase)]).astype(np.float32) / LENGTH
    sums = np.tile(np.eye(2, dtype=np.float32), (2, 1))  # sine and cosine of a tone
    graph = helper.make_graph(
        [
            helper.make_node("MatMul", ["x", "waves"], ["amplitude"]),
            helper.make_node("Mul", ["amplitude", "amplitude"], ["power"]),
            helper.make_node("MatMul", ["power", "sums"], ["y"]),
        ],
        "tones",
        [helper.make_tensor_value_info("x", number, [1, LENGTH])],
        [helper.make_tensor_value_info("y", number, [1, 2])],
        [onnx.numpy_helper.from_array(waves, "waves"), onnx.numpy_helper.from_array(sums, "sums")],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)])
    model.ir_version = 8
    content = model.SerializeToString()
    path.write_bytes(content)
    return hashlib.sha256(content).hexdigest()


def tone(label: str, seed: int) -> np.ndarray:
    generator = np.random.default_rng(seed)
    phase = 2 * np.pi * (TONES_HZ[label] * np.arange(LENGTH) / RATE_HZ + generator.uniform())
    return 0.3 * np.sin(phase) + generator.normal(0, 0.1, LENGTH)


@pytest.fixture
def tones(src, paths, ajgdata) -> str:
    """A data set of sixteen tones, whose feature is the output of the network; its checksum."""
    for seed in range(1, 17):
        label = ("ball", "cube")[seed % 2]
        write_wav(src / f"{seed}_{label}.wav", tone(label, seed))
    folder = paths.dataset("tones").parent
    folder.mkdir(parents=True)
    sha256 = write_network(folder / "tones.onnx")
    declared = {
        "name": "tones",
        "licence": "CC0-1.0",
        "authors": ["A"],
        "features": {
            "kind": "embedding",
            "file": "tones.onnx",
            "sha256": sha256,
            "length_s": LENGTH / RATE_HZ,
        },
        "targets": {"label": {"kind": "classification"}},
        "tasks": {"label": {"target": "label", "models": ["knn_plain"], "folds": 4}},
        "imports": {"pattern": "starter-kit"},
    }
    paths.dataset("tones").write_text(yaml.safe_dump(declared))
    assert ajgdata("import", src, "--dataset", "tones").code == 0
    make_features(paths, "tones")
    return sha256


def test_an_embedding_is_evaluated_and_predicts_a_file(tones, paths, ajgdata, src):
    (request,) = run_experiments(paths, "tones")
    ((_, tables),) = read_measurements(paths.experiment(*request.jobs[0]))
    scores = next(table for table in tables if table.name == "scores")
    (row,) = scores.where(metric="accuracy", statistic="mean", split="grouped").rows
    assert row["value"] == 1  # a tone has a power of 0.3² / 4 in its component, the other has none
    table = read_store(paths.features("tones"))
    settings = read_dataset(paths, "tones").training("label")
    folder = paths.model("tones", "label", "knn_plain")
    train_model(table, settings, model="knn_plain", seed=0, folder=folder)
    predictor = load_predictor("tones", "label", "knn_plain", paths.root)
    write_wav(src / "new.wav", tone("cube", 99))
    assert predictor.predict_file(src / "new.wav").value == "cube"
    printed = ajgdata("export", "tones", "label", "knn_plain")
    assert printed.code == 1
    assert "a model of the feature embedding cannot be exported" in printed.text


def test_a_published_data_set_names_the_network_that_it_lacks(tones, paths, ajgdata, tmp_path):
    printed = ajgdata("publish", "tones")
    assert printed.code == 0, printed.text
    tree = paths.published("tones")
    assert not list(tree.rglob("*.onnx"))
    card = (tree / "README.md").read_text(encoding="utf-8")
    assert f"tones.onnx, sha256 {tones}; not part of this data set" in card
    other = Paths(tmp_path / "other")
    (other.root / "datasets").mkdir(parents=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(other.root)
        printed = ajgdata("fetch", tree)
        assert printed.code == 0, printed.text
        network = other.dataset("tones").parent / "tones.onnx"
        assert "tones.onnx: copy it there" in printed.text and tones in printed.text
        for result in (ajgdata("check", "tones").text, _problem(other)):
            assert "features.file: tones.onnx does not exist" in result and tones in result
        write_network(network)
        make_features(other, "tones")
    own, fetched = (read_store(p.features("tones")).feature for p in (paths, other))
    assert np.array_equal(own, fetched)


def _problem(paths: Paths) -> str:
    """The error of a run."""
    with pytest.raises(DataError) as error:
        plan(paths, ["tones"], check=True)
    return str(error.value)
