"""Learning curves and permutation tests."""

import numpy as np

from ajgdata.evaluate.few_grasps import grasps_needed, learning_curve
from ajgdata.evaluate.task_data import TaskData


def grasps(
    classes: int = 3, groups: int = 10, spread: float = 1.0, distance: float = 1.0, seed: int = 0
) -> TaskData:
    """Two recordings of each of `groups` grasps a class; `distance`: how far apart classes are."""
    rng = np.random.default_rng(seed)
    group = np.repeat(np.arange(classes * groups), 2)
    y = group % classes
    centre = distance * rng.normal(size=(classes, 30))
    x = centre[y] + spread * rng.normal(size=(classes * groups, 30))[group]
    x += 0.01 * rng.normal(size=x.shape)
    return TaskData(np.exp(x).astype(np.float32), np.array(["a", "b", "c"])[y], group, group)


def test_more_grasps_are_better_and_the_validation_grasps_stay():
    data = grasps(spread=2.0)
    ask = {"kind": "classification", "model": "linear_plain", "folds": 5, "seed": 1}
    points = learning_curve(data, sizes=(1, 2, 8), repeats=6, **ask).points
    assert [(p.groups, p.repeat) for p in points[:4]] == [(1, 0), (2, 0), (8, 0), (1, 1)]
    assert {p.groups: p.recordings for p in points} == {1: 6, 2: 12, 8: 48}
    mean = {n: np.mean([p.scores["accuracy"] for p in points if p.groups == n]) for n in (1, 2, 8)}
    assert 1 / 3 < mean[1] < mean[8]
    # eight of eight is one draw: a model without chance in it learns the same each time
    assert len({p.scores["accuracy"] for p in points if p.groups == 8}) == 1
    assert points == learning_curve(data, sizes=(1, 2, 8), repeats=6, **ask).points
    assert {p.chance["accuracy"] for p in points} == {1 / 3}  # six balanced validation grasps
    alone = learning_curve(data, sizes=(2,), repeats=6, **ask).points
    assert alone == tuple(p for p in points if p.groups == 2)


def test_a_size_that_fails_leaves_the_others():
    data = grasps()
    ask = {"kind": "classification", "model": "knn_plain", "repeats": 2, "seed": 1}
    whole = learning_curve(data, sizes=(1, 8), **ask)
    curve = learning_curve(data, sizes=(1, 8, 9), **ask)
    assert curve.points == whole.points and whole.skipped == {}
    assert list(curve.skipped) == [9] and "a class has 8" in curve.skipped[9]


def test_each_point_has_the_correct_recordings_of_each_validation_grasp():
    ask = {"kind": "classification", "model": "linear_plain", "folds": 5, "seed": 1}
    for point in learning_curve(grasps(spread=2.0), sizes=(1, 4), repeats=2, **ask).points:
        assert len(point.correct) == 6  # two of ten grasps of each of three classes
        assert np.mean(list(point.correct.values())) == point.scores["accuracy"]


def test_the_number_of_grasps_has_the_interval_of_its_accuracy():
    """Accuracies of 50, 79 and 95 %. Their standard errors over 100 grasps are 5, 4 and 2 %, so
    80 % are reached with 8 or 16 grasps, and never with 4 grasps."""
    random = np.random.default_rng(0)
    shares = np.array([0.50, 0.79, 0.95])
    one_draw = random.permuted(np.arange(100) < 100 * shares[:, None], axis=1).astype(float)
    correct = np.repeat(one_draw[:, None, :], 5, axis=1)
    assert grasps_needed([4, 8, 16], correct, 0.80) == (16, (8, 16))
    assert grasps_needed([16, 8, 4], correct[::-1], 0.80) == (16, (8, 16))  # in any order
    assert grasps_needed([4, 8, 16], correct, 0.95)[1] == (16, np.inf)
    assert grasps_needed([4, 8, 16], correct, 1.00) == (np.inf, (np.inf, np.inf))
    few = grasps_needed([4, 8, 16], correct[:, :, :9], 0.80)
    assert not few[1].is_defined


def test_draws_of_training_grasps_widen_the_interval_of_the_number_of_grasps():
    equal = np.full((2, 6, 400), 0.8)
    differing = equal + np.array([-0.3, -0.2, -0.1, 0.1, 0.2, 0.3])[:, None]
    assert grasps_needed([4, 8], equal, 0.79) == (4, (4, 4))
    assert grasps_needed([4, 8], differing, 0.79)[1].high == np.inf
