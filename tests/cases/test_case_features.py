"""Two microphones and every kind of feature: from import to prediction, report and publishing."""

import numpy as np
import pytest
import yaml
from recorded import make_features, run_experiments
from sounds import FRAMES, RATE_HZ, resonances, write_wav

import ajgdata as package
from ajgdata.export import Deployed
from ajgdata.loading import load_predictor
from ajgdata.pipeline.dataset_summary import summary
from ajgdata.pipeline.train import train_model
from ajgdata.report.figures import spectra_figure
from ajgdata.store.features import read_store
from ajgdata.store.sessions import read_dataset, read_session, write_session
from ajgdata.types import Excitation, NotPossibleError

#: Settings of each kind, and the dimensions of its feature.
KINDS = {
    "spectrum": ({"window": 512}, ["channel", "frequency"]),
    "spectrogram": (
        {"window": 512, "hop": 512, "length_s": 0.1},
        ["channel", "feature_time", "frequency"],
    ),
    "mel": ({"bands": 20}, ["channel", "mel"]),
    "transfer_function": (
        {"reference": 1, "window": 512, "hop": 256, "least_coherence": 0.1},
        ["channel", "frequency"],
    ),
}


@pytest.fixture
def declared(ajgdata, src, paths):
    """A data set of two microphones: the second one is a filtered copy with noise.

    It has a label `time`, which is also the name of a dimension.
    """
    (src / "labels.csv").write_text(
        "name,object,time\n"
        + "".join(f"{o}{g},{o},{10 * g}\n" for o in ("cube", "ball") for g in range(1, 7))
    )
    for number, label in enumerate(("cube", "ball")):
        for grasp in range(1, 7):
            first = resonances(number, grasp)
            second = 0.5 * np.roll(first, number + 1)
            second += 0.001 * np.random.default_rng(grasp).standard_normal(FRAMES)
            write_wav(src / f"{label}{grasp}.wav", np.stack([first, second], axis=1))
    done = ajgdata(
        "import", src, "--dataset", "mine", "--table", "labels.csv", "--file", "{name}.wav",
        "--target", "object", "--microphone", "1,2",
    )  # fmt: skip
    assert done.code == 0, done.text
    assert "microphones 1 and 2" in done.text

    def declare(features: dict) -> None:
        file = paths.dataset("mine")
        content = yaml.safe_load(file.read_text())
        content["features"] = features
        file.write_text(yaml.safe_dump(content))

    return declare


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_of_feature_from_import_to_prediction(declared, ajgdata, paths, src, kind):
    settings, dimensions = KINDS[kind]
    declared({"kind": kind, **settings})
    assert make_features(paths, "mine") == (12, 0)
    assert make_features(paths, "mine") == (0, 12)
    with package.load_features("mine", paths.root) as features:
        assert list(features.feature.dims) == ["recording", *dimensions]
        assert features.feature.attrs["long_name"] == kind
        assert features.sizes["channel"] == (1 if kind == "transfer_function" else 2)
        assert set(features["time"].values) == {str(10 * g) for g in range(1, 7)}
    spec = read_dataset(paths, "mine")
    store = read_store(paths.features("mine"))
    run_experiments(paths, "mine")
    train_model(
        store,
        spec.training("object"),
        model="knn_plain",
        seed=0,
        task="object",
        folder=paths.model("mine", "object", "knn_plain"),
    )
    predictor = load_predictor("mine", "object", "knn_plain", paths.root)
    names = store.columns["recording"].values.tolist()
    row = names.index("src/ball3")
    waveform = package.load_recordings("mine", paths.root).waveform[row].values
    assert waveform.shape == (2, FRAMES)
    prediction = predictor.predict(waveform, RATE_HZ)
    assert prediction.value == "ball" and prediction == predictor.predict_file(src / "ball3.wav")
    np.testing.assert_array_equal(predictor.feature(waveform, RATE_HZ), store.flat[row])
    with pytest.raises(NotPossibleError, match="cannot be exported"):
        Deployed(predictor)
    about = summary(paths, spec, store)
    assert (about.spectra is None) == (kind == "mel")
    if about.spectra:
        assert spectra_figure(about, about.spectra).caption.alt
    assert ajgdata("check", "mine").code == 0
    assert ajgdata("publish", "mine", "--out", paths.root / "tree").code in (0, 3)
    assert (paths.root / "tree" / "features.nc").is_file()
    issues = [issue.code for issue in about.findings]
    assert issues.count("similar") == (0 if kind == "spectrum" else 1)


def test_all_channels_are_listed(ajgdata, src, paths):
    for number, label in enumerate(("cube", "ball")):
        channels = [resonances(number, seed) for seed in range(3)]
        write_wav(src / f"{number + 1}_{label}.wav", np.stack(channels, axis=1))
    ajgdata("import", src, "--dataset", "mine", "--microphone", "all")
    assert read_dataset(paths, "mine").audio.microphone == (1, 2, 3)
    refused = ajgdata("import", src, "--dataset", "other", "--microphone", "1,4")
    assert refused.code == 1
    assert "microphone 4 is not in the files, which have up to 3 channels" in refused.text


def test_a_transfer_function_from_the_played_sound(declared, paths, src):
    """The played sound is the first channel, which microphone 1 records unchanged."""
    features = {"kind": "transfer_function", "window": 512, "hop": 256, "least_coherence": 0.1}
    declared(features)
    assert make_features(paths, "mine") == (12, 0)
    assert len(read_store(paths.features("mine")).feature) == 0  # no session played a sound
    folder = paths.session("mine", "src")
    first, _ = package.load_recordings("mine", paths.root).waveform[0].values
    file = write_wav(folder / "excitation.wav", first)
    from ajgdata.store.audio import file_sha256
    from ajgdata.store.sessions import read_recordings

    excitation = Excitation(file=file.name, sha256=file_sha256(file))
    session = read_session(folder).model_copy(update={"excitation": excitation})
    write_session(folder, session, read_recordings(folder)[0])
    assert make_features(paths, "mine") == (12, 0)  # the table of the session changed
    store = read_store(paths.features("mine"))
    assert len(store.feature) > 0
    name = str(package.load_recordings("mine", paths.root).recording.values[0])
    row = store.columns["recording"].values.tolist().index(name)
    response = store.feature[row, 0]
    np.testing.assert_allclose(response[response > 0], 1, rtol=1e-3)
