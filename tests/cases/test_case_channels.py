"""Channels are microphones, counted from 1, and are treated the same in every place."""

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from recorded import make_features
from sounds import FRAMES, RATE_HZ, resonances, write_wav

from ajgdata.features.channels import channel_statistics
from ajgdata.loading import load_predictor, read_predictor
from ajgdata.pipeline.acquire_live import open_hands
from ajgdata.pipeline.train import train_model
from ajgdata.store.features import read_store
from ajgdata.store.sessions import read_dataset, write_session
from ajgdata.types import Acquisition, AudioSettings, DataError, Session

ROOT = Path(__file__).resolve().parents[2]


def sweep() -> np.ndarray:
    """A loop-back of the played sound: a logarithmic sweep (frames,) with a peak of 0.5."""
    time = np.arange(FRAMES) / FRAMES
    cycles = 20 * (FRAMES / RATE_HZ) / np.log(1000) * np.expm1(time * np.log(1000))
    return 0.5 * np.sin(2 * np.pi * cycles)


def write_folder(folder: Path, second, grasps: int = 3) -> None:
    """Write stereo files of two objects: the microphone, and what `second` returns for it."""
    for number, label in enumerate(("cube", "ball")):
        for grasp in range(1, grasps + 1):
            microphone = resonances(number, grasp)
            channels = np.stack([microphone, second(microphone)], axis=1)
            write_wav(folder / f"{grasp + grasps * number}_{label}.wav", channels)


def noise(level: float) -> np.ndarray:
    return level * np.random.default_rng(1).standard_normal(FRAMES)


UNEQUAL = {
    "loop-back": lambda microphone: sweep(),
    "11 dB quieter": lambda microphone: 10 ** (-11 / 20) * microphone,
    "no cable": lambda microphone: np.zeros(FRAMES),
    "other sound": lambda microphone: noise(float(np.sqrt(np.mean(microphone**2)))),
    "opposite sign": lambda microphone: -microphone,
    "8 ms later": lambda microphone: np.roll(microphone, 353) + noise(0.05),
}


@pytest.mark.parametrize("name", UNEQUAL)
def test_channels_with_different_sounds_stop_the_import(ajgdata, src, paths, name):
    write_folder(src, UNEQUAL[name])
    stopped = ajgdata("import", src, "--dataset", "mine")
    assert stopped.code == 1
    assert stopped.err.count("\n") == 1
    for part in ("microphone 1: level ", "microphone 2: level ", "correlation ", "--microphone"):
        assert part in stopped.text
    assert not paths.dataset("mine").exists() and not paths.recordings("mine").exists()
    chosen = ajgdata("import", src, "--dataset", "mine", "--microphone", "1")
    assert chosen.code == 0
    assert "44100 Hz, microphone 1, targets label" in chosen.text
    assert read_dataset(paths, "mine").audio.microphone == 1
    assert ajgdata("check", "mine").code == 0


def test_the_printed_level_and_correlation_are_those_of_the_samples(ajgdata, src):
    half = 10 ** (-20 / 20)
    write_folder(src, lambda microphone: 0.25 + half * microphone)  # an offset is not a level
    text = ajgdata("import", src, "--dataset", "mine").text
    levels = [float(part.split()[0]) for part in text.split("level ")[1:]]
    assert levels[0] - levels[1] == pytest.approx(20, abs=0.11)
    assert text.count("correlation 1.00") == 2


@pytest.mark.parametrize(
    ("second", "name"),
    [
        (lambda microphone: microphone, "copy"),
        (lambda microphone: 0.4 * microphone, "8 dB quieter"),
        (lambda microphone: microphone + noise(0.002), "own noise"),
    ],
)
def test_channels_with_one_sound_are_averaged_with_a_note(ajgdata, src, paths, second, name):
    write_folder(src, second)
    done = ajgdata("import", src, "--dataset", "mine")
    assert done.code == 0
    assert "audio.microphone: the mean of all channels is used" in done.text
    assert "microphone 2: level" in done.text
    assert read_dataset(paths, "mine").audio.microphone == "mean"


def test_three_channels_are_compared_with_each_other(ajgdata, src, paths):
    for n, label in enumerate(("cube", "ball")):
        sound = resonances(n, 1)
        write_wav(src / f"{n + 1}_{label}.wav", np.stack([sound, sound, noise(0.05)], axis=1))
    stopped = ajgdata("import", src, "--dataset", "mine")
    assert stopped.code == 1
    assert "microphone 3: level" in stopped.text and "one of 1, 2, 3" in stopped.text
    refused = ajgdata("import", src, "--dataset", "mine", "--microphone", 4)
    assert refused.code == 1
    assert "microphone 4 is not in the files, which have up to 3 channels" in refused.text
    assert ajgdata("import", src, "--dataset", "mine", "--microphone", 3).code == 0
    assert read_dataset(paths, "mine").audio.microphone == 3


def test_statistics_of_silent_and_damaged_recordings():
    assert channel_statistics([np.zeros((10, 2), np.float32)]) is None
    bad = np.full((10, 2), np.nan, np.float32)
    good = np.stack([resonances(0, 1), 0.5 * resonances(0, 1)], axis=1).astype(np.float32)
    statistics = channel_statistics([bad, good])
    assert statistics.level_range_db == pytest.approx(20 * np.log10(2), abs=1e-4)
    assert statistics.lowest_correlation == pytest.approx([1, 1])
    assert statistics.are_alike


def test_a_folder_of_mono_and_stereo_files_is_reported(ajgdata, src, paths):
    write_folder(src, lambda microphone: microphone)
    write_wav(src / "7_cube.wav", resonances(0, 7))
    done = ajgdata("import", src, "--dataset", "mine")
    assert done.code == 3
    assert "channels files have: 1 (1 file) and 2 (6 files) channels" in done.text
    assert "channels 1_cube.wav: has 2 channels" in done.text
    assert "channels 7_cube.wav" not in done.text
    assert read_dataset(paths, "mine").audio.microphone is None
    for option, unusable in (("1", 0), ("2", 1), ("mean", 0)):
        done = ajgdata("import", src, "--dataset", f"m{option}", "--microphone", option)
        assert done.code == 3
        assert ("channels 7_cube.wav: has 1 channel, " in done.text) == bool(unusable)
        assert ajgdata("check", f"m{option}").code == (3 if unusable else 0)


def test_files_with_two_and_three_channels_stop_the_import(ajgdata, src, paths):
    write_folder(src, lambda microphone: microphone)
    write_wav(src / "7_cube.wav", np.stack([resonances(0, 7)] * 3, axis=1))
    stopped = ajgdata("import", src, "--dataset", "mine")
    assert stopped.code == 1
    assert "has files with 2 (6 files) and 3 (1 file) channels. Add --microphone" in stopped.text
    assert not paths.recordings("mine").exists()
    done = ajgdata("import", src, "--dataset", "mine", "--microphone", 3)
    assert done.code == 3
    assert done.text.count("has 2 channels, and the data set uses microphone 3") == 6


def test_a_declared_data_set_keeps_its_microphone(ajgdata, src):
    write_folder(src, UNEQUAL["loop-back"])
    again = ("import", src, "--dataset", "mine", "--microphone")
    assert ajgdata(*again, 1).code == 0
    assert ajgdata(*again, 1).code == 0
    assert ajgdata(*again[:-1]).code == 0
    refused = ajgdata(*again, "mean")
    assert refused.code == 1
    assert "mean is not the microphone of" in refused.text and "declares 1" in refused.text


@pytest.mark.parametrize("value", ["0", "-1", "1.0", "true", "mono", "left", "²"])
def test_other_values_of_the_option_are_one_line(ajgdata, src, value):
    write_folder(src, lambda microphone: microphone)
    refused = ajgdata("import", src, "--dataset", "mine", f"--microphone={value}")
    assert refused.code == 1
    assert refused.err.count("\n") == 1
    assert (
        "not a microphone: use its number, counted from 1, a list of numbers, or mean"
        in refused.text
    )


@pytest.mark.parametrize("value", ["true", "false", "0", "-1", "1.5", "1.0", "'1'", "mono", "[1]"])
def test_other_values_in_dataset_yaml_are_one_line(ajgdata, paths, value):
    paths.dataset("mine").parent.mkdir()
    paths.dataset("mine").write_text(f"name: mine\naudio:\n  microphone: {value}\n")
    refused = ajgdata("check", "mine")
    assert refused.code == 1
    assert refused.err.count("\n") == 1
    assert "dataset.yaml:3: audio.microphone" in refused.text
    assert (
        "not a microphone: use its number, counted from 1, a list of numbers, or mean"
        in refused.text
    )


@pytest.mark.parametrize(
    ("old", "line"),
    [
        ("0", "Replace `channel: 0` by `microphone: 1`."),
        ("1", "Replace `channel: 1` by `microphone: 2`."),
        ("mean", "Replace `channel: mean` by `microphone: mean`."),
        ("mono", "Delete `channel: mono`"),
        ("true", "Replace `channel: true` by `microphone: N`"),
    ],
)
def test_the_old_key_is_refused_with_the_line_to_write(ajgdata, paths, old, line):
    paths.dataset("mine").parent.mkdir()
    paths.dataset("mine").write_text(f"name: mine\naudio:\n  channel: {old}\n")
    refused = ajgdata("check", "mine")
    assert refused.code == 1
    assert refused.err.count("\n") == 1
    assert "dataset.yaml:3: audio.channel was replaced by audio.microphone" in refused.text
    assert line in refused.text


@pytest.fixture
def trained(ajgdata, src, paths):
    """A model of stereo files: microphone 1, and a loop-back in channel 2."""
    write_folder(src, UNEQUAL["loop-back"], grasps=6)
    assert ajgdata("import", src, "--dataset", "mine", "--microphone", 1).code == 0
    spec = read_dataset(paths, "mine")
    make_features(paths, "mine")
    train_model(
        read_store(paths.features("mine")),
        spec.training("label"),
        model="knn",
        seed=0,
        task="label",
        folder=paths.model("mine", "label", "knn"),
    )
    return load_predictor("mine", "label", "knn", paths.root)


def test_a_prediction_uses_the_microphone_of_the_training(trained, tmp_path, src):
    new = resonances(1, 99)
    mono = write_wav(tmp_path / "mono.wav", new)
    stereo = write_wav(tmp_path / "stereo.wav", np.stack([new, sweep()], axis=1))
    swapped = write_wav(tmp_path / "swapped.wav", np.stack([sweep(), new], axis=1))
    assert trained.audio.microphone == 1
    assert trained.predict_file(stereo) == trained.predict_file(mono)
    assert trained.predict_file(stereo).novelty != trained.predict_file(swapped).novelty
    second = dataclasses.replace(trained, audio=AudioSettings(microphone=2))
    assert second.predict_file(swapped) == trained.predict_file(mono)
    with pytest.raises(DataError, match="has 1 channel, and the data set uses microphone 2"):
        second.predict_file(mono)
    none = dataclasses.replace(trained, audio=AudioSettings())
    with pytest.raises(DataError, match="has 2 channels, and the data set does not specify a"):
        none.predict_file(stereo)


def test_sense_records_the_microphone_of_the_training(paths, trained, monkeypatch):
    from ajgdata.pipeline import acquire_live

    opened = []

    def open_card(settings):
        opened.append(settings.microphone)
        raise DataError("card", "was opened", "stop here")

    monkeypatch.setattr(acquire_live, "open_card", open_card)
    spec = read_dataset(paths, "mine")

    def sense(used, **card):
        with open_hands(
            paths,
            spec,
            source="soundcard",
            card={"device": "x", **card},
            robot=None,
            seed=0,
            confirm=lambda text: None,
            rate_hz=RATE_HZ,
            microphone=used,
        ):
            pass

    for microphone, card in ((2, {}), (None, {}), (2, {"microphone": 4})):
        with pytest.raises(DataError, match="was opened"):
            sense(microphone, **card)
    assert opened == [2, 1, 4]
    with pytest.raises(DataError, match="trained with the mean of all microphones"):
        sense("mean")
    with pytest.raises(DataError, match="Replace `input_channel: 2` by `microphone: 2`"):
        sense(None, input_channel=2)
    with pytest.raises(DataError, match="microphone = True"):
        sense(None, microphone=True)


@pytest.mark.parametrize("key", ["microphone", "input_channel"])
def test_sense_records_the_microphone_of_the_sessions(paths, monkeypatch, key):
    """`ajgdata record --microphone 2` writes files of one channel: dataset.yaml names none."""
    from ajgdata.pipeline import acquire_live

    paths.dataset("mine").parent.mkdir()
    paths.dataset("mine").write_text("name: mine\n")
    spec = read_dataset(paths, "mine")
    opened = []

    def open_card(settings):
        opened.append(settings.microphone)
        raise DataError("card", "was opened", "stop here")

    def sense(**card):
        with open_hands(
            paths,
            spec,
            source="soundcard",
            card={"device": "x", **card},
            robot=None,
            seed=0,
            confirm=lambda text: None,
            rate_hz=RATE_HZ,
            microphone=None,
        ):
            pass

    def recorded_with(session, number):
        setup = {"device": {key: number}}
        acquisition = Acquisition(finished=True, setup=setup)
        declared = Session(session_id=session, source="soundcard", acquisition=acquisition)
        folder = paths.session("mine", session)
        folder.mkdir(parents=True, exist_ok=True)
        write_session(folder, declared, [])

    monkeypatch.setattr(acquire_live, "open_card", open_card)
    recorded_with("first", 2)
    with pytest.raises(DataError, match="was opened"):
        sense()
    recorded_with("second", 3)
    with pytest.raises(DataError, match=r"several microphones: 2 \(first\), 3 \(second\)"):
        sense()
    with pytest.raises(DataError, match="was opened"):
        sense(microphone=3)
    assert opened == [2, 3]


def test_a_sound_card_does_not_record_into_a_data_set_of_microphone_2(ajgdata, paths):
    paths.dataset("mine").parent.mkdir()
    protocol = {"objects": [{"name": "cube"}], "robot": {"command": ["true"]}}
    content = {"name": "mine", "audio": {"microphone": 2}, "protocol": protocol}
    paths.dataset("mine").write_text(yaml.safe_dump(content))
    refused = ajgdata("record", "mine", "--device", "x", "--microphone", 2, "--yes")
    assert refused.code == 1
    assert "audio.microphone is 2, and a sound card writes one channel" in refused.text
    assert not paths.recordings("mine").exists()


def test_a_model_of_an_older_version_must_be_trained_again(ajgdata, paths, trained):
    file = paths.model("mine", "label", "knn") / "model.json"
    about = json.loads(file.read_text())
    del about["audio"]["microphone"]
    about["audio"]["channel"] = 0
    file.write_text(json.dumps(about))
    with pytest.raises(DataError) as refused:
        read_predictor(file.parent, "mine", "label")
    assert "channel was replaced by microphone" in refused.value.problem
    assert refused.value.fix.startswith("run `ajgdata train mine label --model knn --force`")
    sensed = ajgdata("sense", "mine", "label", "knn", "--device", "x")
    assert sensed.code == 1
    assert sensed.err.count("\n") == 1 and "ajgdata train mine label" in sensed.text


#: Replaces ONNX Runtime: stores the samples that the example gives to the model.
RUNTIME = """
import json, os
import numpy as np
class Meta:
    def __init__(self): self.custom_metadata_map = {"ajgdata": os.environ["ABOUT"]}
class InferenceSession:
    def __init__(self, model, providers): pass
    def get_modelmeta(self): return Meta()
    def get_outputs(self): return []
    def run(self, names, inputs):
        np.save(os.environ["SAMPLES"], inputs["waveform"])
        raise SystemExit("used")
"""


def test_the_onnx_example_uses_the_microphone_of_the_training(tmp_path, monkeypatch):
    """It cannot import the package, so its lines are compared with the function of the training."""
    import runpy

    from ajgdata.store.audio import AudioError, read_audio

    (tmp_path / "onnxruntime.py").write_text(RUNTIME)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "onnxruntime", raising=False)
    monkeypatch.setenv("SAMPLES", str(tmp_path / "samples.npy"))
    mono = write_wav(tmp_path / "mono.wav", resonances(1, 99))
    both = np.stack([resonances(1, 99), sweep()], axis=1)
    stereo = write_wav(tmp_path / "stereo.wav", both)
    for microphone in (None, 1, 2, "mean"):
        about = {"sample_rate_hz": RATE_HZ, "microphone": microphone, "features": {"window": 2048}}
        monkeypatch.setenv("ABOUT", json.dumps(about))
        for path in (mono, stereo):
            monkeypatch.setattr(sys, "argv", ["onnx_predict.py", "m.onnx", str(path)])
            with pytest.raises(SystemExit) as ended:
                runpy.run_path(str(ROOT / "docs/examples/onnx_predict.py"))
            try:
                expected = read_audio(path, AudioSettings(microphone=microphone)).samples
            except AudioError:
                assert "the model needs" in ended.value.code
                continue
            assert ended.value.code == "used"
            (samples,) = np.load(tmp_path / "samples.npy")
            np.testing.assert_array_equal(samples, expected)
    sys.modules.pop("onnxruntime", None)


def test_the_onnx_file_names_the_microphone(trained):
    from ajgdata.cli.export import onnx_metadata

    about = {"seed": 0, "target": "label", "recordings": 1, "period": None, "provenance": {}}
    assert onnx_metadata(trained, about)["microphone"] == 1
