"""A model of modulations: how fast the level changes over time, and from band to band.

It takes the dimensions of the feature, because the values of a recording in one row do not state
which of them are neighbours. The feature has the dimensions `time` and another one, e.g.
`{kind: mel, over_time: frames}`.
"""

import numpy as np
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.linear_model import LogisticRegression, Ridge
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler


class Modulations(TransformerMixin, BaseEstimator):
    """Magnitudes of the two-dimensional spectrum: they do not depend on the begin of a sound."""

    def __init__(self, frame_s: float, highest_hz: float = 20.0):
        self.frame_s = frame_s  # time from one frame to the next
        self.highest_hz = highest_hz  # faster changes over time are ignored

    def fit(self, X, y=None):
        """Learn nothing: there is nothing to scale."""
        self.fitted_ = True
        return self

    def transform(self, X):
        """Return magnitudes (n, m) of features X (n, time, band)."""
        modulation_hz = np.abs(np.fft.fftfreq(X.shape[1], self.frame_s))
        magnitude = np.abs(np.fft.rfft2(X))[:, modulation_hz <= self.highest_hz]
        return magnitude.reshape(len(X), -1)


def modulations(kind: str, seed: int, dimensions: dict[str, np.ndarray]):
    """Return an unfitted estimator of features (n, time, band); `kind` is that of the target.

    `dimensions` has the coordinates of each dimension by name, here the times in s.
    """
    if len(dimensions) != 2 or "time" not in dimensions:
        raise ValueError("modulations needs a feature with the dimensions time and another one")
    frame_s = float(np.diff(dimensions["time"]).mean())
    final = Ridge() if kind == "regression" else LogisticRegression(max_iter=1000)
    return make_pipeline(Modulations(frame_s), StandardScaler(), final)
