"""Bending of a plate that lies on something soft: Kirchhoff's plate with free edges, by Ritz."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.linalg import eigh

from ajgdata.gripper.contact import Spring, plane_modulus
from ajgdata.gripper.object_materials import Material

Real = NDArray[np.floating]
#: Polynomials along each edge: the first five bending modes to 1e-4.
POLYNOMIALS = 10


@dataclass(frozen=True)
class PlateModes:
    """Bending modes in order of frequency: ω² (N,), loss (N,) and `weights` (N, P, P) of the
    products of Legendre polynomials along both edges, mass-normalised."""

    square: Real
    loss: Real
    weights: Real
    length: float
    width: float

    def at(self, u: Real, v: Real) -> Real:
        """Shapes (N, points) at distances u, v (m) from the centre along length and width."""
        along = legendre.legvander(2 * u / self.length, POLYNOMIALS - 1)
        across = legendre.legvander(2 * v / self.width, POLYNOMIALS - 1)
        return np.einsum("nij,ki,kj->nk", self.weights, along, across)


def plate_modes(
    length: float, width: float, thickness: float, material: Material, bed: Spring, count: int = 5
) -> PlateModes:
    """The first `count` bending modes of a plate (m) on a Winkler foundation `bed`.

    Minimises D/2 ∫ (w_xx + w_yy)² - 2(1-ν)(w_xx w_yy - w_xy²) dS over polynomials (Leissa 1969,
    eq. 1.9; Ritz 1909). The uniform foundation leaves all shapes as they are and adds k/(ρh) to
    each ω². Bounce and tilt, which bend nothing, are left to the column.
    """
    x, gauss = legendre.leggauss(POLYNOMIALS + 2)
    unit = np.eye(POLYNOMIALS)
    slopes = [
        np.array([legendre.legval(x, legendre.legder(row, d)) for row in unit]) for d in range(3)
    ]

    def over(edge: float, one: int, other: int) -> Real:
        return (slopes[one] * gauss) @ slopes[other].T * (2 / edge) ** (one + other) * edge / 2

    def product(x_one: int, x_other: int, y_one: int, y_other: int) -> Real:
        return np.kron(over(length, x_one, x_other), over(width, y_one, y_other))

    nu = material.poisson
    curved = product(2, 2, 0, 0) + product(0, 0, 2, 2) + 2 * (1 - nu) * product(1, 1, 1, 1)
    curved += nu * (product(2, 0, 0, 2) + product(0, 2, 2, 0))
    rigidity = float(plane_modulus(material.young_pa, nu)) * thickness**3 / 12
    per_area = material.density_kg_m3 * thickness
    wanted = (3, 2 + count)
    bent, vectors = eigh(rigidity * curved, per_area * product(0, 0, 0, 0), subset_by_index=wanted)
    held = bed.stiffness_n_m3 / per_area
    square = bent + held
    loss = (material.loss * bent + bed.loss * held) / square
    weights = vectors.T.reshape(count, POLYNOMIALS, POLYNOMIALS)
    return PlateModes(square, loss, weights, length, width)
