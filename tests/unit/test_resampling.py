"""Repeated splits and their interval: known answers, coverage, and no group on both sides."""

import math

import pytest

from ajgdata.evaluate.agreement import why_undefined
from ajgdata.evaluate.fold_tests import (
    corrected_deviation,
    corrected_interval,
)


def test_the_corrected_variance_of_fifty_folds_is_that_of_the_papers():
    """Ten repeats of five folds: s² (1/50 + 8/32), as Bouckaert & Frank write it for 40 rows."""
    assert corrected_deviation(4.0, 50, 8 / 32) == pytest.approx(math.sqrt(0.27 * 4), rel=1e-15)


def test_the_interval_of_a_single_split_is_that_of_the_paired_test():
    """Values 1..5: mean 3, s² = 2.5; (1/5 + 1/4) 2.5 = 1.125, t(0.975, 4) = 2.7764451."""
    low, high = corrected_interval([1, 2, 3, 4, 5], folds=5)
    assert (3 - low, high - 3) == pytest.approx([2.7764451 * math.sqrt(1.125)] * 2, rel=1e-7)


def test_an_interval_ends_where_the_metric_does():
    values = [0.9, 1.0, 1.0, 0.95, 0.85] * 2
    low, high = corrected_interval(values, 5, "accuracy")
    assert high == 1.0 and low == corrected_interval(values, 5)[0] < 0.9
    assert corrected_interval([0.0, 5.0, 1.0], 3, "rmse").low == 0.0
    assert corrected_interval([0.0, -5.0, 1.0], 3, "r2").low < -5.0
    assert all(map(math.isnan, corrected_interval([0.1, math.nan], 2)))


def test_folds_that_are_all_right_claim_no_certainty():
    for equal in ([1.0] * 50, [0.1 + 0.2, 0.3]):  # which differ by rounding
        assert all(map(math.isnan, corrected_interval(equal, 5, "accuracy")))
    assert "same value" in why_undefined("accuracy", "low")
