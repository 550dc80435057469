"""Hertz's contact, to which the contacts of the gripper are compared."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def hertz_stiffness(force: ArrayLike, radius: ArrayLike, modulus: ArrayLike) -> NDArray:
    """Stiffness dF/dδ of a sphere on a half-space, (6 E*² R F)^(1/3) in N/m, of a force (N), radius
    (m) and modulus E* (Pa); the arrays broadcast. Hertz 1882; Johnson 1985, eq. 4.23."""
    return np.cbrt(6 * np.square(modulus) * np.asarray(radius) * np.asarray(force))
