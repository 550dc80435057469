"""Bending of plates and of spherical shells.

`ring_modes` computes the modes of a Kirchhoff plate with free edges that lies on a ring of rubber.
`shell_modes` computes the modes of a thin spherical shell that bends and stretches, without a
support and without a load.
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
#: Polynomials along each edge: the first five bending modes are exact to 1e-4.
POLYNOMIALS = 10
#: Points around a ring: sums over them are exact for all products of two polynomials.
AROUND = 4 * POLYNOMIALS


class Ring(NamedTuple):
    """A ring of rubber around the centre: radius (m), stiffness per length (N/m²), loss factor."""

    radius: float
    stiffness_n_m2: float
    loss: float


class Load(NamedTuple):
    """Masses (kg) that move with a plate, at u, v (m) from its centre: three arrays (n,)."""

    u: Real
    v: Real
    mass: Real


@dataclass(frozen=True)
class Plate:
    """A plate with free edges: length, width and thickness in m.

    A round plate fills the ellipse whose axes are the length and the width.
    """

    length: float
    width: float
    thickness: float
    material: Material
    round: bool = False

    @property
    def mass_per_area(self) -> float:
        """Mass per area, kg/m²."""
        return self.material.density_kg_m3 * self.thickness

    @property
    def rigidity(self) -> float:
        """Bending stiffness D = E h³ / 12 (1-ν²), N m."""
        modulus = float(plane_modulus(self.material.young_pa, self.material.poisson))
        return modulus * self.thickness**3 / 12

    @cached_property
    def quadrature(self) -> tuple[Real, Real, Real]:
        """Gauss points u, v (m) and their areas (m²), each (n,): exact for products of shapes."""
        x, weight = legendre.leggauss(2 * POLYNOMIALS)
        if self.round:
            radius = (x[:, None] + 1) / 2
            angle = 2 * np.pi * np.arange(AROUND) / AROUND
            u = radius * np.cos(angle)
            v = radius * np.sin(angle)
            area = weight[:, None] / 8 * radius * (2 * np.pi / AROUND) * np.ones_like(angle)
        else:
            u, v = np.meshgrid(x, x, indexing="ij")
            area = np.outer(weight, weight) / 4
        return (
            u.ravel() * self.length / 2,
            v.ravel() * self.width / 2,
            area.ravel() * self.length * self.width,
        )

    @cached_property
    def degrees(self) -> NDArray[np.int64]:
        """Degrees (2, P) of the P shapes along length and width.

        The sum of both degrees is limited in a round plate, where shapes of higher degrees are not
        distinguishable from the others.
        """
        along, across = np.indices((POLYNOMIALS, POLYNOMIALS)).reshape(2, -1)
        mask = along + across < (POLYNOMIALS if self.round else 2 * POLYNOMIALS)
        return np.stack([along[mask], across[mask]])

    def shapes(self, u: Real, v: Real, d_u: int = 0, d_v: int = 0) -> Real:
        """Return the shapes (P, points) at u, v (m): products of two Legendre polynomials.

        `d_u` and `d_v` are the orders of their derivatives along u and v.
        """
        along = _derivatives(2 * u / self.length, d_u) * (2 / self.length) ** d_u
        across = _derivatives(2 * v / self.width, d_v) * (2 / self.width) ** d_v
        return along[self.degrees[0]] * across[self.degrees[1]]

    @cached_property
    def stiffness(self) -> Real:
        """Stiffness matrix (P, P), N/m: D ∫ (w_uu + w_vv)² - 2(1-ν)(w_uu w_vv - w_uv²) dS."""
        u, v, area = self.quadrature
        uu = self.shapes(u, v, 2, 0)
        vv = self.shapes(u, v, 0, 2)
        uv = self.shapes(u, v, 1, 1)
        nu = self.material.poisson
        mixed = (uu * area) @ vv.T
        bent = (uu * area) @ uu.T + (vv * area) @ vv.T + nu * (mixed + mixed.T)
        return self.rigidity * (bent + 2 * (1 - nu) * (uv * area) @ uv.T)

    @cached_property
    def mass(self) -> Real:
        """Mass matrix (P, P), kg."""
        u, v, area = self.quadrature
        shapes = self.shapes(u, v)
        return np.asarray(self.mass_per_area * (shapes * area) @ shapes.T)


def _derivatives(x: Real, order: int) -> Real:
    """Return the derivatives (POLYNOMIALS, points) of an order of all polynomials at `x`."""
    unit = np.eye(POLYNOMIALS)
    return np.array([legendre.legval(x, legendre.legder(row, order)) for row in unit])


@dataclass(frozen=True)
class PlateModes:
    """Modes of a plate in order of frequency.

    `omega_squared` (N,) in 1/s², loss factor `loss` (N,), and `weights` (N, P) of the plate's
    shapes, mass-normalised.
    """

    omega_squared: Real
    loss: Real
    weights: Real
    plate: Plate

    def at(self, u: Real, v: Real) -> Real:
        """Return displacements (N, points) at u, v (m) from the centre along length and width."""
        return np.asarray(self.weights @ self.plate.shapes(u, v))


def ring_modes(plate: Plate, ring: Ring, load: Load | None = None, count: int = 8) -> PlateModes:
    """Return the first `count` modes of a plate that lies on a `ring` and carries a `load`.

    The method of Ritz (1909) minimises the energy of bending (Leissa 1969, eq. 1.9) over
    polynomials. The ring adds k/2 ∮ w² ds to the energy, and the load adds to the mass. Bounce and
    tilt are among the modes, because they bend a plate that a line supports. If the ring is hard,
    the plate is simply supported on it (Leissa 1969, chapters 2 and 4).
    """
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    on_ring = plate.shapes(ring.radius * np.cos(angle), ring.radius * np.sin(angle))
    support = ring.stiffness_n_m2 * 2 * np.pi * ring.radius / AROUND * on_ring @ on_ring.T
    mass = plate.mass
    if load is not None:
        shapes = plate.shapes(load.u, load.v)
        mass = mass + (shapes * load.mass) @ shapes.T
    omega_squared, vectors = eigh(plate.stiffness + support, mass, subset_by_index=(0, count - 1))
    weights = vectors.T
    damping = plate.material.loss * plate.stiffness + ring.loss * support
    dissipated = np.einsum("ni,ij,nj->n", weights, damping, weights)
    return PlateModes(omega_squared, dissipated / omega_squared, weights, plate)


#: Highest degree of the spherical harmonics; it bends over a fortieth of the circumference.
DEGREES = 20


@dataclass(frozen=True)
class ShellModes:
    """Modes of a shell that are symmetric about one axis, in order of frequency.

    `omega_squared` (N,) in 1/s², loss factor `loss` (N,), `degree` (N,) of the Legendre polynomial,
    and mass-normalised radial displacement at the axis, `radial` (N,).
    """

    omega_squared: Real
    loss: Real
    degree: NDArray[np.int64]
    radial: Real

    def at(self, cosine: Real) -> Real:
        """Return radial displacements (N, points) at the angles arccos(`cosine`) from the axis."""
        legendres = legendre.legvander(np.clip(cosine, -1, 1), DEGREES)
        return self.radial[:, None] * legendres.T[self.degree]


def shell_modes(radius: float, thickness: float, material: Material) -> ShellModes:
    """Return the modes of degree 0 and 2 to DEGREES of a shell of mean `radius` (m).

    With λ = n(n+1), β² = h²/12a² and Ω² = ω²a²ρ(1-ν²)/E, each degree n has two Ω². They are the
    eigenvalues of a matrix for tangential and radial displacement, with trace
    1 + 3ν + λ - β²(1-ν-λ²-νλ) and determinant (λ-2)(1-ν²) + β²[λ³ - 4λ² + λ(5-ν²) - 2(1-ν²)]
    (Junger & Feit, Sound, Structures and their Interaction, 1986, section 7.13; without bending,
    β = 0: Lamb, Proc. London Math. Soc. 14, 1882, 50). Degree 1 is the motion of the whole shell,
    except for one mode far above the others; it is not included.
    """
    nu = material.poisson
    bend = thickness**2 / (12 * radius**2)
    degree = np.array([0, *range(2, DEGREES + 1)])
    lam = degree * (degree + 1.0)
    stretch = nu + lam - 1
    matrix = np.empty((len(degree), 2, 2))
    matrix[:, 0, 0] = (1 + bend) * stretch
    matrix[:, 1, 1] = 2 * (1 + nu) + bend * lam * stretch
    matrix[:, 0, 1] = matrix[:, 1, 0] = np.sqrt(lam) * (bend * stretch + 1 + nu)
    values, vectors = np.linalg.eigh(matrix)
    # Degree 0 has no tangential displacement: its lower eigenvalue, ν - 1, is not a mode.
    is_mode = np.column_stack([degree > 0, degree >= 0])
    scale = plane_modulus(material.young_pa, nu) / (material.density_kg_m3 * radius**2)
    mass = material.density_kg_m3 * 4 * np.pi * radius**2 * thickness
    radial = vectors[:, 1, :] * np.sqrt((2 * degree + 1) / mass)[:, None]
    omega_squared = (values * scale)[is_mode]
    degrees = np.broadcast_to(degree[:, None], is_mode.shape)[is_mode]
    order = np.argsort(omega_squared, kind="stable")
    loss = np.full(len(order), material.loss)
    return ShellModes(omega_squared[order], loss, degrees[order], radial[is_mode][order])
