"""Is a recording like any that was trained on? Two distances, and their alarm.

Features are compressed and standardised as the baselines do, z = (asinh(x / scale) - mean) / std.
A recording is novel if one of two distances is too large:

- *nearest*: the distance |z - g| to the nearest grasp g, the mean of its recordings. It detects
  changes of the gripper.
- *relative*: the distance to the nearest object divided by the distance to the centre of all
  objects. Both are Mahalanobis distances of principal components, the first with the covariance
  within objects, the second with the variance of all recordings. It detects objects that are
  between known objects (Ren et al. 2021, arXiv 2106.09022, use the difference of both squares).

The thresholds are conformal quantiles of the distances of grasps that were held out, so they hold
for new grasps of known objects, at a stated rate. `docs/predicting.md` compares the detectors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from scipy.spatial.distance import cdist
from scipy.special import logsumexp, softmax
from sklearn.covariance import LedoitWolf
from sklearn.decomposition import PCA
from sklearn.preprocessing import StandardScaler

from ajgdata.evaluate.calibration import grasp_weights, weighted_quantile
from ajgdata.evaluate.splits import grouped_folds
from ajgdata.models import fit_named_model
from ajgdata.models.scaling import Compress
from ajgdata.types import NotPossibleError

#: Points nearer than this are the same: they are of order one, and float32 when they are stored.
EQUAL = 1e-6
#: Folds that are held out to find a threshold: nothing is trained, so many folds cost little.
THRESHOLD_FOLDS = 10
#: Share of the groups of known objects that are held out together with some objects: 1 / 5.
GROUP_FOLDS = 5
#: Recordings of novel objects from which a detection rate is computed, over all folds.
MAX_TESTED = 2_000
#: Recordings from which principal components and covariances are computed.
MAX_FITTED = 5_000
#: Principal components, at most half the number of grasps. Of 16 objects, 160 components detect as
#: many novel objects as 80 (area under the ROC curve .78 and .77), 20 components fewer (.72).
MAX_COMPONENTS = 80
#: Smallest variance within objects, relative to the largest: below it is rounding.
MIN_VARIANCE = 1e-6
#: Detectors, by name: the first two are those of a guard, the others are compared with them.
NEAREST, RELATIVE = "nearest", "relative"
MAHALANOBIS, RECONSTRUCTION = "mahalanobis", "reconstruction"
ENERGY, PROBABILITY = "energy", "probability"


@dataclass(frozen=True, eq=False)
class NoveltyGuard:
    """Grasps and objects that a model knows, and how far from them is too far.

    `grasps` (g, f) and `references` (r, f), recordings of an empty gripper, are points z (see
    above); `mean` and `std` (f,), `scale` a number. Principal components of points are
    p = (z - `centre`) `components`^T with `centre` (f,) and `components` (k, f); `total` (k,) is
    their standard deviation. p `within`, with `within` (k, k), has the unit covariance within
    objects, whose means are `objects` (c, k). k is 0 if there is no relative distance. All are
    float32, as they are stored.

    `threshold` and `relative_threshold` are the limits of both distances, or None.
    """

    grasps: np.ndarray
    references: np.ndarray
    mean: np.ndarray
    std: np.ndarray
    scale: np.ndarray
    centre: np.ndarray
    components: np.ndarray
    within: np.ndarray
    total: np.ndarray
    objects: np.ndarray
    threshold: float | None = None
    relative_threshold: float | None = None

    def __repr__(self) -> str:
        """Return the numbers of grasps, references and bins, and the threshold."""
        sizes = (
            f"{len(self.grasps)} grasps, {len(self.references)} references, {len(self.mean)} bins"
        )
        threshold = "no threshold" if self.threshold is None else f"threshold {self.threshold:.3g}"
        return f"<NoveltyGuard: {sizes}, {threshold}>"

    @classmethod
    def absent(cls, bins: int) -> Self:
        """Return the guard of a model that has none: it checks nothing."""
        return cls._space(np.zeros(bins), np.ones(bins), np.ones(()))

    @classmethod
    def _space(cls, mean: np.ndarray, std: np.ndarray, scale: np.ndarray) -> Self:
        """Return a guard that knows how to compute points, and nothing else."""
        bins = len(mean)
        return cls(
            grasps=np.empty((0, bins), np.float32),
            references=np.empty((0, bins), np.float32),
            mean=np.asarray(mean, np.float32),
            std=np.asarray(std, np.float32),
            scale=np.asarray(scale, np.float32),
            centre=np.zeros(bins, np.float32),
            components=np.empty((0, bins), np.float32),
            within=np.empty((0, 0), np.float32),
            total=np.empty(0, np.float32),
            objects=np.empty((0, 0), np.float32),
        )

    @classmethod
    def of(cls, features: np.ndarray, grasp: np.ndarray, objects: np.ndarray | None = None) -> Self:
        """Return a guard without thresholds or references.

        It knows features (n, f) of grasps named `grasp` (n,), of objects named `objects` (n,).
        Without objects, with a single one, or with fewer than two grasps per object, it has no
        relative distance.
        """
        compress = Compress().fit(features)
        # the scaler leaves bins unchanged that have the same value in all recordings
        scaler = StandardScaler().fit(compress.transform(features))
        guard = cls._space(scaler.mean_, scaler.scale_, np.asarray(compress.scale_))
        points = guard.points(features)
        names, inverse = np.unique(grasp, return_inverse=True)
        grasps = _means(points, inverse).astype(np.float32)
        guard = replace(guard, grasps=grasps)
        if objects is None:
            return guard
        count = len(np.unique(objects))
        if count < 2 or len(names) < 2 * count:
            return guard
        return guard._with_objects(points, objects, len(names) // 2)

    def _with_objects(self, points: np.ndarray, objects: np.ndarray, components: int) -> Self:
        """Return the same with a relative distance, from points (n, f) of `objects` (n,)."""
        step = max(1, len(points) // MAX_FITTED)
        points, objects = points[::step], objects[::step]
        count = min(components, MAX_COMPONENTS, *points.shape)
        pca = PCA(count, svd_solver="randomized", random_state=0)
        coordinates = pca.fit_transform(points)
        total = coordinates.std(axis=0)
        varies = total > EQUAL
        coordinates = coordinates[:, varies]
        _, inverse = np.unique(objects, return_inverse=True)
        means = _means(coordinates, inverse)
        residual = coordinates - means[inverse]
        if not varies.any() or np.square(residual).mean() < EQUAL:
            return self
        covariance = LedoitWolf(assume_centered=True).fit(residual).covariance_
        variance, axes = np.linalg.eigh(covariance)
        within = axes / np.sqrt(np.maximum(variance, MIN_VARIANCE * variance[-1]))
        return replace(
            self,
            centre=pca.mean_.astype(np.float32),
            components=pca.components_[varies].astype(np.float32),
            within=within.astype(np.float32),
            total=total[varies].astype(np.float32),
            objects=(means @ within).astype(np.float32),
        )

    def points(self, features: np.ndarray) -> np.ndarray:
        """Return features (m, f) as points z (m, f), float64."""
        compressed = np.arcsinh(np.asarray(features, np.float64) / self.scale)
        return (compressed - self.mean) / self.std

    def distance(self, features: np.ndarray) -> np.ndarray:
        """Return the distance (m,) of features (m, f) to the nearest grasp."""
        return self._nearest(self.points(features))

    def _nearest(self, points: np.ndarray) -> np.ndarray:
        """Return the distance (m,) of points (m, f) to the nearest grasp."""
        return cdist(points, self.grasps).min(axis=1)

    @property
    def has_objects(self) -> bool:
        """Return whether the guard has a relative distance."""
        return len(self.objects) > 0

    def scores(self, features: np.ndarray) -> dict[str, np.ndarray]:
        """Return the score (m,) of features (m, f) by each detector; larger is more novel."""
        points = self.points(features)
        scores = {NEAREST: self._nearest(points)}
        if not self.has_objects:
            return scores
        centred = points - self.centre
        coordinates = centred @ self.components.T.astype(float)
        to_object = cdist(coordinates @ self.within, self.objects).min(axis=1)
        to_centre = np.linalg.norm(coordinates / self.total, axis=1)
        left = np.square(centred).sum(axis=1) - np.square(coordinates).sum(axis=1)
        return scores | {
            RELATIVE: to_object / np.maximum(to_centre, EQUAL),
            MAHALANOBIS: to_object,
            RECONSTRUCTION: np.sqrt(np.maximum(left, 0)),
        }

    def novelty(self, features: np.ndarray) -> np.ndarray:
        """Return the larger distance (m,), each in units of its threshold; NaN without them."""
        if not self.can_check:
            return np.full(len(features), np.nan)
        scores = self.scores(features)
        novelty = scores[NEAREST] / self.threshold
        if self.relative_threshold is None:
            return novelty
        return np.maximum(novelty, scores[RELATIVE] / self.relative_threshold)

    @property
    def can_check(self) -> bool:
        """Return whether novel objects can be detected: grasps and a threshold are known."""
        return bool(self.threshold) and len(self.grasps) > 0

    def is_nothing(self, features: np.ndarray) -> np.ndarray:
        """Return whether features (m, f) are nearer to a reference than to any grasp: (m,)."""
        if not len(self.references) or not len(self.grasps):
            return np.zeros(len(features), bool)
        points = self.points(features)
        return cdist(points, self.references).min(axis=1) < self._nearest(points)

    def with_references(self, features: np.ndarray) -> Self:
        """Return the same with features (r, f) of further recordings of an empty gripper."""
        extra = np.asarray(features, np.float32)
        if extra.ndim != 2 or extra.shape[1] != len(self.mean):
            raise ValueError(f"references need shape (r, {len(self.mean)}), not {extra.shape}")
        if not np.isfinite(extra).all():
            raise ValueError("references hold NaN or infinity: leave those out")
        points = self.points(extra).astype(np.float32)
        return replace(self, references=np.concatenate([self.references, points]))


def _means(rows: np.ndarray, number: np.ndarray) -> np.ndarray:
    """Return the mean (m, f) of rows (n, f) that have the same `number` (n,), 0 to m - 1."""
    sums = np.zeros((number.max() + 1, rows.shape[1]))
    np.add.at(sums, number, rows)
    return sums / np.bincount(number)[:, np.newaxis]


@dataclass(frozen=True)
class Alarm:
    """Thresholds of both distances; None: that distance is not used.

    `false_alarm` is the largest share of new grasps of known objects that the guard flags.
    """

    threshold: float
    relative_threshold: float | None
    false_alarm: float


def alarm(
    features: np.ndarray,
    grasp: np.ndarray,
    groups: np.ndarray,
    *,
    objects: np.ndarray | None = None,
    false_alarm: float = 0.05,
    seed: int = 0,
) -> Alarm:
    """Return the distances that new grasps exceed in a share of up to `false_alarm`.

    `features` (n, f), their `grasp` (n,), `objects` (n,), and the `groups` (n,) that are held out
    together. Folds have no classes to keep: a group is held out whether or not there are others
    like it. Raises NotPossibleError for a single group, and if held-out grasps lie on known ones.
    """
    count = len(np.unique(groups))
    if count < 2:
        raise NotPossibleError("one group only: none is left to hold out")
    scores = held_out_scores(features, grasp, groups, objects=objects, seed=seed)
    rate = _possible(false_alarm, count)
    relative = scores.get(RELATIVE)
    if relative is None or not can_share(rate, count):
        relative_threshold = None
        threshold = threshold_at(scores[NEAREST], groups, rate)
    else:
        relative_threshold = threshold_at(relative, groups, rate / 2)
        threshold = threshold_at(scores[NEAREST], groups, rate / 2)
    if threshold < EQUAL:
        raise NotPossibleError(
            "held-out grasps lie on those that are known: their features are equal"
        )
    return Alarm(threshold, relative_threshold, rate)


def can_share(false_alarm: float, groups: int) -> bool:
    """Return whether each of two distances can have half of the false alarms."""
    return false_alarm / 2 >= 1 / (groups + 1)


def held_out_scores(
    features: np.ndarray,
    grasp: np.ndarray,
    groups: np.ndarray,
    *,
    objects: np.ndarray | None = None,
    seed: int,
) -> dict[str, np.ndarray]:
    """Return the scores (n,) of each recording by a guard that knows the other folds.

    Detectors that are missing in a fold are left out.
    """
    folds = min(THRESHOLD_FOLDS, len(np.unique(groups)))
    held_out: dict[str, list[np.ndarray]] = {}
    rows = []
    parts = list(grouped_folds(np.zeros(len(features)), groups, "regression", folds, seed))
    for known, held in parts:
        own = None if objects is None else objects[known]
        guard = NoveltyGuard.of(features[known], grasp[known], own)
        rows.append(held)
        for name, score in guard.scores(features[held]).items():
            held_out.setdefault(name, []).append(score)
    order = np.argsort(np.concatenate(rows))
    return {
        name: np.concatenate(scores)[order]
        for name, scores in held_out.items()
        if len(scores) == len(parts)
    }


def threshold_at(held_out: np.ndarray, groups: np.ndarray, false_alarm: float) -> float:
    """Return what held-out values (n,) exceed in up to a share `false_alarm` of the groups."""
    share = 1 - _possible(false_alarm, len(np.unique(groups)))
    return float(weighted_quantile(held_out[:, None], grasp_weights(groups), share)[0])


def _possible(false_alarm: float, groups: int) -> float:
    return max(false_alarm, 1 / (groups + 1))


@dataclass(frozen=True, eq=False)
class NovelScores:
    """Scores of held-out grasps of known objects, and of novel objects, by detector.

    `known` has arrays (m,) of recordings in `known_group` (m,); `novel` has arrays (n,) of
    recordings of the grasps `novel_grasp` (n,) of the objects `novel_object` (n,).
    """

    known: Mapping[str, np.ndarray]
    novel: Mapping[str, np.ndarray]
    known_group: np.ndarray
    novel_grasp: np.ndarray
    novel_object: np.ndarray

    def flags(self, detectors: Mapping[str, float]) -> np.ndarray:
        """Return which recordings of novel objects (n,) one of some detectors flags.

        `detectors` has the false-alarm rate of each by name.
        """
        flags = np.zeros(len(self.novel_grasp), bool)
        for name, rate in detectors.items():
            flags |= self.novel[name] > threshold_at(self.known[name], self.known_group, rate)
        return flags

    def detected(self, detectors: Mapping[str, float]) -> float:
        """Return the share of grasps of novel objects that one of some detectors flags."""
        weights = grasp_weights(self.novel_grasp)
        return float(np.average(self.flags(detectors), weights=weights))

    def guard_rates(self, false_alarm: float) -> dict[str, float]:
        """Return the false-alarm rates of the detectors of a guard."""
        count = len(np.unique(self.known_group))
        rate = _possible(false_alarm, count)
        if RELATIVE in self.known and can_share(rate, count):
            return {NEAREST: rate / 2, RELATIVE: rate / 2}
        return {NEAREST: rate}

    def detection_rate(self, false_alarm: float) -> float:
        """Return the share of grasps of novel objects that a guard detects."""
        return self.detected(self.guard_rates(false_alarm))

    def area(self, detector: str) -> float:
        """Return the area under the ROC curve of a detector: 0.5 is chance, 1 is perfect.

        It is the probability that a novel recording has a larger score than a known one.
        """
        known, novel = np.sort(self.known[detector]), self.novel[detector]
        below = np.searchsorted(known, novel, side="left")
        equal = np.searchsorted(known, novel, side="right") - below
        return float(np.mean(below + equal / 2) / len(known))


def classifier_scores(model: Any, features: np.ndarray) -> dict[str, np.ndarray]:
    """Return two scores (m,) of features (m, f) by the class scores s of a fitted classifier.

    They are the energy -log(sum(exp(s))) (Liu et al. 2020, arXiv 2010.03759) and the negative
    largest probability (Hendrycks & Gimpel 2017, arXiv 1610.02136).
    """
    scores = model.decision_function(features)
    if scores.ndim == 1:  # of two classes, that of the second
        scores = np.column_stack([np.zeros(len(scores)), scores])
    probability = softmax(scores, axis=1)
    return {ENERGY: -logsumexp(scores, axis=1), PROBABILITY: -probability.max(axis=1)}


def novel_scores(
    features: np.ndarray,
    grasp: np.ndarray,
    groups: np.ndarray,
    objects: np.ndarray,
    *,
    classifier: str = "",
    seed: int = 0,
) -> NovelScores:
    """Return scores of objects that were held out, and of held-out groups of the other objects.

    `features` (n, f), their `grasp` (n,), `groups` (n,) and `objects` (n,). With more than
    THRESHOLD_FOLDS objects, several are held out at a time. Each fold also holds out a fifth of
    the groups of its known objects, as a reference. `classifier` names a model with class scores,
    which is trained on the objects for two further detectors (see `classifier_scores`). Raises
    NotPossibleError for fewer than two objects or groups.
    """
    count = len(np.unique(objects))
    if count < 2:
        raise NotPossibleError("one object only: none is left to hold out")
    folds, random = min(THRESHOLD_FOLDS, count), np.random.default_rng(seed)
    known_scores: dict[str, list[np.ndarray]] = {}
    novel: dict[str, list[np.ndarray]] = {}
    known_rows, novel_rows = [], []
    none = np.zeros(len(features))
    parts = grouped_folds(none, objects, "regression", folds, seed)
    for fold, (known, held) in enumerate(parts):
        group_count = len(np.unique(groups[known]))
        if group_count < 2:
            raise NotPossibleError("one group only: none is left to hold out")
        group_folds = min(GROUP_FOLDS, group_count)
        splits = list(grouped_folds(none[known], groups[known], "regression", group_folds, seed))
        train, test = splits[fold % group_folds]
        train, test = known[train], known[test]
        chosen = random.permutation(held)[: MAX_TESTED // folds]
        tested = features[np.concatenate([test, chosen])]
        guard = NoveltyGuard.of(features[train], grasp[train], objects[train])
        held_out = guard.scores(tested)
        if classifier and len(np.unique(objects[train])) > 1:
            fitted = fit_named_model(
                classifier,
                "classification",
                features[train],
                objects[train],
                groups[train],
                seed=seed,
            )
            held_out |= classifier_scores(fitted, tested)
        for name, score in held_out.items():
            known_scores.setdefault(name, []).append(score[: len(test)])
            novel.setdefault(name, []).append(score[len(test) :])
        known_rows.append(test)
        novel_rows.append(chosen)
    complete = [name for name, scores in novel.items() if len(scores) == folds]
    return NovelScores(
        known={name: np.concatenate(known_scores[name]) for name in complete},
        novel={name: np.concatenate(novel[name]) for name in complete},
        known_group=groups[np.concatenate(known_rows)],
        novel_grasp=grasp[np.concatenate(novel_rows)],
        novel_object=objects[np.concatenate(novel_rows)],
    )
