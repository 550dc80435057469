"""`augment` of a task: copies of recordings on disk, in cross-validation and in final models."""

import re
from pathlib import Path

import numpy as np
import pytest
import soundfile
import yaml
from recorded import make_features, run_experiments
from worlds import AUDIO, FEATURES, RATE_HZ

from ajgdata.evaluate.task_data import training_data
from ajgdata.experiments.requests import all_requests
from ajgdata.loading import read_model
from ajgdata.paths import Paths
from ajgdata.pipeline.copies import copy_maker
from ajgdata.pipeline.plan import plan
from ajgdata.pipeline.train import train_final_model
from ajgdata.store.audio import file_sha256, write_pcm24
from ajgdata.store.features import read_store
from ajgdata.store.sessions import read_dataset, read_recordings, write_session
from ajgdata.store.tables import read_measurements
from ajgdata.types import DataError, Excitation, NotPossibleError, Recording, Session
from ajgdata.types.augment import AddedNoise, Augment

NOISE = {"source": "white", "snr_db": [0, 20]}
COUNT = 24  #: recordings per data set, of two classes, each of its own grasp


def declare(paths: Paths, name: str, **keys: object) -> None:
    """Write dataset.yaml of tones of two classes."""
    content = {
        "name": name,
        "audio": {"sample_rate_hz": RATE_HZ},
        "features": {"window": FEATURES.window, "hop": FEATURES.hop},
        "targets": {"kind": {"kind": "classification"}},
    }
    path = paths.dataset(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(yaml.safe_dump(content | keys, sort_keys=False))


def record(paths: Paths, name: str, sounds: list[np.ndarray], rate_hz: int = RATE_HZ) -> None:
    """Record sounds (n,), by turns of the classes `a` and `b`, and compute their features."""
    folder = paths.session(name, "s1")
    rows = []
    for number, samples in enumerate(sounds):
        file = f"audio/{number}.wav"
        write_pcm24(folder / file, samples, rate_hz)
        labels = {"kind": "ab"[number % 2]}
        identity = str(number)
        rows.append(Recording(recording_id=identity, file=file, grasp_id=identity, labels=labels))
    write_session(folder, Session(session_id="s1", source="import"), rows)
    make_features(paths, name)


def planted(seed: int, noise: float) -> list[np.ndarray]:
    """Return sounds (4000,) of two classes that differ in two bands.

    In the first band, class `b` has the louder of two loud tones, which scatter. In the second
    band, class `b` has a weak tone, which noise of an RMS of 0.05 hides.
    """
    generator = np.random.default_rng(seed)
    time_s = np.arange(4000) / RATE_HZ
    sounds = []
    for number in range(COUNT):
        is_b = number % 2
        low = 0.2 * (1 + 0.5 * is_b) * np.exp(0.1 * generator.normal())
        tones = ((low, 500), (0.2, 800), (0.005 * is_b, 3000))
        samples = noise * generator.normal(size=4000)
        for amplitude, hz in tones:
            samples += amplitude * np.sin(2 * np.pi * (hz * time_s + generator.uniform()))
        sounds.append(samples)
    return sounds


def task(**keys: object) -> dict[str, object]:
    return {"target": "kind", "folds": 4, "models": ["linear_plain"], **keys}


@pytest.fixture
def paths(tmp_path) -> Paths:
    return Paths(tmp_path)


@pytest.fixture
def planted_project(paths) -> Paths:
    """Quiet recordings `quiet` and recordings with noise `noisy`, of the planted classes."""
    tasks = {
        "plain": task(test_on=["noisy"]),
        "augmented": task(test_on=["noisy"], augment={"copies": 3, "noise": NOISE}),
    }
    declare(paths, "quiet", tasks=tasks)
    declare(paths, "noisy")
    record(paths, "noisy", planted(seed=2, noise=0.05))
    record(paths, "quiet", planted(seed=1, noise=1e-4))
    return paths


def accuracies(paths: Paths, dataset: str, task: str) -> dict[str, float]:
    """Return the mean accuracy of the model of a task by the tested data set."""
    file = paths.experiment(dataset, task, "cross_validation", "plain")
    ((about, tables),) = read_measurements(file)
    assert "skipped" not in about, about.get("skipped")
    rows = tables[0].where(metric="accuracy", statistic="mean").where(split="grouped").rows
    return {row["test_set"]: row["value"] for row in rows}


def test_copies_with_noise_improve_the_score_under_noise(planted_project):
    run_experiments(planted_project, "quiet")
    plain = accuracies(planted_project, "quiet", "plain")
    augmented = accuracies(planted_project, "quiet", "augmented")
    assert plain["quiet"] >= 0.9 and augmented["quiet"] >= 0.9
    assert plain["noisy"] == 0.5  # the noise hides the weak tone, so each prediction is the same
    assert augmented["noisy"] >= 0.9


def test_results_state_the_copies_only_if_there_are_some(planted_project):
    run_experiments(planted_project, "quiet")
    about = {}
    for name in ("plain", "augmented"):
        file = planted_project.experiment("quiet", name, "cross_validation", "plain")
        ((about[name], _),) = read_measurements(file)
    assert "augment" not in about["plain"]
    assert about["augmented"]["augment"] == {"copies": 3, "noise": NOISE}


# Copies


def maker(paths: Paths, augment: Augment, dataset: str = "quiet"):
    table = read_store(paths.features(dataset))
    return copy_maker(augment, table, paths, {dataset: AUDIO}, FEATURES, dataset=dataset, seed=0)


def test_there_are_no_copies_without_the_setting(planted_project):
    assert maker(planted_project, None) is None


def test_copies_are_in_the_order_of_the_rows_and_do_not_depend_on_other_recordings(planted_project):
    augment = Augment(copies=2, noise=AddedNoise(snr_db=(0, 20)), shift_ms=(-5, 5))
    names = [f"s1/{number}" for number in range(4)]
    copies = maker(planted_project, augment).copies("quiet", names)
    assert copies.row.tolist() == [0, 0, 1, 1, 2, 2, 3, 3]
    assert copies.feature.shape == (8, 129) and copies.feature.dtype == np.float32
    assert len(np.unique(copies.feature, axis=0)) == 8
    again = maker(planted_project, augment).copies("quiet", ["s1/3", "s1/1"])
    np.testing.assert_array_equal(again.feature, copies.feature[[6, 7, 2, 3]])


@pytest.fixture
def with_noise_set(planted_project):
    """A short recording of 2 kHz at another rate, which begins with silence."""
    rate_hz = 2 * RATE_HZ
    declare(planted_project, "hum", audio={"sample_rate_hz": rate_hz})
    time_s = np.arange(2000) / rate_hz
    hum = np.sin(2 * np.pi * 2000 * time_s)
    record(planted_project, "hum", [np.concatenate([np.zeros(500), hum])], rate_hz)
    return planted_project


def test_recordings_of_a_data_set_are_noise_at_the_rate_of_the_recordings(with_noise_set):
    noise = AddedNoise(source="hum", snr_db=(-40, -40))
    copies = maker(with_noise_set, Augment(noise=noise)).copies("quiet", ["s1/0", "s1/1"])
    loudest = copies.feature.argmax(axis=1) * RATE_HZ / FEATURES.window
    assert loudest.tolist() == [2000, 2000]


def test_a_file_of_noise_is_hashed_once_per_call(with_noise_set, monkeypatch):
    hashed = []

    def counted(path):
        hashed.append(path.name)
        return file_sha256(path)

    monkeypatch.setattr("ajgdata.store.audio.file_sha256", counted)
    folder = with_noise_set.session("hum", "s1")
    (row,) = read_recordings(folder)[0]
    file = folder / row.file
    row = row.model_copy(update={"sha256": file_sha256(file)})
    write_session(folder, Session(session_id="s1", source="import"), [row])
    noise = AddedNoise(source="hum", snr_db=(0, 0))
    made = maker(with_noise_set, Augment(copies=5, noise=noise))
    made.copies("quiet", ["s1/0"])
    assert sorted(hashed) == ["0.wav", "0.wav"]  # the recording and its noise
    write_pcm24(file, np.ones(100) / 2, RATE_HZ)
    with pytest.raises(NotPossibleError, match="its bytes are not those"):
        made.copies("quiet", ["s1/1"])


KINDS = {
    "spectrogram": {
        "kind": "spectrogram",
        "window": 256,
        "hop": 128,
        "length_s": 0.25,
        "normalisation": "none",
    },
    "mel": {"kind": "mel", "window": 256, "hop": 128, "bands": 12, "normalisation": "none"},
    "played": {"kind": "transfer_function", "window": 128, "hop": 64},
    "microphone": {"kind": "transfer_function", "window": 128, "hop": 64, "reference": 2},
}


@pytest.fixture(params=KINDS)
def two_microphones(paths, request) -> Paths:
    """Recordings of a played noise by two microphones. The first one is louder for class `b`."""
    augment = {"copies": 1, "gain_db": [0, 0]}
    declare(
        paths,
        "two",
        audio={"sample_rate_hz": RATE_HZ, "microphone": [1, 2]},
        features=KINDS[request.param],
        tasks={"kind": task(models=["knn"], folds=2, augment=augment)},
    )
    folder = paths.session("two", "s1")
    generator = np.random.default_rng(0)
    played = generator.uniform(-0.2, 0.2, 2000)
    write_pcm24(folder / "excitation.wav", played, RATE_HZ)
    sound = Excitation(file="excitation.wav", sha256=file_sha256(folder / "excitation.wav"))
    (folder / "audio").mkdir()
    rows = []
    for number in range(8):
        name = str(number)
        gains = np.array([1 + 2 * (number % 2), 1])
        samples = played[:, np.newaxis] * gains + generator.normal(0, 1e-3, (2000, 2))
        soundfile.write(folder / f"audio/{name}.wav", samples, RATE_HZ, "PCM_24")
        labels = {"kind": "ab"[number % 2]}
        file = f"audio/{name}.wav"
        rows.append(Recording(recording_id=name, file=file, grasp_id=name, labels=labels))
    write_session(folder, Session(session_id="s1", source="import", excitation=sound), rows)
    make_features(paths, "two")
    return paths


def test_a_copy_without_a_change_has_the_feature_of_its_recording(two_microphones):
    """A gain of 0 dB changes nothing, for each kind of feature and for several microphones."""
    spec = read_dataset(two_microphones, "two")
    table = read_store(two_microphones.features("two"))
    made = copy_maker(
        spec.tasks["kind"].augment,
        table,
        two_microphones,
        {"two": spec.audio},
        spec.features,
        dataset="two",
        seed=0,
    )
    names = table.columns["recording"].values.tolist()
    np.testing.assert_array_equal(made.copies("two", names).feature, table.flat)
    run_experiments(two_microphones, "two")
    file = two_microphones.experiment("two", "kind", "cross_validation", "plain")
    ((about, tables),) = read_measurements(file)
    assert "skipped" not in about, about.get("skipped")
    rows = tables[0].where(metric="accuracy", statistic="mean", split="grouped").rows
    assert [row["value"] for row in rows] == [1.0]


def test_a_silent_segment_of_noise_is_drawn_again(planted_project):
    declare(planted_project, "clicks")
    mostly_silent = np.zeros(12_000)
    mostly_silent[:1000] = np.random.default_rng(0).normal(0, 0.1, 1000)
    record(planted_project, "clicks", [mostly_silent])
    noise = AddedNoise(source="clicks", snr_db=(0, 0))
    copies = maker(planted_project, Augment(copies=20, noise=noise)).copies("quiet", ["s1/0"])
    assert np.isfinite(copies.feature).all()


def test_noise_without_a_usable_recording_is_named(planted_project):
    declare(planted_project, "silence")
    record(planted_project, "silence", [np.zeros(4000)])
    noise = AddedNoise(source="silence", snr_db=(0, 0))
    with pytest.raises(NotPossibleError, match="silence has no usable recording"):
        maker(planted_project, Augment(noise=noise)).copies("quiet", ["s1/0"])


def test_noise_with_recordings_of_the_data_set_is_refused(planted_project):
    declare(planted_project, "same")
    record(planted_project, "same", planted(seed=1, noise=1e-4)[:3])
    noise = AddedNoise(source="same", snr_db=(0, 0))
    with pytest.raises(DataError, match="has recordings of quiet, which models are tested on"):
        maker(planted_project, Augment(noise=noise))


def test_a_recording_without_file_is_named(planted_project):
    (planted_project.session("quiet", "s1") / "audio/3.wav").unlink()
    run_experiments(planted_project, "quiet")
    file = planted_project.experiment("quiet", "augmented", "cross_validation", "plain")
    ((about, tables),) = read_measurements(file)
    assert about["skipped"].startswith("recording 's1/3'") and not tables


# Final models


def test_a_final_model_is_trained_on_copies_and_calibrated_on_recordings(planted_project, tmp_path):
    paths = planted_project
    spec = read_dataset(paths, "quiet")
    noisy = read_store(paths.features("noisy"))
    right = {}
    for name in ("plain", "augmented"):
        folder = tmp_path / name
        train_final_model(
            paths.features("quiet"),
            [],
            dataset="quiet",
            settings=spec.training(name),
            task=name,
            model="linear_plain",
            seed=0,
            audio=spec.audio,
            features=spec.features,
            paths=paths,
            folder=folder,
        )
        estimator, about = read_model(folder)
        assert (about["recordings"], about.get("copies")) == (24, {"augmented": 72}.get(name))
        assert about["calibration"]["groups"] == 24
        tests = training_data(noisy, spec.training(name))
        right[name] = np.mean(estimator.predict(tests.feature) == tests.value)
    assert right["plain"] == 0.5
    assert right["augmented"] >= 0.9


# Settings


def problem_of(paths: Paths, **keys: object) -> str:
    """Return the message for a task `kind` with these keys."""
    declare(paths, "quiet", tasks={"kind": task(**keys)})
    with pytest.raises(DataError) as error:
        plan(paths, ["quiet"], check=True)
    return str(error.value)


def test_the_example_of_the_page_is_a_task_of_a_data_set(paths):
    page = Path(__file__).resolve().parents[2] / "docs/augmentation.md"
    (example,) = re.findall(r"```yaml\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.S)
    declare(
        paths, "mine", **yaml.safe_load(example), targets={"object": {"kind": "classification"}}
    )
    augment = read_dataset(paths, "mine").training("object").augment
    assert augment.text == (
        "2 copies of each recording with a shift of -5 to 5 ms, white noise at 0 to 20 dB below "
        "the recording, a gain of -6 to 6 dB"
    )


def test_wrong_noise_is_one_line_with_the_task(planted_project):
    def noise(source: str) -> dict[str, object]:
        return {"noise": {"source": source, "snr_db": [0, 20]}}

    problem = problem_of(planted_project, augment=noise("esc11"))
    assert "task kind: augment.noise.source: no such data set 'esc11'. Use white, pink" in problem
    problem = problem_of(planted_project, augment=noise("quiet"))
    assert "task kind: augment.noise.source 'quiet' is also tested" in problem
    problem = problem_of(planted_project, augment=noise("noisy"), test_on=["noisy"])
    assert "task kind: augment.noise.source 'noisy' is also tested" in problem
    problem = problem_of(planted_project, augment={"noise": {"snr_db": [20, 0]}})
    assert "tasks.kind.augment.noise.snr_db = [20, 0]" in problem
    assert "is not a range: write the low end first" in problem


@pytest.mark.parametrize(
    ("experiment", "settings"),
    [("learning_curve", {"groups": [2, 4]}), ("transfer", {"leave_out": "session_id"})],
)
def test_an_experiment_that_trains_without_copies_is_refused(planted_project, experiment, settings):
    augment = {"gain_db": [0, 6]}
    problem = problem_of(planted_project, augment=augment, experiments={experiment: settings})
    assert f"experiments.{experiment} has no copies of recordings" in problem
    assert "use a task without `augment`" in problem


def test_the_data_set_of_the_noise_is_a_part_of_the_run(with_noise_set):
    augment = {"noise": {"source": "hum", "snr_db": [0, 20]}}
    declare(with_noise_set, "quiet", tasks={"kind": task(augment=augment)})
    assert set(plan(with_noise_set, ["quiet"], check=True)) == {"quiet", "hum"}
    spec = read_dataset(with_noise_set, "quiet")
    (request,) = all_requests(spec, with_noise_set.dataset("quiet"))
    assert (request.required_sets, request.other_sets) == (("hum",), ())
    assert request.job_type == "experiment with copies"
