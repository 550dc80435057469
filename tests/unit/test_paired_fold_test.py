"""Intervals, p values and verdicts on differences between cross-validations, one or several."""

import math

import numpy as np
import pytest
from scipy.stats import t as student

from ajgdata.evaluate.fold_tests import holm, paired_fold_test, verdict

FIVE = (0.70, 0.72, 0.66, 0.74, 0.68)
NOISE = np.array([0.0, 0.01, -0.01, 0.02, -0.02])


def test_the_interval_is_the_corrected_one():
    """Differences 1..5: mean 3, s² = 2.5; (1/5 + 1/4) 2.5 = 1.125, t(0.975, 4) = 2.776."""
    result = paired_fold_test([0] * 5, [1, 2, 3, 4, 5], metric="", paired=True)
    assert result.gain == 3
    reach = 2.7764451 * np.sqrt(1.125)  # tables give t to eight digits
    assert result.high - result.gain == pytest.approx(reach, rel=1e-7)
    assert result.gain - result.low == pytest.approx(reach, rel=1e-7)
    assert result.p == pytest.approx(2 * student.sf(3 / np.sqrt(1.125), 4), rel=1e-12)


def test_unpaired_variances_add():
    before = np.array(FIVE)
    after = np.array(FIVE[::-1]) + 0.1
    result = paired_fold_test(before, after, metric="", paired=False)
    variance = before.var(ddof=1) + after.var(ddof=1)
    reach = student.ppf(0.975, 4) * np.sqrt(0.45 * variance)
    assert (result.low, result.high) == pytest.approx((0.1 - reach, 0.1 + reach))


@pytest.mark.parametrize(
    ("before", "after"), [(FIVE, FIVE[:1]), ([FIVE] * 2, [FIVE] * 2), (FIVE[:1], FIVE[:1])]
)
def test_other_than_two_or_more_pairs_of_folds_are_refused(before, after):
    with pytest.raises(ValueError, match="need as many folds of both, two or more"):
        paired_fold_test(before, after, metric="", paired=True)


@pytest.mark.parametrize(
    ("shift", "metric", "expected", "answer"),
    [
        (0.3, "accuracy", "better", "supported"),
        (0.3, "accuracy", "worse", "refuted"),
        (0.3, "rmse", "better", "refuted"),
        (-0.3, "mae", "better", "supported"),
        (-0.3, "r2", "worse", "supported"),
    ],
)
def test_the_verdict_is_on_what_was_expected(shift, metric, expected, answer):
    result = paired_fold_test(FIVE, np.array(FIVE) + shift + NOISE, metric=metric, paired=True)
    assert verdict(result.gain, result.p, expected) == answer


@pytest.mark.parametrize("shift", [0.0, 0.1])
def test_folds_that_all_differ_alike_cannot_be_tested(shift):
    """No `0 to 0`: without a variance nothing is known of other folds."""
    result = paired_fold_test(FIVE, np.array(FIVE) + shift, metric="accuracy", paired=True)
    assert result.gain == pytest.approx(shift)
    assert all(map(math.isnan, (result.low, result.high, result.p)))
    assert verdict(result.gain, result.p) == "not testable"


@pytest.mark.parametrize(
    ("metric", "low", "high"), [("accuracy", -0.7, 0.3), ("r2", None, 0.3), ("rmse", None, 0.7)]
)
def test_no_gain_leads_out_of_the_range_of_the_metric(metric, low, high):
    """Folds so different that the interval would be about ± 1.6: from a mean of 0.7 an accuracy can
    rise to 1 or fall to 0, and an error can fall to 0. None: the metric has no such end."""
    swing = np.array([0.8, -0.9, 0.9, -0.8, 0.1])
    result = paired_fold_test(FIVE, np.array(FIVE) + swing, metric=metric, paired=True)
    free = paired_fold_test(FIVE, np.array(FIVE) + swing, metric="", paired=True)
    assert free.high > 1
    unlimited = -free.high if metric == "rmse" else free.low  # less error is a gain
    assert result.high == pytest.approx(high)
    assert result.low == pytest.approx(unlimited if low is None else low)


def test_holm_multiplies_the_smallest_by_all_and_stays_in_order():
    """Four tests by hand: 4 · 0.01, 3 · 0.02, then 2 · 0.022, which is below 3 · 0.02, 1 · 0.9."""
    assert holm([0.02, 0.01, 0.9, 0.022]) == pytest.approx([0.06, 0.04, 0.9, 0.06])
    assert holm([0.5, 0.6]) == [1.0, 1.0]
    assert holm([]) == []
