"""Folds for cross-validation.

Each function returns a list of pairs (train, test) of sorted row numbers. Each row is in one test
part, and in the training parts of all other folds.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence

import numpy as np
from sklearn.model_selection import KFold, LeaveOneGroupOut, StratifiedKFold

from ajgdata.models.thinning import thinned
from ajgdata.models.tuning import Folds, whole_groups
from ajgdata.types import Kind, NotPossibleError
from ajgdata.types.session import PLACEMENT_COLUMN


def column_folds(
    y: Sequence | np.ndarray,
    groups: Sequence | np.ndarray,
    column: str,
    kind: Kind,
    folds: int,
    seed: int,
) -> Folds:
    """Return the folds of a task with `groups` (n,) from a `column` of its recordings.

    These are `placement_folds` for the column of placements, otherwise `grouped_folds`.
    """
    if column == PLACEMENT_COLUMN:
        return placement_folds(y, groups, kind, folds)
    return grouped_folds(y, groups, kind, folds, seed)


def grouped_folds(
    y: Sequence | np.ndarray,
    groups: Sequence | np.ndarray,
    kind: Kind,
    folds: int = 5,
    seed: int = 0,
) -> Folds:
    """Return folds that never divide a group, for example a grasp or a session.

    `y` (n,) are the targets, and `groups` (n,) are labels. A fold is a pair (train, test) of sorted
    row numbers; each row is in one test part. The folds are stratified by class as far as whole
    groups allow. If there are as many groups as folds, each group is one fold, in sorted order.
    Published folds can therefore be given as groups.

    A class can have fewer groups than there are folds; some test parts then have no such class.
    Raises ValueError if there are fewer groups than folds, or if a training part would lack a
    class.

    >>> import ajgdata
    >>> grasps = ["a", "a", "b", "b", "c", "c"]
    >>> folds = ajgdata.grouped_folds([1, 1, 2, 2, 3, 3], grasps, "regression", folds=3)
    >>> [test.tolist() for _, test in folds]
    [[0, 1], [2, 3], [4, 5]]
    """
    y = np.asarray(y)
    group = np.unique(np.asarray(groups), return_inverse=True)[1]
    if len(y) != len(group):
        raise ValueError(f"{len(y)} targets but {len(group)} groups")
    count = int(group.max(initial=-1)) + 1
    if min(count, folds) < 2:
        raise NotPossibleError(
            "all recordings, or those of a class, are of one group: two are needed"
        )
    if count < folds:
        raise NotPossibleError(
            f"{count} groups cannot make {folds} folds: lower folds, or record more"
        )
    if count == folds:
        pairs = list(LeaveOneGroupOut().split(y, y, group))
    else:
        pairs = whole_groups(y, group, folds, kind == "classification", seed)
    return _checked(pairs, y, kind, group)


def placement_folds(
    y: Sequence | np.ndarray, placements: Sequence | np.ndarray, kind: Kind, folds: int = 5
) -> Folds:
    """Return folds that each hold out placements of every class (or value).

    `y` (n,) are the targets, and `placements` (n,) are names that sort by session. If a fold held
    out a placement of one class only, the other classes of its session would be in the training
    part. A model would then avoid the class that is missing, and its score would be too low. The
    placements of a class are assigned to the folds in turn, in sorted order. One placement per
    class and session therefore gives the folds of held-out sessions. The number of folds is
    `folds`, or less if a class has fewer placements.

    Raises NotPossibleError if a placement has several values, or if a class has one placement.

    >>> import ajgdata
    >>> objects = ["a", "a", "b", "b"]
    >>> placements = ["1/a", "2/a", "1/b", "2/b"]
    >>> folds = ajgdata.placement_folds(objects, placements, "classification")
    >>> [test.tolist() for _, test in folds]
    [[0, 2], [1, 3]]
    """
    y = np.asarray(y)
    if y.ndim > 1:  # equal vectors are one value
        y = np.array([str(vector) for vector in y.tolist()])
    placement = np.asarray(placements).astype(str)
    names_of = {value: np.unique(placement[y == value]) for value in np.unique(y).tolist()}
    if sum(len(names) for names in names_of.values()) > len(np.unique(placement)):
        raise NotPossibleError(
            "a placement has recordings of several values: split by grasp, or by session"
        )
    fewest = min(names_of, key=lambda value: len(names_of[value]))
    count = min(folds, len(names_of[fewest]))
    if count < 2:
        raise NotPossibleError(
            f"{fewest!r} has one placement: record it in another placement, or split by grasp"
        )
    fold = np.zeros(len(y), int)
    for value, names in names_of.items():
        own = y == value
        fold[own] = np.searchsorted(names, placement[own]) % count
    pairs = [(np.flatnonzero(fold != n), np.flatnonzero(fold == n)) for n in range(count)]
    return _checked(pairs, y, kind, placement)


def random_folds(y: Sequence | np.ndarray, kind: Kind, folds: int = 5, seed: int = 0) -> Folds:
    """Return folds of the targets y (n,) that ignore groups.

    Recordings of one grasp are then in both parts of a fold, so scores are optimistic. Use these
    folds only to show this bias. Raises ValueError if there are fewer rows than folds, or if all
    rows of a class are in one test part.

    >>> import ajgdata
    >>> folds = ajgdata.random_folds(["a", "b"] * 4, "classification", folds=2)
    >>> [len(test) for _, test in folds]
    [4, 4]
    """
    y = np.asarray(y)
    if len(y) < folds:
        raise NotPossibleError(
            f"{len(y)} rows cannot make {folds} folds: lower folds, or record more"
        )
    counts = np.unique(y, return_counts=True)[1]
    # scikit-learn refuses to stratify if every class has fewer rows than there are folds
    is_stratified = kind == "classification" and counts.min() >= 2 and counts.max() >= folds
    splitter = StratifiedKFold if is_stratified else KFold
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "The least populated class", UserWarning)
        pairs = list(splitter(folds, shuffle=True, random_state=seed).split(y, y))
    return _checked(pairs, y, kind, np.arange(len(y)))


def balanced_rows(y: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Return sorted row numbers with equally many rows of each class.

    `y` (n,) are classes, and `groups` (n,) labels. All rows of the smallest class remain. Those of
    a larger class are drawn at random with a fixed seed, from all its groups as evenly as possible.

    >>> import numpy as np
    >>> label, grasp = np.array(["a", "a", "a", "a", "b", "b"]), np.array([1, 1, 2, 2, 3, 3])
    >>> rows = balanced_rows(label, grasp)
    >>> label[rows].tolist(), grasp[rows].tolist()
    (['a', 'a', 'b', 'b'], [1, 2, 3, 3])
    """
    classes, counts = np.unique(y, return_counts=True)
    own_rows = [np.flatnonzero(y == label) for label in classes]
    drawn = [rows[thinned(groups[rows], int(counts.min()))] for rows in own_rows]
    return np.sort(np.concatenate(drawn))


def balanced_folds(folds: Folds, y: np.ndarray, groups: np.ndarray) -> Folds:
    """Return folds whose training parts have equally many rows of each class (`balanced_rows`).

    The test parts are unchanged. `y` (n,) are classes, and `groups` (n,) labels.
    """
    return [(train[balanced_rows(y[train], groups[train])], test) for train, test in folds]


def _checked(pairs: Iterable, y: np.ndarray, kind: Kind, group: np.ndarray) -> Folds:
    """Return folds with sorted rows.

    Raises NotPossibleError if a class is missing in a training part, and names all such classes.
    """
    folds = [(np.sort(train), np.sort(test)) for train, test in pairs]
    if kind != "classification":
        return folds
    trained = [set(y[train].tolist()) for train, _ in folds]
    missing = sorted(set(y.tolist()) - set.intersection(*trained))
    if missing:
        counts = [len(np.unique(group[y == label])) for label in missing]
        named = ", ".join(f"{c!r} ({n})" for c, n in zip(missing, counts, strict=True))
        raise NotPossibleError(
            f"too few groups to be in every training part: {named}; record more of them, or "
            f"exclude these classes (min_groups: {max(counts) + 1})"
        )
    return folds


def check_folds(folds: Folds, groups: np.ndarray) -> None:
    """Raise ValueError unless each row is tested once and no fold divides a group (n,)."""
    tested = np.concatenate([test for _, test in folds])
    if not np.array_equal(np.sort(tested), np.arange(len(groups))):
        raise ValueError(f"the test parts must hold each of the {len(groups)} rows once")
    for fold, (train, test) in enumerate(folds):
        divided = np.intersect1d(groups[train], groups[test])
        if len(divided):
            raise ValueError(f"fold {fold} trains and tests on group {divided[0]!s}")
