"""Bands of frequency: third octaves, and what recordings of a part of the band would have given."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.features.spectrum import Float32, normalised


def within(
    feature: NDArray[Any],
    frequency_hz: NDArray[np.float64],
    band_hz: tuple[float, float],
    normalisation: str,
) -> tuple[Float32, NDArray[np.float64]]:
    """Return the bins of features (n, f) with low <= frequency <= high, and their frequencies.

    Divided by their own norm again (see `FeatureSettings.normalisation`), they are the features
    with that `band_hz` but for rounding: what lies outside is in no bin, nor in the norm. Raises
    ValueError for a band without bins.

    >>> import numpy as np
    >>> from ajgdata.features.bands import within
    >>> shares = np.array([[0.5, 0.1, 0.3, 0.1]], np.float32)
    >>> within(shares, np.array([0.0, 10.0, 20.0, 30.0]), (10, 25), "l1")
    (array([[0.25, 0.75]], dtype=float32), array([10., 20.]))
    """
    low, high = band_hz
    inside = (frequency_hz >= low) & (frequency_hz <= high)
    if not inside.any():
        raise ValueError(f"no bin of the feature lies within {low:g} to {high:g} Hz")
    rows = [normalised(row, normalisation) for row in feature[:, inside].astype(np.float64)]
    return np.reshape(rows, (len(feature), -1)).astype(np.float32), frequency_hz[inside]


def third_octaves(low_hz: float = 25.0, high_hz: float = 16_000.0) -> np.ndarray:
    """Return the exact centres of third octaves, 1000 · 10^(k/10) Hz (IEC 61260), within limits."""
    k = np.arange(np.ceil(10 * np.log10(low_hz / 1_000) - 1e-9), 10 * np.log10(high_hz / 1_000))
    return np.asarray(1_000 * 10 ** (k / 10))
