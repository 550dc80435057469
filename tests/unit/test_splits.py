"""Folds partition the rows and never split a group."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ajgdata.evaluate.splits import grouped_folds, placement_folds, random_folds
from ajgdata.types import NotPossibleError

KINDS = ("regression", "classification")


@st.composite
def tasks(draw):
    """Rows of 2 to 4 classes in groups of 1 to 5 rows, at least as many groups as folds."""
    folds = draw(st.integers(2, 5))
    sizes = draw(st.lists(st.integers(1, 5), min_size=folds, max_size=25))
    groups = np.repeat(np.arange(len(sizes)), sizes)
    label = draw(st.lists(st.integers(0, 3), min_size=len(sizes), max_size=len(sizes)))
    order = np.array(draw(st.permutations(range(len(groups)))))
    return np.array(label)[groups][order], groups[order], folds, draw(st.integers(0, 99))


def check_partition(parts, n, folds):
    assert len(parts) == folds
    assert sorted(np.concatenate([test for _, test in parts]).tolist()) == list(range(n))
    for train, test in parts:
        assert len(test)
        assert sorted([*train, *test]) == list(range(n))


@settings(deadline=None, max_examples=150)
@given(tasks(), st.sampled_from(KINDS), st.booleans())
def test_folds_partition_the_rows_and_keep_groups_whole(task, kind, random):
    y, groups, folds, seed = task
    if random:
        groups = np.arange(len(y))
    split = random_folds if random else partial(grouped_folds, groups=groups)
    try:
        parts = split(y, kind=kind, folds=folds, seed=seed)
    except ValueError as error:
        assert kind == "classification"
        assert "too few groups to be in every training part" in str(error)
        return
    check_partition(parts, len(y), folds)
    for train, test in parts:
        assert not set(groups[train]) & set(groups[test])
        if kind == "classification":
            assert set(y[train]) == set(y)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("split", [random_folds, partial(grouped_folds, groups=np.arange(60) // 3)])
def test_the_seed_decides(kind, split):
    first, again, other = (
        [test.tolist() for _, test in split(np.arange(60) // 3 % 2, kind=kind, folds=5, seed=seed)]
        for seed in (1, 1, 2)
    )
    assert first == again != other


def test_classes_are_spread_evenly():
    y = np.repeat(["a", "a", "a", "b"], 20)  # 60 a, 20 b
    groups = np.arange(80) // 2  # 30 groups of a, 10 of b
    for parts in (
        grouped_folds(y, groups, "classification", 5, 0),
        random_folds(y, "classification", 5, 0),
    ):
        assert [(y[test] == "b").sum() for _, test in parts] == [4] * 5
        assert [len(test) for _, test in parts] == [16] * 5


def test_impossible_folds_are_refused_with_the_reason():
    with pytest.raises(ValueError, match="3 groups cannot make 5 folds"):
        grouped_folds(np.zeros(9), np.arange(9) % 3, "regression", 5, 0)
    with pytest.raises(ValueError, match="4 rows cannot make 5 folds"):
        random_folds(np.zeros(4), "regression", 5, 0)
    y = np.array(["rare"] * 3 + ["a"] * 10)
    groups = np.array([0] * 3 + list(range(1, 11)))
    with pytest.raises(ValueError, match=r"'rare' \(1\); .* \(min_groups: 2\)"):
        grouped_folds(y, groups, "classification", 5, 0)
    with pytest.raises(ValueError, match=r"every training part: 'rare' \(1\)"):
        random_folds(["rare"] + ["a"] * 9, "classification", 5, 0)


def test_a_fold_holds_out_one_placement_of_every_class():
    """Two placements in each of three sessions; a class that was placed five times only."""
    names = [(kind, f"{s}/{kind}{p}") for kind in "ab" for s in range(3) for p in range(2)]
    names = names[:-1]
    y = np.repeat([kind for kind, _ in names], 4)
    placement = np.repeat([name for _, name in names], 4)
    folds = placement_folds(y, placement, "classification", 9)
    assert len(folds) == 5  # of the class with the fewest
    for train, test in folds:
        assert not set(placement[train]) & set(placement[test])
        assert set(y[test]) == {"a", "b"}
    held = [sorted(set(placement[test]) - set(placement[y == "b"])) for _, test in folds]
    assert sorted(map(len, held)) == [1, 1, 1, 1, 2]
    assert np.concatenate([test for _, test in folds]).tolist() != sorted(range(len(y)))
    assert sorted(np.concatenate([test for _, test in folds]).tolist()) == list(range(len(y)))


def test_placements_of_one_value_each_work_for_numbers_too():
    y = np.repeat([10.0, 20.0], 4)
    placement = np.repeat(["1/a", "2/a", "1/b", "2/b"], 2)
    pairs = placement_folds(y, placement, "regression", 5)
    assert [test.tolist() for _, test in pairs] == [[0, 1, 4, 5], [2, 3, 6, 7]]


@pytest.mark.parametrize(
    ("y", "placement", "reason"),
    [
        (["a", "a", "b", "b"], ["1", "2", "3", "3"], "'b' has one placement"),
        ([1.0, 2.0, 1.0, 2.0], ["1", "1", "2", "2"], "recordings of several values"),
    ],
)
def test_placements_that_make_no_folds_are_refused(y, placement, reason):
    with pytest.raises(NotPossibleError, match=reason):
        placement_folds(y, placement, "classification", 5)
