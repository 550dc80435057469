"""Each kind of feature, with known answers."""

from __future__ import annotations

import hashlib
import sys
import tomllib
from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest
import scipy.signal

from ajgdata.features.compute import FeatureComputer
from ajgdata.features.mel import filter_bank
from ajgdata.features.spectrum import spectrum
from ajgdata.features.transfer_function import h1
from ajgdata.store import code_hash as code_hash_module
from ajgdata.store.code_hash import features_code
from ajgdata.store.syntax import deciding_tree
from ajgdata.types import AudioSettings, DataError, DatasetSpec, FeatureSettings, checked
from ajgdata.types.features import (
    FEATURES,
    EmbeddingSettings,
    FeatureKind,
    MelSettings,
    SpectrogramSettings,
    TransferFunctionSettings,
    feature_settings,
)

RATE_HZ = 8_000
ONE = AudioSettings(sample_rate_hz=RATE_HZ)
TWO = AudioSettings(sample_rate_hz=RATE_HZ, microphone=(1, 2))


def noise(seed: int = 0, count: int = RATE_HZ) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-0.5, 0.5, count).astype(np.float32)


def tone(frequency_hz: float) -> np.ndarray:
    time_s = np.arange(RATE_HZ) / RATE_HZ
    return np.sin(2 * np.pi * frequency_hz * time_s).astype(np.float32)


def names(feature) -> list[str]:
    return [axis.name for axis in feature.axes]


# spectrum


def test_each_microphone_has_the_spectrum_of_its_own_samples():
    settings = FeatureSettings(window=256, hop=128)
    one = FeatureComputer(ONE, settings)(noise())
    two = FeatureComputer(TWO, settings)(np.stack([noise(1), noise()]))
    assert names(one) == ["frequency"] and names(two) == ["channel", "frequency"]
    assert two.axes[0].values.tolist() == [1, 2]
    assert one.values.tobytes() == spectrum(noise(), RATE_HZ, settings).tobytes()
    assert two.values[1].tobytes() == one.values.tobytes()


def test_the_former_name_of_the_kind_is_read():
    old = feature_settings({"kind": "stft", "hop": 128})
    assert old == FeatureSettings(hop=128) and old.model_dump()["kind"] == "spectrum"


# spectrogram


def test_the_energy_of_a_spectrogram_is_that_of_the_samples():
    """Parseval: windows without overlap and taper hold each sample once."""
    settings = SpectrogramSettings(
        window=250, hop=250, window_shape="boxcar", quantity="power", normalisation="none"
    )
    feature = FeatureComputer(ONE, settings)(noise())
    twice = np.full(126, 2.0)  # the bins of negative frequencies
    twice[[0, -1]] = 1
    energy = (feature.values * twice).sum() / 250
    assert feature.values.shape == (32, 126)
    assert energy == pytest.approx(np.square(noise().astype(float)).sum(), rel=1e-5)


def test_the_sum_of_a_spectrogram_over_time_is_the_spectrum():
    settings = {"window": 256, "hop": 64}
    feature = FeatureComputer(ONE, SpectrogramSettings(**settings))(noise())
    expected = spectrum(noise(), RATE_HZ, FeatureSettings(**settings))
    np.testing.assert_allclose(feature.values.sum(axis=0), expected, rtol=1e-4)


def test_a_click_is_in_the_windows_that_hold_it():
    samples = np.zeros(RATE_HZ, np.float32)
    samples[4020] = 1
    settings = SpectrogramSettings(window=100, hop=100, normalisation="none")
    feature = FeatureComputer(ONE, settings)(samples)
    (frame,) = np.flatnonzero(feature.values.sum(axis=1))
    time = feature.axes[0]
    assert time.name == "time" and time.values[frame] == pytest.approx(4050 / RATE_HZ)


def test_longer_recordings_are_cut_and_shorter_ones_refused():
    computer = FeatureComputer(ONE, SpectrogramSettings(window=256, hop=256, length_s=0.5))
    assert computer.least_samples == 4000
    whole, cut = computer(noise()), computer(noise()[:4000])
    assert whole.values.tobytes() == cut.values.tobytes()


# mel


@pytest.mark.parametrize("scale", ["htk", "slaney"])
def test_neighbouring_mel_bands_share_each_frequency(scale):
    """Triangles with common edges add up to 1 between the first and the last centre."""
    filters, centres = filter_bank(RATE_HZ, MelSettings(bands=20, scale=scale))
    frequency = np.arange(1025) * RATE_HZ / 2048
    inside = (frequency >= centres[0]) & (frequency <= centres[-1])
    np.testing.assert_allclose(filters.sum(axis=0)[inside], 1, rtol=1e-12)


def test_the_centres_of_mel_bands_follow_the_formula():
    _, centres = filter_bank(RATE_HZ, MelSettings(bands=9))
    mel = 2595 * np.log10(1 + np.array([*centres, 4000.0]) / 700)
    np.testing.assert_allclose(np.diff(mel), mel[-1] / 10, rtol=1e-9)
    _, centres = filter_bank(RATE_HZ, MelSettings(bands=9, scale="slaney", band_hz=(100, 1000)))
    np.testing.assert_allclose(np.diff(centres), 90, rtol=1e-9)  # linear below 1 kHz


@pytest.mark.parametrize("over_time", ["mean", "frames"])
def test_a_tone_is_in_the_band_around_it(over_time):
    feature = FeatureComputer(ONE, MelSettings(bands=20, over_time=over_time))(tone(1000))
    centres = feature.axes[-1].values
    level = np.atleast_2d(feature.values)
    nearest = np.abs(centres - 1000).argmin()
    assert (level.argmax(axis=1) == nearest).all()
    assert level.max() == 0 and level.min() >= -80


def test_levels_do_not_depend_on_the_amplitude_unless_they_are_not_normalised():
    quiet = FeatureComputer(ONE, MelSettings())(0.01 * noise()).values
    np.testing.assert_allclose(
        quiet, FeatureComputer(ONE, MelSettings())(noise()).values, atol=1e-4
    )
    computer = FeatureComputer(ONE, MelSettings(normalisation="none"))
    difference = computer(noise()).values - computer(0.01 * noise()).values
    np.testing.assert_allclose(difference, 40, atol=1e-3)


def test_cepstra_are_an_orthonormal_transform_of_the_levels():
    level = FeatureComputer(ONE, MelSettings(bands=20))(noise()).values
    cepstra = FeatureComputer(ONE, MelSettings(bands=20, cepstra=20))(noise())
    assert names(cepstra) == ["cepstrum"]
    assert np.linalg.norm(cepstra.values) == pytest.approx(np.linalg.norm(level), rel=1e-5)
    assert cepstra.values[0] == pytest.approx(level.sum() / np.sqrt(20), rel=1e-5)


def test_too_many_mel_bands_are_one_line():
    computer = FeatureComputer(ONE, MelSettings(bands=2000))
    with pytest.raises(DataError, match="2000 mel bands are too narrow"):
        _ = computer.axes


# transfer function

FILTER = np.array([0.5, 0.0, -0.25, 0.0, 0.125])


def test_the_transfer_function_of_a_known_filter():
    played = noise(count=4 * RATE_HZ)
    response = scipy.signal.lfilter(FILTER, 1, played).astype(np.float32)
    settings = TransferFunctionSettings(window=256, hop=128)
    feature = FeatureComputer(ONE, settings)(response, played)
    _, expected = scipy.signal.freqz(FILTER, worN=2 * np.pi * np.arange(129) / 256)
    # the filter is 5 samples long, so windows of 256 samples miss less than 2 % of its response
    np.testing.assert_allclose(feature.values, np.abs(expected), rtol=0.02, atol=0.005)
    assert feature.doubts == ()


def test_a_delay_changes_the_phase_only():
    played = noise(count=4 * RATE_HZ)
    settings = TransferFunctionSettings(window=256, hop=128)
    estimate, coherence = h1(played[:-3], np.r_[np.zeros(3), played][: len(played) - 3], settings)
    delay = -np.angle(estimate[1:-1]) / (2 * np.pi * np.arange(1, 128) / 256)
    assert np.median(delay[:20]) == pytest.approx(3, abs=0.05)
    assert coherence[1:-1].min() > 0.95


@pytest.mark.parametrize("noise_to_sound", [0.25, 1.0, 3.0])
def test_noise_lowers_the_coherence_by_a_known_amount(noise_to_sound):
    """gamma^2 = 1 / (1 + noise/sound) for white noise of this power ratio."""
    played = noise(1, 40 * RATE_HZ).astype(float)
    added = noise(2, 40 * RATE_HZ) * np.sqrt(noise_to_sound)
    settings = TransferFunctionSettings(window=256, hop=256, window_shape="boxcar")
    _, coherence = h1(played, played + added, settings)
    # 1,250 windows: the standard deviation of a bin is below 0.03, of the mean below 0.003
    assert coherence.mean() == pytest.approx(1 / (1 + noise_to_sound), abs=0.01)


def test_bins_without_coherence_are_zero_and_reported():
    low = scipy.signal.butter(8, 1000, fs=RATE_HZ, output="sos")
    played = scipy.signal.sosfilt(low, noise(1, 4 * RATE_HZ))
    response = (played + 0.05 * noise(2, 4 * RATE_HZ)).astype(np.float32)
    settings = TransferFunctionSettings(window=256, hop=128)
    feature = FeatureComputer(ONE, settings)(response, played)
    frequency = feature.axes[-1].values
    assert feature.values[frequency < 800].min() > 0.9
    assert feature.values[frequency > 2500].max() == 0
    assert [code for code, _, _ in feature.doubts] == ["low_coherence"]
    with pytest.raises(ValueError, match="no bin has a coherence"):
        FeatureComputer(ONE, settings)(noise(3, 4 * RATE_HZ), played)


def test_a_microphone_can_be_the_reference():
    samples = np.stack([noise(count=4 * RATE_HZ), 2 * noise(count=4 * RATE_HZ)])
    settings = TransferFunctionSettings(reference=1, window=256, hop=128)
    feature = FeatureComputer(TWO, settings)(samples)
    assert feature.axes[0].values.tolist() == [2] and feature.values.shape == (1, 129)
    np.testing.assert_allclose(feature.values, 2, rtol=1e-6)


def test_a_played_sound_that_is_missing_is_one_line():
    with pytest.raises(ValueError, match="the played sound is not known"):
        FeatureComputer(ONE, TransferFunctionSettings(window=256, hop=128))(noise())


# embedding


def write_network(folder: Path, length: int, flat: bool = True) -> str:
    """Write a network that returns mean and largest sample; return its checksum."""
    onnx = pytest.importorskip("onnx")
    pytest.importorskip("onnxruntime")
    helper = onnx.helper
    axes = [0, 1] if flat else [0]
    nodes = [
        helper.make_node("ReduceMean", ["x"], ["mean"], axes=axes, keepdims=int(not flat)),
        helper.make_node("ReduceMax", ["x"], ["max"], axes=axes, keepdims=int(not flat)),
    ]
    if flat:
        one = helper.make_tensor("one", onnx.TensorProto.INT64, [1], [1])
        nodes += [
            helper.make_node("Reshape", ["mean", "one"], ["a"]),
            helper.make_node("Reshape", ["max", "one"], ["b"]),
            helper.make_node("Concat", ["a", "b"], ["y"], axis=0),
        ]
    else:
        one = None
        nodes.append(helper.make_node("Concat", ["mean", "max"], ["y"], axis=0))
    number = onnx.TensorProto.FLOAT
    graph = helper.make_graph(
        nodes,
        "tiny",
        [helper.make_tensor_value_info("x", number, [1, length])],
        [helper.make_tensor_value_info("y", number, None)],
        [one] if one is not None else [],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)])
    model.ir_version = 8
    content = model.SerializeToString()
    (folder / "tiny.onnx").write_bytes(content)
    return hashlib.sha256(content).hexdigest()


def test_an_embedding_is_the_output_of_the_network(tmp_path):
    sha256 = write_network(tmp_path, 4000)
    settings = EmbeddingSettings(file="tiny.onnx", sha256=sha256, length_s=0.5)
    feature = FeatureComputer(ONE, settings, tmp_path)(noise())
    assert names(feature) == ["component"]
    used = noise()[:4000]
    np.testing.assert_allclose(feature.values, [used.mean(), used.max()], atol=1e-6)


def test_the_samples_of_an_embedding_have_the_rate_of_the_network(tmp_path):
    sha256 = write_network(tmp_path, 2000)
    settings = EmbeddingSettings(
        file="tiny.onnx", sha256=sha256, length_s=0.5, sample_rate_hz=RATE_HZ // 2
    )
    assert FeatureComputer(ONE, settings, tmp_path)(noise()).values.shape == (2,)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"length_s": 1.0}, "does not accept samples"),
        ({"file": "other.onnx"}, "does not exist. Copy the network with the sha256"),
        ({"sha256": "0" * 64}, "not that of features.sha256"),
    ],
)
def test_a_wrong_network_is_one_line(tmp_path, change, problem):
    given = {"file": "tiny.onnx", "sha256": write_network(tmp_path, 4000), "length_s": 0.5}
    computer = FeatureComputer(ONE, EmbeddingSettings(**{**given, **change}), tmp_path)
    with pytest.raises(DataError, match=problem) as error:
        _ = computer.axes
    assert "\n" not in str(error.value)


def test_an_output_that_is_no_vector_is_one_line(tmp_path):
    sha256 = write_network(tmp_path, 4000, flat=False)
    settings = EmbeddingSettings(file="tiny.onnx", sha256=sha256, length_s=0.5)
    with pytest.raises(DataError, match="not a vector"):
        _ = FeatureComputer(ONE, settings, tmp_path).axes


# settings

WRONG = {
    "unknown kind of feature 'mfcc': choose one of spectrum, spectrogram, mel": {"kind": "mfcc"},
    "unknown key features.bnds": {"kind": "mel", "bnds": 3},
    "cepstra 9 exceed bands 4": {"kind": "mel", "bands": 4, "cepstra": 9},
    "features.sha256 is missing": {"kind": "embedding", "file": "x.onnx"},
    "features.reference 2 is not one of several": {"kind": "transfer_function", "reference": 2},
    "holds no bin": {"kind": "mel", "band_hz": [23_000, 24_000]},
    "write a mapping": "mel",
}


@pytest.mark.parametrize("problem", WRONG)
def test_wrong_settings_are_one_line(problem):
    with pytest.raises(DataError) as error:
        checked(DatasetSpec, "dataset.yaml", {"name": "d", "features": WRONG[problem]})
    assert problem in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize("value", [[1], [1, 1], [0, 1], [1, True], ["1", "2"], []])
def test_wrong_lists_of_microphones_are_refused(value):
    with pytest.raises(DataError, match=r"audio\.microphone"):
        checked(DatasetSpec, "dataset.yaml", {"name": "d", "audio": {"microphone": value}})


def test_a_feature_with_another_shape_or_with_nan_is_refused(monkeypatch):
    computer = FeatureComputer(ONE, FeatureSettings(window=256, hop=256))
    assert computer.axes
    result = computer(noise())

    def changed(values: np.ndarray) -> None:
        monkeypatch.setattr(computer, "_computed", lambda *_: replace(result, values=values))

    changed(result.values[:5])
    with pytest.raises(ValueError, match=r"has the shape \(5,\), not \(129,\)"):
        computer(noise())
    changed(result.values * np.nan)
    with pytest.raises(ValueError, match="NaN"):
        computer(noise())


def test_settings_of_a_job_keep_their_class():
    spec = DatasetSpec(name="d", features={"kind": "mel", "bands": 10})
    content = spec.model_dump(mode="json")["features"]
    assert isinstance(spec.features, MelSettings) and content["bands"] == 10
    assert feature_settings(content) == spec.features
    assert issubclass(MelSettings, FeatureKind)


# a feature of another package


@pytest.fixture
def octaves(monkeypatch, tmp_path):
    """The example package, as if it was installed; return its file."""
    example = Path(__file__).resolve().parents[2] / "docs/examples/own_feature_package"
    file = tmp_path / "own_feature.py"
    file.write_text((example / "own_feature.py").read_text())
    monkeypatch.syspath_prepend(tmp_path)
    about = tomllib.loads((example / "pyproject.toml").read_text())
    ((name, value),) = about["project"]["entry-points"]["ajgdata.features"].items()
    monkeypatch.setitem(FEATURES, name, EntryPoint(name, value, "ajgdata.features"))
    yield file
    sys.modules.pop("own_feature", None)


def test_a_feature_of_another_package(octaves):
    spec = checked(DatasetSpec, "x", {"name": "d", "features": {"kind": "octaves", "bands": 5}})
    one = FeatureComputer(ONE, spec.features)(tone(1000))
    two = FeatureComputer(TWO, spec.features)(np.stack([tone(250), tone(500)]))
    assert names(one) == ["octave"] and names(two) == ["channel", "octave"]
    assert one.axes[0].values[one.values.argmax()] == 1000
    assert two.axes[1].values[two.values.argmax(axis=1)].tolist() == [250, 500]
    with pytest.raises(DataError, match="unknown key"):
        checked(DatasetSpec, "x", {"name": "d", "features": {"kind": "octaves", "bnds": 5}})


def test_an_edit_of_the_package_concerns_only_its_features(octaves):
    own = feature_settings({"kind": "octaves"})
    before = features_code(own), features_code(MelSettings()), features_code(FeatureSettings())
    octaves.write_text(octaves.read_text().replace("10 * sample_rate_hz", "20 * sample_rate_hz"))
    for cached in (code_hash_module.code_hash, code_hash_module._digest, deciding_tree):
        cached.cache_clear()
    after = features_code(own), features_code(MelSettings()), features_code(FeatureSettings())
    assert before[0] != after[0] and before[1:] == after[1:]
    assert len({*before}) == 3
