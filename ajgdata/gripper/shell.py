"""Ringing of a thin spherical shell: bending and stretching together, free and empty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from ajgdata.gripper.contact import plane_modulus
from ajgdata.gripper.object_materials import Material

Real = NDArray[np.floating]
#: Degrees of the spherical harmonics: the highest bend over a fortieth of the circumference.
DEGREES = 20


@dataclass(frozen=True)
class ShellModes:
    """Modes that are alike all round one axis, in order of frequency: ω² (N,), loss factor (N,),
    degree (N,) and mass-normalised radial displacement at the axis (N,)."""

    square: Real
    loss: Real
    degree: NDArray[np.int64]
    radial: Real

    def at(self, cosine: Real) -> Real:
        """Radial displacement (N, points) where the axis and the radius enclose arccos `cosine`."""
        legendres = legendre.legvander(np.clip(cosine, -1, 1), DEGREES)
        return self.radial[:, None] * legendres.T[self.degree]


def shell_modes(radius: float, thickness: float, material: Material) -> ShellModes:
    """Return the modes of degree 0 and 2 to DEGREES of a shell of mean `radius` (m).

    Each degree n has two: with λ = n(n+1), β² = h²/12a² and Ω² = ω²a²ρ(1-ν²)/E they are the
    eigenvalues of tangential and radial displacement, trace 1 + 3ν + λ - β²(1-ν-λ²-νλ) and
    determinant (λ-2)(1-ν²) + β²[λ³ - 4λ² + λ(5-ν²) - 2(1-ν²)] (Junger & Feit, Sound, Structures and
    their Interaction, 1986, section 7.13; without bending, β = 0, Lamb, Proc. London Math. Soc. 14,
    1882, 50). Degree 1 is the motion of the whole, but for one mode far above.
    """
    nu, bend = material.poisson, thickness**2 / (12 * radius**2)
    degree = np.array([0, *range(2, DEGREES + 1)])
    lam = degree * (degree + 1.0)
    held = nu + lam - 1
    matrix = np.empty((len(degree), 2, 2))
    matrix[:, 0, 0] = (1 + bend) * held
    matrix[:, 1, 1] = 2 * (1 + nu) + bend * lam * held
    matrix[:, 0, 1] = matrix[:, 1, 0] = np.sqrt(lam) * (bend * held + 1 + nu)
    values, vectors = np.linalg.eigh(matrix)
    # Degree 0 has no tangential displacement: its other eigenvalue, ν - 1, is no mode.
    real = np.column_stack([degree > 0, degree >= 0])
    wave = plane_modulus(material.young_pa, nu) / (material.density_kg_m3 * radius**2)
    mass = material.density_kg_m3 * 4 * np.pi * radius**2 * thickness
    radial = vectors[:, 1, :] * np.sqrt((2 * degree + 1) / mass)[:, None]
    square, degrees = (values * wave)[real], np.broadcast_to(degree[:, None], real.shape)[real]
    order = np.argsort(square, kind="stable")
    loss = np.full(len(order), material.loss)
    return ShellModes(square[order], loss, degrees[order], radial[real][order])
