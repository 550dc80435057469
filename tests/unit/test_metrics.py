"""Metrics against figures worked out by hand."""

import math

import numpy as np
import pytest

from ajgdata.evaluate import metrics


def test_regression():
    scores = metrics.score(np.array([1.0, 2, 3, 6]), np.array([2.0, 2, 1, 6]), "regression")
    # errors 1, 0, -2, 0; deviations from the mean 3: 4 + 1 + 0 + 9
    assert scores == pytest.approx({"rmse": math.sqrt(5 / 4), "mae": 3 / 4, "r2": 1 - 5 / 14})
    assert tuple(scores) == metrics.METRICS["regression"]


def test_a_weight_of_two_counts_as_a_row_given_twice():
    y_true = np.array([1.0, 2, 6])
    y_pred = np.array([2.0, 2, 5])
    weight = np.array([1, 3, 2])
    twice = metrics.regression(np.repeat(y_true, weight), np.repeat(y_pred, weight))
    assert metrics.regression(y_true, y_pred, weight=weight) == pytest.approx(twice)


def test_r2_is_undefined_where_all_targets_are_equal():
    scores = metrics.score(np.array([2.0, 2]), np.array([1.0, 3]), "regression")
    assert math.isnan(scores["r2"])
    assert (scores["rmse"], scores["mae"]) == (1, 1)
    assert math.isnan(metrics.score(np.array([2.0]), np.array([2.0]), "regression")["r2"])


def test_classification():
    y_true = np.array(["a", "a", "a", "b", "b", "c"])
    y_pred = np.array(["a", "a", "b", "b", "c", "a"])
    scores = metrics.score(y_true, y_pred, "classification")
    # a: precision 2/3, recall 2/3, F1 2/3; b: 1/2, 1/2, 1/2; c: 0
    expected = {"accuracy": 3 / 6, "balanced_accuracy": 7 / 18, "macro_f1": 7 / 18}
    assert scores == pytest.approx(expected)
    assert tuple(scores) == metrics.METRICS["classification"]


def test_a_class_that_is_predicted_but_absent_lowers_f1_and_not_balanced_accuracy():
    scores = metrics.score(np.array([0, 0, 1]), np.array([0, 2, 1]), "classification")
    # recalls 1/2 and 1; F1 2/3, 1 and 0
    assert scores["balanced_accuracy"] == pytest.approx(3 / 4)
    assert scores["macro_f1"] == pytest.approx(5 / 9)


def test_chance_is_the_commonest_class_or_the_mean_of_the_training_part():
    chance = metrics.chance(np.array([1, 1, 0]), np.array([0, 0, 1, 0]), "classification")
    assert chance["accuracy"] == 1 / 2  # the commonest class: 1 / 4; a uniform guess: 1 / 2
    chance = metrics.chance(np.array([1, 1, 0]), np.array([1, 1, 1, 0]), "classification")
    assert chance["accuracy"] == 3 / 4
    # Two classes are equally frequent in training, and tested 1 and 3 times.
    for names in (("a", "b"), ("b", "a")):
        train = np.repeat(names, 5)
        test = np.repeat(names, (1, 3))
        tied = metrics.chance(train, test, "classification")
        assert tied["accuracy"] == tied["balanced_accuracy"] == 0.5
        assert tied["macro_f1"] == pytest.approx((0.4 / 2 + (6 / 7) / 2) / 2)
    chance = metrics.chance(np.array([0.0, 4]), np.array([3.0, 5]), "regression")
    assert chance["rmse"] == pytest.approx(math.sqrt((1 + 9) / 2))
    assert chance["mae"] == pytest.approx(2)
