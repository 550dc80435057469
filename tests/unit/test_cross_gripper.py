"""Two grippers that answer differently: what one learns is wrong on the other at first."""

import re

import numpy as np
import pytest

from ajgdata.evaluate.few_grasps import cross_gripper
from ajgdata.evaluate.task_data import TaskData
from ajgdata.experiments.registry import EXPERIMENTS
from ajgdata.types import NotPossibleError

CLASSES = 4
GRASPS = 6
SAMPLES = 2


def gripper(shift: int, names: str = "g", seed: int = 0) -> TaskData:
    """Six grasps of four classes, two samples each; the class's peak is moved by `shift` bins."""
    generator = np.random.default_rng(seed)
    y = np.repeat(np.arange(CLASSES), GRASPS * SAMPLES)
    feature = generator.uniform(0.9, 1.1, (len(y), 40))
    feature[np.arange(len(y)), 8 * y + shift] += 20
    group = np.array([f"{names}{n // SAMPLES}" for n in range(len(y))])
    return TaskData(feature, np.array(list("abcd"))[y], group, group)


def points_of(own, other, **changes):
    settings = {"kind": "classification", "model": "linear_plain", "sizes": (0, 1, 5), "folds": 6}
    return cross_gripper(own, {"other": other}, **settings | changes)["other"]


def accuracy(points, grasps):
    return [p.scores["accuracy"] for p in points if p.grasps == grasps]


def test_the_same_gripper_needs_no_calibration_and_another_does():
    """Peaks moved by 8 bins are those of the next class: without calibration all are mistaken."""
    assert accuracy(points_of(gripper(0), gripper(0)), 0) == [1] * 6
    points = points_of(gripper(0), gripper(8, seed=1), sizes=(0,))
    assert accuracy(points, 0) == [0] * 6
    assert [p.own_scores["accuracy"] for p in points] == [1] * 6
    moved = points_of(gripper(0), gripper(3, seed=1))
    assert accuracy(moved, 5) == [1] * 6


def test_too_many_calibration_grasps_name_the_setting():
    """Each class has six grasps, one of which is tested."""
    with pytest.raises(NotPossibleError) as refused:
        points_of(gripper(0), gripper(0), sizes=(0, 6))
    key = re.search(r"experiments\.(\w+)\.(\w+)", str(refused.value)).groups()
    assert key[1] in EXPERIMENTS[key[0]].settings.model_fields
    assert "6 calibration grasps: a class has 5 that are not tested" in str(refused.value)


def test_other_grippers_share_a_training_and_have_the_points_that_each_has_alone():
    own = gripper(0)
    peers = {"near": gripper(3, seed=1), "far": gripper(8, seed=2)}
    settings = {"kind": "classification", "model": "linear_plain", "sizes": (0, 1), "folds": 6}
    together = cross_gripper(own, peers, **settings)
    assert together == {name: points_of(own, other, sizes=(0, 1)) for name, other in peers.items()}
    assert accuracy(together["far"], 0) == [0] * 6


def test_points_say_what_was_added_and_where_it_was_tested():
    points = points_of(gripper(0), gripper(3))
    assert [(p.fold, p.grasps, p.recordings) for p in points] == [
        (fold, n, n * CLASSES * SAMPLES) for fold in range(6) for n in (0, 1, 5)
    ]
    assert all(bool(p.own_scores) == (p.grasps == 0) for p in points)
    assert {p.chance["accuracy"] for p in points} == {1 / CLASSES}
    assert not any(p.own_scores for p in points_of(gripper(0), gripper(3, names="other")))
    assert points_of(gripper(0), gripper(3)) == points


def test_what_is_tested_is_trained_on_in_neither_gripper():
    """Each recording has a bin of its own grasp, the only sign of its class: whoever was trained
    without the grasp in either gripper cannot know."""
    own = gripper(0)
    alike = np.eye(CLASSES * GRASPS)[np.unique(own.group, return_inverse=True)[1]]
    tags = own._replace(feature=alike + 0.01)
    points = points_of(tags, tags, sizes=(0, 5))
    assert max(accuracy(points, 0) + accuracy(points, 5)) < 0.6  # with the grasp it would be 1
    leaky = tags._replace(group=np.char.add("own-", tags.group.astype(str)))
    assert accuracy(points_of(leaky, tags, sizes=(0,)), 0) == [1] * 6


def test_each_fold_draws_its_own_calibration_grasps():
    """Grasps of 1 to 6 recordings of one class, and of 10 to 60 of another: the number of added
    recordings shows which two were drawn. If all folds drew by the same random numbers, a class
    could only show two neighbouring grasps, because a fold holds out one of six."""
    sizes = [*range(1, 7), *range(10, 70, 10)]
    groups = np.repeat([f"g{size:02d}" for size in sizes], sizes)
    target = np.repeat(["a"] * 6 + ["b"] * 6, sizes)
    feature = np.random.default_rng(0).uniform(1, 2, (len(target), 4))
    other = TaskData(feature, target, groups, groups)
    points = points_of(other, other, sizes=(1,), model="knn_plain")
    drawn = [divmod(point.recordings, 10) for point in points]
    assert len(drawn) == 6
    assert all(len(set(numbers)) > 2 for numbers in zip(*drawn, strict=True))


def test_too_few_grasps_are_said():
    with pytest.raises(ValueError, match="6 calibration grasps: a class has 5 that are not tested"):
        points_of(gripper(0), gripper(3), sizes=(0, 6))
