"""Recordings of a task as arrays, for training and tests."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.store.features import FeatureRows
from ajgdata.types import Kind, NotPossibleError
from ajgdata.types.input_layout import InputLayout
from ajgdata.types.task_settings import TrainingSettings

#: Largest number of recordings that a message names.
MAX_NAMED = 5


class TaskData(NamedTuple):
    """Recordings of a task: features (n, f); values of the target, groups and names (n,).

    The values of a target that is a vector are (n, k). With c covariates, the features are the
    input (n, f + c) of a model, see `types.input_layout`.
    """

    feature: np.ndarray
    value: np.ndarray
    group: np.ndarray
    name: np.ndarray

    def where(self, chosen: np.ndarray) -> TaskData:
        """Return the `chosen` recordings: a boolean array (n,), or row numbers.

        If a boolean array chooses all recordings, the arrays are not copied.
        """
        if chosen.dtype == bool and chosen.all():
            return self
        return TaskData(*(column[chosen] for column in self))

    def values(self) -> list[Any]:
        """Return the values (n,) as Python values that can be compared: vectors as tuples."""
        if self.value.ndim == 1:
            return list(self.value.tolist())
        return [tuple(vector) for vector in self.value.tolist()]

    def by_session(self) -> TaskData:
        """Return the same recordings, grouped by session. Names begin with the session and "/"."""
        sessions = [str(name).partition("/")[0] for name in self.name]
        return self._replace(group=np.array(sessions))

    def joined(self, other: TaskData) -> TaskData:
        """Return the recordings of both; those of `other` are last."""
        return TaskData(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))


class TrainingCopies(NamedTuple):
    """Changed copies of recordings, on which folds train only; see `augment` of a task.

    `row` (m,) is the row of the recording of each copy, and `feature` (m, f) the copy's feature.
    """

    row: np.ndarray
    feature: np.ndarray


def training_part(
    data: TaskData, rows: np.ndarray, copies: TrainingCopies | None = None
) -> TaskData:
    """Return the recordings with row numbers `rows`, and after them their copies.

    A copy has the value, the group, the name and the covariates of its recording.

    >>> import numpy as np
    >>> from ajgdata.evaluate.task_data import TaskData, TrainingCopies, training_part
    >>> grasp = np.array(["a", "b"])
    >>> data = TaskData(np.array([[1.0], [2.0]]), np.array([10.0, 20.0]), grasp, grasp)
    >>> copies = TrainingCopies(np.array([0, 1]), np.array([[1.1], [2.1]]))
    >>> training_part(data, np.array([1]), copies).feature[:, 0].tolist()
    [2.0, 2.1]
    """
    part = data.where(rows)
    if copies is None:
        return part
    is_used = np.isin(copies.row, rows)
    originals = data.where(copies.row[is_used])
    feature = copies.feature[is_used]
    covariates = originals.feature[:, feature.shape[1] :]
    if covariates.shape[1]:
        feature = np.hstack([feature, covariates])
    return part.joined(originals._replace(feature=feature))


def task_data(
    table: FeatureRows,
    target: str,
    kind: Kind,
    groups: str,
    classes: Sequence[str] = (),
    without: Collection[str] = (),
    axes: Sequence[str] = (),
    covariates: Sequence[str] = (),
) -> TaskData:
    """Return the recordings of `table` whose `target` is not missing, grouped by column `groups`.

    `axes` are the columns of a target that is a vector; a recording needs a value of each.
    `covariates` are columns of numbers that are added to the features.
    If `classes` are given, recordings of other classes are excluded. The objects `without` (those
    of a placebo) are always excluded. Raises NotPossibleError if there are no recordings, if a
    column is missing, for a class without recordings, if all values or all groups are equal, and
    for a recording without a group.
    """
    if not len(table.feature):
        raise NotPossibleError("no recording can be used: see the quarantine table")
    for column in (*(axes or [target]), groups):
        if column not in table.columns:
            raise NotPossibleError(f"there is no column {column!r}: add it to recordings.csv")
    values = target_values(table, target, axes)
    included = _has_value(values, target, kind, classes)
    if without:
        included &= ~np.isin(table.columns["object"].values, [*without])
    if (values[included] == values[included][:1]).all():
        raise NotPossibleError(
            f"every recording has the same {target!r}: at least two values are required"
        )
    group = table.columns[groups].values.astype(str)
    names = table.columns["recording"].values
    without_group = included & np.isin(group, ["", "nan"])
    if without_group.any():
        raise NotPossibleError(
            f"recording {str(names[without_group][0])!r} has no {groups!r}, which groups folds"
        )
    if len(np.unique(group[included])) < 2:
        raise NotPossibleError(f"all recordings have the same {groups!r}: folds need at least two")
    features = table.flat
    if covariates:
        features = np.hstack([features, covariate_values(table, covariates, included)])
    return TaskData(features, values, group, names).where(included)


def covariate_values(
    table: FeatureRows, covariates: Sequence[str], included: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return the covariates (n, c) of the recordings of `table`.

    Raises NotPossibleError for a column that is missing or text, and for a missing value of an
    `included` recording.
    """
    columns = []
    for name in covariates:
        if name not in table.columns:
            raise NotPossibleError(f"covariate: there is no column {name!r} in recordings.csv")
        values = table.columns[name].values
        if values.dtype.kind not in "fiu":
            raise NotPossibleError(
                f"covariate {name!r} is text: declare it under `targets` with `kind: regression`"
            )
        missing = table.columns["recording"].values[included & ~np.isfinite(values)].tolist()
        if missing:
            listed = ", ".join(missing[:MAX_NAMED])
            if len(missing) > MAX_NAMED:
                listed += ", …"
            raise NotPossibleError(
                f"covariate {name!r} has no value for {len(missing)} of {included.sum()} "
                f"recordings ({listed}): add the values to recordings.csv, or reject the recordings"
            )
        columns.append(values.astype(np.float64))
    return np.column_stack(columns)


def _has_value(
    values: np.ndarray, target: str, kind: Kind, classes: Sequence[str]
) -> NDArray[np.bool_]:
    """Return which recordings have a value (n,) of the target, one of `classes` if given."""
    if kind == "regression":
        has_value = np.isfinite(values).reshape(len(values), -1).all(axis=1)
    else:
        has_value = values != ""
    if not has_value.any():
        raise NotPossibleError(f"no recording has a value of {target!r}")
    if classes:
        missing = sorted(set(classes) - set(values.tolist()))
        if missing:
            raise NotPossibleError(f"classes: no recording has the {target} {missing[0]!r}")
        has_value &= np.isin(values, classes)
    return np.asarray(has_value)


def target_values(table: FeatureRows, target: str, axes: Sequence[str] = ()) -> np.ndarray:
    """Return the values (n,) of a target, or (n, k) if it is a vector with the columns `axes`."""
    if not axes:
        return table.columns[target].values
    return np.column_stack([table.columns[axis].values for axis in axes])


def column_labels(table: FeatureRows, data: TaskData, column: str) -> np.ndarray:
    """Return the text (n,) in a column of `table` for the recordings `data` of this table."""
    chosen = np.isin(table.columns["recording"].values, data.name)
    return table.columns[column].values[chosen].astype(str)


def grasp_names(table: FeatureRows, data: TaskData) -> np.ndarray:
    """Return names (n,) of the grasps of the recordings `data`, different in different groups."""
    grasp = column_labels(table, data, "grasp_id")
    return np.array([f"{a}\n{b}" for a, b in zip(data.group, grasp, strict=True)])


def frequent_classes(
    table: FeatureRows,
    target: str,
    groups: str,
    classes: Sequence[str],
    min_groups: int,
    without: Collection[str] = (),
) -> tuple[list[str], dict[str, int]]:
    """Return the classes with at least `min_groups` groups, and the numbers of groups of others.

    `target` and `groups` are columns of `table`. If `classes` are given, other classes are
    excluded. The objects `without` (those of a placebo) are always excluded. Without recordings, or
    without one of the columns, the result is `classes`. Raises NotPossibleError if fewer than two
    classes remain.
    """
    if not {target, groups} <= set(table.columns) or not len(table.feature):
        return list(classes), {}
    value = table.columns[target].values.astype(str)
    group = table.columns[groups].values.astype(str)
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
    """Return the recordings with training values, and those with the withheld values `withhold`.

    Raises NotPossibleError for a value without recordings, and for fewer than two training values.
    """
    for value in withhold:
        if not is_among(data.value, [value]).any():
            raise NotPossibleError(f"withhold: no recording has the value {value:g}")
    is_withheld = is_among(data.value, withhold)
    if len(np.unique(data.value[~is_withheld])) < 2:
        raise NotPossibleError("withhold: at least two values must be left to train on")
    return data.where(~is_withheld), data.where(is_withheld)


def is_among(values: np.ndarray, listed: Sequence[float]) -> np.ndarray:
    """Return a boolean array (n,): whether each of `values` (n,) is `listed`, up to rounding."""
    equal = [np.isclose(values, value, rtol=1e-6, atol=1e-9) for value in listed]
    return np.any(equal, axis=0) if equal else np.zeros(len(values), bool)


def classes_of(
    table: FeatureRows, settings: TrainingSettings
) -> tuple[Sequence[str], Mapping[str, int]]:
    """Return the classes of a task (none: all), and the excluded classes.

    An excluded class has fewer than `min_groups` groups; the mapping has its number of groups.
    Raises NotPossibleError if too few classes remain.
    """
    if not settings.min_groups:
        return settings.classes, {}
    return frequent_classes(
        table,
        settings.target,
        settings.groups,
        settings.classes,
        settings.min_groups,
        settings.placebo_objects,
    )


def training_data(table: FeatureRows, settings: TrainingSettings) -> TaskData:
    """Return the recordings of a task without those of excluded classes.

    Raises NotPossibleError if no model can be trained on them; see `task_data`.
    """
    return task_data(
        table,
        settings.target,
        settings.kind,
        settings.groups,
        classes_of(table, settings)[0],
        settings.placebo_objects,
        settings.axes,
        settings.covariates,
    )


def input_layout(table: FeatureRows, settings: TrainingSettings) -> InputLayout:
    """Return the layout of the features of `task_data`."""
    dimensions = {axis.name: axis.values for axis in table.axes}
    return InputLayout(dimensions, settings.covariates)
