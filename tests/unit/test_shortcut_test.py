"""Predictions from silence: flagged where they depend on the truth, however far off they are."""

import numpy as np
import pytest

from ajgdata.evaluate.shortcut_test import FLAG_LEVEL, shortcut_test

GROUPS = 60
GROUP = np.repeat(np.arange(GROUPS), 2)
FOLD = GROUP % 5
ANGLE = 9.0 * (np.arange(GROUPS) * 7 % 19)[GROUP]


def noise(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=len(GROUP))


def shortcut(predicted, y=ANGLE, kind="regression", period=None, seed=0, permutations=199):
    return shortcut_test(
        y, predicted, FOLD, GROUP, kind=kind, period=period, permutations=permutations, seed=seed
    )


@pytest.mark.parametrize("period", [None, 180.0])
def test_a_trace_of_the_truth_is_flagged_wherever_the_predictions_lie(period):
    """Each fold's model is off by something else, and answers in its own sense."""
    offset = 40.0 * FOLD
    sense = np.where(FOLD % 2, -1e-3, 1e-3)
    tilt = ANGLE if period is None else 90 * np.sin(2 * np.pi * ANGLE / 180)
    result = shortcut(offset + sense * tilt, period=period)
    assert result.p == 1 / 200 < FLAG_LEVEL
    assert result.value > 0.5 > result.null
    if period is None:
        assert result.value == pytest.approx(1)


def test_true_angles_correlate_fully_and_a_constant_not_at_all():
    assert shortcut(ANGLE + 360, period=180.0).value == pytest.approx(1)
    constant = shortcut(np.full(len(GROUP), 130.0), period=180.0)
    assert (constant.value, constant.p) == (0, 1)
    assert shortcut(np.full(len(GROUP), 130.0)).p == 1


def test_noise_is_as_seldom_improbable_as_p_says():
    """p <= 0.05 in one of 20 tests: of 20, six or more happen once in 3000 times; and the mean of
    20 values that are uniform in 0..1 has a standard deviation of 0.065."""
    values = [shortcut(noise(n), seed=n, permutations=59).p for n in range(20)]
    assert sum(p <= 0.05 for p in values) < 6
    assert abs(np.mean(values) - 0.5) < 4 * 0.065


def test_classes_that_are_mistaken_for_others_in_turn_are_flagged():
    y = np.array(["a", "b", "c"])[(GROUP // 5) % 3]
    wrong = np.array(["b", "c", "a"])[(GROUP // 5) % 3]
    result = shortcut(wrong, y=y, kind="classification")
    assert result.p < FLAG_LEVEL and result.measure == "mutual information"
    same = shortcut(np.full(len(GROUP), "a"), y=y, kind="classification")
    assert (same.value, same.p) == (0, 1)


def test_groups_exchange_their_labels_as_a_whole():
    """Predictions that know the grasp, not its label: rows exchanged alone seem improbable."""
    per_grasp = np.random.default_rng(1).normal(size=GROUPS)[GROUP]
    assert shortcut(per_grasp).p > FLAG_LEVEL
    with pytest.raises(ValueError, match="a group holds several labels"):
        shortcut(ANGLE, y=noise(0))


def test_the_null_is_that_of_all_orders_of_the_labels_of_grasps():
    """Three grasps of ten recordings each, predicted perfectly. Of the six orders of three labels,
    two have an absolute rank correlation of 1 and four have 0.5: p is 1/3, the mean is 2/3.

    If recordings exchanged their labels, no order would correlate fully and p would be 1/1000.
    Standard errors of 999 draws: 0.015 of p, 0.0075 of the mean."""
    label = np.repeat([1.0, 2.0, 3.0], 10)
    result = shortcut_test(
        label, label, np.zeros(30), label, kind="regression", permutations=999, seed=0
    )
    assert result.value == pytest.approx(1)
    assert result.p == pytest.approx(1 / 3, abs=4 * 0.015)
    assert result.null == pytest.approx(2 / 3, abs=4 * 0.0075)


def test_grasps_exchange_labels_only_within_their_fold():
    """Each fold has grasps of one label, which no exchange within the fold can change."""
    label = np.repeat([1.0, 2.0], 10)
    grasp = np.repeat(np.arange(4), 5)
    result = shortcut_test(label, label, label, grasp, kind="regression", permutations=19)
    assert (result.value, result.null, result.p) == (0, 0, 1)
