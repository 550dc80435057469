"""Folds within sessions and across them: what a model of one day is worth on the next.

Recordings of one session share the gripper as it stood, the room and the level. Folds within a
session never meet another one; across sessions they always do.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from ajgdata.types import Kind, NotPossibleError

if TYPE_CHECKING:
    from ajgdata.evaluate.splits import Folds

WITHIN, ACROSS = "within session", "across sessions"
#: Across sessions, with as many groups of each class to learn from as within one.
AS_MANY = "across sessions, as many"
#: Of more sessions so many are tested, evenly spaced in their order.
MOST_SESSIONS = 10
#: Folds inside a session, at most.
FOLDS = 5
#: Of fewer sessions a model that chooses divides the training by groups: it would learn from one.
ENOUGH_SESSIONS = 3


def session_of(names: Iterable[object]) -> np.ndarray:
    """Return the session of each recording by its name, `session/recording`."""
    return np.array([str(name).partition("/")[0] for name in names])


def session_splits(
    y: np.ndarray, groups: np.ndarray, sessions: np.ndarray, kind: Kind, folds: int, seed: int
) -> dict[str, Folds]:
    """Return folds by the name of the split; the test parts of all are the same rows together.

    `y`, `groups`, `sessions` (n,). *Within*: grouped folds inside each session. *Across*: a session
    is tested by a model of all others (where a group has recordings in several sessions, by as many
    models as within, so that none meets a group that it is tested on). *As many*: each
    test part within a session, by a model of the others' groups, drawn to be as many of each class
    (of each value of a number, where the others have it) as there are within; where there are more
    than two sessions. Raises NotPossibleError, with the reason, for a single session, for sessions
    that are the groups or hold one class alone, and for a class that one session alone has.
    """
    y, groups, sessions = np.asarray(y), np.asarray(groups).astype(str), np.asarray(sessions)
    names = np.unique(sessions)
    if len(names) < 2:
        raise NotPossibleError("all recordings are of one session: two are needed")
    if all(len(np.unique(groups[sessions == name])) < 2 for name in names):
        raise NotPossibleError("each session is one group: folds are across sessions already")
    if kind == "classification":
        _check_classes(y, sessions, names)
    tested = names[_evenly(len(names), MOST_SESSIONS)]
    within = [
        part
        for name in tested
        for part in _inside(y, groups, np.flatnonzero(sessions == name), kind, folds, seed, name)
    ]
    met = _met(groups, sessions)
    spans = len(np.unique(met)) > len(np.unique(groups))
    whole = [np.flatnonzero(sessions == name) for name in tested]
    tests = [test for _, test in within] if spans else whole
    across = [_elsewhere(groups, sessions, test) for test in tests]
    splits = {WITHIN: within, ACROSS: across}
    if len(names) > 2:
        generator = np.random.default_rng([seed, len(names)])
        splits[AS_MANY] = [
            (_as_many(y, met, train, _elsewhere(groups, sessions, test)[0], kind, generator), test)
            for train, test in within
        ]
    return {name: _learnable(parts, y) for name, parts in splits.items()}


def _evenly(count: int, most: int) -> np.ndarray:
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int))


def _check_classes(y: np.ndarray, sessions: np.ndarray, names: np.ndarray) -> None:
    held = {name: set(y[sessions == name].tolist()) for name in names}
    if alone := sorted(name for name, classes in held.items() if len(classes) < 2):
        raise NotPossibleError(f"session {alone[0]!s} holds one class alone: {held[alone[0]]}")
    for label in sorted(set.union(*held.values())):
        where = [name for name, classes in held.items() if label in classes]
        if len(where) < 2:
            raise NotPossibleError(f"class {label!s} is in session {where[0]!s} alone")


def _inside(
    y: np.ndarray,
    groups: np.ndarray,
    rows: np.ndarray,
    kind: Kind,
    folds: int,
    seed: int,
    name: str,
) -> Folds:
    """Return grouped folds of the rows of one session, as rows of all."""
    from ajgdata.evaluate.splits import grouped_folds  # scikit-learn

    count = min(folds, FOLDS, len(np.unique(groups[rows])))
    try:
        parts = grouped_folds(y[rows], groups[rows], kind, count, seed)
    except NotPossibleError as error:
        raise NotPossibleError(f"session {name!s}: {error}") from None
    return [(rows[train], rows[test]) for train, test in parts]


def _elsewhere(
    groups: np.ndarray, sessions: np.ndarray, test: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return all rows of other sessions whose group is not tested, and the rows of the test."""
    other = (sessions != sessions[test[0]]) & ~np.isin(groups, groups[test])
    return np.flatnonzero(other), test


def _as_many(
    y: np.ndarray,
    groups: np.ndarray,
    train: np.ndarray,
    other: np.ndarray,
    kind: Kind,
    generator: np.random.Generator,
) -> np.ndarray:
    """Return rows of `other`: as many groups of each class as `train` has; of a number as many of
    each value where `other` has them, in all where it does not."""
    by_value = kind == "classification" or _has_each(y, groups, train, other)
    label = y if by_value else np.zeros(len(y), int)
    chosen = []
    for one in np.unique(label[train]):
        rows = other[label[other] == one]
        known = np.unique(groups[rows])
        wanted = min(len(known), len(np.unique(groups[train[label[train] == one]])))
        drawn = generator.choice(known, wanted, replace=False)
        chosen.append(rows[np.isin(groups[rows], drawn)])
    return np.sort(np.concatenate(chosen))


def _has_each(y: np.ndarray, groups: np.ndarray, train: np.ndarray, other: np.ndarray) -> bool:
    """Return whether `other` has as many groups of each value as `train`."""

    def count(rows: np.ndarray, value: object) -> int:
        return len(np.unique(groups[rows[y[rows] == value]]))

    return all(count(other, value) >= count(train, value) for value in np.unique(y[train]))


def choice_groups(groups: np.ndarray, sessions: np.ndarray, train: np.ndarray) -> np.ndarray:
    """Return what inner folds must not divide (n,) for a model of the rows `train` that is to meet
    another session: sessions, where there are as many as inner folds and no group is in two of
    them; else groups.
    """
    enough = len(np.unique(sessions[train])) >= ENOUGH_SESSIONS
    one_each = len(np.unique(_met(groups, sessions))) == len(np.unique(groups))
    return sessions if enough and one_each else groups


def _met(groups: np.ndarray, sessions: np.ndarray) -> np.ndarray:
    """Return each group in each session as one label (n,)."""
    return np.char.add(np.char.add(groups.astype(str), "\n"), sessions.astype(str))


def _learnable(parts: Folds, y: np.ndarray) -> Folds:
    """Refuse folds that leave nothing to learn from."""
    for train, _ in parts:
        if len(np.unique(y[train])) < 2:
            raise NotPossibleError("what is tested is all that other sessions hold, too")
    return parts
