"""An exported model beside the package itself: how far they are apart, and how far they may be.

Rounding of the feature and of the model are told apart: the model is given the feature that the
exported file made, so that a vote that rounding turns is no error of the file.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ajgdata.export.description import feature_tolerance
from ajgdata.export.numpy_runtime import largest_difference

#: What is said, (n, k), of features (n, n_bins).
Says = Callable[[np.ndarray], np.ndarray]
_EPSILON = float(np.finfo(np.float32).eps)
#: Each of the five layers of a float32 network rounds about as much as its input being off by one
#: rounding; scikit-learn's models count in float64 and stay far below.
_ROUNDINGS = 8


@dataclass(frozen=True)
class Difference:
    """The largest of one quantity over all recordings, and what rounding explains."""

    quantity: str
    largest: float
    allowed: float

    @property
    def is_beyond(self) -> bool:
        """True if rounding does not explain it; NaN is beyond, too."""
        return not self.largest <= self.allowed


def feature_difference(ours: np.ndarray, theirs: np.ndarray, window: int) -> Difference:
    """Return the difference of features (n, n_bins), relative to the 2-norm of each."""
    norm = np.linalg.norm(ours.astype(np.float64), axis=1)
    error = np.linalg.norm(theirs.astype(np.float64) - ours, axis=1) / np.where(norm, norm, 1.0)
    return Difference("feature", float(error.max(initial=0)), feature_tolerance(window))


def difference(
    quantity: str, says: Says, features: np.ndarray, theirs: np.ndarray, period: float | None = None
) -> Difference:
    """Return the difference of what is said, (n, k), of the same features (n, n_bins).

    `says` is the package's. With a `period`, differences are the shortest way round.
    """
    ours = says(features)
    signs = np.random.default_rng(0).choice([-1.0, 1.0], features.shape)
    rounded = (features * (1 + _EPSILON * signs)).astype(np.float32)
    amplified = largest_difference(says(rounded), ours, period)
    allowed = _ROUNDINGS * amplified + 4 * _EPSILON * float(np.abs(ours).max(initial=0))
    return Difference(quantity, largest_difference(theirs, ours, period), allowed)
