"""Is a recording like any that was trained on? The distance to the nearest grasp, and its alarm.

Features are compressed and standardised as the baselines do, z = (asinh(x / scale) - mean) / std; a
grasp is the mean of its recordings there. The threshold is a conformal quantile of the distances of
grasps that were held out, so that it holds for new grasps of what is known, at a stated rate.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.spatial.distance import cdist

from ajgdata.evaluate.calibration import grasp_weights, weighted_quantile
from ajgdata.evaluate.splits import grouped_folds
from ajgdata.types import NotPossibleError

#: Points nearer than this are the same: they are of order one, and float32 when they are stored.
EQUAL = 1e-6
#: That are held out to find a threshold: nothing is trained, so that many cost little.
FOLDS = 10
#: Recordings from which a detection rate is computed: each is compared with all grasps.
MAX_TESTED = 2_000


@dataclass(frozen=True, eq=False)
class Guard:
    """Grasps that a model knows, and how far from them is too far.

    `grasps` (g, f) and `references` (r, f), recordings in which nothing is held, are points z (see
    above); `mean` and `std` (f,), `scale` a number; all float32, as they are stored.
    `threshold` is a distance between points, None where none could be found.
    """

    grasps: np.ndarray
    references: np.ndarray
    mean: np.ndarray
    std: np.ndarray
    scale: np.ndarray
    threshold: float | None = None

    def __repr__(self) -> str:
        """Return the numbers of grasps, references and bins, and the threshold."""
        sizes = (
            f"{len(self.grasps)} grasps, {len(self.references)} references, {len(self.mean)} bins"
        )
        threshold = "no threshold" if self.threshold is None else f"threshold {self.threshold:.3g}"
        return f"<Guard: {sizes}, {threshold}>"

    @classmethod
    def absent(cls, bins: int) -> Self:
        """Return the guard of a model that has none: it checks nothing."""
        none = np.empty((0, bins), np.float32)
        ones = np.ones(bins, np.float32)
        return cls(none, none, 0 * ones, ones, np.ones((), np.float32))

    @classmethod
    def of(cls, features: np.ndarray, grasp: np.ndarray) -> Self:
        """Return a guard without threshold or references that knows features (n, f) of grasps named
        `grasp` (n,)."""
        from sklearn.preprocessing import StandardScaler

        from ajgdata.models.scaling import Compress

        compress = Compress().fit(features)
        points = compress.transform(features)
        scaler = StandardScaler().fit(points)  # which leaves bins alone that are all the same
        space = cls(
            grasps=np.empty((0, points.shape[1]), np.float32),
            references=np.empty((0, points.shape[1]), np.float32),
            mean=scaler.mean_.astype(np.float32),
            std=scaler.scale_.astype(np.float32),
            scale=np.asarray(compress.scale_, np.float32),
        )
        points = space.points(features)
        _, inverse = np.unique(grasp, return_inverse=True)
        sums = np.zeros((inverse.max() + 1, points.shape[1]))
        np.add.at(sums, inverse, points)
        means = sums / np.bincount(inverse)[:, np.newaxis]
        return replace(space, grasps=means.astype(np.float32))

    def points(self, features: np.ndarray) -> np.ndarray:
        """Return features (m, f) as points z (m, f), float64."""
        compressed = np.arcsinh(np.asarray(features, np.float64) / self.scale)
        return (compressed - self.mean) / self.std

    def distance(self, features: np.ndarray) -> np.ndarray:
        """Return the distance (m,) of features (m, f) to the nearest grasp."""
        return cdist(self.points(features), self.grasps).min(axis=1)

    def novelty(self, features: np.ndarray) -> np.ndarray:
        """Return `distance` (m,) in units of the threshold; NaN without a threshold."""
        if not self.can_check:
            return np.full(len(features), np.nan)
        return self.distance(features) / self.threshold

    @property
    def can_check(self) -> bool:
        """Return whether novel objects can be detected: grasps and a threshold are known."""
        return bool(self.threshold) and len(self.grasps) > 0

    def is_nothing(self, features: np.ndarray) -> np.ndarray:
        """Return whether features (m, f) are nearer to a reference than to any grasp: (m,)."""
        if not len(self.references) or not len(self.grasps):
            return np.zeros(len(features), bool)
        nearest = cdist(self.points(features), self.references).min(axis=1)
        return nearest < self.distance(features)

    def with_references(self, features: np.ndarray) -> Self:
        """Return the same with features (r, f) of further recordings in which nothing is held."""
        extra = np.asarray(features, np.float32)
        if extra.ndim != 2 or extra.shape[1] != len(self.mean):
            raise ValueError(f"references need shape (r, {len(self.mean)}), not {extra.shape}")
        if not np.isfinite(extra).all():
            raise ValueError("references hold NaN or infinity: leave those out")
        points = self.points(extra).astype(np.float32)
        return replace(self, references=np.concatenate([self.references, points]))


@dataclass(frozen=True)
class Alarm:
    """A threshold: `false_alarm` is the largest share of new grasps of known objects that it flags,
    no less than 1 / (groups + 1)."""

    threshold: float
    false_alarm: float


def alarm(
    features: np.ndarray,
    grasp: np.ndarray,
    groups: np.ndarray,
    *,
    false_alarm: float = 0.01,
    seed: int = 0,
) -> Alarm:
    """Return the distance that new grasps exceed in a share of up to `false_alarm`.

    `features` (n, f), their `grasp` (n,) and the `groups` (n,) that are held out together. Folds
    have no classes to keep: a group is held out whether or not there are others like it. Raises
    NotPossibleError for a single group, and where held-out grasps lie on those that are known.
    """
    count = len(np.unique(groups))
    if count < 2:
        raise NotPossibleError("one group only: none is left to hold out")
    distance = held_out_distances(features, grasp, groups, seed=seed)
    threshold = threshold_at(distance, groups, false_alarm)
    if threshold < EQUAL:
        raise NotPossibleError(
            "held-out grasps lie on those that are known: their features are equal"
        )
    return Alarm(threshold, _possible(false_alarm, count))


def held_out_distances(
    features: np.ndarray, grasp: np.ndarray, groups: np.ndarray, *, seed: int
) -> np.ndarray:
    """Return the distance (n,) of each recording to the nearest grasp of the other folds."""
    folds, distance = min(FOLDS, len(np.unique(groups))), np.empty(len(features))
    for known, held in grouped_folds(np.zeros(len(features)), groups, "regression", folds, seed):
        distance[held] = Guard.of(features[known], grasp[known]).distance(features[held])
    return distance


def threshold_at(held_out: np.ndarray, groups: np.ndarray, false_alarm: float) -> float:
    """Return what held-out values (n,) exceed in up to a share `false_alarm` of the groups."""
    share = 1 - _possible(false_alarm, len(np.unique(groups)))
    return float(weighted_quantile(held_out[:, None], grasp_weights(groups), share)[0])


def _possible(false_alarm: float, groups: int) -> float:
    return max(false_alarm, 1 / (groups + 1))


def detection_rate(
    features: np.ndarray,
    grasp: np.ndarray,
    objects: np.ndarray,
    threshold: float,
    *,
    seed: int = 0,
) -> float:
    """Return the share of grasps of novel objects that are further away than `threshold`.

    `features` (n, f), their `grasp` (n,) and their `objects` (n,), which are held out: with more
    than FOLDS objects several at a time, so the rate is then slightly too high. Each grasp counts
    once. Raises NotPossibleError for fewer than two objects.
    """
    count = len(np.unique(objects))
    if count < 2:
        raise NotPossibleError("one object only: none is left to hold out")
    folds, random = min(FOLDS, count), np.random.default_rng(seed)
    detected, tested = [], []
    none = np.zeros(len(features))
    for known, held in grouped_folds(none, objects, "regression", folds, seed):
        chosen = random.permutation(held)[: MAX_TESTED // folds]
        distance = Guard.of(features[known], grasp[known]).distance(features[chosen])
        detected.append(distance > threshold)
        tested.append(grasp[chosen])
    weights = grasp_weights(np.concatenate(tested))
    return float(np.average(np.concatenate(detected), weights=weights))
