"""Intervals and verdicts on differences between cross-validations."""

import numpy as np
import pytest
from scipy.stats import t as student

from ajgdata.evaluate.paired_fold_test import paired_fold_test

FIVE = (0.70, 0.72, 0.66, 0.74, 0.68)


def test_the_interval_is_the_corrected_one():
    """Differences 1..5: mean 3, s² = 2.5; (1/5 + 1/4) 2.5 = 1.125, t(0.975, 4) = 2.776."""
    found = paired_fold_test([0] * 5, [1, 2, 3, 4, 5], lower_is_better=False, paired=True)
    assert found.gain == 3
    reach = 2.7764451 * np.sqrt(1.125)  # tables give t to eight digits
    assert found.high - found.gain == pytest.approx(reach, rel=1e-7)
    assert found.gain - found.low == pytest.approx(reach, rel=1e-7)


def test_unpaired_variances_add():
    before, after = np.array(FIVE), np.array(FIVE[::-1]) + 0.1
    found = paired_fold_test(before, after, lower_is_better=False, paired=False)
    variance = before.var(ddof=1) + after.var(ddof=1)
    reach = student.ppf(0.975, 4) * np.sqrt(0.45 * variance)
    assert (found.low, found.high) == pytest.approx((0.1 - reach, 0.1 + reach))


@pytest.mark.parametrize(
    ("shift", "lower", "expected", "verdict"),
    [
        (0.3, False, "better", "supported"),
        (0.3, False, "worse", "refuted"),
        (0.3, True, "better", "refuted"),
        (-0.3, True, "better", "supported"),
        (-0.3, False, "worse", "supported"),
    ],
)
def test_the_verdict_is_on_what_was_expected(shift, lower, expected, verdict):
    noise = np.array([0.0, 0.01, -0.01, 0.02, -0.02])
    found = paired_fold_test(
        FIVE, np.array(FIVE) + shift + noise, lower_is_better=lower, paired=True
    )
    assert found.verdict(expected) == verdict


def test_what_folds_vary_by_supports_nothing():
    found = paired_fold_test(FIVE, FIVE[::-1], lower_is_better=False, paired=True)
    assert found.verdict("better") == found.verdict("worse") == "not supported"
    same = paired_fold_test(FIVE, FIVE, lower_is_better=False, paired=True)
    assert (same.gain, same.verdict()) == (0, "not supported")


@pytest.mark.parametrize("after", [FIVE[:4], (*FIVE[:4], float("nan"))])
def test_folds_that_cannot_be_compared_are_refused(after):
    with pytest.raises(ValueError, match="fold"):
        paired_fold_test(FIVE, after, lower_is_better=False, paired=True)
    with pytest.raises(ValueError, match="two or more"):
        paired_fold_test([1.0], [2.0], lower_is_better=False, paired=True)
