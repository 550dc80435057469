"""Cross-validation: nothing leaks, nothing drifts, rows stay where they are."""

import dataclasses
import math

import numpy as np
import pytest
from sklearn.dummy import DummyRegressor

from ajgdata.evaluate.crossval import cross_validate
from ajgdata.evaluate.splits import grouped_folds


def spectra(n: int = 60) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Features that determine the class, or the number 0 and 1; groups of two rows."""
    rng = np.random.default_rng(0)
    groups = np.arange(n) // 2
    y = groups % 2
    x = np.exp(y[:, None] * np.linspace(-1, 1, 24) + 0.1 * rng.normal(size=(n, 24)))
    return (x / x.sum(axis=1, keepdims=True)).astype(np.float32), y, groups


def group_only(groups: int = 60, repeats: int = 15) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Features that tell the group and nothing of its class, which is balanced.

    More bins than groups: any labelling of the groups is then linearly separable. More repeats
    than neighbours: most of the five nearest are then of the same group.
    """
    rng = np.random.default_rng(1)
    group = np.repeat(np.arange(groups), repeats)
    signature = rng.normal(size=(groups, 100))
    x = np.exp(signature[group] + 0.05 * rng.normal(size=(len(group), 100)))
    return x.astype(np.float32), np.array(["metal", "wood"])[group % 2], group


def same(a: object, b: object) -> bool:
    return repr(dataclasses.asdict(a)) == repr(dataclasses.asdict(b))


@pytest.mark.parametrize("model", ["linear_plain", "knn_plain"])
def test_features_that_tell_only_the_group_are_worth_nothing_but_to_a_random_split(model):
    x, y, groups = group_only()
    grouped = cross_validate(x, y, groups, kind="classification", model=model).scores
    random = cross_validate(x, y, None, kind="classification", model=model).scores
    assert (grouped.split, grouped.groups) == ("grouped", 60)
    assert (random.split, random.groups) == ("random", 900)
    # 60 independent coin tosses: three standard deviations are 3 * sqrt(1/4 / 60) = 0.19
    assert abs(grouped.pooled["accuracy"] - 0.5) < 0.2
    assert random.pooled["accuracy"] > 0.97


def test_a_model_learns_the_obvious_and_repeats_itself():
    x, y, groups = spectra()
    first, second = (
        cross_validate(
            x,
            np.array(["a", "b"])[y],
            groups,
            kind="classification",
            model="linear",
            folds=3,
            seed=4,
        )
        for _ in range(2)
    )
    assert first.scores.mean == {"accuracy": 1, "balanced_accuracy": 1, "macro_f1": 1}
    assert first.scores.sd == {"accuracy": 0, "balanced_accuracy": 0, "macro_f1": 0}
    assert first.scores.chance["accuracy"] == pytest.approx(0.5, abs=0.05)
    assert first.scores.classes == ("a", "b")
    assert same(first.scores, second.scores)
    assert first.predictions.y_pred.tobytes() == second.predictions.y_pred.tobytes()
    p = first.predictions.probability
    q = second.predictions.probability
    assert p.tobytes() == q.tobytes()
    assert ((p > 0.5) & (p <= 1)).all()


def test_predictions_are_out_of_fold_and_in_the_order_of_the_rows():
    y = np.random.default_rng(0).normal(size=40)
    groups = np.random.default_rng(1).integers(0, 11, 40)
    result = cross_validate(
        np.zeros((40, 3)), y, groups, kind="regression", model=DummyRegressor(), folds=4, seed=2
    )
    parts = grouped_folds(y, groups, "regression", 4, 2)
    for number, (train, test) in enumerate(parts):
        assert (result.predictions.fold[test] == number).all()
        # the dummy predicts the mean of what it was trained on: that tells exactly what it saw
        np.testing.assert_allclose(result.predictions.y_pred[test], y[train].mean(), rtol=1e-12)
    assert np.array_equal(result.predictions.y_true, y)
    assert result.predictions.probability is None
    assert result.scores.mean == pytest.approx(result.scores.chance)
    rmse = [np.sqrt(np.mean((y[test] - y[train].mean()) ** 2)) for train, test in parts]
    assert result.scores.per_fold["rmse"] == pytest.approx(rmse)
    assert result.scores.mean["rmse"] == pytest.approx(np.sum(rmse) / 4)
    deviation = np.array(rmse) - np.mean(rmse)
    assert result.scores.sd["rmse"] == pytest.approx(np.sqrt(np.sum(deviation**2) / 3))
    pooled = np.sqrt(np.mean((y - result.predictions.y_pred) ** 2))
    assert result.scores.pooled["rmse"] == pytest.approx(pooled)


def test_a_fold_with_one_target_value_leaves_r2_to_the_pooled_predictions():
    x, y, _ = spectra()
    scores = cross_validate(x, y, y, kind="regression", model="linear", folds=2).scores
    assert math.isnan(scores.mean["r2"])
    assert math.isfinite(scores.pooled["r2"])
    assert scores.classes == ()
