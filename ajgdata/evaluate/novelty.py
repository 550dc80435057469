"""Detection of novel objects (out-of-distribution detection).

Features x are compressed and standardised as for the baselines: points z = (asinh(x / scale) -
mean) / std. A recording is novel if one of two distances is too large:

- *nearest*: the distance |z - g| to the nearest grasp g, the mean of its recordings. It detects
  changes of the gripper.
- *relative*: the distance to the nearest object divided by the distance to the centre of all
  objects. Both are Mahalanobis distances of principal components, the first with the covariance
  within objects, the second with the variance of all recordings. It detects objects that are
  between known objects (Ren et al. 2021, arXiv 2106.09022, use the difference of both squares).

The thresholds are conformal quantiles of the distances of held-out grasps. A stated share of new
grasps of known objects therefore exceeds them. `docs/predicting.md` compares the detectors.
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

#: Distance of equal points. Coordinates of points are near 1, and stored points are float32.
EQUAL = 1e-6
#: Number of folds for the thresholds. Many folds take little time, because nothing is trained.
THRESHOLD_FOLDS = 10
#: Number of folds of the groups of known objects. One fold is held out together with some objects.
GROUP_FOLDS = 5
#: Largest number of recordings of novel objects for a detection rate, over all folds.
MAX_TESTED = 2_000
#: Largest number of recordings for principal components and covariances.
MAX_FITTED = 5_000
#: Largest number of principal components (at most half the number of grasps). For 16 objects, the
#: area under the ROC curve is 0.72 with 20 components, 0.77 with 80, and 0.78 with 160.
MAX_COMPONENTS = 80
#: Smallest variance within objects, relative to the largest. Smaller variances are rounding.
MIN_VARIANCE = 1e-6
#: Names of the detectors of a guard.
NEAREST = "nearest"
RELATIVE = "relative"
#: Names of the detectors that are compared with a guard.
MAHALANOBIS = "mahalanobis"
RECONSTRUCTION = "reconstruction"
ENERGY = "energy"
PROBABILITY = "probability"


@dataclass(frozen=True, eq=False)
class NoveltyGuard:
    """Grasps and objects of the training recordings, and thresholds of the distances to them.

    Points are z = (asinh(x / `scale`) - `mean`) / `std` of features x (f,), with `scale` () and
    `mean` and `std` (f,). `grasps` (g, f) and `references` (r, f) are points of grasps and of
    recordings of the empty gripper.

    The relative distance uses principal components p = (z - `centre`) `components`^T, with `centre`
    (f,) and `components` (k, f). `total` (k,) is their standard deviation. The vectors p `within`,
    with `within` (k, k), have the unit covariance within objects, and `objects` (c, k) are their
    means by object. k is 0 if there is no relative distance. All arrays are float32, as they are
    stored.

    `threshold` and `relative_threshold` are the limits of the two distances, or None.
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
        """Return a guard without grasps and thresholds, for a model whose features are not checked.

        `bins` is the number of features.
        """
        return cls._with_scaling(np.zeros(bins), np.ones(bins), np.ones(()))

    @classmethod
    def _with_scaling(cls, mean: np.ndarray, std: np.ndarray, scale: np.ndarray) -> Self:
        """Return a guard with the scaling of points, but without grasps and thresholds."""
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
    def from_grasps(
        cls, features: np.ndarray, grasp: np.ndarray, objects: np.ndarray | None = None
    ) -> Self:
        """Return a guard without thresholds and references, from features (n, f).

        `grasp` (n,) and `objects` (n,) are the names of grasps and objects. The guard has no
        relative distance without `objects`, with one object, or with fewer than two grasps per
        object.
        """
        compress = Compress().fit(features)
        # the scaler leaves bins unchanged that have the same value in all recordings
        scaler = StandardScaler().fit(compress.transform(features))
        guard = cls._with_scaling(scaler.mean_, scaler.scale_, np.asarray(compress.scale_))
        points = guard.points(features)
        names, number = np.unique(grasp, return_inverse=True)
        guard = replace(guard, grasps=_means(points, number).astype(np.float32))
        if objects is None:
            return guard
        count = len(np.unique(objects))
        if count < 2 or len(names) < 2 * count:
            return guard
        return guard._with_objects(points, objects, len(names) // 2)

    def _with_objects(self, points: np.ndarray, objects: np.ndarray, max_components: int) -> Self:
        """Return the guard with a relative distance, from points (n, f) of `objects` (n,).

        If the points do not vary within objects, the guard is returned without this distance.
        """
        step = max(1, len(points) // MAX_FITTED)
        points = points[::step]
        objects = objects[::step]
        count = min(max_components, MAX_COMPONENTS, *points.shape)
        pca = PCA(count, svd_solver="randomized", random_state=0)
        coordinates = pca.fit_transform(points)
        total = coordinates.std(axis=0)
        varies = total > EQUAL
        coordinates = coordinates[:, varies]
        _, number = np.unique(objects, return_inverse=True)
        means = _means(coordinates, number)
        residual = coordinates - means[number]
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
        """Return the points z (m, f), float64, of features (m, f)."""
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
        squared_error = np.square(centred).sum(axis=1) - np.square(coordinates).sum(axis=1)
        scores[RELATIVE] = to_object / np.maximum(to_centre, EQUAL)
        scores[MAHALANOBIS] = to_object
        scores[RECONSTRUCTION] = np.sqrt(np.maximum(squared_error, 0))
        return scores

    def novelty(self, features: np.ndarray) -> np.ndarray:
        """Return the novelty (m,) of features (m, f): a recording is novel if it exceeds 1.

        This is the larger of the two distances, each divided by its threshold; NaN without a
        threshold.
        """
        if not self.can_check:
            return np.full(len(features), np.nan)
        scores = self.scores(features)
        novelty = scores[NEAREST] / self.threshold
        if self.relative_threshold is None:
            return novelty
        return np.maximum(novelty, scores[RELATIVE] / self.relative_threshold)

    @property
    def can_check(self) -> bool:
        """Return whether novel objects can be detected, which needs grasps and a threshold."""
        return bool(self.threshold) and len(self.grasps) > 0

    def is_empty_gripper(self, features: np.ndarray) -> np.ndarray:
        """Return whether features (m, f) are nearer to a reference than to any grasp, as (m,)."""
        if not len(self.references) or not len(self.grasps):
            return np.zeros(len(features), bool)
        points = self.points(features)
        return cdist(points, self.references).min(axis=1) < self._nearest(points)

    def with_references(self, features: np.ndarray) -> Self:
        """Return the guard with additional references: features (r, f) of the empty gripper."""
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
    """Thresholds of both distances. The relative distance is not used if its threshold is None.

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
    """Return the thresholds that a share of up to `false_alarm` of new grasps exceeds.

    `features` (n, f), their `grasp` (n,) and `objects` (n,). Folds hold out complete `groups` (n,),
    also the only group of an object. With few groups, the share is larger (see `Alarm`). Raises
    NotPossibleError for a single group, and if held-out grasps have the features of known grasps.
    """
    count = len(np.unique(groups))
    if count < 2:
        raise NotPossibleError("one group only: none is left to hold out")
    scores = held_out_scores(features, grasp, groups, objects=objects, seed=seed)
    rate = _possible_rate(false_alarm, count)
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


def _possible_rate(false_alarm: float, groups: int) -> float:
    """Return `false_alarm`, or the smallest rate that a quantile over this many groups can have."""
    return max(false_alarm, 1 / (groups + 1))


def can_share(false_alarm: float, groups: int) -> bool:
    """Return whether half of the rate of false alarms is possible for this number of groups."""
    return false_alarm / 2 >= 1 / (groups + 1)


def held_out_scores(
    features: np.ndarray,
    grasp: np.ndarray,
    groups: np.ndarray,
    *,
    objects: np.ndarray | None = None,
    seed: int,
) -> dict[str, np.ndarray]:
    """Return the scores (n,) of each recording by a guard from the other folds, by detector.

    Detectors that are missing in a fold are omitted.
    """
    fold_count = min(THRESHOLD_FOLDS, len(np.unique(groups)))
    # Folds of a regression are not stratified, so they also hold out the only group of an object.
    folds = grouped_folds(np.zeros(len(features)), groups, "regression", fold_count, seed)
    by_detector: dict[str, list[np.ndarray]] = {}
    for known, held_out in folds:
        known_objects = None if objects is None else objects[known]
        guard = NoveltyGuard.from_grasps(features[known], grasp[known], known_objects)
        for name, score in guard.scores(features[held_out]).items():
            by_detector.setdefault(name, []).append(score)
    order = np.argsort(np.concatenate([held_out for _, held_out in folds]))
    return {
        name: np.concatenate(scores)[order]
        for name, scores in by_detector.items()
        if len(scores) == len(folds)
    }


def threshold_at(scores: np.ndarray, groups: np.ndarray, false_alarm: float) -> float:
    """Return the value that the held-out scores (n,) of up to a share of groups (n,) exceed.

    The share is `false_alarm`, or more if there are few groups.
    """
    share = 1 - _possible_rate(false_alarm, len(np.unique(groups)))
    return float(weighted_quantile(scores[:, None], grasp_weights(groups), share)[0])


@dataclass(frozen=True, eq=False)
class NovelScores:
    """Scores of held-out grasps of known objects, and of novel objects, by detector.

    `known` has the scores (m,) of recordings in the groups `known_group` (m,). `novel` has the
    scores (n,) of recordings of the grasps `novel_grasp` (n,) of the objects `novel_object` (n,).
    """

    known: Mapping[str, np.ndarray]
    novel: Mapping[str, np.ndarray]
    known_group: np.ndarray
    novel_grasp: np.ndarray
    novel_object: np.ndarray

    def flags(self, detectors: Mapping[str, float]) -> np.ndarray:
        """Return which recordings of novel objects (n,) at least one of the detectors flags.

        `detectors` has the rate of false alarms of each detector by name.
        """
        flags = np.zeros(len(self.novel_grasp), bool)
        for name, rate in detectors.items():
            flags |= self.novel[name] > threshold_at(self.known[name], self.known_group, rate)
        return flags

    def detected(self, detectors: Mapping[str, float]) -> float:
        """Return the share of grasps of novel objects that at least one of the detectors flags."""
        weights = grasp_weights(self.novel_grasp)
        return float(np.average(self.flags(detectors), weights=weights))

    def guard_rates(self, false_alarm: float) -> dict[str, float]:
        """Return the rates of false alarms of the detectors of a guard by name."""
        count = len(np.unique(self.known_group))
        rate = _possible_rate(false_alarm, count)
        if RELATIVE in self.known and can_share(rate, count):
            return {NEAREST: rate / 2, RELATIVE: rate / 2}
        return {NEAREST: rate}

    def detection_rate(self, false_alarm: float) -> float:
        """Return the share of grasps of novel objects that a guard detects."""
        return self.detected(self.guard_rates(false_alarm))

    def area(self, detector: str) -> float:
        """Return the area under the ROC curve of a detector: 0.5 is chance, 1 is perfect.

        It is the probability that a novel recording has a larger score than a known recording.
        """
        known = np.sort(self.known[detector])
        novel = self.novel[detector]
        below = np.searchsorted(known, novel, side="left")
        equal = np.searchsorted(known, novel, side="right") - below
        return float(np.mean(below + equal / 2) / len(known))


def classifier_scores(model: Any, features: np.ndarray) -> dict[str, np.ndarray]:
    """Return two scores (m,) of features (m, f), from the class scores s of a fitted classifier.

    They are the energy -log(sum(exp(s))) (Liu et al. 2020, arXiv 2010.03759) and the negative
    largest probability (Hendrycks & Gimpel 2017, arXiv 1610.02136).
    """
    scores = model.decision_function(features)
    if scores.ndim == 1:  # for two classes, only the score of the second
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
    """Return scores of held-out objects, and of held-out groups of the other objects.

    `features` (n, f), their `grasp` (n,), `groups` (n,) and `objects` (n,). With more than
    THRESHOLD_FOLDS objects, a fold holds out several objects. It also holds out a fifth of the
    groups of the other, known objects. `classifier` is the name of a model with class scores; it is
    trained on the objects for two more detectors (see `classifier_scores`). Raises NotPossibleError
    for fewer than two objects or groups.
    """
    object_count = len(np.unique(objects))
    if object_count < 2:
        raise NotPossibleError("one object only: none is left to hold out")
    fold_count = min(THRESHOLD_FOLDS, object_count)
    random = np.random.default_rng(seed)
    known_by_detector: dict[str, list[np.ndarray]] = {}
    novel_by_detector: dict[str, list[np.ndarray]] = {}
    known_rows = []
    novel_rows = []
    no_classes = np.zeros(len(features))
    folds = grouped_folds(no_classes, objects, "regression", fold_count, seed)
    for fold, (known, held_out) in enumerate(folds):
        group_count = len(np.unique(groups[known]))
        if group_count < 2:
            raise NotPossibleError("one group only: none is left to hold out")
        group_folds = grouped_folds(
            no_classes[known],
            groups[known],
            "regression",
            min(GROUP_FOLDS, group_count),
            seed,
        )
        train_part, test_part = group_folds[fold % len(group_folds)]
        train = known[train_part]
        test = known[test_part]
        novel = random.permutation(held_out)[: MAX_TESTED // fold_count]
        tested = features[np.concatenate([test, novel])]
        guard = NoveltyGuard.from_grasps(features[train], grasp[train], objects[train])
        scores = guard.scores(tested)
        if classifier and len(np.unique(objects[train])) > 1:
            fitted = fit_named_model(
                classifier,
                "classification",
                features[train],
                objects[train],
                groups[train],
                seed=seed,
            )
            scores.update(classifier_scores(fitted, tested))
        for name, score in scores.items():
            known_by_detector.setdefault(name, []).append(score[: len(test)])
            novel_by_detector.setdefault(name, []).append(score[len(test) :])
        known_rows.append(test)
        novel_rows.append(novel)
    # detectors that have scores in all folds
    complete = [name for name, parts in novel_by_detector.items() if len(parts) == fold_count]
    return NovelScores(
        known={name: np.concatenate(known_by_detector[name]) for name in complete},
        novel={name: np.concatenate(novel_by_detector[name]) for name in complete},
        known_group=groups[np.concatenate(known_rows)],
        novel_grasp=grasp[np.concatenate(novel_rows)],
        novel_object=objects[np.concatenate(novel_rows)],
    )
