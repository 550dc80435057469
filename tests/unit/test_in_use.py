"""Calibration of a model in use: known answers, and rates that hold on new grasps."""

import numpy as np
import pytest

from ajgdata.evaluate.in_use import calibration
from ajgdata.evaluate.novelty import Guard, alarm, detection_rate

GENERATOR = np.random.default_rng(0)


def spectra(edge, generator=GENERATOR, bins=40):
    """Spectra (n, bins) that grow with the edge, each with 2 % of noise."""
    shape = 1 + np.outer(np.asarray(edge, float), np.linspace(0, 1, bins))
    return shape * (1 + 0.02 * generator.standard_normal(shape.shape))


def test_residuals_of_a_constant_prediction_give_the_half_width():
    """Equal spectra: each fold predicts the mean of the others. 19 grasps at 0, one at 1: the
    residual of each 0 is at most 1/16, that of the 1 is 1; 90 % need 19 of 21 weights."""
    y = np.append(np.zeros(19), 1.0)
    result = calibration(
        np.ones((20, 8)), y, np.arange(20), np.arange(20), model="ridge", kind="regression"
    )
    assert result.half_width == pytest.approx(1 / 16, abs=1e-12)
    assert result.novelty_threshold is None
    assert "features are equal" in result.problems["novelty_threshold"]


def test_what_cannot_be_calibrated_says_why():
    features, y = spectra(np.arange(8)), np.arange(8.0)
    few = calibration(features, y, np.arange(8), np.arange(8), model="ridge", kind="regression")
    assert few.half_width is None
    assert few.coverage is None
    assert few.problems == {
        "half_width": "8 groups cannot show where 90 % of new ones lie: record at least 9"
    }
    assert few.false_alarm == pytest.approx(1 / 9)
    classes = np.repeat(["a", "b"], 4)
    svm = calibration(
        features, classes, np.arange(8), np.arange(8), model="svm", kind="classification"
    )
    assert svm.temperature is None
    assert "'svm' has no probabilities" in svm.problems["temperature"]


def test_a_guard_measures_from_the_means_of_grasps():
    features = spectra([1, 1, 3, 3])
    guard = Guard.of(features, np.array(["p", "p", "q", "q"]))
    points = guard.points(features)
    np.testing.assert_allclose(points.mean(axis=0), 0, atol=1e-4)  # float32 means and deviations
    np.testing.assert_allclose(points.std(axis=0), 1, atol=1e-4)
    np.testing.assert_allclose(guard.grasps, [points[:2].mean(0), points[2:].mean(0)], rtol=1e-5)
    expected = np.linalg.norm(points[0] - guard.grasps[0].astype(float))
    assert guard.distance(features[:1])[0] == pytest.approx(expected, rel=1e-12)
    assert np.isnan(guard.novelty(features)).all()  # without a threshold nothing was checked


def test_nothing_is_what_is_nearer_to_a_reference():
    guard = Guard.of(spectra([1, 1, 3, 3]), np.array(["p", "p", "q", "q"]))
    assert not guard.is_nothing(spectra([9])).any()
    empty = guard.with_references(spectra([9, 9]))
    assert empty.is_nothing(spectra([9, 1, 3, 8])).tolist() == [True, False, False, True]
    assert len(empty.with_references(spectra([7])).references) == 3
    with pytest.raises(ValueError, match=r"references need shape \(r, 40\)"):
        guard.with_references(np.zeros(40))
    with pytest.raises(ValueError, match="NaN"):
        guard.with_references(np.full((1, 40), np.nan))


def test_false_alarms_come_as_often_as_stated():
    generator = np.random.default_rng(3)
    flagged, rate = [], 0.1
    for _ in range(20):
        grasp = np.repeat(np.arange(60), 2)
        features = spectra(np.repeat(generator.uniform(1, 4, 60), 2), generator, bins=12)
        known = grasp < 40
        result = alarm(features[known], grasp[known], grasp[known], false_alarm=rate)
        assert result.false_alarm == rate
        away = Guard.of(features[known], grasp[known]).distance(features[~known])
        flagged.append((away > result.threshold).mean())
    # of 20 worlds of 40 and 20 grasps each: sd of the mean <= sqrt(.1 * .9 * (1/40 + 1/20) / 20)
    assert np.mean(flagged) < rate + 3 * np.sqrt(0.09 * 0.075 / 20)
    assert np.mean(flagged) > 0.02


def test_objects_far_from_the_others_are_detected_and_near_ones_are_not():
    """Three grasps of two recordings of four objects, of which two give the same spectra."""
    objects, grasp = np.repeat(["a", "b", "c", "d"], 6), np.repeat(np.arange(12), 2)
    edge = np.repeat([1.0, 1.0, 5.0, 9.0], 6)
    features = 1 + np.outer(edge, np.linspace(0, 1, 40))
    assert detection_rate(features, grasp, objects, 0.1) == pytest.approx(2 / 4)
    assert detection_rate(features, grasp, objects, 1e9) == 0
    with pytest.raises(ValueError, match="one object only"):
        detection_rate(features, grasp, np.zeros(24), 1.0)


def test_a_model_in_use_stores_the_rate_at_its_own_threshold():
    edge = np.repeat([1.0, 3.0, 5.0, 7.0], 10)
    features = spectra(edge, np.random.default_rng(6))
    objects, grasp = edge.astype(str), np.arange(40)
    result = calibration(
        features, objects, grasp, grasp, model="linear_plain", kind="classification",
        objects=objects,
    )  # fmt: skip
    expected = detection_rate(features, grasp, objects, result.novelty_threshold)
    assert result.detection_rate == expected > 0.5
