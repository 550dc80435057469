"""Errors over repeated fits: known answers of the median and of its interval."""

import dataclasses

import numpy as np
import pytest
from experiment_samples import measured, small_inputs, small_store, task_results

from ajgdata.evaluate.crossval import Predictions, cross_validate
from ajgdata.evaluate.fold_tests import grasp_errors, robust_score
from ajgdata.experiments.registry import load_experiment
from ajgdata.report.comparison import UNSTABLE, PaperFigure


def test_recordings_of_a_grasp_count_together_and_angles_go_the_shortest_way_round():
    rows = np.array([3, 0, 1, 2])
    true = np.array([0.0, 10, 10, 10])
    predicted = np.array([176.0, 13, 9, 12])
    held_out = Predictions(rows, np.zeros(4, int), true, predicted, None)
    grasp = np.array(["b", "b", "a", "c"])  # of rows 0 to 3
    assert grasp_errors(held_out, grasp, period=180).tolist() == [4, (9 + 1) / 2, 16]
    with pytest.raises(ValueError, match="a grasp was predicted by no fold"):
        grasp_errors(held_out, np.array(["b", "b", "a", "c", "d"]))


def test_the_interval_over_grasps_is_that_of_normal_errors():
    """The mean square of n normal errors has the standard deviation σ² √(2 / n), its root half of
    that: 1.96 of these on both sides. Fits that are all the same add nothing."""
    n = 4_000
    sigma = 3.0
    squared = np.square(np.random.default_rng(0).normal(0, sigma, n))
    error = robust_score(np.tile(squared, (5, 1)))
    reach = 1.96 * sigma / np.sqrt(2 * n)
    # The standard error of a 95 % end of 2,000 resamples is 0.06 of its distance; three of these.
    assert error.high - error.median == pytest.approx(reach, rel=0.2)
    assert error.median - error.low == pytest.approx(reach, rel=0.2)
    assert error.median == pytest.approx(sigma, abs=3 * reach)


def test_fits_that_differ_widen_the_interval_and_one_that_fails_does_not_move_the_median():
    rng = np.random.default_rng(1)
    scale = np.array([1.0, 2, 3, 4, 500])
    squared = np.square(scale[:, None] * rng.normal(size=(5, 2_000)))
    error = robust_score(squared)
    # The standard deviation of an RMSE of 2,000 errors is 1 / √4,000 of it; four of these.
    assert error.per_fit == pytest.approx(scale, rel=4 / np.sqrt(4_000))
    assert error.median == error.per_fit[2]
    # The median of five fits drawn with replacement is the least of them if three or more of five
    # draws are: 6 % of all. So the least is an end of the interval, and the largest the other.
    assert error.low < 1.2 and error.high > 400
    assert robust_score(np.full((3, 4), [[1.0], [4.0], [100.0]])).median == 2


def louder(store, rng):
    """The recordings of `small_store` with noise in every bin."""
    noise = rng.uniform(0, 3, store.feature.shape).astype(np.float32)
    return dataclasses.replace(store, feature=store.feature + noise)


def test_fits_differ_by_their_seed_and_the_paper_s_value_is_compared_with_their_median():
    inputs = small_inputs(
        "regression", other_sets={"b": louder(small_store(), np.random.default_rng(3))}
    )
    ask = {"test_on": ["b"], "repeats": 3, "models": ["knn_plain", "ridge_plain"]}
    outcomes = {model: measured("repeated_fits", inputs, model, **ask) for model in ask["models"]}
    again = measured("repeated_fits", inputs, "ridge_plain", **ask)
    assert again.tables == outcomes["ridge_plain"].tables
    for outcome in outcomes.values():
        rows = outcome.tables[0].where(test_set="b")
        each = [rows.where(statistic=f"fit {n}").numbers("value")[0] for n in range(3)]
        assert len(set(each)) == 3
        assert rows.where(statistic="median").numbers("value")[0] == np.median(each)
        assert outcome.about == {"counts": {"b": [30, 60]}}
    # one cross-validation with the task's own seed is the first fit
    own = inputs.data()
    tested = inputs.data("b")
    extra = {"b": tested}
    once = cross_validate(
        own.feature,
        own.value,
        own.group,
        model="ridge_plain",
        extra_tests=extra,
        kind="regression",
        folds=5,
        seed=0,
    )
    # five folds of as many recordings: the mean of their mean squares is the whole
    squares = np.square(once.extra_tests["b"].scores.per_fold["rmse"])
    first = outcomes["ridge_plain"].tables[0].where(statistic="fit 0").numbers("value")[0]
    assert first == pytest.approx(np.sqrt(squares.mean()))
    published = PaperFigure(id="noise", metric="rmse", value=1e6, unit="mm", text="t", where="w")
    results = task_results(
        "repeated_fits", outcomes, "regression", ask, papers={"repeated_fits": published}
    )
    (row,) = load_experiment("repeated_fits").paper_comparison(results, lambda *_: None)
    assert (row.agrees, row.model) == ("better", results.results[0].label)
    assert row.marks[0].low <= row.marks[0].value <= row.marks[0].high
    unsure = published.model_copy(update={"spread": 2e6})
    results = dataclasses.replace(results, papers={"repeated_fits": unsure})
    (row,) = load_experiment("repeated_fits").paper_comparison(results, lambda *_: None)
    assert row.agrees == "inconclusive" and row.remark == UNSTABLE
