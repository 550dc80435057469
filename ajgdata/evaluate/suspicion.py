"""Suspicion that labels of recordings are wrong, between 0 and 1.

Three observations give the suspicion S of a recording:

- *prediction*, from models that were not trained on its grasp. For classes, let r(i, j) be the
  share of the other recordings with label i that are predicted as j, (count + 1) / (number +
  classes). A recording with label i and prediction j has the likelihood ratio R = r(j, j) / r(i, j)
  of *the label is wrong* to *the label is right*; for the prediction i, the numerator is the mean
  of r(k, i) over the other classes k. With the confidence w = (q - 1 / classes) / (1 - 1 / classes)
  for the probability q of the predicted class, P = R^w / (1 + R^w). So a prediction counts more if
  it is confident, and less if both classes are often confused. Counts of labels and predictions
  also find wrong labels in confident learning (Northcutt et al. 2021, JAIR 70, arXiv 1911.00068).
  For numbers, with the residual r and the typical residual s (1.48 times the median of |r|):
  P = z / (1 + z) with z = |r| / s.
- *outlier*, from the distances between sounds. For classes, with the distance d(k) to the mean of
  class k without the grasp of the recording: O = 1 - exp(-2 d(i)² / m) / sum over k of
  exp(-2 d(k)² / m) for the label i, where m is the median of d(i)² over all recordings. This is the
  probability of the other classes for normal distributions of four dimensions. For numbers, O is
  as P, with the difference from the median of the nearest recordings of other grasps.
- *contradiction*: a recording with nearly the same sound, or of the same grasp, has another label.

S is the mean of P and O; if one of them is unknown, it is 1/2. With a contradiction, S becomes
(1 + S) / 2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit
from sklearn.decomposition import PCA
from sklearn.neighbors import NearestNeighbors

from ajgdata.evaluate.metrics import length, wrapped

#: Ratio of the standard deviation of a normal distribution to the median of its absolute values.
NORMAL = 1.4826
#: Largest number of principal components of the sounds, and at most half the number of grasps.
MAX_COMPONENTS = 20
#: Factor of squared distances in O.
SHARPNESS = 2.0
#: Largest exponent: O is then 1, and its numerator is still a finite number.
MAX_EXPONENT = 500.0
#: Number of nearest recordings whose median is the expected number.
NEIGHBOURS = 5
#: Share of grasps with several labels above which a label varies within grasps by intention.
MIXED_BY_INTENTION = 1 / 4


def class_predictions(
    label: NDArray[np.str_], predicted: NDArray[np.str_], probability: NDArray[np.float64] | None
) -> NDArray[np.float64]:
    """Return P (n,) of the predictions of one model.

    `label` (n,), `predicted` (n,), and the `probability` (n,) of the predicted class; None if the
    model has no probabilities, which are then 1.

    >>> import numpy as np
    >>> label = np.array(["cube"] * 5 + ["bar"] * 5)
    >>> predicted = np.array(["cube"] * 4 + ["bar"] * 6)  # the fifth cube is predicted as a bar
    >>> class_predictions(label, predicted, np.full(10, 0.9)).round(2)[[0, 4, 5]]
    array([0.23, 0.79, 0.3 ])
    """
    names, number = np.unique(np.concatenate([label, predicted]), return_inverse=True)
    given = number[: len(label)]
    seen = number[len(label) :]
    classes = len(names)
    if classes == 1:
        return np.full(len(label), 0.5)
    count = np.zeros((classes, classes))
    np.add.at(count, (given, seen), 1)
    total = count.sum(axis=1)
    rate = (count + 1) / (total[:, np.newaxis] + classes)
    right = np.diag(rate)
    confused = (rate.sum(axis=0) - right) / (classes - 1)
    if_wrong = np.where(given == seen, confused[seen], right[seen])
    if_right = count[given, seen] / (total[given] + classes - 1)  # without the recording itself
    confidence = np.ones(len(label))
    if probability is not None:
        confidence = np.clip((probability - 1 / classes) / (1 - 1 / classes), 0, 1)
    return np.asarray(expit(confidence * np.log(if_wrong / if_right)))


def value_suspicion(residual: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return P or O (n,) of residuals (n,) of numbers; NaN for NaN.

    >>> import numpy as np
    >>> value_suspicion(np.array([1.0, -1.0, 1.0, 9.0])).round(2)
    array([0.4 , 0.4 , 0.4 , 0.86])
    """
    size = np.abs(residual)
    if np.isnan(size).all():
        return size
    typical = NORMAL * float(np.nanmedian(size))
    if typical == 0:
        return np.where(np.isnan(size), np.nan, (size > 0).astype(float))
    return np.asarray(size / (size + typical))


def coordinates(fingerprints: NDArray[np.floating], grasp: NDArray[np.str_]) -> NDArray[np.float64]:
    """Return principal components (n, d) of sounds (n, b) of the grasps `grasp` (n,)."""
    count = min(MAX_COMPONENTS, max(1, len(np.unique(grasp)) // 2), *fingerprints.shape)
    return np.asarray(PCA(count, random_state=0).fit_transform(fingerprints.astype(np.float64)))


def class_outliers(
    points: NDArray[np.float64], label: NDArray[np.str_], grasp: NDArray[np.str_]
) -> tuple[NDArray[np.float64], NDArray[np.str_]]:
    """Return O (n,) of points (n, d), and the other class (n,) with the nearest mean.

    The means of the classes of `label` (n,) are without the grasp (n,) of the point. O is NaN for
    the only grasp of a class, if there is one class, and if all sounds of each class are equal.

    >>> import numpy as np
    >>> points = np.array([[0.0], [1.0], [2.0], [8.0], [9.0], [10.0], [9.0]])
    >>> label = np.array(["ball"] * 3 + ["cube"] * 3 + ["ball"])  # the last one is probably a cube
    >>> class_outliers(points, label, np.arange(7).astype(str))[0].round(2)[-1]
    np.float64(1.0)
    """
    classes, member = np.unique(label, return_inverse=True)
    grasps, of_grasp = np.unique(grasp, return_inverse=True)
    distance = np.full((len(points), len(classes)), np.nan)
    for number in range(len(classes)):
        is_member = member == number
        sums = np.zeros((len(grasps), points.shape[1]))
        np.add.at(sums, of_grasp[is_member], points[is_member])
        counts = np.bincount(of_grasp[is_member], minlength=len(grasps))
        others = counts.sum() - counts
        has_mean = others > 0
        means = (sums.sum(axis=0) - sums)[has_mean] / others[has_mean, np.newaxis]
        rows = np.flatnonzero(has_mean[of_grasp])
        place = np.cumsum(has_mean) - 1
        difference = points[rows] - means[place[of_grasp[rows]]]
        distance[rows, number] = np.linalg.norm(difference, axis=1)
    squared = np.square(distance)
    own = np.take_along_axis(squared, member[:, np.newaxis], axis=1)[:, 0]
    np.put_along_axis(squared, member[:, np.newaxis], np.nan, axis=1)
    others = np.where(np.isnan(squared), np.inf, squared)
    nearest = classes[others.argmin(axis=1)]
    is_known = np.isfinite(own) & np.isfinite(others.min(axis=1))
    outlier = np.full(len(points), np.nan)
    if not is_known.any() or np.median(own[is_known]) == 0:
        return outlier, nearest
    exponent = -SHARPNESS * (others - own[:, np.newaxis]) / np.median(own[is_known])
    odds = np.exp(np.minimum(exponent[is_known], MAX_EXPONENT)).sum(axis=1)
    outlier[is_known] = odds / (1 + odds)
    return outlier, nearest


def value_outliers(
    points: NDArray[np.float64],
    value: NDArray[np.float64],
    grasp: NDArray[np.str_],
    period: float | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return O (n,) of points (n, d) with numbers (n,) or vectors (n, k), and the expected values.

    The expected value is that of the nearest recordings of other grasps: their median, or the
    nearest of them for a target with a `period`. It is NaN without another grasp.
    """
    groups = np.unique(grasp, return_inverse=True)[1]
    largest = int(np.bincount(groups).max())
    count = min(len(points), NEIGHBOURS + largest)
    neighbours = NearestNeighbors(n_neighbors=count).fit(points).kneighbors(points)[1]
    expected = np.full(value.shape, np.nan)
    for row, near in enumerate(neighbours):
        other = near[groups[near] != groups[row]][:NEIGHBOURS]
        if len(other):
            expected[row] = value[other[0]] if period else np.median(value[other], axis=0)
    return value_suspicion(length(wrapped(value - expected, period))), expected


def minority_labels(label: NDArray[np.str_], grasp: NDArray[np.str_]) -> NDArray[np.intp]:
    """Return for each recording (n,) a row of its grasp with a more frequent or equally frequent
    other label; -1 without such a row.

    All are -1 if more than a quarter of the grasps have several labels, because the label then
    varies within grasps by intention.
    """
    rows_of: dict[str, list[int]] = {}
    for row, name in enumerate(grasp.tolist()):
        rows_of.setdefault(name, []).append(row)
    other = np.full(len(label), -1)
    mixed = 0
    for rows in rows_of.values():
        names, counts = np.unique(label[rows], return_counts=True)
        if len(names) == 1:
            continue
        mixed += 1
        count_of = dict(zip(names.tolist(), counts.tolist(), strict=True))
        for row in rows:
            for candidate in rows:
                is_other = label[candidate] != label[row]
                if is_other and count_of[label[candidate]] >= count_of[label[row]]:
                    other[row] = candidate
                    break
    if mixed > MIXED_BY_INTENTION * len(rows_of):
        return np.full(len(label), -1)
    return other


def combined(
    prediction: NDArray[np.float64],
    outlier: NDArray[np.float64],
    is_contradicted: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """Return S (n,) of P (n,) and O (n,), which are NaN if they are unknown.

    >>> import numpy as np
    >>> unknown = np.nan
    >>> combined(np.array([0.8, unknown]), np.array([0.6, 0.4]), np.array([False, True])).round(3)
    array([0.7  , 0.725])
    """
    suspicion = (np.nan_to_num(prediction, nan=0.5) + np.nan_to_num(outlier, nan=0.5)) / 2
    return np.asarray(np.where(is_contradicted, (1 + suspicion) / 2, suspicion))
