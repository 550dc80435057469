"""Scores of features: a feature without time cannot tell a rising from a falling tone."""

import math

import numpy as np
import pytest
import soundfile as sf
from scipy.signal import chirp

from ajgdata.evaluate.fold_tests import paired_fold_test
from ajgdata.paths import Paths
from ajgdata.pipeline.importing import import_folder
from ajgdata.types import ImportSettings
from benchmarks import feature_scores
from benchmarks.feature_scores import Evaluation, costs, evaluated, feature_table
from tools.feature_page import Gain, corrected, cost_table, estimate, fold_gains, score_table

RATE_HZ = 44_100
#: Samples of six complete windows of a spectrum, so that the reversed sound has the same windows.
LENGTH = 2048 + 5 * 512
EVALUATION = Evaluation("tones", "label", "grasp_id")


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """A project with 10 rising and 10 falling tones in noise."""
    root = tmp_path_factory.mktemp("project")
    folder = root / "wav"
    folder.mkdir()
    random = np.random.default_rng(0)
    time_s = np.arange(LENGTH) / RATE_HZ
    rising = 0.5 * chirp(time_s, 1000, time_s[-1], 8000)
    for number in range(1, 21):
        sound = rising if number % 2 else rising[::-1]
        noisy = sound + 0.1 * random.standard_normal(len(sound))
        label = "rising" if number % 2 else "falling"
        sf.write(folder / f"{number}_{label}.wav", noisy, RATE_HZ, subtype="PCM_24")
    (root / "datasets").mkdir()
    import_folder(Paths(root), "tones", folder, settings=ImportSettings(pattern="starter-kit"))
    return root


def test_only_the_spectrogram_has_the_direction_of_a_tone(project, monkeypatch):
    monkeypatch.setattr(feature_scores, "FOLDS", 2)
    (row,) = evaluated(project, EVALUATION)
    assert list(row["features"]) == ["spectrum", "spectrogram", "mel"]  # no sound was played
    assert (row["recordings"], row["units"], row["chance"]) == (20, 20, 0.5)
    assert row["features"]["spectrogram"]["value"] == 1.0
    for feature in ("spectrum", "mel"):  # a guess differs from 50 % by less than 3.5 deviations
        assert abs(row["features"][feature]["value"] - 0.5) < 3.5 * math.sqrt(0.25 / 20)


def test_a_spectrogram_is_as_long_as_the_shortest_recording(project):
    table = feature_table(project, "tones")
    frames = (LENGTH - 1024) // 512 + 1
    assert table.feature["spectrogram"].shape == (20, frames * 513)
    assert table.feature["spectrum"].shape == (20, 1025)
    assert table.lacking == {"spectrum": 0, "spectrogram": 0, "mel": 0}
    assert costs("tones", table)["features"]["mel"]["values"] == 64


@pytest.mark.parametrize("gains", [[0.25, 0.25, 0.25], [0.1, 0.4]], ids=["equal", "two"])
def test_equal_gains_and_two_data_sets_have_no_test(gains):
    (gain,) = corrected([estimate(gains)])
    assert gain.gain == 0.25
    assert math.isnan(gain.p)
    assert gain.verdict == "no test"


def test_no_difference_requires_the_whole_interval_inside_the_margin():
    assert Gain(0.02, -0.08, 0.12, 0.3).verdict == "no difference"
    assert Gain(0.05, -0.03, 0.13, 0.3).verdict == "inconclusive"
    assert Gain(-0.05, -0.13, 0.03, 0.3).verdict == "inconclusive"
    assert Gain(0.05, 0.01, 0.09, 0.03).verdict == "better"
    assert Gain(-0.05, -0.09, -0.01, 0.03).verdict == "worse"


def test_the_gain_over_folds_is_that_of_the_package():
    before, after = [1.0, 1.2, 0.9, 1.1], [0.8, 1.1, 0.9, 0.7]
    row = {"metric": "rmse", "chance": 5.0, "perfect": 0.0, "test_set": ""}
    row["features"] = {"spectrum": {"per_fold": before}, "mel": {"per_fold": after}}
    test = paired_fold_test(before, after, metric="rmse", paired=True)
    gain = fold_gains([row])[0, "mel"]
    expected = [test.gain / 5, test.low / 5, test.high / 5, test.p]
    assert list(gain) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("folds", "test_set"), [(2, ""), (5, "size_80dba")], ids=["two folds", "same recordings"]
)
def test_dependent_and_too_few_folds_have_no_test_and_do_not_count(folds, test_set):
    values = [0.5, 0.7, 0.6, 0.8, 0.9]
    row = {"chance": 0.0, "perfect": 1.0, "test_set": ""}
    row["features"] = {"spectrum": {"per_fold": values}, "mel": {"per_fold": values[::-1]}}
    untested = {**row, "test_set": test_set}
    untested["features"] = {
        "spectrum": {"per_fold": values[:folds]},
        "mel": {"per_fold": values[:folds][::-1]},
    }
    assert fold_gains([row, untested]) == fold_gains([row])


def test_tables_have_a_dash_for_a_feature_that_is_not_possible():
    features = {
        name: {
            "value": 0.8,
            "low": 0.7,
            "high": 0.9,
            "per_fold": [0.7, 0.8, 0.9],
            "train_cpu_s": seconds,
        }
        for name, seconds in (("spectrum", 1.0), ("spectrogram", 3.0))
    }
    row = {
        "dataset": "esc10",
        "source": "recorded",
        "target": "label",
        "held_out": "fold",
        "test_set": "",
        "metric": "accuracy",
        "chance": 0.1,
        "perfect": 1.0,
        "recordings": 160,
        "units": 123,
        "features": features,
    }
    measured = {
        "features": {
            "spectrum": {"values": 1025, "cpu_s": 1.0},
            "spectrogram": {"values": 43_605, "cpu_s": 2.0},
        }
    }
    results = {"scores": [row], "costs": [measured]}
    line = score_table(results).splitlines()[-1]
    expected = "| esc10, sound | published folds | 160, 123 | 10 % | 80 % (70 to 90) "
    assert line == f"{expected}| 80 % (70 to 90), equal | — | — |"
    costs_of = cost_table(results).splitlines()[2:]
    assert costs_of == [
        "| spectrum | 1,025 | 1 | 1 |",
        "| spectrogram | 43,605 | 2 (2 to 2) | 3 (3 to 3) |",
    ]
