"""Transfer of a model to a left-out group of recordings: a new finger, session or workspace.

Each group is left out in turn. Two adaptations change the features of the recordings, and then any
model can be used:

- *Normalisation per group* gives each bin the same mean and the same deviation in every group (a
  z-score per group and bin, in the scale of the training groups). It uses unlabelled recordings of
  the left-out group, including the tested ones. This is legitimate, because no label is used, and
  a user has these recordings when the model predicts them.
- *Alignment* maps the features of the left-out group towards those of the training groups. A few
  labelled grasps of the left-out group fit this map. They are never scored.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import eigh
from scipy.special import logsumexp
from threadpoolctl import threadpool_limits

from ajgdata.evaluate import metrics
from ajgdata.evaluate.agreement import UNDEFINED, Interval
from ajgdata.evaluate.fold_tests import corrected_interval
from ajgdata.evaluate.intervals import ROUNDING, metric_interval
from ajgdata.evaluate.metrics import wrapped
from ajgdata.evaluate.splits import balanced_rows
from ajgdata.evaluate.task_data import TaskData
from ajgdata.models import fit_named_model
from ajgdata.types import Kind, NotPossibleError

#: Largest number of dimensions that an alignment mixes, as principal components.
DIMENSIONS = 24
#: Ridge penalties of the matrix of an alignment, relative to the variance within classes. With an
#: infinite penalty, the alignment only shifts the features.
PENALTIES = (0.01, 0.1, 1.0, 10.0, math.inf)
#: Smallest number of labelled grasps with which a penalty is chosen.
MIN_LABELLED = 3
#: Share of the training recordings, those with the nearest values, whose mean represents a number.
NEAREST_SHARE = 0.1
#: Number of quantile classes into which an alignment divides the values of a regression.
QUANTILES = 8
#: Share of the mean variance that is added to each variance within classes, so that none is 0.
VARIANCE_FLOOR = 1e-6


class Adaptation(NamedTuple):
    """Whether features are normalised per group, and how many labelled grasps align them."""

    is_normalised: bool
    labelled: int


@dataclass(frozen=True, eq=False)
class TransferPoint:
    """Predictions of the recordings of a left-out group by one model, and their scores.

    `y_true`, `y_pred` and `grasp` are (n,). `scores` and `chance` are metrics by name; the chance
    level is that of a guess from the training labels.
    """

    left_out: str
    training_groups: int
    draw: int
    adaptation: Adaptation
    y_true: np.ndarray
    y_pred: np.ndarray
    grasp: np.ndarray
    scores: dict[str, float]
    chance: dict[str, float]


def leave_groups_out(
    data: TaskData,
    left_out: np.ndarray,
    grasp: np.ndarray,
    *,
    kind: Kind,
    model: str,
    sizes: Sequence[int],
    adaptations: Sequence[Adaptation],
    repeats: int = 3,
    seed: int = 0,
    period: float | None = None,
    balance: bool = False,
) -> list[TransferPoint]:
    """Return the scores on each left-out group, for each number of training groups and adaptation.

    `left_out` (n,) has the group of each recording, and `grasp` (n,) its grasp. `sizes` are numbers
    of training groups. A draw chooses training groups and labelled grasps at random; each of
    `repeats` draws has the same labelled grasps for all sizes and adaptations. The grasps of the
    adaptation with the most labels are not scored in any adaptation, so that all adaptations are
    scored on the same recordings. Without choices (all groups, no labels), there is one draw.

    Recordings whose `data.group` is also in the left-out group are not in the training part. With
    `balance`, it has equally many recordings of each class.

    Raises NotPossibleError if there are too few groups for a size, too few grasps of a group for an
    alignment, or training groups of one value.
    """
    names = np.unique(left_out)
    _check_groups(left_out, grasp, sizes, adaptations)
    features = {False: data.feature}
    if any(adaptation.is_normalised for adaptation in adaptations):
        features[True] = standardised(data.feature, left_out)

    def fit(feature: np.ndarray, value: np.ndarray, group: np.ndarray) -> Any:
        return fit_named_model(model, kind, feature, value, group, seed=seed, period=period)

    points: list[TransferPoint] = []
    with threadpool_limits(limits=1):
        for number, name in enumerate(names):
            left = _LeftOutGroup(
                str(name), data, features, left_out, grasp, kind, period, balance, fit
            )
            for size in sizes:
                is_only_choice = size == len(names) - 1 and not _most_labelled(adaptations)
                for draw in range(1 if is_only_choice else repeats):
                    generator = np.random.default_rng([seed, number, draw])
                    others = generator.permutation(names[names != name])
                    order = labelling_order(
                        data.value[left.rows], grasp[left.rows], kind, generator
                    )
                    points += left.points(others[:size], order, draw, adaptations)
    return points


def _check_groups(
    left_out: np.ndarray, grasp: np.ndarray, sizes: Sequence[int], adaptations: Sequence[Adaptation]
) -> None:
    """Raise NotPossibleError if the groups do not allow the sizes or the adaptations."""
    names = np.unique(left_out)
    if max(sizes) > len(names) - 1:
        raise NotPossibleError(
            f"{max(sizes)} training groups: there are {len(names)}, and one is left out; lower "
            "experiments.transfer.groups, or record more"
        )
    most = _most_labelled(adaptations)
    for name in names:
        count = len(np.unique(grasp[left_out == name]))
        if count <= most:
            raise NotPossibleError(
                f"{most} labelled grasps: the group {str(name)!r} has {count}, and some must be "
                "scored; lower experiments.transfer.align, or record more"
            )
        if any(a.is_normalised for a in adaptations) and (left_out == name).sum() < 2:
            raise NotPossibleError(
                f"the group {str(name)!r} has one recording: a deviation needs two; remove group "
                "from experiments.transfer.normalise, or record more"
            )


def _most_labelled(adaptations: Sequence[Adaptation]) -> int:
    """Return the largest number of labelled grasps."""
    return max(adaptation.labelled for adaptation in adaptations)


#: Function that returns a model trained on features (n, f), values (n,) and groups (n,).
Fit = Callable[[np.ndarray, np.ndarray, np.ndarray], Any]


@dataclass(frozen=True, eq=False)
class _Trained:
    """A trained model, the features of its training rows, and those of the left-out group.

    `value` are the values of the target of the training rows.
    """

    model: Any
    known: np.ndarray
    own: np.ndarray
    value: np.ndarray
    kind: Kind

    @cached_property
    def space(self) -> Space:
        """The coordinates of alignments, which all draws of labelled grasps share."""
        return whitened_space(self.own, self.known, self.value, self.kind)


@dataclass(frozen=True, eq=False)
class _LeftOutGroup:
    """The left-out group `name`, and the models that are trained without it.

    `features` are those of all recordings as they are (False), and z-scores per group (True).
    `group` and `grasp` (n,) are those of all recordings.
    """

    name: str
    data: TaskData
    features: Mapping[bool, np.ndarray]
    group: np.ndarray
    grasp: np.ndarray
    kind: Kind
    period: float | None
    balance: bool
    fit: Fit
    trained: dict[tuple[tuple[str, ...], bool], _Trained] = field(default_factory=dict)

    @cached_property
    def rows(self) -> np.ndarray:
        """Row numbers of the group."""
        return np.flatnonzero(self.group == self.name)

    def points(
        self, training: np.ndarray, order: np.ndarray, draw: int, adaptations: Sequence[Adaptation]
    ) -> Iterator[TransferPoint]:
        """Yield the point of each adaptation, for a draw of `training` groups.

        `order` are the grasps of the left-out group in the order in which they are labelled.
        """
        own_grasp = self.grasp[self.rows]
        own_value = self.data.value[self.rows]
        is_scored = ~np.isin(own_grasp, order[: _most_labelled(adaptations)])
        y_true = own_value[is_scored]
        train = self._training_rows(training)
        y_train = self.data.value[train]
        chance = metrics.chance(y_train, y_true, self.kind, self.period)
        for adaptation in adaptations:
            trained = self._trained(train, training, adaptation.is_normalised)
            own = trained.own
            if adaptation.labelled:
                labelled = [own_grasp == name for name in order[: adaptation.labelled]]
                means = np.array([own[rows].mean(axis=0) for rows in labelled])
                labels = np.array([own_value[rows][0] for rows in labelled])
                anchor = anchors(labels, trained.known, y_train, self.kind, self.period)
                own = aligned(own, means, anchor, trained.space)
            y_pred = trained.model.predict(own[is_scored])
            yield TransferPoint(
                left_out=self.name,
                training_groups=len(training),
                draw=draw,
                adaptation=adaptation,
                y_true=y_true,
                y_pred=y_pred,
                grasp=own_grasp[is_scored],
                scores=metrics.score(y_true, y_pred, self.kind, self.period),
                chance=chance,
            )

    def _training_rows(self, training: np.ndarray) -> np.ndarray:
        """Return the rows of the `training` groups without units of the left-out group.

        If the training part is balanced, each class has equally many of them.
        """
        is_shared = np.isin(self.data.group, self.data.group[self.rows])
        rows = np.flatnonzero(np.isin(self.group, training) & ~is_shared)
        if is_shared.all():
            raise NotPossibleError(
                f"{self.name!r} left out: each of the task's groups also has recordings of it, so "
                "none is left to train on; choose another column as `groups` of the task"
            )
        if len(np.unique(self.data.value[rows])) < 2:
            raise NotPossibleError(
                f"{self.name!r} left out, training on {', '.join(map(str, training))}: fewer than "
                "two values of the target; raise experiments.transfer.groups, or record more"
            )
        if self.balance:
            rows = rows[balanced_rows(self.data.value[rows], self.grasp[rows])]
        return rows

    def _trained(self, train: np.ndarray, training: np.ndarray, is_normalised: bool) -> _Trained:
        """Return the model of the rows `train` of the `training` groups.

        Draws of the same training groups share one training.
        """
        key = (tuple(sorted(map(str, training))), is_normalised)
        if key not in self.trained:
            known = self.features[is_normalised][train]
            own = self.features[is_normalised][self.rows]
            if is_normalised:
                scale = group_scale(self.data.feature, self.group, training)
                known = scale.restored(known)
                own = scale.restored(own)
            inner_group = self.group if len(training) > 1 else self.grasp
            model = self.fit(known, self.data.value[train], inner_group[train])
            self.trained[key] = _Trained(model, known, own, self.data.value[train], self.kind)
        return self.trained[key]


def labelling_order(
    value: np.ndarray, grasp: np.ndarray, kind: Kind, generator: np.random.Generator
) -> np.ndarray:
    """Return the grasps in a random order in which each class (or quantile) has its turn.

    `value` and `grasp` are (n,). The values of a regression are divided into `QUANTILES` classes.

    >>> import numpy as np
    >>> label, grasp = np.array(["a", "a", "a", "b"]), np.array(["1", "2", "3", "4"])
    >>> order = labelling_order(label, grasp, "classification", np.random.default_rng(0))
    >>> "4" in order[:2]
    True
    """
    names, first = np.unique(grasp, return_index=True)
    classes = _classes(value[first], kind)
    turns = np.empty(len(names), int)
    for label in np.unique(classes):
        own = np.flatnonzero(classes == label)
        turns[own] = generator.permutation(len(own))
    return names[np.lexsort((generator.random(len(names)), turns))]


def _classes(value: np.ndarray, kind: Kind) -> np.ndarray:
    """Return the classes (n,), or for a regression the quantile class of each value (n,)."""
    if kind == "classification":
        return value
    ends = np.quantile(value, np.linspace(0, 1, QUANTILES + 1)[1:-1])
    return np.searchsorted(ends, value)


# Normalisation


class Scale(NamedTuple):
    """Mean (f,) and deviation (f,) of each bin within groups."""

    mean: np.ndarray
    deviation: np.ndarray

    def restored(self, standard: np.ndarray) -> np.ndarray:
        """Return features (n, f) from z-scores (n, f)."""
        return (self.mean + self.deviation * standard).astype(np.float32)


def standardised(feature: np.ndarray, group: np.ndarray) -> np.ndarray:
    """Return z-scores (n, f) per group and bin. A bin that is constant in a group becomes 0.

    `feature` is (n, f), and `group` (n,) has the group of each row.
    """
    standard = np.empty(feature.shape)
    for name in np.unique(group):
        rows = feature[group == name].astype(np.float64)
        mean = rows.mean(axis=0)
        deviation = rows.std(axis=0)
        varies = deviation > ROUNDING * np.abs(mean)
        standard[group == name] = np.where(varies, rows - mean, 0) / np.where(varies, deviation, 1)
    return standard


def group_scale(feature: np.ndarray, group: np.ndarray, names: np.ndarray) -> Scale:
    """Return the means over the groups `names` of the mean and of the deviation of each bin.

    Models therefore receive features in the scale of their training groups. Their own weights of
    bins and their compression stay useful, which z-scores alone would prevent.
    """
    rows = [feature[group == name].astype(np.float64) for name in names]
    mean = np.mean([own.mean(axis=0) for own in rows], axis=0)
    deviation = np.mean([own.std(axis=0) for own in rows], axis=0)
    return Scale(mean, deviation)


# Alignment


class Space(NamedTuple):
    """Coordinates u = x P of features x (n, f); P is `project` (f, d), and `restore` (d, f) maps
    differences of coordinates back to differences of features."""

    project: np.ndarray
    restore: np.ndarray


class AffineMap(NamedTuple):
    """The map x -> x + shift + (x - centre) P M R of features x (n, f).

    `shift` and `centre` are (f,), M is `matrix` (d, d), and P and R are of the `space`. Outside of
    the space, the map is the shift alone.
    """

    shift: np.ndarray
    centre: np.ndarray
    matrix: np.ndarray
    space: Space

    def apply(self, feature: np.ndarray) -> np.ndarray:
        """Return mapped features (n, f)."""
        mixed = (feature - self.centre) @ self.space.project @ self.matrix
        mapped: np.ndarray = feature + self.shift + mixed @ self.space.restore
        return mapped


def anchors(
    labels: np.ndarray,
    known: np.ndarray,
    known_value: np.ndarray,
    kind: Kind,
    period: float | None = None,
) -> np.ndarray:
    """Return the mean training feature (k, f) of each of `labels` (k,).

    `known` (m, f) and `known_value` (m,) are of the training part. For a regression, the mean is
    over the `NEAREST_SHARE` of its recordings with the nearest values. A class without training
    recordings has NaN.
    """
    means = np.full((len(labels), known.shape[1]), np.nan)
    for number, label in enumerate(labels):
        if kind == "classification":
            near = known_value == label
        else:
            distance = np.abs(wrapped(known_value - label, period))
            near = distance <= np.quantile(distance, NEAREST_SHARE, method="lower")
        if near.any():
            means[number] = known[near].mean(axis=0, dtype=np.float64)
    return means


def whitened_space(
    own: np.ndarray, known: np.ndarray, known_value: np.ndarray, kind: Kind
) -> Space:
    """Return the coordinates in which an alignment is fitted.

    They are principal components of the left-out group `own` (n, f) and of the training part
    `known` (m, f). Both parts are centred and have the same weight, so directions that vary in one
    part only are included. In these coordinates, the covariance within the classes of the training
    part is the unit matrix. Otherwise, a least-squares map would remove the scatter of grasps, and
    the differences between classes with it.
    """
    width = own.shape[1]
    covariance = np.atleast_2d(np.cov(own.T, ddof=0) + np.cov(known.T, ddof=0))
    largest = (max(0, width - DIMENSIONS), width - 1)
    basis = eigh(covariance, subset_by_index=largest)[1]
    coordinates = known.astype(np.float64) @ basis
    floor = VARIANCE_FLOOR * coordinates.var(axis=0).mean()
    classes = _classes(known_value, kind)
    for label in np.unique(classes):
        coordinates[classes == label] -= coordinates[classes == label].mean(axis=0)
    within = coordinates.T @ coordinates / len(coordinates) + floor * np.eye(basis.shape[1])
    root = np.linalg.cholesky(within)
    return Space(basis @ np.linalg.inv(root).T, root.T @ basis.T)


def aligned(
    feature: np.ndarray, source: np.ndarray, target: np.ndarray, space: Space
) -> np.ndarray:
    """Return features (n, f) of a left-out group, mapped towards those of the training groups.

    `source` (k, f) are the mean features of labelled grasps of the left-out group, and `target`
    (k, f) their `anchors`. Grasps without an anchor are not used; if none has one, the features are
    returned unchanged.

    The matrix of the map has a ridge penalty on the difference from the unchanged features. The
    penalty is chosen by leaving out one labelled grasp at a time; no map at all is one of the
    choices. With fewer than `MIN_LABELLED` grasps, the map is the mean shift.
    """
    has_anchor = np.isfinite(target).all(axis=1)
    used = source[has_anchor].astype(np.float64)
    anchor = target[has_anchor]
    if not len(used):
        return feature
    best: AffineMap | None = fitted_map(used, anchor, space, math.inf)
    if len(used) >= MIN_LABELLED:
        best = chosen_map(used, anchor, space)
    if best is None:
        return feature
    return best.apply(feature.astype(np.float64)).astype(np.float32)


def fitted_map(source: np.ndarray, target: np.ndarray, space: Space, penalty: float) -> AffineMap:
    """Return the map from features `source` (k, f) to `target` (k, f).

    The matrix minimises |U M - D|² + `penalty` * k |M|². U are the centred coordinates of the
    source, and D those of the difference of target and source.
    """
    centre = source.mean(axis=0)
    shift = (target - source).mean(axis=0)
    dimensions = space.project.shape[1]
    matrix = np.zeros((dimensions, dimensions))
    if math.isfinite(penalty):
        u = (source - centre) @ space.project
        difference = (target - source - shift) @ space.project
        ridge = penalty * len(source) * np.eye(dimensions)
        matrix = np.linalg.solve(u.T @ u + ridge, u.T @ difference)
    return AffineMap(shift, centre, matrix, space)


def chosen_map(source: np.ndarray, target: np.ndarray, space: Space) -> AffineMap | None:
    """Return the map whose penalty is best for labelled grasps that are left out.

    None if the unchanged features are at least as good. The measure is `_surprise`: with the
    distance to the anchor, a map of all grasps to one place would look good.
    """
    others = ~np.eye(len(source), dtype=bool)
    places = target @ space.project
    surprise: dict[float, float] = {}
    for penalty in PENALTIES:
        mapped = [
            fitted_map(source[used], target[used], space, penalty).apply(source[grasp])
            for grasp, used in enumerate(others)
        ]
        surprise[penalty] = _surprise(np.array(mapped) @ space.project, places)
    best = min(surprise, key=surprise.__getitem__)
    if _surprise(source @ space.project, places) <= surprise[best]:
        return None
    return fitted_map(source, target, space, best)


def _surprise(mapped: np.ndarray, places: np.ndarray) -> float:
    """Return -log of the probability of the anchors `places` (k, d) of grasps at `mapped` (k, d).

    Each distinct anchor is equally probable beforehand, with a normal distribution of unit
    variance, the variance within classes.
    """
    distinct = np.unique(places, axis=0)
    half_squares = np.square(mapped[:, None] - distinct).sum(axis=2) / 2
    own = np.square(mapped - places).sum(axis=1) / 2
    return float((own + logsumexp(-half_squares, axis=1)).sum())


# Scores of all left-out groups together


class GroupScores(NamedTuple):
    """Scores of all left-out groups with one adaptation and number of training groups.

    `per_group` has the metrics of each group, means over its draws. `value` is the mean over groups
    of the first metric. `over_groups` is its 95 % interval for further groups, and `over_grasps`
    that for further grasps of the same groups.
    """

    per_group: dict[str, dict[str, float]]
    value: float
    over_groups: Interval
    over_grasps: Interval
    chance: float

    @property
    def interval(self) -> Interval:
        """Return the interval that contains both intervals.

        If one of them is undefined, this is the other: the interval over groups is undefined if all
        groups have the same score.
        """
        known = [each for each in (self.over_groups, self.over_grasps) if each.is_defined]
        if not known:
            return UNDEFINED
        return Interval(min(each.low for each in known), max(each.high for each in known))


def group_scores(
    points: Sequence[TransferPoint], kind: Kind, *, period: float | None = None, seed: int = 0
) -> GroupScores:
    """Return the scores of points of one adaptation and one number of training groups.

    The interval over groups is that of folds (`fold_tests.corrected_interval`): groups are the
    folds, and the ratio of tested to training rows is one to the number of training groups. With
    few groups, a bootstrap over groups would be too narrow. The interval over grasps is a
    bootstrap over grasps within groups.
    """
    metric = metrics.METRICS[kind][0]
    per_group: dict[str, dict[str, float]] = {}
    for name in dict.fromkeys(point.left_out for point in points):
        own = [point for point in points if point.left_out == name]
        per_group[name] = {
            key: float(np.mean([point.scores[key] for point in own])) for key in own[0].scores
        }
    values = [scores[metric] for scores in per_group.values()]
    over_grasps = metric_interval(
        np.concatenate([point.y_true for point in points]),
        np.concatenate([point.y_pred for point in points]),
        np.repeat(np.arange(len(points)), [len(point.y_true) for point in points]),
        np.concatenate([point.grasp for point in points]),
        kind=kind,
        period=period,
        seed=seed,
    )
    return GroupScores(
        per_group=per_group,
        value=float(np.mean(values)),
        over_groups=corrected_interval(values, points[0].training_groups + 1, metric),
        over_grasps=over_grasps,
        chance=float(np.mean([point.chance[metric] for point in points])),
    )
