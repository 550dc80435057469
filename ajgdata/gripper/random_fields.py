"""Gaussian random fields that are functions of the position, so they are equal on every grid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ajgdata.gripper.scene import History, derive_seed

#: Number of plane waves of a field.
MODES = 200
#: Least weight ρᵏ with which the grasp k grasps earlier still has an effect.
FORGOTTEN = 1e-3
Real = NDArray[np.floating]


@dataclass(frozen=True)
class RandomField:
    """A stationary field of zero mean, unit variance and covariance exp(-|x|²/2ℓ²).

    It is a sum of 200 plane waves, whose wave vectors are drawn from the spectrum of the covariance
    (Shinozuka & Deodatis 1991). `seed` and `name` determine the waves; `correlation` is ℓ in the
    unit of the positions.

    With a `history`, its seed determines the waves instead of `seed`. Their complex amplitudes
    follow the autoregressive process of the history, and so does the field at every position. The
    run time is that of one field.
    """

    seed: int
    name: str
    dimensions: int
    correlation: float
    history: History | None = None

    def on_axes(self, *axes: Real) -> Real:
        """Return values (n, m, …) on the grid of `dimensions` axes (n,), (m,), …."""
        return _values(self, *(tuple(axis.tolist()) for axis in axes))


# The cache is for scenes with the same field, which takes half of the time of a cavity.
@lru_cache(maxsize=8)
def _values(field: RandomField, *positions: tuple[float, ...]) -> Real:
    """Return the values of a field on the grid of the positions along each axis."""
    axes = [np.array(axis) for axis in positions]
    history = field.history
    seed = history.seed if history else field.seed
    generator = np.random.default_rng(derive_seed(seed, field.name))
    vectors = generator.standard_normal((MODES, field.dimensions)) / field.correlation
    if history:
        real, imaginary = normals(0, field.name, 2 * MODES, history).reshape(2, MODES)
        phases = np.arctan2(imaginary, real)
        amplitudes = np.hypot(real, imaginary) / np.sqrt(2)
    else:
        phases = generator.uniform(0.0, 2 * np.pi, MODES)
        amplitudes = np.ones(MODES)
    first = np.exp(1j * (np.outer(axes[0], vectors[:, 0]) + phases)) * amplitudes
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
    """Return the real part (a, b) of left (a, m) @ right (m, b), summed in a fixed order.

    The rounding of BLAS depends on the number of threads.
    """
    values = np.zeros((left.shape[0], right.shape[1]))
    real = right.real.copy()
    imag = right.imag.copy()
    for a in range(left.shape[0]):
        for m in range(left.shape[1]):
            x = left[a, m].real
            y = left[a, m].imag
            for b in range(right.shape[1]):
                values[a, b] += x * real[m, b] - y * imag[m, b]
    return values


def normals(seed: int, name: str, count: int, history: History | None = None) -> Real:
    """Return standard normal numbers (count,) of a grasp; with a history, they follow it.

    The process is x_n = ρ x_{n-1} + √(1 - ρ²) ξ_n with a stationary start. The result is a sum over
    past ξ, each with a seed of its own, so no other grasp has to be computed. The first grasp with
    ρᵏ < 0.001, counted backwards, is the start.
    """
    if history is None:
        return np.random.default_rng(derive_seed(seed, name)).standard_normal(count)
    rho = history.memory
    fresh = np.sqrt(1 - rho**2)
    total = np.zeros(count)
    for back in range(history.number + 1):
        past_seed = derive_seed(history.seed, name, history.number - back)
        past = np.random.default_rng(past_seed).standard_normal(count)
        weight = rho**back
        if back == history.number or weight < FORGOTTEN:
            break
        total += fresh * weight * past
    return total + weight * past
