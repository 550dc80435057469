"""What `import ajgdata` gives, against what is on disk and what the evaluation did."""

import numpy as np
import pytest
from worlds import RATE_HZ, Project, tone, write_tone

import ajgdata
from ajgdata.experiments import cross_validation
from ajgdata.experiments.base import Inputs
from ajgdata.paths import Paths
from ajgdata.store.audio import read_audio, resample, write_pcm24
from ajgdata.store.features import read_store
from ajgdata.types import AudioSettings, CrossValidationSettings, Recording

#: One step of 24 bits: what writing a recording may change.
STEP = 2.0**-23


def load(project):
    return ajgdata.load_recordings("d", project.root)


def test_recordings_are_the_samples_with_time_in_seconds(project):
    project.session("s1", {"a": 500.0, "b": 750.0})
    project.session("s2", {"a": 1000.0})
    loaded = load(project)
    assert loaded.waveform.dims == ("recording", "time")
    assert loaded.waveform.dtype == np.float32
    assert loaded.recording.values.tolist() == ["s1/a", "s1/b", "s2/a"]
    np.testing.assert_array_equal(loaded.time, np.arange(2000) / RATE_HZ)
    assert (loaded.time.attrs["units"], loaded.waveform.attrs["units"]) == ("s", "1")
    assert loaded.attrs == {"data_set": "d", "source": "recorded", "sample_rate_hz": RATE_HZ}
    for name, hz in {"s1/a": 500, "s1/b": 750, "s2/a": 1000}.items():
        waveform = loaded.waveform.sel(recording=name)
        np.testing.assert_allclose(waveform, tone(hz), atol=STEP)
    # the phase of a sine at a time in seconds does not depend on how samples are numbered
    part = loaded.waveform.sel(recording="s2/a", time=slice(0.1, 0.11))
    np.testing.assert_allclose(part, 0.5 * np.sin(2 * np.pi * 1000 * part.time), atol=STEP)


def test_labels_are_those_of_the_features(project):
    project.session("s1")
    project.session("s2", {"a": 1250.0}, gripper="soft")
    project.build("s1", "s2")
    with ajgdata.load_features("d", project.root) as features:
        loaded = load(project)
        shared = set(features.coords) - {"frequency", "flags", "channel_levels"}
        assert {"edge_mm", "gripper", "grasp_id", "object", "sample", "sha256"} <= shared
        for name in shared:
            np.testing.assert_array_equal(loaded[name], features[name], err_msg=name)
            assert loaded[name].attrs == features[name].attrs
    assert loaded.edge_mm.attrs["units"] == "mm"


def test_shorter_recordings_end_in_nan_and_other_rates_are_resampled(project):
    project.declare(audio={"sample_rate_hz": RATE_HZ, "other_rate": "resample"})
    rows = project.session("s1", {"a": 500.0, "b": 500.0})
    path = project.folder() / "audio" / "b.wav"
    slow = 0.5 * np.sin(2 * np.pi * 500 * np.arange(901) / 6000)
    write_pcm24(path, slow, 6000)
    project.write([rows[0], rows[1].model_copy(update={"sha256": ""})])
    loaded = load(project)
    assert loaded.frames.values.tolist() == [2000, 1202]  # 901 * 8/6, rounded up
    second = loaded.waveform.sel(recording="s1/b").values
    assert np.isnan(second[1202:]).all()
    expected = resample(read_audio(path, AudioSettings(sample_rate_hz=6000)).samples, 6000, RATE_HZ)
    np.testing.assert_array_equal(second[:1202], expected)
    middle = slice(200, 1000)  # away from the ends, where zeros are assumed
    # resample_poly's Kaiser window (beta = 5) keeps ripple below 1 %
    np.testing.assert_allclose(second[middle], tone(500)[middle], atol=0.005)


def test_what_cannot_be_used_is_excluded_or_missing(project):
    rows = project.session("s1", {"a": 500.0, "b": 750.0, "c": 1000.0, "e": 600.0})
    write_pcm24(project.folder() / "audio" / "b.wav", tone(500), 16_000)
    bad = rows[2].model_copy(update={"labels": {"edge_mm": "large"}})
    rejected = rows[3].model_copy(update={"quality": "reject"})
    project.write([*rows[:2], bad, rejected])
    with pytest.warns(UserWarning, match=r"of d: ") as warned:
        loaded = load(project)
    excluded, used = (str(warning.message) for warning in warned)
    assert excluded.startswith("recordings of d: 1 excluded; s1/b: sampled at 16000 Hz")
    assert used.startswith("recordings of d: 1 used with an issue; s1/c: edge_mm = 'large' is not")
    assert loaded.recording.values.tolist() == ["s1/a", "s1/c"]
    np.testing.assert_array_equal(loaded.edge_mm, [500.0, np.nan])


TARGETS = {
    "edge_mm": {"kind": "regression", "unit": "mm"},
    "object": {"kind": "classification"},
}
TASKS = {
    "size": {"target": "edge_mm", "folds": 3, "withhold": [700.0]},
    "what": {"target": "object", "folds": 9, "groups": "session_id"},
}


@pytest.fixture(scope="module")
def evaluated(tmp_path_factory):
    """Four sessions of six tones, two of a grasp; features merged, tasks declared."""
    project = Project(Paths(tmp_path_factory.mktemp("evaluated")))
    project.declare(targets=TARGETS, tasks=TASKS)
    sessions = [f"s{n}" for n in range(4)]
    for number, session in enumerate(sessions):
        rows = []
        folder = project.folder(session) / "audio"
        for index in range(6):
            name = f"r{index}"
            hz = 500.0 + 100 * (index // 2) + number
            rows.append(
                Recording(
                    recording_id=name,
                    file=f"audio/{name}.wav",
                    sha256=write_tone(folder / f"{name}.wav", hz, 2000 + index),
                    grasp_id=f"g{index // 2}",
                    object="ab"[index // 2 % 2],
                    labels={"edge_mm": str(500 + 100 * (index // 2))},
                )
            )
        project.write(rows, session)
    targets = ajgdata.load_dataset("d", project.root).spec.targets
    project.build(*sessions, targets=targets)
    return project


@pytest.mark.parametrize(("task", "seed"), [("size", 5), ("what", 0)])
def test_splits_are_the_folds_of_the_evaluation(evaluated, task, seed):
    loaded = ajgdata.load_dataset("d", evaluated.root)
    inputs = Inputs(
        "d",
        task,
        loaded.spec.task_settings(task),
        seed=seed,
        store=read_store(evaluated.paths.features("d")),
    )
    outcome = cross_validation.measure(inputs, CrossValidationSettings(), "knn")
    (predictions,) = (table for table in outcome.tables if table.name == "predictions")
    folds = predictions.where(split="grouped", target_values="training").split_by("fold")
    tested = [set(folds[fold].column("recording")) for fold in sorted(folds)]
    assert len(tested) == {"size": 3, "what": 4}[task]  # as many folds as groups at most
    everything = set().union(*tested)
    for names, (train, test) in zip(tested, loaded.folds(task, seed), strict=True):
        assert set(test.recordings) == names
        assert set(train.recordings) == everything - names
        assert not set(train.groups) & set(test.groups)
        assert train.X.shape == (len(train), 129)
    held = set(loaded.all(task).recordings) - everything
    assert held == (set(loaded.withheld(task).recordings) if task == "size" else set())
    assert len(held) == {"size": 8, "what": 0}[task]
