"""Folds within sessions and across them: what is on which side, and why there are none."""

import numpy as np
import pytest

from ajgdata.evaluate.sessions import (
    ACROSS,
    AS_MANY,
    MOST_SESSIONS,
    WITHIN,
    choice_groups,
    session_of,
    session_splits,
)
from ajgdata.models.tuning import LARGE_FOLDS, inner_folds

CLASSES = np.array(list("ab"))


def grasps(sessions: int = 3, each: int = 4, samples: int = 2):
    """Two classes, `each` grasps of either in every session, `samples` recordings of a grasp."""
    count = sessions * 2 * each
    grasp = np.repeat(np.arange(count), samples)
    return CLASSES[grasp % 2], grasp, np.char.add("s", (grasp // (2 * each)).astype(str))


def made(y, group, session, kind="classification", folds=2):
    return session_splits(y, group, session, kind, folds, 0)


def test_names_say_the_session():
    assert session_of(["s1/a/b", "s2/a"]).tolist() == ["s1", "s2"]


@pytest.mark.parametrize("kind", ["classification", "regression"])
def test_each_split_tests_every_row_once_and_meets_what_its_name_says(kind):
    y, group, session = grasps()
    target = y if kind == "classification" else group.astype(float)
    splits = made(target, group, session, kind)
    assert list(splits) == [WITHIN, ACROSS, AS_MANY]
    assert [len(parts) for parts in splits.values()] == [6, 3, 6]
    for name, parts in splits.items():
        tested = np.concatenate([test for _, test in parts])
        assert sorted(tested.tolist()) == list(range(len(y)))
        for train, test in parts:
            assert not set(group[train]) & set(group[test])
            (here,) = set(session[test])
            assert (set(session[train]) == {here}) if name == WITHIN else here not in session[train]
    assert all(len(train) == 32 for train, _ in splits[ACROSS])


def test_as_many_grasps_of_each_class_as_within_are_drawn_from_all_other_sessions():
    y, group, session = grasps(each=8)
    splits = made(y, group, session, folds=4)
    for (within, _), (drawn, _) in zip(splits[WITHIN], splits[AS_MANY], strict=True):
        for label in CLASSES:
            counts = [len(set(group[rows][y[rows] == label])) for rows in (within, drawn)]
            assert counts == [6, 6]
    used = {name for drawn, test in splits[AS_MANY] for name in session[drawn]}
    assert used == {"s0", "s1", "s2"}


def test_as_many_of_each_value_of_a_number_are_drawn_where_others_have_them():
    y, group, session = grasps(each=8)
    size = np.where(y == "a", 10.0, 20.0)
    splits = made(size, group, session, "regression", folds=4)
    for (within, _), (drawn, _) in zip(splits[WITHIN], splits[AS_MANY], strict=True):
        for value in (10.0, 20.0):
            counts = [len(set(group[rows][size[rows] == value])) for rows in (within, drawn)]
            assert counts[0] == counts[1]
    own = made(group.astype(float), group, session, "regression", folds=4)  # no value comes again
    for (within, _), (drawn, _) in zip(own[WITHIN], own[AS_MANY], strict=True):
        assert len(set(group[within])) == len(set(group[drawn]))


def test_a_model_that_is_to_meet_another_session_is_chosen_by_sessions():
    _, group, session = grasps(sessions=4)
    elsewhere, two = np.flatnonzero(session != "s0"), np.flatnonzero(session < "s2")
    assert choice_groups(group, session, elsewhere) is session
    assert choice_groups(group, session, two) is group
    thing = group % 8  # met in every session
    assert choice_groups(thing, session, elsewhere) is thing


def test_of_three_large_sessions_each_is_met_by_a_model_of_two():
    session, y = np.repeat(np.arange(3), 100), np.arange(300) % 2
    for classes in (True, False):
        folds = inner_folds(y, session, classes, 0)
        assert [len(set(session[train])) for train, _ in folds] == [2, 2, 2]
    assert len(inner_folds(y, np.arange(300) // 2, True, 0)) == LARGE_FOLDS  # grasps


def test_two_sessions_have_as_many_anyway():
    assert list(made(*grasps(sessions=2))) == [WITHIN, ACROSS]


def test_of_many_sessions_some_are_tested_by_models_of_all_others():
    y, group, session = grasps(sessions=25, samples=1)
    splits = made(y, group, session)
    assert len(splits[ACROSS]) == MOST_SESSIONS
    assert {len(train) for train, _ in splits[ACROSS]} == {24 * 8}
    tested = [set(session[test]) for _, test in splits[ACROSS]]
    assert {"s0"} in tested and set.union(*tested) == {
        session[test][0] for _, test in splits[WITHIN]
    }


def test_a_group_that_spans_sessions_is_not_learnt_where_it_is_tested():
    y, group, session = grasps()
    thing = group % 8  # each was grasped in all three sessions
    for name, parts in made(y, thing, session).items():
        assert len(parts) == 6
        for train, test in parts:
            assert not set(thing[train]) & set(thing[test]), name
            assert len(train) == (8 if name != ACROSS else 16)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda y, g, s: (y, g, np.full_like(s, "s0")), "all recordings are of one session"),
        (lambda y, g, s: (y, s, s), "each session is one group"),
        (lambda y, g, s: (np.where(s == "s1", "a", y), g, s), "session s1 holds one class alone"),
        (lambda y, g, s: (np.where((s == "s1") & (g > 11), "c", y), g, s), "class c is in session"),
        (lambda y, g, s: (np.where(g == 8, "a", np.where(s == "s1", "b", y)), g, s),
         "session s1: too few groups"),
    ],
)  # fmt: skip
def test_why_sessions_cannot_be_compared(change, reason):
    with pytest.raises(ValueError, match=reason):
        made(*change(*grasps()))
