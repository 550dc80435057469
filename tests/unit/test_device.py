"""The device of trainings: the CPU unless a setting names a GPU, and no trace of it afterwards."""

import numpy as np
import pytest
import torch

from ajgdata.embed import encoder
from ajgdata.models import cnn
from ajgdata.models.device import device_facts, training_device, training_on
from ajgdata.pipeline.jobs import logged
from ajgdata.types import DataError, Embedding

HAS_GPU = torch.cuda.is_available()
needs_gpu = pytest.mark.skipif(not HAS_GPU, reason="PyTorch finds no GPU on this computer")
without_gpu = pytest.mark.skipif(HAS_GPU, reason="this computer has a GPU")
ROWS = np.random.default_rng(0).random((40, 64), np.float32)
LABEL = np.arange(40) // 10
GRASP = np.arange(40) // 2
SETTINGS = Embedding(
    supervision="objects", target="object", epochs=2, batch_instances=4, batch_recordings=4
)
QUICK = {"epochs": 1, "min_steps": 20}


def trained() -> list[np.ndarray]:
    """Weights of a classifier, and latents of two encoders."""
    weights = cnn.CnnClassifier(**QUICK).fit(ROWS, LABEL).__getstate__()["module_"]
    return [*weights.values(), *(network.encode(ROWS) for network in encoders())]


def encoders() -> list[encoder.Encoder]:
    return encoder.train_encoders(ROWS, LABEL, GRASP, dimensions=(2, 3), settings=SETTINGS, seed=0)


@pytest.mark.parametrize("device", ["cpu", pytest.param("auto", marks=without_gpu)])
def test_on_the_cpu_the_setting_changes_no_bit_and_no_description(device):
    default = trained()
    with training_on(device):
        assert (training_device(), device_facts()) == ("cpu", {})
        again = trained()
    assert [part.tobytes() for part in again] == [part.tobytes() for part in default]


@without_gpu
def test_a_gpu_that_is_missing_ends_the_job_with_one_line(tmp_path):
    with (
        pytest.raises(SystemExit) as stopped,
        logged(str(tmp_path / "job.log")),
        training_on("cuda"),
    ):
        pytest.fail("the job began")
    assert stopped.value.code == (tmp_path / "job.log").read_text().rstrip("\n")
    assert stopped.value.code.startswith("device=cuda: PyTorch finds no GPU on this computer. Use")
    assert training_device() == "cpu"


def test_a_failed_block_restores_the_device(monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    with pytest.raises(DataError), training_on("auto"):
        assert (training_device(), device_facts()) == ("cuda", {"device": "cuda"})
        raise DataError("a", "b", "c")
    assert (training_device(), device_facts()) == ("cpu", {})


@pytest.mark.parametrize(
    "train",
    [encoders, cnn.CnnClassifier(**QUICK).fit, cnn.CnnRegressor(**QUICK).fit],
    ids=["encoders", "classifier", "regressor"],
)
def test_all_tensors_of_a_training_are_on_its_device(monkeypatch, train):
    """Torch's device `meta`, which has shapes and no numbers, refuses a tensor of the CPU; it
    cannot be copied back to it."""
    losses = []
    for module in (cnn, encoder):
        monkeypatch.setattr(module, "training_device", lambda: "meta")
    monkeypatch.setattr(cnn.Descent, "step", lambda self, loss: losses.append(loss.device.type))
    with pytest.raises(NotImplementedError, match="Cannot copy out of meta tensor"):
        train(*(() if train is encoders else (ROWS, LABEL)))
    assert set(losses) == {"meta"}


@needs_gpu
def test_training_on_a_gpu_gives_models_of_the_cpu():
    reference = cnn.CnnClassifier(**QUICK).fit(ROWS, LABEL)
    with training_on("cuda"):
        assert device_facts() == {"device": "cuda"}
        model = cnn.CnnClassifier(**QUICK).fit(ROWS, LABEL)
    assert {str(value.device) for value in model.module_.state_dict().values()} == {"cpu"}
    assert model.predict_proba(ROWS).shape == (40, 4)
    assert model.__getstate__()["module_"].keys() == reference.__getstate__()["module_"].keys()
    assert torch.equal(model.module_.scale, reference.module_.scale)  # counted, not trained
