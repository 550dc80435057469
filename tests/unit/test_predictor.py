"""A predictor says of every recording what the workflow says, and refuses what it refuses."""

import dataclasses
import json
import shutil
import sys

import numpy as np
import pytest
import soundfile
from worlds import RATE_HZ, Project, tone

import ajgdata
from ajgdata.cli import main
from ajgdata.evaluate import in_use
from ajgdata.live.predictor import NoveltyVerdict
from ajgdata.loading import read_model, read_predictor
from ajgdata.paths import Paths
from ajgdata.pipeline.recordings import examine
from ajgdata.pipeline.train import train_model
from ajgdata.store.audio import read_audio, write_pcm24
from ajgdata.store.features import read_store
from ajgdata.types import AudioSettings, DataError, Recording, Target

TARGETS = {
    "edge_mm": {"kind": "regression", "unit": "mm"},
    "object": {"kind": "classification"},
}
TASKS = {
    "size": {"target": "edge_mm", "models": ["knn"]},
    "what": {"target": "object", "models": ["linear"]},
}
TRUTH = {name: Target.model_validate(target) for name, target in TARGETS.items()}


def sound(hz: float, generator: np.random.Generator, samples: int) -> np.ndarray:
    return 0.8 * tone(hz, samples) + 0.02 * generator.standard_normal(samples)


def record(project, session, generator):
    """Twelve grasps of three tones, two recordings of each, and two of nothing."""
    rows = []
    folder = project.folder(session) / "audio"
    for n in range(26):
        name = f"r{n:02d}"
        grasp = n // 2
        hz = 0 if grasp == 12 else 500.0 + 250 * (grasp % 3)
        at = hz * (1 + 0.01 * generator.standard_normal())
        write_pcm24(folder / f"{name}.wav", sound(at, generator, 2000 + 7 * n), RATE_HZ)
        labels = {"edge_mm": str(hz) if hz else ""}
        rows.append(
            Recording(
                recording_id=name,
                file=f"audio/{name}.wav",
                grasp_id=f"g{grasp}",
                sample=n % 2,
                object="abc"[grasp % 3] if hz else "",
                labels=labels,
            )
        )
    project.write(rows, session)


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A project with three models, trained as the workflow does."""
    project = Project(Paths(tmp_path_factory.mktemp("trained")))
    project.declare(targets=TARGETS, tasks=TASKS)
    generator = np.random.default_rng(0)
    for session in ("s1", "s2"):
        record(project, session, generator)
    project.build("s1", "s2", targets=TRUTH)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(in_use, "CALIBRATION_FOLDS", 2)
        for task, model in (("size", "knn"), ("what", "linear"), ("what", "svm")):
            spec = ajgdata.load_dataset("d", project.root).spec
            train_model(
                read_store(project.paths.features("d")),
                spec.training(task),
                model=model,
                seed=0,
                task=task,
                folder=project.paths.model("d", task, model),
            )
    return project


def load(project, task, model):
    return ajgdata.load_predictor("d", task, model, project.root)


def waveforms(project):
    """Every recording by its name in the store, float32 samples (n,)."""
    audio = AudioSettings(sample_rate_hz=RATE_HZ)
    files = {
        f"{s}/{path.stem}": path
        for s in ("s1", "s2")
        for path in sorted((project.folder(s) / "audio").glob("*.wav"))
    }
    return files, {name: read_audio(path, audio).samples for name, path in files.items()}


@pytest.mark.parametrize(("task", "model"), [("size", "knn"), ("what", "linear"), ("what", "svm")])
def test_every_recording_gives_the_numbers_of_the_workflow(trained, task, model):
    predictor = load(trained, task, model)
    store = read_store(trained.paths.features("d"))
    names = store.columns["recording"].values.tolist()
    files, samples = waveforms(trained)
    assert len(names) == len(files) == 52
    estimator, _ = read_model(trained.paths.model("d", task, model))
    expected = estimator.predict(store.feature).tolist()
    together = predictor.of_features(store.feature)
    for row, name in enumerate(names):
        feature = predictor.feature(samples[name], RATE_HZ)
        np.testing.assert_array_equal(feature, store.feature[row])  # bit for bit
        answer = predictor.predict(samples[name], RATE_HZ)
        assert answer == predictor.predict_file(files[name])
        assert (answer.value, answer.verdict) == (together[row].value, together[row].verdict)
        assert answer.value == expected[row]
        assert answer.novelty == together[row].novelty
        assert list(answer.probability) == (["a", "b", "c"] if model == "linear" else [])
        assert answer.probability == pytest.approx(together[row].probability, abs=1e-12)
        assert json.loads(json.dumps(answer.plain()))["value"] == answer.value
        assert answer.verdict is (NoveltyVerdict.KNOWN if row % 26 < 24 else NoveltyVerdict.NOTHING)


def test_probabilities_are_scaled_by_the_stored_temperature(trained):
    predictor = load(trained, "what", "linear")
    folder = trained.paths.model("d", "what", "linear")
    estimator, about = read_model(folder)
    store = read_store(trained.paths.features("d"))
    log_p = np.log(estimator.predict_proba(store.feature[:5])) / about["calibration"]["temperature"]
    by_hand = np.exp(log_p) / np.exp(log_p).sum(axis=1, keepdims=True)
    shares = [list(p.probability.values()) for p in predictor.of_features(store.feature[:5])]
    np.testing.assert_allclose(shares, by_hand, atol=1e-9)
    assert about["calibration"]["folds"] == 2
    assert about["classes"] == ["a", "b", "c"]
    assert about["audio"]["sample_rate_hz"] == RATE_HZ
    assert about["features"]["window"] == 256
    assert (predictor.sample_rate_hz, predictor.features.window) == (RATE_HZ, 256)
    np.testing.assert_array_equal(predictor.frequency_hz, store.frequency_hz)
    assert predictor.has_probabilities
    assert not load(trained, "what", "svm").has_probabilities


def test_numbers_have_an_interval_of_the_stated_coverage(trained):
    predictor = load(trained, "size", "knn")
    said = predictor.predict(tone(750), RATE_HZ)
    half = predictor.calibration.half_width
    assert (predictor.calibration.coverage, said.unit) == (0.9, "mm")
    assert said.interval == (said.value - half, said.value + half)
    assert said.probability == {}


def test_what_was_never_heard_is_unknown_and_nothing_is_nothing(trained):
    predictor = load(trained, "what", "linear")
    generator = np.random.default_rng(9)
    chord = tone(1500, 2000) * 0.4 + tone(3100, 2000) * 0.4 + tone(350, 2000) * 0.1
    assert predictor.predict(chord, RATE_HZ).verdict is NoveltyVerdict.UNKNOWN
    assert predictor.predict(chord, RATE_HZ).novelty > 1
    hiss = 0.01 * generator.standard_normal(2000)
    assert predictor.predict(hiss, RATE_HZ).verdict is NoveltyVerdict.NOTHING
    bare = dataclasses.replace(
        predictor,
        guard=dataclasses.replace(predictor.guard, references=predictor.guard.references[:0]),
    )
    assert bare.predict(hiss, RATE_HZ).verdict is NoveltyVerdict.UNKNOWN
    assert predictor.has_references and not bare.has_references
    again = bare.with_references(predictor.feature(hiss, RATE_HZ)[np.newaxis])
    assert again.predict(hiss, RATE_HZ).verdict is NoveltyVerdict.NOTHING


@pytest.mark.parametrize(
    ("rate", "verdict", "note"),
    [
        (0.5, NoveltyVerdict.KNOWN, ""),
        (0.4, NoveltyVerdict.NO_SIGN, "the novelty check detects only 40 % of novel objects"),
        (None, NoveltyVerdict.NO_SIGN, "the detection rate of the novelty check is not measured"),
    ],
)
def test_nothing_is_known_if_most_novel_objects_are_missed(trained, rate, verdict, note):
    predictor = load(trained, "what", "linear")
    calibration = dataclasses.replace(predictor.calibration, detection_rate=rate)
    predictor = dataclasses.replace(predictor, calibration=calibration)
    feature = read_store(trained.paths.features("d")).feature[:1]
    assert predictor.of_features(feature)[0].verdict is verdict
    assert predictor.novelty_note == note
    bare = dataclasses.replace(
        predictor, guard=dataclasses.replace(predictor.guard, threshold=None)
    )
    assert bare.of_features(feature)[0].verdict is NoveltyVerdict.NOT_CHECKED
    assert bare.novelty_note == "novelty is not checked"


GOOD = tone(750).astype(np.float32)
UNUSABLE = {
    "short": GOOD[:200],
    "nan": np.where(np.arange(2000) == 7, np.nan, GOOD).astype(np.float32),
}


@pytest.mark.parametrize("samples", UNUSABLE.values(), ids=UNUSABLE)
def test_what_the_workflow_refuses_is_refused_in_its_words(trained, tmp_path, samples):
    soundfile.write(tmp_path / "x.wav", samples, RATE_HZ, subtype="FLOAT")
    predictor = load(trained, "what", "linear")
    result = examine(tmp_path / "x.wav", predictor.audio, predictor.features.window)
    assert result.samples is None
    with pytest.raises(DataError) as refused:
        predictor.predict(samples, RATE_HZ)
    assert (refused.value.problem, refused.value.fix) == result.remarks[-1][2:]


def test_a_dead_second_microphone_is_refused_as_in_the_workflow(trained, tmp_path):
    waveform = np.stack([tone(500), np.zeros_like(tone(500))]).astype(np.float32)
    soundfile.write(tmp_path / "x.wav", waveform.T, RATE_HZ, subtype="FLOAT")
    audio = AudioSettings(sample_rate_hz=RATE_HZ, microphone=(1, 2))
    predictor = dataclasses.replace(load(trained, "what", "linear"), audio=audio)
    result = examine(tmp_path / "x.wav", audio, predictor.features.window)
    (error,) = result.remarks
    assert error.code == "silent"
    for predict in (
        lambda: predictor.predict(waveform, RATE_HZ),
        lambda: predictor.predict_file(tmp_path / "x.wav"),
    ):
        with pytest.raises(DataError) as refused:
            predict()
        assert (refused.value.problem, refused.value.fix) == (error.problem, error.fix)


def test_another_rate_or_channel_is_refused_but_in_files_that_the_data_set_converts(
    trained, tmp_path
):
    predictor = load(trained, "what", "linear")
    path = tmp_path / "x.wav"
    waveform = np.stack([tone(500, 3001), tone(900, 3001)], axis=1).astype(np.float32)
    soundfile.write(path, waveform, 12_000, subtype="FLOAT")
    with pytest.raises(DataError, match="sampled at 12000 Hz, not 8000 Hz"):
        predictor.predict(waveform[:, 0], 12_000)
    with pytest.raises(DataError, match=r"float32 of shape \(3001, 2\)"):
        predictor.predict(waveform, RATE_HZ)
    audio = AudioSettings(sample_rate_hz=RATE_HZ, other_rate="resample", microphone=2)
    samples = read_audio(path, audio).samples
    converting = dataclasses.replace(predictor, audio=audio)
    assert converting.predict_file(path) == predictor.predict(samples, RATE_HZ)


def test_models_that_cannot_be_used_are_refused(trained, tmp_path):
    """A damaged file, no file."""
    folder = tmp_path / "model"
    shutil.copytree(trained.paths.model("d", "what", "linear"), folder)

    def refused(message):
        with pytest.raises(DataError, match=message):
            read_predictor(folder, "d", "what")

    for name in ("guard.safetensors", "model.skops"):
        (folder / name).write_bytes(b"spoilt")
        refused("not a readable model")
    with pytest.raises(DataError, match=r"Run `ajgdata train d size --model linear`"):
        load(trained, "size", "linear")
    with pytest.raises(DataError, match=r"there is no model 'linaer'. Use one of cnn, linear, "):
        load(trained, "size", "linaer")
    with pytest.raises(DataError, match=r"there is no task 'colour'. Use one of size, what"):
        load(trained, "colour", "linear")


SIXTEEN_BIT = (tone(750) * 32767).astype(np.int16)
#: Samples that are not real numbers of full scale ±1, the problem, and what to do.
UNSCALED = {
    "int16": (SIXTEEN_BIT, "samples are int16", "divide 16-bit integers by 32768"),
    "complex": (tone(750).astype(complex), "samples are complex128", "give floats"),
    "text": (["a"] * 2000, "samples are <U1", "floats"),
    "int16 as float": (SIXTEEN_BIT.astype(float), "the peak is ", "divide by full scale (32768"),
}


@pytest.mark.parametrize("name", UNSCALED)
def test_samples_of_another_type_or_scale_are_refused(trained, name):
    samples, problem, fix = UNSCALED[name]
    with pytest.raises(DataError) as refused:
        load(trained, "what", "linear").predict(samples, RATE_HZ)
    assert problem in refused.value.problem
    assert fix in refused.value.fix


def test_a_predictor_is_described_in_a_line(trained):
    assert repr(load(trained, "size", "knn")) == (
        "<Predictor d/size/knn: predicts a number in mm from 8000 Hz recordings>"
    )
    assert repr(load(trained, "what", "linear")) == (
        "<Predictor d/what/linear: predicts one of 3 classes from 8000 Hz recordings>"
    )


def without(about, key):
    return {name: value for name, value in about.items() if name != key}


OTHER_VERSIONS = {
    "features: unknown": (
        lambda about: about | {"features": about["features"] | {"mel_bands": 40}},
        "unknown key mel_bands",
    ),
    "features: invalid": (
        lambda about: about | {"features": about["features"] | {"quantity": "mel"}},
        "quantity = 'mel'",
    ),
    "audio: missing": (lambda about: without(about, "audio"), "audio is missing"),
    "calibration: unknown": (
        lambda about: about | {"calibration": about["calibration"] | {"sharpness": 1}},
        "unexpected keyword argument 'sharpness'",
    ),
    "calibration: missing": (
        lambda about: about | {"calibration": without(about["calibration"], "problems")},
        "missing 1 required positional argument: 'problems'",
    ),
}


@pytest.mark.parametrize("name", OTHER_VERSIONS)
def test_a_model_of_another_version_is_refused_in_a_line(trained, tmp_path, name):
    change, detail = OTHER_VERSIONS[name]
    folder = tmp_path / "model"
    shutil.copytree(trained.paths.model("d", "size", "knn"), folder)
    file = folder / "model.json"
    file.write_text(json.dumps(change(json.loads(file.read_text()))))
    with pytest.raises(DataError) as refused:
        read_predictor(folder, "d", "size")
    said = str(refused.value)
    assert said.startswith(f"{file}: was written by another version of ajgdata (")
    assert detail in said and "\n" not in said
    assert said.endswith(". Compute it again with this version of ajgdata.")


@pytest.mark.parametrize(
    "arguments",
    [("export", "d", "size", "knn"), ("sense", "d", "size", "knn", "--source", "virtual")],
)
def test_commands_refuse_a_model_of_another_version_in_a_line(
    trained, monkeypatch, capsys, arguments
):
    file = trained.paths.model("d", "size", "knn") / "model.json"
    before = file.read_text()
    about = json.loads(before)
    about["features"]["mel_bands"] = 40
    monkeypatch.chdir(trained.root)
    monkeypatch.setattr(sys, "argv", ["ajgdata", *arguments])
    file.write_text(json.dumps(about))
    try:
        with pytest.raises(SystemExit) as ended:
            main()
    finally:
        file.write_text(before)
    assert ended.value.code == 1
    printed = capsys.readouterr()
    assert "unknown key mel_bands" in printed.err
    assert len(printed.err.strip().splitlines()) == 1
