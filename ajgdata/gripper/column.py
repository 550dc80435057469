"""The column under the imprint: ground, support, object, membrane and grains as a chain of rods.

The object yields in two parts. Its skin is as deep as the imprint is wide, or as the object is
high. It yields point by point: a locally reacting wall. The core below the skin carries the load of
the whole imprint: one-dimensional finite elements with the object's cross-section. Near the imprint
and near the foot, only the cone along which a load spreads carries the load. The stiffness is then
right for a half-space, a slender block, a thin layer and a sphere that stands on its lowest point.

With the frame of the grains, a seat and the grains are on top. The grains are a solid of modulus M
under lateral restraint. Displacements and forces are positive downwards.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray
from scipy.linalg import eigh

from ajgdata.gripper.bending import PlateModes
from ajgdata.gripper.contact import Frame, Spring
from ajgdata.gripper.objects import Material

Real = NDArray[np.floating]
#: Elements of the object's core, of its skin, and of the grains.
OBJECT_RODS = 32
SKIN_RODS = 8
GRAIN_RODS = 16


@dataclass(frozen=True)
class Body:
    """A solid of `height` (m) whose cross-section (m²) at a height (m) over its foot is `section`.

    It stands on `foot_m2`, and a load on `imprint_m2` presses it from above.
    """

    material: Material
    height: float
    section: Callable[[Real], Real]
    foot_m2: float
    imprint_m2: float

    @property
    def imprint_radius(self) -> float:
        """Radius of a circle with the area of the imprint, m."""
        return float(np.sqrt(self.imprint_m2 / np.pi))

    @property
    def core(self) -> float:
        """Height of the core below the skin, m; never quite zero, so that a column remains."""
        return max(self.height - self.imprint_radius, 1e-3 * self.height)

    @property
    def skin_flexibility(self) -> float:
        """Flexibility of the skin, m/Pa."""
        flexibility, _ = _rods(self, self.core, self.height, SKIN_RODS)
        return float(flexibility.sum()) * self.imprint_m2


@dataclass(frozen=True)
class Bed:
    """The grains over an imprint: frame, the seat between them and the object, depth (m)."""

    frame: Frame
    seat: Spring
    depth: float


@dataclass(frozen=True)
class Stack:
    """Matrices of the column: `mass` M (kg), `stiffness` K (N/m) and `damping` ηK (N/m).

    The node `contact` is the imprint; the nodes above it are the grains from seat to surface.
    """

    mass: Real
    stiffness: Real
    damping: Real
    contact: int


@dataclass(frozen=True)
class StackModes:
    """Mass-normalised modes of the column, in order of frequency.

    `omega_squared` (N,) in 1/s², loss factor `loss` (N,), and `shapes` (N, nodes): the displacement
    at the imprint, then in the grains from seat to surface if there are any. If the object bends,
    the displacement at the imprint is a mean, and `column_shapes` (N, columns) has the displacement
    in each column of the imprint.
    """

    omega_squared: Real
    loss: Real
    shapes: Real
    column_shapes: Real | None = None


class Skin(NamedTuple):
    """A locally reacting surface, per area: mass (kg/m²), resistance (Pa s/m), stiffness (N/m³)."""

    mass: float
    resistance: float
    stiffness: float


def skin(body: Body, membrane_kg_m2: float) -> Skin:
    """Return the skin of an object with the mass of the membrane (kg/m²) on it.

    A third of the skin's mass moves with its surface (Rayleigh). In addition to the material's
    loss, waves radiate downwards as into a cone, whose dashpot is ρc (Meek & Wolf, J. Geotech. Eng.
    118, 1992); the share of the core in the height weighs this radiation.
    """
    material = body.material
    stiffness = 1 / body.skin_flexibility
    mass = membrane_kg_m2 + material.density_kg_m3 * (body.height - body.core) / 3
    wave = np.sqrt(material.density_kg_m3 * material.young_pa)
    inner = material.loss * np.sqrt(stiffness * mass)
    return Skin(mass, float(inner + wave * body.core / body.height), stiffness)


def stack(
    body: Body,
    membrane_kg_m2: float,
    support: tuple[float, float] = (np.inf, 0.0),
    bed: Bed | None = None,
) -> Stack:
    """Assemble the column of `body` and `bed`; `support` is the stiffness (N/m) and loss factor of
    the support of the body."""
    support_stiffness, support_loss = support
    flexibility, weight = _rods(body, 0.0, body.core, OBJECT_RODS)
    rods = np.stack([1 / flexibility, np.full(OBJECT_RODS, body.material.loss), weight], axis=1)
    if bed is not None:
        rods = np.concatenate([rods, _grain_rods(bed, body)])
    mass, stiffness, damping = _chain(rods)
    _, cap = _rods(body, body.core, body.height, SKIN_RODS)
    mass[OBJECT_RODS, OBJECT_RODS] += membrane_kg_m2 * body.imprint_m2 + cap.sum()
    if np.isinf(support_stiffness):
        first = 1  # the foot does not move
    else:
        first = 0
        stiffness[0, 0] += support_stiffness
        damping[0, 0] += support_stiffness * support_loss
    free = slice(first, None)
    return Stack(mass[free, free], stiffness[free, free], damping[free, free], OBJECT_RODS - first)


def grain_stack(body: Body, bed: Bed) -> Stack:
    """Assemble only the grains on their seat; the first node is the imprint, which moves freely."""
    return Stack(*_chain(_grain_rods(bed, body)), contact=0)


def _chain(rods: Real) -> tuple[Real, Real, Real]:
    """Return mass, stiffness and damping (n + 1, n + 1) of a chain of rods (n, 3): spring (N/m),
    loss factor and mass (kg)."""
    spring, loss, weight = rods.T
    nodes = len(rods) + 1
    mass, stiffness, damping = np.zeros((3, nodes, nodes))
    lower = np.arange(nodes - 1)
    upper = np.arange(1, nodes)
    for matrix, diagonal, off_diagonal in (
        (stiffness, spring, -spring),
        (damping, loss * spring, -loss * spring),
        (mass, weight / 3, weight / 6),
    ):
        matrix[lower, lower] += diagonal
        matrix[upper, upper] += diagonal
        matrix[lower, upper] = matrix[upper, lower] = off_diagonal
    return mass, stiffness, damping


def _grain_rods(bed: Bed, body: Body) -> Real:
    """Return the rods (1 + GRAIN_RODS, 3) of the seat, in series with the skin, and of the grains:
    spring (N/m), loss factor and mass (kg)."""
    area = body.imprint_m2
    step = bed.depth / GRAIN_RODS
    frame = bed.frame
    seat = bed.seat
    rod = (frame.modulus_pa * area / step, frame.loss, frame.density * area * step)
    flexibility = 1 / seat.stiffness_n_m3 + body.skin_flexibility
    loss = seat.loss / seat.stiffness_n_m3 + body.material.loss * body.skin_flexibility
    return np.array([(area / flexibility, loss / flexibility, 0.0), *[rod] * GRAIN_RODS])


def _rods(body: Body, low: float, high: float, count: int) -> tuple[Real, Real]:
    """Return flexibility (m/N) and mass (kg) of `count` equal elements from `low` to `high` (m).

    Between parts of a compound that do not touch, the section is empty. The area that carries the
    load then also has the mass, because nodes without mass would have no frequency.
    """
    step = (high - low) / count
    # Three Gauss points in each element resolve the cones.
    nodes, weights = leggauss(3)
    z = low + (np.arange(count)[:, None] + (nodes + 1) / 2) * step
    carrying = rod_areas(body, z)
    section = body.section(z)
    flexibility = (weights / 2 / carrying).sum(1) * step / body.material.young_pa
    solid = np.where(section > 0, section, carrying)
    mass = (weights / 2 * solid).sum(1) * step * body.material.density_kg_m3
    return flexibility, mass


def rod_areas(body: Body, z: Real) -> Real:
    """Return the area (m²) that carries the load at the heights `z` (m), of the shape of `z`: the
    section within both cones."""
    slope = cone_slope(body.material.poisson)
    depth = body.height - z
    upper = np.pi * (np.sqrt(body.imprint_m2 / np.pi) + slope * depth) ** 2
    lower = np.pi * (np.sqrt(body.foot_m2 / np.pi) + slope * z) ** 2
    least = np.where(z > body.height / 2, body.imprint_m2, body.foot_m2)
    return np.minimum(np.minimum(upper, lower), np.maximum(body.section(z), least))


def cone_slope(poisson: float) -> float:
    """Return the slope of the cone along which a load spreads.

    Its rod yields as a half-space under a uniform load on a circle, whose mean displacement is
    16 (1-ν²) p a / (3π E) (Johnson 1985, section 3.4).
    """
    return 3 * np.pi / (16 * (1 - poisson**2))


def solve(column: Stack) -> StackModes:
    """Return all modes of the column; each has the loss of its strain energy (Johnson & Kienholz
    1982)."""
    omega_squared, vectors = _eigenmodes(column.stiffness, column.mass)
    shapes = vectors.T
    loss = _energy(column.damping, shapes) / _energy(column.stiffness, shapes)
    return StackModes(omega_squared, loss, shapes[:, column.contact :])


def _eigenmodes(stiffness: Real, mass: Real) -> tuple[Real, Real]:
    """Return ω² (N,) and the mass-normalised vectors (nodes, N) of all modes."""
    omega_squared, vectors = eigh(stiffness, mass)
    # The lowest ω² of heavy, soft columns can be below the rounding error, and even negative.
    return np.maximum(omega_squared, np.finfo(float).eps * omega_squared[-1]), vectors


def _energy(matrix: Real, shapes: Real) -> Real:
    """Return twice the strain energy (N,) of shapes (N, nodes) in a chain of springs.

    The sum is over springs and not over elements of the matrix: rounding errors of stiff springs
    that hardly move would hide the energy of soft ones.
    """
    springs = -np.diag(matrix, 1)
    ground = matrix[0, 0] - springs[0] if len(springs) else matrix[0, 0]
    return ground * shapes[:, 0] ** 2 + (springs * np.diff(shapes, axis=1) ** 2).sum(1)


def bent_modes(
    modes: PlateModes, shapes: Real, area: Real, body: Body, bed: Bed | None
) -> StackModes:
    """Return the modes of a plate on a rim, and of the grains on it if there is a `bed`.

    A plate that a line supports bends as it bounces, so its own modes (`bending.ring_modes`)
    replace the column below the imprint. `shapes` (N, columns) are the modes of the plate in the
    columns of the imprint, of `area` (m², (columns,)). In its modal coordinates, the plate has unit
    masses and the springs ω². The grains move with the mean displacement of the imprint.
    """
    mean = shapes @ area / area.sum()
    if bed is None:
        return StackModes(modes.omega_squared, modes.loss, mean[:, None], shapes)
    grains = grain_stack(body, bed)
    count = len(modes.omega_squared)
    joined = np.zeros((len(grains.mass), count + len(grains.mass) - 1))
    joined[0, :count] = mean
    joined[1:, count:] = np.eye(len(grains.mass) - 1)

    def combined(of_grains: Real, of_plate: Real) -> Real:
        """Return a matrix of the grains plus a diagonal of the plate, in common coordinates."""
        padded = np.pad(of_plate, (0, len(of_grains) - 1))
        return joined.T @ of_grains @ joined + np.diag(padded)

    mass = combined(grains.mass, np.ones(count))
    stiffness = combined(grains.stiffness, modes.omega_squared)
    damping = combined(grains.damping, modes.loss * modes.omega_squared)
    omega_squared, vectors = _eigenmodes(stiffness, mass)
    loss = np.einsum("in,ij,jn->n", vectors, damping, vectors) / omega_squared
    column_shapes = vectors[:count].T @ shapes
    return StackModes(omega_squared, loss, (joined @ vectors).T, column_shapes)
