"""Gaussian random fields that live in physical space, hence are the same on every grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.scene import derive_seed

MODES = 200
Real = NDArray[np.floating]


@dataclass(frozen=True)
class RandomField:
    """Stationary field of zero mean, unit variance and covariance exp(-|x|²/2ℓ²).

    A sum of 200 plane waves whose wave vectors are drawn from the covariance's spectrum (Shinozuka
    & Deodatis 1991): a closed formula of the position, not values on some grid.
    """

    vectors: Real
    phases: Real

    @classmethod
    def draw(cls, seed: int, name: str, dimensions: int, correlation: float) -> RandomField:
        """Draw the field called `name`; `correlation` ℓ in the unit of the positions."""
        rng = np.random.default_rng(derive_seed(seed, name))
        vectors = rng.standard_normal((MODES, dimensions)) / correlation
        return cls(vectors, rng.uniform(0.0, 2 * np.pi, MODES))

    def on_axes(self, *axes: Real) -> Real:
        """Values (n, m, …) on the grid spanned by one axis a dimension, last axis fastest."""
        first = np.exp(1j * (np.outer(axes[0], self.vectors[:, 0]) + self.phases))
        waves = first.reshape(len(axes[0]), MODES)
        for axis, positions in enumerate(axes[1:-1], start=1):
            factor = np.exp(1j * np.outer(positions, self.vectors[:, axis]))
            waves = (waves[:, None, :] * factor[None]).reshape(-1, MODES)
        last = np.exp(1j * np.outer(axes[-1], self.vectors[:, -1]))
        # Not a matrix product: BLAS rounds differently with another number of threads.
        values = np.einsum("am,bm->ab", waves.real, last.real)
        values -= np.einsum("am,bm->ab", waves.imag, last.imag)
        return values.reshape([len(axis) for axis in axes]) * np.sqrt(2 / MODES)
