"""Repeated splits and their interval: known answers, coverage, and no group on both sides."""

import math

import numpy as np
import pytest
from scipy.stats import norm

from ajgdata.evaluate.agreement import why_undefined
from ajgdata.evaluate.intervals import CONFIDENCE
from ajgdata.evaluate.resampling import (
    corrected_deviation,
    corrected_interval,
    corrected_reach,
    repeat_seed,
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


def accuracies(x: np.ndarray, y: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """Ten repeats of five folds (50,) of a threshold halfway between the means of two classes."""
    found = []
    for _ in range(10):
        for test in np.array_split(generator.permutation(len(x)), 5):
            train = np.setdiff1d(np.arange(len(x)), test)
            half = (x[train][y[train] == 1].mean() + x[train][y[train] == 0].mean()) / 2
            found.append(np.mean((x[test] > half) == y[test]))
    return np.array(found)


def test_coverage_is_nearer_the_stated_one_than_that_of_the_plain_interval():
    """The truth, the accuracy of such a threshold learnt from 32 rows, is known but for a mean over
    thresholds: these are normal about the middle with variance 1/32."""
    generator, shift, runs = np.random.default_rng(0), 1.0, 200
    y = np.repeat([0, 1], 20)
    halves = shift / 2 + generator.normal(0, math.sqrt(1 / 32), 20_000)
    truth = np.mean((norm.cdf(halves) + norm.cdf(shift - halves)) / 2)
    corrected = plain = 0
    for _ in range(runs):
        values = accuracies(shift * y + generator.normal(size=40), y, generator)
        low, high = corrected_interval(values, 5)
        corrected += low <= truth <= high
        plain += abs(values.mean() - truth) <= corrected_reach(values.var(ddof=1), 50, 0.0)
    spread = math.sqrt(CONFIDENCE * (1 - CONFIDENCE) / runs)  # of a share of that many runs
    assert plain / runs < CONFIDENCE - 5 * spread
    assert abs(corrected / runs - CONFIDENCE) <= 3 * spread


def test_seeds_of_repeats_differ_between_seeds_of_a_task():
    seeds = [repeat_seed(seed, number) for seed in range(3) for number in range(10)]
    assert len(set(seeds)) == 30
    assert [repeat_seed(seed, 0) for seed in range(3)] == [0, 1, 2]
