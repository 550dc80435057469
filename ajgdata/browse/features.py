"""Features of a data set as a page shows them: spectra of classes, a plane, and novelty."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from sklearn.decomposition import PCA

from ajgdata.models.scaling import raw_scaling
from ajgdata.store.feature_array import CHANNEL, FREQUENCY, Axis
from ajgdata.store.features import FeatureRows

#: Largest number of recordings to which the scaling and the components are fitted, and that others
#: are compared with.
MAX_FITTED = 5_000
#: Largest number of principal components in which distances are computed.
MAX_COMPONENTS = 20
#: Rows that are transformed at once.
_BLOCK = 2_000


class Compared(NamedTuple):
    """The curve of a recording and the mean curves of its class and of the nearest other class,
    each (f,); "" and None if there is no such class."""

    own: np.ndarray
    label: str
    of_label: np.ndarray | None
    nearest: str
    of_nearest: np.ndarray | None


@dataclass(frozen=True, eq=False)
class Features:
    """The features of a data set; `names` (n,) are the recordings of its rows."""

    table: FeatureRows

    @cached_property
    def names(self) -> list[str]:
        """The names (n,) of the recordings."""
        return list(map(str, self.table.columns["recording"].values))

    @cached_property
    def row(self) -> dict[str, int]:
        """The row of each recording by name."""
        return {name: row for row, name in enumerate(self.names)}

    @property
    def axis(self) -> Axis:
        """The dimension that a curve is drawn over: frequency, else the first one that is no
        channel."""
        axes = [axis for axis in self.table.axes if axis.name != CHANNEL]
        return next((axis for axis in axes if axis.name == FREQUENCY), axes[0])

    @cached_property
    def curves(self) -> np.ndarray:
        """The curves (n, f) over `axis`: the mean over all other dimensions, also over channels."""
        kept = 1 + self.table.axes.index(self.axis)
        others = tuple(n for n in range(1, self.table.feature.ndim) if n != kept)
        return self.table.feature.mean(axis=others) if others else self.table.feature

    @cached_property
    def points(self) -> np.ndarray:
        """The compressed, standardised features in their first principal components (n, d),
        float32; d <= MAX_COMPONENTS."""
        flat = self.table.flat
        fitted = flat[_spread(len(flat))]
        scaling = raw_scaling().fit(fitted)
        count = min(MAX_COMPONENTS, *fitted.shape)
        pca = PCA(count, svd_solver="randomized", random_state=0).fit(scaling.transform(fitted))
        blocks = [
            pca.transform(scaling.transform(flat[start : start + _BLOCK])).astype(np.float32)
            for start in range(0, len(flat), _BLOCK)
        ]
        return np.concatenate(blocks)

    @property
    def plane(self) -> np.ndarray:
        """The first two principal components (n, 2); the second is 0 if there is only one."""
        missing = max(0, 2 - self.points.shape[1])
        return np.pad(self.points, ((0, 0), (0, missing)))[:, :2]


@dataclass(frozen=True, eq=False)
class ClassCurves:
    """Sums of the curves (n, f) of each class; `labels` (n,) are the classes of all rows, "" for
    none."""

    curves: np.ndarray
    labels: Sequence[str]

    @cached_property
    def _sums(self) -> dict[str, tuple[np.ndarray, int]]:
        """Return the sum (f,) and the number of the curves of each class."""
        distinct, number = np.unique(np.asarray(self.labels, np.str_), return_inverse=True)
        members = {value: number == code for code, value in enumerate(distinct.tolist()) if value}
        return {
            value: (self.curves[is_member].sum(axis=0, dtype=float), int(is_member.sum()))
            for value, is_member in members.items()
        }

    def compared(self, row: int) -> Compared:
        """Return the curve of a row with the means of its class and of the nearest other class.

        The curve is not in the mean of its class. The nearest class is the one whose mean has the
        smallest Euclidean distance to the curve, after the compression asinh(x / mean of the
        curve).
        """
        own = self.curves[row]
        label = self.labels[row]
        means = {value: total / count for value, (total, count) in self._sums.items()}
        of_label = None
        if label:
            means.pop(label)
            total, count = self._sums[label]
            if count > 1:
                of_label = (total - own) / (count - 1)
        scale = float(np.abs(own).mean()) or 1.0
        compressed = np.arcsinh(own / scale)
        distances = {
            value: float(np.linalg.norm(np.arcsinh(mean / scale) - compressed))
            for value, mean in means.items()
        }
        nearest = min(distances, key=distances.__getitem__, default="")
        return Compared(own, label, of_label, nearest, means.get(nearest))


def _spread(count: int) -> np.ndarray:
    """Return up to MAX_FITTED row numbers, evenly spread over `count` rows."""
    step = -(-count // MAX_FITTED)
    return np.arange(0, count, max(1, step))


def novelty(points: np.ndarray, grasps: Iterable[str]) -> np.ndarray:
    """Return the novelty (n,) of points (n, d): the distance to the nearest recording of another
    grasp, divided by its median over all points.

    The novelty of a usual recording is 1. Each recording is compared with up to MAX_FITTED others.
    NaN if there is only one grasp.

    >>> import numpy as np
    >>> from ajgdata.browse.features import novelty
    >>> novelty(np.array([[0.0], [1.0], [2.0], [5.0]], np.float32), ["a", "b", "c", "d"]).tolist()
    [1.0, 1.0, 1.0, 3.0]
    """
    _, grasp = np.unique(list(grasps), return_inverse=True)
    compared = _spread(len(points))
    references = points[compared]
    squares = np.square(references).sum(axis=1)
    nearest = np.empty(len(points))
    for start in range(0, len(points), _BLOCK):
        block = points[start : start + _BLOCK]
        squared = np.square(block).sum(axis=1)[:, np.newaxis] + squares - 2 * block @ references.T
        is_own = grasp[start : start + _BLOCK, np.newaxis] == grasp[compared]
        squared[is_own] = np.inf
        nearest[start : start + _BLOCK] = np.sqrt(np.maximum(squared.min(axis=1), 0))
    nearest[np.isinf(nearest)] = np.nan
    usual = np.nanmedian(nearest) if np.isfinite(nearest).any() else np.nan
    return nearest / usual if usual > 0 else nearest
