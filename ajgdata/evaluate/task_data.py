"""Recordings of one task as arrays: what every evaluation trains on and is tested on."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.store.features import FeatureRows
from ajgdata.types import Kind, NotPossibleError


class TaskData(NamedTuple):
    """Recordings of a task: feature (n, f), and value of the target, group and name, each (n,)."""

    feature: np.ndarray
    value: np.ndarray
    group: np.ndarray
    name: np.ndarray

    def where(self, chosen: np.ndarray) -> TaskData:
        """Return the recordings that are `chosen`, a boolean (n,) or rows: if all, no copy."""
        if chosen.dtype == bool and chosen.all():
            return self
        return TaskData(*(column[chosen] for column in self))

    def by_session(self) -> TaskData:
        """Return the same recordings, grouped by session, with which their names begin."""
        sessions = [str(name).partition("/")[0] for name in self.name]
        return self._replace(group=np.array(sessions))

    def joined(self, other: TaskData) -> TaskData:
        """Return the recordings of both, these first."""
        return TaskData(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))


def task_data(
    table: FeatureRows,
    target: str,
    kind: Kind,
    groups: str,
    classes: Sequence[str] = (),
    without: Collection[str] = (),
) -> TaskData:
    """Return the recordings of `table` whose `target` is not missing, grouped by column `groups`.

    Only `classes` count, if there are any, and not the objects `without`, which are a placebo.
    Raises ValueError when the store lacks rows or a column, for a class that no recording has, when
    all values or all groups are the same, and when a recording belongs to no group.
    """
    if not len(table.feature):
        raise NotPossibleError("no recording can be used: see the quarantine table")
    for column in (target, groups):
        if column not in table.columns:
            raise NotPossibleError(f"there is no column {column!r}: add it to recordings.csv")
    values = table.columns[target].values
    present = _present(values, target, kind, classes)
    if without:
        present &= ~np.isin(table.columns["object"].values, [*without])
    if (values[present] == values[present][:1]).all():
        raise NotPossibleError(
            f"every recording has the same {target!r}: at least two values are required"
        )
    group = table.columns[groups].values.astype(str)
    names = table.columns["recording"].values
    if (homeless := present & np.isin(group, ["", "nan"])).any():
        raise NotPossibleError(
            f"recording {str(names[homeless][0])!r} has no {groups!r}, which groups folds"
        )
    if len(np.unique(group[present])) < 2:
        raise NotPossibleError(f"all recordings have the same {groups!r}: folds need at least two")
    return TaskData(table.feature, values, group, names).where(present)


def labels_of(table: FeatureRows, data: TaskData, column: str) -> np.ndarray:
    """Return the text (n,) in a column of `table` for its recordings `data`."""
    chosen = np.isin(table.columns["recording"].values, data.name)
    return table.columns[column].values[chosen].astype(str)


def grasps_of(table: FeatureRows, data: TaskData) -> np.ndarray:
    """Return the grasp (n,) of each of the recordings `data`; never the same in two groups."""
    grasp = labels_of(table, data, "grasp_id")
    return np.array([f"{a}\n{b}" for a, b in zip(data.group, grasp, strict=True)])


def _present(
    values: np.ndarray, target: str, kind: Kind, classes: Sequence[str]
) -> NDArray[np.bool_]:
    """Return which recordings have a value (n,) of the target, of `classes` alone if given."""
    present = np.isfinite(values) if kind == "regression" else values != ""
    if not present.any():
        raise NotPossibleError(f"no recording has a value of {target!r}")
    if classes:
        if missing := sorted(set(classes) - set(values.tolist())):
            raise NotPossibleError(f"classes: no recording has the {target} {missing[0]!r}")
        present &= np.isin(values, classes)
    return np.asarray(present)


def frequent_classes(
    table: FeatureRows,
    target: str,
    groups: str,
    classes: Sequence[str],
    min_groups: int,
    without: Collection[str] = (),
) -> tuple[list[str], dict[str, int]]:
    """Return the classes of `target` with at least `min_groups` groups, and how many each of the
    others has.

    Only `classes` count, if there are any, and not the objects `without`, which are a placebo. A
    store that lacks a column has none. Raises
    NotPossibleError where fewer than two classes are left.
    """
    if not {target, groups} <= set(table.columns) or not len(table.feature):
        return list(classes), {}
    value, group = (table.columns[name].values.astype(str) for name in (target, groups))
    if without:
        value = np.where(np.isin(table.columns["object"].values, [*without]), "", value)
    counts = {
        str(label): len(np.unique(group[value == label]))
        for label in np.unique(value[value != ""])
        if not classes or label in classes
    }
    rare = {label: count for label, count in counts.items() if count < min_groups}
    frequent = [label for label in classes or counts if label not in rare]
    if rare and len(frequent) < 2:
        raise NotPossibleError(f"min_groups {min_groups} leaves fewer than two classes: lower it")
    return frequent, rare


def split_withheld(data: TaskData, withhold: Sequence[float]) -> tuple[TaskData, TaskData]:
    """Return the recordings to train on, and those whose value is withheld.

    Raises ValueError for a value that no recording has, and when fewer than two are left.
    """
    for value in withhold:
        if not is_among(data.value, [value]).any():
            raise NotPossibleError(f"withhold: no recording has the value {value:g}")
    held = is_among(data.value, withhold)
    if len(np.unique(data.value[~held])) < 2:
        raise NotPossibleError("withhold: at least two values must be left to train on")
    return data.where(~held), data.where(held)


def is_among(values: np.ndarray, some: Sequence[float]) -> np.ndarray:
    """Return which of `values` (n,) are one of `some`, but for rounding: boolean (n,)."""
    same = [np.isclose(values, value, rtol=1e-6, atol=1e-9) for value in some]
    return np.any(same, axis=0) if same else np.zeros(len(values), bool)
