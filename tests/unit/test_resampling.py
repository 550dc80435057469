"""Repeated splits and their interval: known answers, coverage, and no group on both sides."""

import math

import numpy as np
import pytest

from ajgdata.evaluate.agreement import why_undefined
from ajgdata.evaluate.crossval import cross_validate
from ajgdata.evaluate.resampling import (
    corrected_deviation,
    corrected_interval,
    repeated,
    repeats_of,
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
    assert "same value" in why_undefined("repeated", "accuracy", "low")


def test_few_recordings_are_split_ten_times_unless_there_is_one_split_alone():
    assert repeats_of("auto", 99, 50, 5) == 10
    assert repeats_of("auto", 100, 50, 5) == 1
    assert repeats_of(3, 5000, 50, 5) == 3
    assert repeats_of(3, 50, 5, 5) == 1  # each group is a fold, whatever the seed


def small() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    generator = np.random.default_rng(1)
    group = np.repeat(np.arange(12), 2)
    return generator.uniform(1, 2, (24, 8)), np.array(list("ab"))[group % 2], group


def test_no_repeat_has_a_group_on_both_sides_and_all_differ():
    x, y, group = small()

    def once(seed: int):
        named = {"kind": "classification", "model": "knn", "folds": 3}
        return cross_validate(x, y, group, seed=seed, **named)

    first = once(5)
    found = repeated(once, first, 4, seed=5)
    fold = found.predictions.fold.reshape(4, 24)
    assert [sorted(set(one)) for one in fold] == [[3 * n, 3 * n + 1, 3 * n + 2] for n in range(4)]
    for one in fold:
        assert all(len(set(one[group == g])) == 1 for g in range(12))
    parts = {frozenset(frozenset(np.flatnonzero(one == f)) for f in set(one)) for one in fold}
    assert len(parts) == 4
    np.testing.assert_array_equal(found.predictions.y_pred[:24], first.predictions.y_pred)
    right = (found.predictions.y_pred == found.predictions.y_true).reshape(4, 24)
    each = [np.mean(right[n // 3][fold[n // 3] == n]) for n in range(12)]
    assert found.scores.per_fold["accuracy"] == pytest.approx(each, rel=1e-12)
    assert found.scores.mean["accuracy"] == pytest.approx(np.mean(each), rel=1e-12)
    assert np.sum(found.scores.confusion) == 96
    again = repeated(once, once(5), 4, seed=5)
    assert again.scores == found.scores
