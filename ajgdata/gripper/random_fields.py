"""Gaussian random fields in physical space, so they are the same on every grid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ajgdata.gripper.scene import History, derive_seed

MODES = 200
#: What happened to a bed is forgotten when less than this of it is left.
FORGOTTEN = 1e-3
Real = NDArray[np.floating]


@dataclass(frozen=True)
class RandomField:
    """Stationary field of zero mean, unit variance and covariance exp(-|x|²/2ℓ²).

    A sum of 200 plane waves whose wave vectors are drawn from the covariance's spectrum (Shinozuka
    & Deodatis 1991): a closed formula of the position, not values on some grid. `seed` and `name`
    draw it; `correlation` is ℓ in the unit of the positions.

    With a `history` its seed draws the waves, and their complex amplitudes follow its process from
    grasp to grasp; `seed` is not used. So does the field then, at every place alike, at the cost of
    one field.
    """

    seed: int
    name: str
    dimensions: int
    correlation: float
    history: History | None = None

    def on_axes(self, *axes: Real) -> Real:
        """Values (n, m, …) on the grid spanned by one axis a dimension, last axis fastest."""
        return _values(self, *(tuple(axis.tolist()) for axis in axes))


def normals(seed: int, name: str, count: int, history: History | None = None) -> Real:
    """Return `count` standard normal numbers of a grasp, which follow its bed's history.

    x_n = ρ x_{n-1} + √(1 - ρ²) ξ_n from a stationary start, as a sum over past ξ, each with a seed
    of its own: any grasp can be had alone. What came before ρᵏ < 0.001 counts as the start.
    """
    if history is None:
        return np.random.default_rng(derive_seed(seed, name)).standard_normal(count)
    rho, now, back = history.memory, history.number, 0
    total = np.zeros(count)
    fresh = np.sqrt(1 - rho**2)
    while True:
        drawn = np.random.default_rng(derive_seed(history.seed, name, now - back))
        new, left = drawn.standard_normal(count), rho**back
        if back == now or left < FORGOTTEN:
            return total + left * new
        total += fresh * left * new
        back += 1


# Scenes that differ in anything else share their field, which takes half the time of a cavity.
@lru_cache(maxsize=8)
def _values(field: RandomField, *positions: tuple[float, ...]) -> Real:
    axes = [np.array(axis) for axis in positions]
    past = field.history
    rng = np.random.default_rng(derive_seed(past.seed if past else field.seed, field.name))
    vectors = rng.standard_normal((MODES, field.dimensions)) / field.correlation
    phases, size = rng.uniform(0.0, 2 * np.pi, MODES), np.ones(MODES)
    if past:
        real, imaginary = normals(0, field.name, 2 * MODES, past).reshape(2, MODES)
        phases, size = np.arctan2(imaginary, real), np.hypot(real, imaginary) / np.sqrt(2)
    first = np.exp(1j * (np.outer(axes[0], vectors[:, 0]) + phases)) * size
    waves = first.reshape(len(axes[0]), MODES)
    for axis, along in enumerate(axes[1:-1], start=1):
        factor = np.exp(1j * np.outer(along, vectors[:, axis]))
        waves = (waves[:, None, :] * factor[None]).reshape(-1, MODES)
    last = np.exp(1j * np.outer(axes[-1], vectors[:, -1]))
    values = _real_product(waves, np.ascontiguousarray(last.T))
    values = values.reshape([len(axis) for axis in axes]) * np.sqrt(2 / MODES)
    values.flags.writeable = False
    return values


@njit(nogil=True, cache=True)
def _real_product(left, right):
    """Real part of left @ right, (a, m) and (m, b), summed in a fixed order: BLAS rounds
    differently with another number of threads."""
    values = np.zeros((left.shape[0], right.shape[1]))
    real, imag = right.real.copy(), right.imag.copy()
    for a in range(left.shape[0]):
        for m in range(left.shape[1]):
            x, y = left[a, m].real, left[a, m].imag
            for b in range(right.shape[1]):
                values[a, b] += x * real[m, b] - y * imag[m, b]
    return values
