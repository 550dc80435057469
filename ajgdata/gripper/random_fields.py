"""Gaussian random fields that live in physical space, hence are the same on every grid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.scene import derive_seed

MODES = 200
Real = NDArray[np.floating]


@dataclass(frozen=True)
class RandomField:
    """Stationary field of zero mean, unit variance and covariance exp(-|x|²/2ℓ²).

    A sum of 200 plane waves whose wave vectors are drawn from the covariance's spectrum (Shinozuka
    & Deodatis 1991): a closed formula of the position, not values on some grid. `seed` and `name`
    draw it; `correlation` is ℓ in the unit of the positions.
    """

    seed: int
    name: str
    dimensions: int
    correlation: float

    def on_axes(self, *axes: Real) -> Real:
        """Values (n, m, …) on the grid spanned by one axis a dimension, last axis fastest."""
        return _values(self, *(tuple(axis.tolist()) for axis in axes))


# Scenes that differ in anything else share their field, which takes half the time of a cavity.
@lru_cache(maxsize=8)
def _values(field: RandomField, *positions: tuple[float, ...]) -> Real:
    axes = [np.array(axis) for axis in positions]
    rng = np.random.default_rng(derive_seed(field.seed, field.name))
    vectors = rng.standard_normal((MODES, field.dimensions)) / field.correlation
    phases = rng.uniform(0.0, 2 * np.pi, MODES)
    first = np.exp(1j * (np.outer(axes[0], vectors[:, 0]) + phases))
    waves = first.reshape(len(axes[0]), MODES)
    for axis, along in enumerate(axes[1:-1], start=1):
        factor = np.exp(1j * np.outer(along, vectors[:, axis]))
        waves = (waves[:, None, :] * factor[None]).reshape(-1, MODES)
    last = np.exp(1j * np.outer(axes[-1], vectors[:, -1]))
    # Not a matrix product: BLAS rounds differently with another number of threads.
    values = np.einsum("am,bm->ab", waves.real, last.real)
    values -= np.einsum("am,bm->ab", waves.imag, last.imag)
    values = values.reshape([len(axis) for axis in axes]) * np.sqrt(2 / MODES)
    values.flags.writeable = False
    return values
