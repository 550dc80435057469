"""Intervals over grasps: known answers, coverage on simulated data, and what is undefined."""

import numpy as np
import pytest
from scipy.stats import beta, bootstrap

from ajgdata.evaluate.agreement import Interval
from ajgdata.evaluate.crossval import Predictions, overall
from ajgdata.evaluate.intervals import (
    clopper_pearson,
    mean_interval,
    metric_interval,
    resampled_counts,
)

ONE_FOLD = np.zeros(60, int)


def test_one_recording_per_grasp_is_the_plain_bootstrap():
    """SciPy's percentile bootstrap of the same values; both ends vary by the resamples drawn:
    of 20,000 resamples a quantile at 2.5 % has a standard error of about 1 % of the width."""
    value = np.random.default_rng(1).gamma(2.0, 1.0, 60)
    expected = bootstrap((value,), np.mean, n_resamples=20_000, method="percentile", rng=2)
    interval = mean_interval(value, np.arange(60), resamples=20_000)
    width = interval.high - interval.low
    assert interval.low == pytest.approx(expected.confidence_interval.low, abs=0.05 * width)
    assert interval.high == pytest.approx(expected.confidence_interval.high, abs=0.05 * width)


def test_the_statistic_is_the_mean_over_folds():
    """Folds of errors 1 and 3, of 10 and of 50 grasps: their mean is 2; the root of the mean square
    of all is 2.77."""
    y_pred = np.r_[np.full(10, 1.0), np.full(50, 3.0)] + np.tile([-0.1, 0.1], 30)
    fold = np.repeat([0, 1], [10, 50])
    low, high = metric_interval(np.zeros(60), y_pred, fold, np.arange(60), kind="regression")
    assert 1.95 < low < 2 < high < 2.05


def test_a_grasp_that_all_folds_predict_is_drawn_once_for_all():
    """Five folds that predict the same: no narrower than one fold alone."""
    error = np.random.default_rng(5).normal(size=40)
    grasp = np.arange(40)
    single = metric_interval(np.zeros(40), error, np.zeros(40, int), grasp, kind="regression")
    five = metric_interval(
        np.zeros(200),
        np.tile(error, 5),
        np.repeat(range(5), 40),
        np.tile(grasp, 5),
        kind="regression",
    )
    assert five == pytest.approx(single, rel=1e-12)


def test_a_target_with_a_period_errs_the_short_way_round():
    y = np.tile([1.0, 179.0], 30)
    other = np.where(y < 90, 179.0, 1.0) + np.linspace(-0.2, 0.2, 60)
    low, high = metric_interval(y, other, ONE_FOLD, np.arange(60), kind="regression", period=180)
    assert 1.9 < low < 2 < high < 2.1


def test_parts_are_weighted_by_their_recordings():
    """Every resample of two parts that each have one error is between them; the interval is about
    the reported value of known and withheld values together."""
    generator = np.random.default_rng(6)
    known = Predictions(np.arange(40), np.arange(40) % 4, *np.zeros((2, 40)), None)
    known.y_pred[:] = generator.normal(1.0, 0.1, 40)
    held = Predictions(np.tile(range(10), 4), np.repeat(range(4), 10), *np.zeros((2, 40)), None)
    held.y_pred[:] = np.tile(generator.normal(4.0, 0.4, 10), 4)
    grasp = np.r_[np.arange(40), 100 + held.row]
    stacked = [np.r_[getattr(known, k), getattr(held, k)] for k in ("y_true", "y_pred", "fold")]
    part = np.repeat(["known", "withheld"], 40)
    low, high = metric_interval(*stacked, grasp, kind="regression", part=part)
    reported = np.mean(overall(known, held)["rmse"])
    assert low < reported < high
    # The root of (40 + 10 · 16) / 50 is 2; of 50 grasps 10 ± 2.8 are withheld: 1.5 to 2.4.
    assert 1.4 < low < 1.65 and 2.2 < high < 2.5
    unweighted = metric_interval(*stacked, grasp, kind="regression")
    assert unweighted.low > 2.0  # 10 known and 10 withheld recordings per fold


@pytest.mark.parametrize(("right", "low", "high"), [(20, 0.8316, 1.0), (0, 0.0, 0.1684)])
def test_all_right_or_all_wrong_is_the_exact_interval_of_grasps(right, low, high):
    """0.025 ** (1/20) = 0.8316: 20 grasps, not 40 recordings."""
    y_true = np.ones(40, int)
    y_pred = np.full(40, int(right > 0))
    grasp = np.repeat(np.arange(20), 2)
    interval = metric_interval(y_true, y_pred, np.arange(40) // 8, grasp, kind="classification")
    assert interval == pytest.approx((low, high), abs=1e-4)


def test_exact_intervals_are_those_of_the_beta_distribution():
    assert clopper_pearson(7, 10) == pytest.approx((beta.ppf(0.025, 7, 4), beta.ppf(0.975, 8, 3)))


def test_an_error_without_variance_has_no_interval():
    interval = metric_interval(np.ones(60), np.ones(60), ONE_FOLD, np.arange(60), kind="regression")
    assert not interval.is_defined
    single = metric_interval(
        np.zeros(4), np.arange(4.0), np.zeros(4, int), np.zeros(4), kind="regression"
    )
    assert not single.is_defined  # one grasp
    assert Interval(0.0, 1.0).is_defined


def test_few_grasps_have_no_interval_of_an_error_and_an_exact_one_of_a_share():
    """Two withheld grasps: a bootstrap has three distinct resamples."""
    generator = np.random.default_rng(8)
    fold = np.zeros(9, int)
    nine = metric_interval(np.zeros(9), generator.normal(size=9), fold, fold, kind="regression")
    assert not nine.is_defined
    right = np.array([1, 1, 1, 1, 1, 1, 0, 0, 0])
    share = metric_interval(np.ones(9, int), right, fold, np.arange(9), kind="classification")
    assert share == pytest.approx(clopper_pearson(6, 9))
    ten = metric_interval(
        np.zeros(10), generator.normal(size=10), np.zeros(10), np.arange(10), kind="regression"
    )
    assert ten.is_defined


def test_the_seed_decides_and_every_resample_draws_as_many_grasps():
    value = np.random.default_rng(1).normal(size=25)
    first, again, other = (mean_interval(value, np.arange(25), seed=n) for n in (7, 7, 8))
    assert first == again != other
    drawn = np.concatenate(list(resampled_counts(25, 1000, seed=1)))
    assert drawn.shape == (1000, 25) and (drawn.sum(axis=1) == 25).all()
    assert drawn.mean() == 1 and abs(drawn[:, 0].mean() - 1) < 0.15  # sd 1 / root of 1000
