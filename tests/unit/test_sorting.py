"""Probabilities that mean what they say, and what is sorted by them."""

import math

import numpy as np
import pytest
from scipy.special import log_softmax, softmax

from ajgdata.evaluate.calibration import (
    calibration_error,
    reliability,
    temperature,
    with_temperature,
)
from ajgdata.evaluate.in_use import calibrated_probabilities, calibration
from ajgdata.evaluate.intervals import clopper_pearson
from ajgdata.evaluate.sorting import (
    LONGEST_RUN,
    STOP,
    decision_shares,
    decisions,
    drawn_rows,
    sorting_run,
)
from ajgdata.evaluate.splits import grouped_folds


def overconfident(n: int, t: float) -> tuple[np.ndarray, np.ndarray]:
    """Log-probabilities `t` times too sharp, with labels drawn from the true ones."""
    rng = np.random.default_rng(0)
    logits = rng.normal(size=(n, 3))
    label = np.array([rng.choice(3, p=p) for p in softmax(logits, axis=1)])
    return log_softmax(t * logits, axis=1), label


@pytest.mark.parametrize("t", [0.5, 1.0, 3.0])
def test_the_temperature_by_which_probabilities_are_too_sharp_is_found(t):
    log_p, label = overconfident(5000, t)
    # the score of log T has standard deviation about 1 / sqrt(0.4 n) for such logits: 2 %
    assert temperature(log_p, label) == pytest.approx(t, rel=0.08)
    p = np.exp(log_p)
    right = None
    scaled = with_temperature(p, temperature(log_p, label))
    np.testing.assert_array_equal(scaled.argmax(axis=1), p.argmax(axis=1))
    np.testing.assert_allclose(scaled.sum(axis=1), 1)
    right = p.argmax(axis=1) == label
    errors = [calibration_error(reliability(q.max(axis=1), right)) for q in (p, scaled)]
    assert errors[1] < 0.03
    assert t == 1 or errors[1] < errors[0] / 3


def test_reliability():
    confidence = np.array([0.15, 0.2, 0.95, 1.0, 0.0])
    right = np.array([True, False, True, True, False])
    low, second, high = reliability(confidence, right)
    assert (low.low, low.high, low.count) == (0, pytest.approx(0.1), 1)  # 0 belongs to the first
    assert (second.count, second.confidence, second.accuracy) == (2, pytest.approx(0.175), 0.5)
    assert (high.count, high.confidence, high.accuracy) == (2, pytest.approx(0.975), 1)
    assert calibration_error((low, second, high)) == pytest.approx((0 + 2 * 0.325 + 2 * 0.025) / 5)


def test_calibration_holds_groups_out_twice():
    rng = np.random.default_rng(0)
    group = np.repeat(np.arange(24), 2)
    y = np.array(["a", "b"])[group % 2]
    x = np.exp((group % 2)[:, None] * 0.3 + rng.normal(size=(24, 20))[group]).astype(np.float32)
    result = calibrated_probabilities(x, y, group, model="linear_plain", folds=3)
    assert result.classes.tolist() == ["a", "b"]
    for p in (result.plain, result.scaled):
        np.testing.assert_allclose(p.sum(axis=1), 1)
    parts = grouped_folds(y, group, "classification", 3, 0)
    for train, test in parts:
        shipped = calibration(
            x[train],
            y[train],
            group[train],
            group[train],
            model="linear_plain",
            kind="classification",
        )
        # what training for use stores
        scaled = with_temperature(result.plain[test], shipped.temperature)
        np.testing.assert_array_equal(result.scaled[test], scaled)
        # grasps of such spread are near chance; logistic regression separates its own perfectly
        assert shipped.temperature > 1
    sharp = result.plain.max(axis=1)
    flat = result.scaled.max(axis=1)
    assert (flat <= sharp + 1e-12).all()
    with pytest.raises(ValueError, match="model 'svm' has no probabilities"):
        calibrated_probabilities(x, y, group, model="svm", folds=3)


def test_a_run_ends_with_the_first_refusal():
    """Class 0 is always accepted, class 1 always refused: a run counts heads until tails."""
    p = np.array([[0.9, 0.1], [0.9, 0.1], [0.45, 0.55]])
    label = np.array([0, 0, 1])
    decided = decisions(p, 0.6)
    assert decided.tolist() == [0, 0, STOP]
    sorts = [sorting_run(decided, label, drawn_rows(label, seed)).sorts for seed in range(2000)]
    # geometric with mean 1 and variance 2: three standard deviations of the mean
    assert abs(np.mean(sorts) - 1) < 3 * math.sqrt(2 / 2000)
    assert np.array_equal(drawn_rows(label, 5), drawn_rows(label, 5))


def test_errors_are_counted_and_end_no_run():
    p = np.array([[0.9, 0.1], [0.8, 0.2]])
    label = np.array([0, 1])
    run = sorting_run(decisions(p, 0.6), label, drawn_rows(label, 0))
    assert run.sorts == LONGEST_RUN
    assert abs(run.errors - 500) < 3 * math.sqrt(250)
    in_order = sorting_run(np.array([0, 1, 0, STOP]), np.array([0, 1, 1, 0]), [1, 2, 0, 3, 2])
    assert (in_order.sorts, in_order.errors) == (3, 1)
    assert sorting_run(np.array([STOP, 0]), label, [0, 1]).sorts == 0


def test_shares_of_decisions_count_grasps():
    """Forty grasps of two recordings; the first ten are refused, five of the others are wrong."""
    grasp = np.repeat(np.arange(40), 2)
    label = grasp % 2
    decided = np.where(grasp < 10, STOP, np.where(grasp >= 35, 1 - label, label))
    p = np.eye(2)[np.where(decided == STOP, label, decided)]
    result = decision_shares(p, decided, label, grasp)
    assert (result.grasps, result.accuracy) == (40, 35 / 40)
    assert (result.accepted.value, result.correct.value) == (0.75, pytest.approx(25 / 30))
    # a bootstrap over n grasps has the standard deviation sqrt(s (1 - s) / n) of a binomial share;
    # over recordings, as if they were independent, it would be narrower by a factor of 1.4
    for share, grasps in ((result.accepted, 40), (result.correct, 30)):
        low, high = share.interval
        width = 2 * 1.96 * math.sqrt(share.value * (1 - share.value) / grasps)
        assert high - low == pytest.approx(width, rel=0.15)


def test_shares_without_variance_have_exact_intervals():
    grasp = np.repeat(np.arange(20), 2)
    label = grasp % 2
    p = np.eye(2)[label]
    result = decision_shares(p, label, label, grasp)
    assert result.accepted.interval == result.correct.interval == clopper_pearson(20, 20)
    assert result.correct.interval.low == pytest.approx(0.025 ** (1 / 20))
    refused = decision_shares(p, np.full(40, STOP), label, grasp)
    assert refused.accepted.interval == clopper_pearson(0, 20)
    assert math.isnan(refused.correct.value)
    assert not refused.correct.interval.is_defined
