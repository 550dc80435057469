"""Values that no fold trains on, and rows of other recordings: who predicts what, and the sums."""

import numpy as np
import pytest
from sklearn.dummy import DummyRegressor

from ajgdata.evaluate.crossval import Predictions, cross_validate, overall
from ajgdata.evaluate.splits import grouped_folds
from ajgdata.evaluate.task_data import TaskData


def rows(n: int = 24) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    groups = np.repeat(np.arange(n // 2), 2)
    return np.zeros((n, 3)), np.random.default_rng(0).normal(size=n), groups


def test_rows_of_new_groups_are_predicted_by_every_fold():
    x, y, groups = rows()
    new_groups = np.array([100, 100, 101, 101])
    new = TaskData(np.zeros((4, 3)), np.array([5.0, 5, 6, 6]), new_groups, new_groups)
    result = cross_validate(
        x, y, groups, kind="regression", model=DummyRegressor(), folds=4, extra_tests={"new": new}
    )
    extra = result.extra_tests["new"]
    assert (extra.scores.split, extra.scores.folds, extra.scores.recordings) == ("new", 4, 4)
    np.testing.assert_array_equal(extra.predictions.row, [0, 1, 2, 3] * 4)
    for fold, (train, _) in enumerate(grouped_folds(y, groups, "regression", 4, 0)):
        mine = extra.predictions.fold == fold
        # the dummy predicts the mean of what it was trained on
        np.testing.assert_allclose(extra.predictions.y_pred[mine], y[train].mean())
        rmse = np.sqrt(np.mean((new.value - y[train].mean()) ** 2))
        assert extra.scores.per_fold["rmse"][fold] == pytest.approx(rmse)


def test_a_second_recording_of_a_grasp_is_predicted_only_where_the_grasp_is_held_out():
    x, y, groups = rows()
    copy = TaskData(x, y, groups, groups)
    result = cross_validate(
        x, y, groups, kind="regression", model=DummyRegressor(), folds=4, extra_tests={"copy": copy}
    )
    extra = result.extra_tests["copy"].predictions
    back = np.argsort(extra.row)
    np.testing.assert_array_equal(extra.row[back], np.arange(24))
    np.testing.assert_array_equal(extra.fold[back], result.predictions.fold)
    np.testing.assert_array_equal(extra.y_pred[back], result.predictions.y_pred)
    assert result.extra_tests["copy"].scores.per_fold == result.scores.per_fold


def predictions(fold, true, predicted, row=None) -> Predictions:
    row = np.arange(len(fold)) if row is None else np.asarray(row)
    true, predicted = np.asarray(true, float), np.asarray(predicted, float)
    return Predictions(row, np.asarray(fold), true, predicted, None)


KNOWN = predictions([0, 0, 1, 1], [1, 2, 1, 2], [2, 2, 1, 5])
HELD = predictions([0, 1], [4, 4], [6, 4], row=[0, 0])


def test_overall_counts_each_recording_once():
    # fold 0: squares 1, 0 stand for four known recordings, 4 for the withheld one
    score = overall(KNOWN, HELD)
    np.testing.assert_allclose(score["rmse"], [np.sqrt((2 * 1 + 4) / 5), np.sqrt((2 * 9 + 0) / 5)])
    np.testing.assert_allclose(score["mae"], [(2 * 1 + 2) / 5, (2 * 3 + 0) / 5])
