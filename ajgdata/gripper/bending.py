"""Bending of plates and spherical shells.

A plate is Kirchhoff's with free edges on a ring of rubber, by Ritz; a thin spherical shell bends
and stretches, free and empty.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.linalg import eigh

from ajgdata.gripper.contact import plane_modulus
from ajgdata.gripper.objects import Material

Real = NDArray[np.floating]
#: Polynomials along each edge: the first five bending modes to 1e-4.
POLYNOMIALS = 10
#: Points around a ring: exact for all products of the polynomials.
AROUND = 4 * POLYNOMIALS


class Ring(NamedTuple):
    """A ring of rubber around the centre: radius (m), stiffness per length (N/m²), loss factor."""

    radius: float
    stiffness_n_m2: float
    loss: float


class Load(NamedTuple):
    """Masses (kg) that ride on a plate, at u, v (m) from its centre; all 1-D."""

    u: Real
    v: Real
    mass: Real


@dataclass(frozen=True)
class Plate:
    """A plate of length, width and thickness (m), free at its edges; `round` ones fill the ellipse
    within."""

    length: float
    width: float
    thickness: float
    material: Material
    round: bool = False

    @property
    def per_area(self) -> float:
        """Mass per area, kg/m²."""
        return self.material.density_kg_m3 * self.thickness

    @property
    def rigidity(self) -> float:
        """Bending stiffness D = E h³ / 12 (1-ν²), Nm."""
        modulus = float(plane_modulus(self.material.young_pa, self.material.poisson))
        return modulus * self.thickness**3 / 12

    @cached_property
    def points(self) -> tuple[Real, Real, Real]:
        """Gauss's points u, v (m) and their areas (m²), exact for products of the shapes."""
        x, weight = legendre.leggauss(2 * POLYNOMIALS)
        if not self.round:
            u, v = np.meshgrid(x, x, indexing="ij")
            area = np.outer(weight, weight) / 4
        else:
            radius, turn = (x[:, None] + 1) / 2, 2 * np.pi * np.arange(AROUND) / AROUND
            u, v = radius * np.cos(turn), radius * np.sin(turn)
            area = weight[:, None] / 8 * radius * (2 * np.pi / AROUND) * np.ones_like(turn)
        return (
            u.ravel() * self.length / 2,
            v.ravel() * self.width / 2,
            area.ravel() * self.length * self.width,
        )

    @cached_property
    def degrees(self) -> NDArray[np.int64]:
        """Degrees (2, P) of the polynomials along length and width: up to a total on round plates,
        where the others are not distinguishable."""
        along, across = np.indices((POLYNOMIALS, POLYNOMIALS)).reshape(2, -1)
        mask = along + across < (POLYNOMIALS if self.round else 2 * POLYNOMIALS)
        return np.stack([along[mask], across[mask]])

    def shapes(self, u: Real, v: Real, d_u: int = 0, d_v: int = 0) -> Real:
        """Products of Legendre polynomials (P, points) at u, v (m), or derivatives of them."""
        along = _derived(2 * u / self.length, d_u) * (2 / self.length) ** d_u
        across = _derived(2 * v / self.width, d_v) * (2 / self.width) ** d_v
        return along[self.degrees[0]] * across[self.degrees[1]]

    @cached_property
    def curved(self) -> Real:
        """Stiffness (P, P): D ∫ (w_uu + w_vv)² - 2(1-ν)(w_uu w_vv - w_uv²) dS."""
        u, v, area = self.points
        uu, vv, uv = (self.shapes(u, v, *d) for d in ((2, 0), (0, 2), (1, 1)))
        nu = self.material.poisson
        mixed = (uu * area) @ vv.T
        bent = (uu * area) @ uu.T + (vv * area) @ vv.T + nu * (mixed + mixed.T)
        return self.rigidity * (bent + 2 * (1 - nu) * (uv * area) @ uv.T)

    @cached_property
    def mass(self) -> Real:
        """Mass (P, P), kg."""
        u, v, area = self.points
        shapes = self.shapes(u, v)
        return np.asarray(self.per_area * (shapes * area) @ shapes.T)


def _derived(x: Real, order: int) -> Real:
    """The `order`-th derivative of each polynomial at x: (POLYNOMIALS, points)."""
    unit = np.eye(POLYNOMIALS)
    return np.array([legendre.legval(x, legendre.legder(row, order)) for row in unit])


@dataclass(frozen=True)
class PlateModes:
    """Modes in order of frequency: ω² (N,), loss (N,) and `weights` (N, P) of the plate's shapes,
    mass-normalised."""

    square: Real
    loss: Real
    weights: Real
    plate: Plate

    def at(self, u: Real, v: Real) -> Real:
        """Displacements (N, points) at u, v (m) from the centre along length and width."""
        return np.asarray(self.weights @ self.plate.shapes(u, v))


def ring_modes(plate: Plate, ring: Ring, load: Load | None = None, count: int = 8) -> PlateModes:
    """The first `count` modes of a plate that lies on a `ring` and carries `load`.

    Minimises the energy of bending (`Plate.curved`) over polynomials (Leissa 1969, eq. 1.9; Ritz
    1909). To this energy comes k/2 ∮ w² ds, to the mass that of the load. Bounce and tilt are
    among the modes: on a line of support they bend the plate. As the ring hardens the plate is
    simply supported on it (Leissa 1969, chapters 2 and 4).
    """
    turn = 2 * np.pi * np.arange(AROUND) / AROUND
    around = plate.shapes(ring.radius * np.cos(turn), ring.radius * np.sin(turn))
    held = ring.stiffness_n_m2 * 2 * np.pi * ring.radius / AROUND * around @ around.T
    mass = plate.mass
    if load is not None:
        shapes = plate.shapes(load.u, load.v)
        mass = mass + (shapes * load.mass) @ shapes.T
    square, vectors = eigh(plate.curved + held, mass, subset_by_index=(0, count - 1))
    weights = vectors.T
    lost = np.einsum(
        "ni,ij,nj->n", weights, plate.material.loss * plate.curved + ring.loss * held, weights
    )
    return PlateModes(square, lost / square, weights, plate)


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
