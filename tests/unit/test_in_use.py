"""Calibration of a model in use: known answers, and rates that hold on new grasps."""

from dataclasses import replace

import numpy as np
import pytest

from ajgdata.evaluate.in_use import Calibration, calibration
from ajgdata.evaluate.novelty import (
    NEAREST,
    RELATIVE,
    NovelScores,
    NoveltyGuard,
    alarm,
    can_share,
    classifier_scores,
    novel_scores,
)

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
    features = spectra(np.arange(8))
    y = np.arange(8.0)
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
    guard = NoveltyGuard.from_grasps(features, np.array(["p", "p", "q", "q"]))
    points = guard.points(features)
    np.testing.assert_allclose(points.mean(axis=0), 0, atol=1e-4)  # float32 means and deviations
    np.testing.assert_allclose(points.std(axis=0), 1, atol=1e-4)
    np.testing.assert_allclose(guard.grasps, [points[:2].mean(0), points[2:].mean(0)], rtol=1e-5)
    expected = np.linalg.norm(points[0] - guard.grasps[0].astype(float))
    assert guard.distance(features[:1])[0] == pytest.approx(expected, rel=1e-12)
    assert np.isnan(guard.novelty(features)).all()  # without a threshold nothing was checked


def test_nothing_is_what_is_nearer_to_a_reference():
    guard = NoveltyGuard.from_grasps(spectra([1, 1, 3, 3]), np.array(["p", "p", "q", "q"]))
    assert not guard.is_empty_gripper(spectra([9])).any()
    empty = guard.with_references(spectra([9, 9]))
    assert empty.is_empty_gripper(spectra([9, 1, 3, 8])).tolist() == [True, False, False, True]
    assert len(empty.with_references(spectra([7])).references) == 3
    with pytest.raises(ValueError, match=r"references need shape \(r, 40\)"):
        guard.with_references(np.zeros(40))
    with pytest.raises(ValueError, match="NaN"):
        guard.with_references(np.full((1, 40), np.nan))


def test_false_alarms_come_as_often_as_stated():
    generator = np.random.default_rng(3)
    flagged = []
    rate = 0.1
    for _ in range(20):
        grasp = np.repeat(np.arange(60), 2)
        features = spectra(np.repeat(generator.uniform(1, 4, 60), 2), generator, bins=12)
        known = grasp < 40
        result = alarm(features[known], grasp[known], grasp[known], false_alarm=rate)
        assert result.false_alarm == rate
        away = NoveltyGuard.from_grasps(features[known], grasp[known]).distance(features[~known])
        flagged.append((away > result.threshold).mean())
    # of 20 worlds of 40 and 20 grasps each: sd of the mean <= sqrt(.1 * .9 * (1/40 + 1/20) / 20)
    assert np.mean(flagged) < rate + 3 * np.sqrt(0.09 * 0.075 / 20)
    assert np.mean(flagged) > 0.02


def clusters(objects, grasps, generator, *, spread, bins=60):
    """Spectra (n, bins) of `grasps` grasps of `objects` objects, with object and grasp (n,).

    Objects differ along all bins by a factor of about e^0.3, grasps of an object by e^spread.
    """
    shape = generator.normal(0, 0.3, (objects, bins))
    number = np.repeat(np.arange(objects), grasps)
    log = shape[number] + generator.normal(0, spread, (len(number), bins))
    return np.exp(log), np.array([f"o{n}" for n in number]), np.arange(len(number))


def test_well_separated_objects_are_detected():
    """Grasps differ ten times less than objects: the nearest distance is that of an object."""
    generator = np.random.default_rng(1)
    features, objects, grasp = clusters(8, 20, generator, spread=0.03)
    scores = novel_scores(features, grasp, grasp, objects)
    assert scores.detected({NEAREST: 0.05}) == 1
    assert scores.detected({RELATIVE: 0.05}) > 0.5
    assert scores.detection_rate(0.05) == 1


def test_objects_without_differences_are_detected_at_the_rate_of_false_alarms():
    """Eight names for one object: known and novel grasps have one distribution."""
    generator = np.random.default_rng(2)
    shape = np.exp(generator.normal(0, 0.1, (400, 60)))
    objects = np.array([f"o{n % 8}" for n in range(400)])
    scores = novel_scores(shape, np.arange(400), np.arange(400), objects)
    for name in (NEAREST, RELATIVE):
        # 400 novel and 64 x 8 / 5 known grasps decide: sd of the rate .05 * sqrt(1/400 + 1/500)
        assert scores.detected({name: 0.05}) == pytest.approx(0.05, abs=0.05)


def test_the_relative_distance_detects_objects_between_the_known_ones():
    """Known objects are far apart along many axes, grasps differ little. A novel object is the
    mean of all: the nearest distance is smaller than that between known objects, and still
    detected; a grasp of a known object is at 0 relative distance of its own mean."""
    generator = np.random.default_rng(3)
    features, objects, grasp = clusters(12, 20, generator, spread=0.05)
    guard = NoveltyGuard.from_grasps(features, grasp, objects)
    middle = np.exp(np.log(features).mean(axis=0))[None]
    own = guard.scores(features)[RELATIVE]
    assert guard.scores(middle)[RELATIVE] > 3 * own.max()
    assert guard.has_objects and len(guard.objects) == 12
    assert not NoveltyGuard.from_grasps(features, grasp).has_objects
    assert not NoveltyGuard.from_grasps(features, grasp, np.full(len(grasp), "one")).has_objects
    assert not NoveltyGuard.from_grasps(
        features, grasp, grasp.astype(str)
    ).has_objects  # one grasp per object


def test_distances_of_a_guard_are_those_of_mahalanobis():
    """In whitened coordinates grasps of an object have unit variance around its mean, and all
    recordings have unit variance around the centre."""
    generator = np.random.default_rng(4)
    features, objects, grasp = clusters(4, 200, generator, spread=0.2, bins=6)
    guard = NoveltyGuard.from_grasps(features, grasp, objects)
    coordinates = (guard.points(features) - guard.centre) @ guard.components.T
    assert len(guard.components) == 6  # as many as bins
    np.testing.assert_allclose((coordinates / guard.total).std(axis=0), 1, rtol=1e-4)
    whitened = coordinates @ guard.within
    number = np.unique(objects, return_inverse=True)[1]
    residual = whitened - guard.objects[number]
    np.testing.assert_allclose(np.cov(residual.T, bias=True), np.eye(6), atol=0.05)


def test_two_distances_share_the_false_alarms_if_there_are_enough_groups():
    assert can_share(0.05, 39) and not can_share(0.05, 38)
    generator = np.random.default_rng(5)
    features, objects, grasp = clusters(4, 20, generator, spread=0.1)
    known = np.arange(80)
    both = alarm(features, grasp, known, objects=objects, false_alarm=0.05)
    assert both.relative_threshold is not None
    few = alarm(features, grasp, known // 4, objects=objects, false_alarm=0.05)
    assert (few.relative_threshold, few.false_alarm) == (None, 0.05)
    # half of the false alarms need a larger threshold
    assert both.threshold >= alarm(features, grasp, known, false_alarm=0.05).threshold


def test_a_recording_is_novel_if_one_distance_is_too_large():
    generator = np.random.default_rng(6)
    features, objects, grasp = clusters(4, 20, generator, spread=0.1)
    guard = NoveltyGuard.from_grasps(features, grasp, objects)
    scores = guard.scores(features[:3])
    limits = replace(guard, threshold=2.0, relative_threshold=0.5)
    expected = np.maximum(scores[NEAREST] / 2, scores[RELATIVE] / 0.5)
    np.testing.assert_allclose(limits.novelty(features[:3]), expected)
    alone = replace(guard, threshold=2.0).novelty(features[:3])
    np.testing.assert_allclose(alone, scores[NEAREST] / 2)


def test_the_detection_rate_counts_grasps_and_joins_both_distances():
    """Known scores are 0 to 98. At 4 %, the limit is 96 of 99 + 1 groups (share .96), at 2 % 97."""
    known = np.arange(99.0)
    novel = {NEAREST: np.array([99.0, 0, 0, 0]), RELATIVE: np.array([0, 0, 97.5, 0])}
    scores = NovelScores(
        {NEAREST: known, RELATIVE: known},
        novel,
        np.arange(99),
        np.array(["a", "a", "b", "c"]),
        np.array(["x"] * 4),
    )
    assert scores.detected({NEAREST: 0.02}) == pytest.approx((1 / 2) / 3)
    assert scores.detection_rate(0.04) == pytest.approx((1 / 2 + 1) / 3)
    with pytest.raises(ValueError, match="one object only"):
        novel_scores(np.ones((4, 2)), np.arange(4), np.arange(4), np.zeros(4))


@pytest.mark.parametrize(("rate", "reliable"), [(None, False), (0.49, False), (0.5, True)])
def test_a_guard_that_misses_most_novel_objects_calls_nothing_known(rate, reliable):
    about = Calibration(5, 10, 0.05, {}, novelty_threshold=1.0, detection_rate=rate)
    assert about.detects_novel_objects is reliable


def test_a_model_in_use_stores_the_rates_of_its_own_guard():
    generator = np.random.default_rng(7)
    features, objects, grasp = clusters(5, 16, generator, spread=0.05)
    result = calibration(
        features,
        objects,
        grasp,
        grasp,
        model="linear_plain",
        kind="classification",
        objects=objects,
    )
    limits = alarm(features, grasp, grasp, objects=objects, false_alarm=0.05)
    assert (result.novelty_threshold, result.relative_threshold) == (
        limits.threshold,
        limits.relative_threshold,
    )
    expected = novel_scores(features, grasp, grasp, objects).detection_rate(0.05)
    assert result.detection_rate == expected
    assert result.false_alarm == result.false_alarm_stated == 0.05


def test_the_area_under_the_curve_of_two_normal_scores():
    """Scores N(0, 1) and N(1, 1): the area is the normal distribution function at 1 / sqrt(2)."""
    generator = np.random.default_rng(8)
    known = generator.normal(size=20_000)
    novel = generator.normal(1, 1, 20_000)
    groups = np.arange(20_000)
    scores = NovelScores(
        {"a": known, "b": 0 * known}, {"a": novel, "b": 0 * novel}, groups, groups, groups
    )
    assert scores.area("a") == pytest.approx(0.7602, abs=0.007)
    assert scores.area("b") == 0.5


def test_class_scores_give_energy_and_probability():
    class Fitted:
        def decision_function(self, features):
            return features

    equal = classifier_scores(Fitted(), np.zeros((1, 4)))
    assert equal["energy"] == pytest.approx(-np.log(4))
    assert equal["probability"] == pytest.approx(-1 / 4)
    two = classifier_scores(Fitted(), np.array([np.log(3.0)]))  # of the second class
    assert two["energy"] == pytest.approx(-np.log(4))
    assert two["probability"] == pytest.approx(-3 / 4)
