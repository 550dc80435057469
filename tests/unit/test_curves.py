"""Learning curves and permutation tests."""

import numpy as np
import pytest

from ajgdata.evaluate import curves
from ajgdata.evaluate.curves import learning_curve
from ajgdata.evaluate.permutations import permutation_test
from ajgdata.models import fit_model
from ajgdata.types import NotPossibleError


def grasps(
    classes: int = 3, groups: int = 10, spread: float = 1.0, told: float = 1.0, seed: int = 0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two recordings of each of `groups` grasps a class; `told`: how far apart classes are."""
    rng = np.random.default_rng(seed)
    group = np.repeat(np.arange(classes * groups), 2)
    y = group % classes
    centre = told * rng.normal(size=(classes, 30))
    x = centre[y] + spread * rng.normal(size=(classes * groups, 30))[group]
    x += 0.01 * rng.normal(size=x.shape)
    return np.exp(x).astype(np.float32), np.array(["a", "b", "c"])[y], group


def test_more_grasps_are_better_and_the_validation_grasps_stay():
    x, y, group = grasps(spread=2.0)
    ask = {"kind": "classification", "model": "linear_plain", "folds": 5, "seed": 1}
    points = learning_curve(x, y, group, sizes=(1, 2, 8), repeats=6, **ask).points
    assert [(p.groups, p.repeat) for p in points[:4]] == [(1, 0), (2, 0), (8, 0), (1, 1)]
    assert {p.groups: p.recordings for p in points} == {1: 6, 2: 12, 8: 48}
    mean = {n: np.mean([p.scores["accuracy"] for p in points if p.groups == n]) for n in (1, 2, 8)}
    assert 1 / 3 < mean[1] < mean[8]
    # eight of eight is one draw: a model without chance in it learns the same each time
    assert len({p.scores["accuracy"] for p in points if p.groups == 8}) == 1
    assert points == learning_curve(x, y, group, sizes=(1, 2, 8), repeats=6, **ask).points
    assert {p.chance["accuracy"] for p in points} == {1 / 3}  # six balanced validation grasps
    alone = learning_curve(x, y, group, sizes=(2,), repeats=6, **ask).points
    assert alone == tuple(p for p in points if p.groups == 2)


def test_a_class_needs_as_many_grasps_as_the_curve():
    x, y, group = grasps()
    ask = {"kind": "classification", "model": "knn_plain", "repeats": 1}
    with pytest.raises(ValueError, match=r"two points.*9 training groups per class: a class has 8"):
        learning_curve(x, y, group, sizes=(1, 9), **ask)
    with pytest.raises(ValueError, match="a group holds several classes"):
        learning_curve(x, y, np.arange(len(y)) % 10, sizes=(1,), **ask)


def test_a_size_that_fails_leaves_the_others():
    x, y, group = grasps()
    ask = {"kind": "classification", "model": "knn_plain", "repeats": 2, "seed": 1}
    whole = learning_curve(x, y, group, sizes=(1, 8), **ask)
    found = learning_curve(x, y, group, sizes=(1, 8, 9), **ask)
    assert found.points == whole.points and whole.others == {}
    assert list(found.others) == [9] and "a class has 8" in found.others[9]


def test_a_size_that_no_model_can_be_made_of_in_one_draw_is_left_out_of_all(monkeypatch):
    x, y, group = grasps()
    ask = {"kind": "classification", "model": "knn_plain", "repeats": 3}
    fits = []

    def fit(made, features, target, groups):
        fits.append(len(target))
        if fits.count(12) == 2 and len(target) == 12:
            raise NotPossibleError("the second draw of two")
        return fit_model(made, features, target, groups)

    monkeypatch.setattr(curves, "fit_model", fit)
    found = learning_curve(x, y, group, sizes=(1, 2, 8), **ask)
    assert found.others == {2: "the second draw of two"}
    assert [(p.groups, p.repeat) for p in found.points] == [
        (n, r) for r in range(3) for n in (1, 8)
    ]
    assert fits.count(12) == 2  # what failed once is not tried again


def test_a_bug_of_a_model_is_not_a_size_that_failed(monkeypatch):
    x, y, group = grasps()

    def fit(*_):
        raise ValueError("a bug")

    monkeypatch.setattr(curves, "fit_model", fit)
    with pytest.raises(ValueError, match="a bug"):
        learning_curve(x, y, group, sizes=(1, 2), kind="classification", model="knn", repeats=1)


def test_labels_that_are_told_differ_from_chance():
    x, y, group = grasps(told=2.0)
    found = permutation_test(
        x, y, group, kind="classification", model="ridge_plain", permutations=49
    )
    assert (found.metric, found.value) == ("accuracy", 1.0)
    assert found.p == 1 / 50
    # chance is 1/3; the mean of 49 draws, each of 30 independent grasps: three deviations
    assert abs(np.mean(found.null) - 1 / 3) < 3 * np.sqrt(2 / 9 / 30)


def test_errors_count_as_good_when_they_are_small():
    x, _, group = grasps(classes=1, groups=20)
    y = np.log(x[:, 0].astype(float)) * 10
    y = np.repeat(y[::2], 2)
    found = permutation_test(
        x[:, :4], y, group, kind="regression", model="linear_plain", permutations=19
    )
    assert found.metric == "rmse"
    assert found.value < min(found.null)
    assert found.p == 1 / 20


def test_without_information_the_p_value_is_uniform():
    """Ten data sets of noise: P(all p > 0.05) is 0.6, P(three or more of ten <= 0.1) is 0.07;
    P(five or more <= 0.1) is 0.0016."""
    ps = []
    for seed in range(10):
        x, y, group = grasps(classes=2, groups=8, told=0.0, seed=seed)
        ask = {"kind": "classification", "model": "knn_plain", "permutations": 19}
        ps.append(permutation_test(x, y, group, folds=4, **ask).p)
    assert sum(p <= 0.1 for p in ps) < 5
    assert len(set(ps)) > 3


def test_exchanging_single_recordings_is_refused():
    x, y, _ = grasps()
    with pytest.raises(ValueError, match="a group holds several labels"):
        permutation_test(
            x, y, np.arange(len(y)) // 7, kind="classification", model="knn_plain", permutations=3
        )
