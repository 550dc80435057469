"""Changed copies of recordings: exact levels, no copy in a test part, and more robust models."""

from typing import ClassVar

import numpy as np
import pytest
from pydantic import ValidationError
from sklearn.base import BaseEstimator, ClassifierMixin
from worlds import RATE_HZ, tone

from ajgdata.evaluate.crossval import cross_validate
from ajgdata.evaluate.in_use import calibration
from ajgdata.evaluate.task_data import TaskData, TrainingCopies, training_part
from ajgdata.features.augment import changed_copy, mean_power, pink_noise, shifted
from ajgdata.features.spectrum import spectrum
from ajgdata.types import FeatureSettings
from ajgdata.types.augment import AddedNoise, Augment

FEATURES = FeatureSettings(window=256, hop=128)


def generator(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


# Samples


@pytest.mark.parametrize("snr_db", [-10.0, 0.0, 20.0])
@pytest.mark.parametrize("source", ["white", "pink"])
@pytest.mark.parametrize("shape", [(2000,), (2, 2000)])
def test_the_signal_to_noise_ratio_of_a_mixture_is_exact(snr_db, source, shape):
    samples = generator().normal(0, 0.1, shape)
    settings = Augment(noise=AddedNoise(source=source, snr_db=(snr_db, snr_db)))
    copy = changed_copy(samples, RATE_HZ, settings, generator(1))
    assert copy.shape == shape
    ratio = mean_power(samples) / mean_power(copy - samples)
    assert 10 * np.log10(ratio) == pytest.approx(snr_db, abs=1e-9)


def test_the_level_of_the_noise_is_its_rms_in_db_of_full_scale():
    settings = Augment(noise=AddedNoise(level_dbfs=(-20, -20)))
    copy = changed_copy(np.zeros(500), RATE_HZ, settings, generator())
    assert np.sqrt(mean_power(copy)) == pytest.approx(0.1, rel=1e-12)


def test_values_are_drawn_from_the_whole_range_and_nowhere_else():
    samples = tone(1000.0)
    settings = Augment(noise=AddedNoise(snr_db=(3, 9)))
    copies = [changed_copy(samples, RATE_HZ, settings, generator(seed)) for seed in range(200)]
    drawn = [10 * np.log10(mean_power(samples) / mean_power(c - samples)) for c in copies]
    assert 3 <= min(drawn) < 3.2 and 8.8 < max(drawn) <= 9


def test_pink_noise_has_equal_power_per_octave_and_no_offset():
    power = np.abs(np.fft.rfft(pink_noise(generator(), (64, 4096)))) ** 2
    octaves = [power[:, low : 2 * low].sum(axis=1).mean() for low in (64, 128, 256, 512)]
    # each octave has 64 x 64 values or more: a relative deviation of 1/64 or less
    assert np.ptp(octaves) / np.mean(octaves) < 6 / 64
    assert power[:, 0].max() < 1e-20


def test_the_default_feature_does_not_depend_on_the_gain():
    samples = generator().normal(0, 0.1, 2000)
    copy = changed_copy(samples, RATE_HZ, Augment(gain_db=(-7, -7)), generator())
    np.testing.assert_allclose(copy, samples * 10 ** (-7 / 20), rtol=1e-12)
    expected = spectrum(samples, RATE_HZ, FEATURES)
    # float32: a rounding error of 6e-8 per sample, of a sum of 14 frames
    np.testing.assert_allclose(spectrum(copy, RATE_HZ, FEATURES), expected, rtol=1e-4)


def test_a_shift_of_one_hop_changes_the_sum_of_frames_by_the_frames_at_the_ends():
    """A sound between silences is in the same frames, which begin one hop later."""
    samples = np.zeros(4000, np.float32)
    samples[1000:2000] = tone(1000.0)[:1000]
    shift_ms = 1000 * FEATURES.hop / RATE_HZ
    copy = changed_copy(samples, RATE_HZ, Augment(shift_ms=(shift_ms, shift_ms)), generator())
    assert np.flatnonzero(copy)[0] == np.flatnonzero(samples)[0] + FEATURES.hop
    expected = spectrum(samples, RATE_HZ, FEATURES)
    np.testing.assert_allclose(spectrum(copy, RATE_HZ, FEATURES), expected, rtol=1e-6)
    # Part of a hop moves the frames by less than a hop: the sum changes by less than the share of
    # the two frames at the ends of the sound among its 1000 / 128 + 2 frames.
    half = shifted(samples.astype(float), FEATURES.hop // 2)
    difference = np.abs(spectrum(half, RATE_HZ, FEATURES) - expected).sum()
    assert 0 < difference < 2 * 2 / (1000 / FEATURES.hop + 2)


@pytest.mark.parametrize(("count", "expected"), [(1, [0, 1, 2]), (-2, [3, 0, 0]), (9, [0, 0, 0])])
def test_zeros_replace_samples_that_a_shift_moves(count, expected):
    assert shifted(np.array([1.0, 2, 3]), count).tolist() == expected


def test_changes_are_a_shift_then_noise_then_a_gain():
    samples = tone(1000.0)
    settings = Augment(shift_ms=(125, 125), noise=AddedNoise(snr_db=(0, 0)), gain_db=(20, 20))
    copy = changed_copy(samples, RATE_HZ, settings, generator()) / 10
    assert copy[:1000].any()  # the noise is also where the shift leaves zeros
    assert mean_power(copy - shifted(samples, 1000)) == pytest.approx(
        mean_power(shifted(samples, 1000))
    )


@pytest.mark.parametrize(
    ("settings", "problem"),
    [
        ({}, "nothing changes: give noise, gain_db or shift_ms"),
        ({"noise": {"source": "white"}}, "give either snr_db or level_dbfs"),
        ({"noise": {"snr_db": [0, 1], "level_dbfs": [0, 1]}}, "give either snr_db or level_dbfs"),
        ({"gain_db": [3, -3]}, r"\[3, -3\] is not a range: write the low end first"),
        ({"gain_db": [0, 3], "copies": 0}, "greater than or equal to 1"),
    ],
)
def test_wrong_settings_are_refused(settings, problem):
    with pytest.raises(ValidationError, match=problem):
        Augment.model_validate(settings)


# Training parts


class Recorder(ClassifierMixin, BaseEstimator):
    """A classifier that stores the features that it is trained on and asked for."""

    calls: ClassVar[list[tuple[str, np.ndarray]]] = []

    def fit(self, X, y):
        self.classes_ = np.unique(y)
        self.calls.append(("fit", X[:, 0].copy()))
        return self

    def predict(self, X):
        self.calls.append(("predict", X[:, 0].copy()))
        return np.repeat(self.classes_[:1], len(X))


def marked(n: int = 12, copies: int = 3) -> tuple[TaskData, TrainingCopies]:
    """Return recordings with features 0, 1, ...; those of their copies are 1000 larger."""
    number = np.arange(n)
    feature = number[:, None].astype(float)
    grasp = np.array([f"g{index // 2:02}" for index in number])
    value = np.array([f"{'ab'[index // 2 % 2]}" for index in number])
    row = np.repeat(number, copies)
    return TaskData(feature, value, grasp, grasp), TrainingCopies(row, 1000.0 + feature[row])


def test_no_copy_is_tested_and_copies_stay_in_the_fold_of_their_grasp():
    data, copies = marked()
    others, _ = marked()
    Recorder.calls = []
    result = cross_validate(
        data.feature,
        data.value,
        data.group,
        kind="classification",
        model=Recorder(),
        folds=3,
        extra_tests={"elsewhere": others._replace(feature=others.feature + 500)},
        copies=copies,
    )
    fits = [features for call, features in Recorder.calls if call == "fit"]
    predicted = np.concatenate([features for call, features in Recorder.calls if call != "fit"])
    assert predicted.max() < 1000  # neither in test parts nor in other data sets
    assert len(fits) == 3
    for features in fits:
        originals = features[features < 1000]
        of_copies = features[features >= 1000] - 1000
        assert len(features) == 8 * (1 + 3)  # 8 of 12 recordings, and 3 copies of each
        assert sorted(of_copies) == sorted(np.repeat(originals, 3))
    assert result.scores.recordings == 12 and len(result.predictions.row) == 12
    assert result.scores.chance["accuracy"] == 0.5


def test_a_copy_has_value_group_and_name_of_its_recording():
    data, copies = marked(n=4, copies=2)
    part = training_part(data, np.array([1, 2]), copies)
    assert part.feature[:, 0].tolist() == [1, 2, 1001, 1001, 1002, 1002]
    assert part.value.tolist() == ["a", "b", "a", "a", "b", "b"]
    assert part.group.tolist() == ["g00", "g01", "g00", "g00", "g01", "g01"]


def test_calibration_predicts_no_copy(monkeypatch):
    from ajgdata.models import baselines

    data, copies = marked(n=24)

    class Probable(Recorder):
        def predict_proba(self, X):
            self.predict(X)
            return np.full((len(X), 2), 0.5)

    monkeypatch.setattr(baselines, "nearest_neighbours_plain", lambda kind, seed: Probable())
    Recorder.calls = []
    result = calibration(
        data.feature,
        data.value,
        data.group,
        data.group,
        model="knn_plain",
        kind="classification",
        copies=copies,
    )
    assert result.temperature is not None
    fits = [features for call, features in Recorder.calls if call == "fit"]
    predicted = np.concatenate([features for call, features in Recorder.calls if call != "fit"])
    assert len(fits) == 5 and all(
        (features >= 1000).sum() == 3 * (features < 1000).sum() for features in fits
    )
    assert len(predicted) == 24 and predicted.max() < 1000
