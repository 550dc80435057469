"""Points and weights of Gauss and Legendre, computed once."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.floating]


@cache
def gauss(count: int) -> tuple[Real, Real]:
    """Return the points in (-1, 1) and their weights, both (count,) and read-only."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    nodes.flags.writeable = weights.flags.writeable = False
    return nodes, weights
