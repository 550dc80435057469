"""Window functions, without `scipy.signal`: importing that takes longer than all else of a job.

With a the coefficients of a shape, w[n] = sum_k a[k] cos(k (2 pi n / N - pi)), n = 0 ... N - 1, is
periodic (Harris 1978, On the use of windows for harmonic analysis, eq. 27 to 33).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

COEFFICIENTS = {
    "boxcar": (1.0,),
    "hann": (0.5, 0.5),
    "hamming": (0.54, 1 - 0.54),
    "blackman": (0.42, 0.50, 0.08),
}


def periodic_window(shape: str, length: int) -> NDArray[np.float64]:
    """Return a periodic window (length,), bit for bit `scipy.signal.get_window(shape, length)`.

    >>> from ajgdata.features.windows import periodic_window
    >>> periodic_window("hann", 4)
    array([0. , 0.5, 1. , 0.5])
    """
    angle = np.linspace(-np.pi, np.pi, length + 1)[:-1]
    window = np.zeros(length)
    for order, share in enumerate(COEFFICIENTS[shape]):
        window += share * np.cos(order * angle)
    return window
