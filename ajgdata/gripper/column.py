"""The stack ground - support - object - membrane - grains under the imprint, as a column of rods.

The object yields in two ways. Its skin, as deep as the imprint is wide or as the object is high,
yields point by point: a locally reacting wall. What is below carries the load of the whole imprint
as one-dimensional finite elements with the object's cross-section. Both are narrowed near imprint
and foot to the cone along which a load spreads, so that together a half-space, a slender block, a
thin layer and a sphere on its point all yield as they should. With the grains' frame, a seat and
the grains, a solid of modulus M under lateral restraint, stand on top. Displacements and forces
count downwards.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray
from scipy.linalg import eigh

from ajgdata.gripper.bending import PlateModes
from ajgdata.gripper.contact import Frame, Spring
from ajgdata.gripper.objects import Material

Real = NDArray[np.floating]
Complex = NDArray[np.complexfloating]
OBJECT_RODS = 32
GRAIN_RODS = 16


@dataclass(frozen=True)
class Body:
    """A solid of `height` (m) whose cross-section (m²) at a height over its foot is `section`.

    It stands on `foot_m2`; a load on `imprint_m2` presses it from above.
    """

    material: Material
    height: float
    section: Callable[[Real], Real]
    foot_m2: float
    imprint_m2: float

    @property
    def imprint_radius(self) -> float:
        """Radius of a circle of the same area, m."""
        return float(np.sqrt(self.imprint_m2 / np.pi))

    @property
    def core(self) -> float:
        """Height of what lies below the skin, m; never quite zero, so that a column remains."""
        return max(self.height - self.imprint_radius, 1e-3 * self.height)

    @property
    def skin_flexibility(self) -> float:
        """Flexibility of the skin, m/Pa."""
        flexibility, _ = _rods(self, self.core, self.height, 8)
        return float(flexibility.sum()) * self.imprint_m2


@dataclass(frozen=True)
class Bed:
    """The grains over an imprint: frame, the seat between them and the object, depth (m)."""

    frame: Frame
    seat: Spring
    depth: float


@dataclass(frozen=True)
class Stack:
    """Matrices of the column: `mass` M, `stiffness` K (N/m) and `damping` ηK; node `contact` is
    the imprint, the nodes above it are the grains from their seat to their surface."""

    mass: Real
    stiffness: Real
    damping: Real
    contact: int


@dataclass(frozen=True)
class StackModes:
    """Mass-normalised modes in order of frequency: ω² (N,), loss factor (N,), shapes (N, nodes),
    first at the imprint, then in the grains from their seat to their surface, if there are any.
    Where the object bends, `foot` (N, columns) is the displacement under each column of the imprint
    and the first of `shape` its mean."""

    square: Real
    loss: Real
    shape: Real
    foot: Real | None = None


def cone_slope(poisson: float) -> float:
    """Slope at which the cone of a load widens: the mean displacement under a uniform load on a
    circle of a half-space, 16 (1-ν²) p a / (3π E) (Johnson 1985, section 3.4)."""
    return 3 * np.pi / (16 * (1 - poisson**2))


def rod_areas(body: Body, z: Real) -> Real:
    """Area (m²) that carries the load at the heights `z` (m), of its shape: the section within both
    cones."""
    slope = cone_slope(body.material.poisson)
    depth = body.height - z
    upper = np.pi * (np.sqrt(body.imprint_m2 / np.pi) + slope * depth) ** 2
    lower = np.pi * (np.sqrt(body.foot_m2 / np.pi) + slope * z) ** 2
    least = np.where(z > body.height / 2, body.imprint_m2, body.foot_m2)
    return np.minimum(np.minimum(upper, lower), np.maximum(body.section(z), least))


def pad_stiffness(rubber: Material, thickness: float, foot_m2: float) -> float:
    """Stiffness (N/m) of a bonded sheet of rubber under a foot; infinite without a sheet.

    E (1 + 2S²) with the shape factor S = a/2t of a disc, in series with the bulk (Gent & Lindley,
    Proc. Inst. Mech. Eng. 173, 1959); under a small foot the load spreads in a cone.
    """
    if thickness == 0:
        return np.inf
    radius = np.sqrt(foot_m2 / np.pi)
    shape = rubber.young_pa * (1 + 2 * (radius / (2 * thickness)) ** 2)
    bulk = rubber.young_pa / (3 * (1 - 2 * rubber.poisson))
    wide = radius * (radius + cone_slope(rubber.poisson) * thickness) * np.pi
    return float(1 / (1 / shape + 1 / bulk) * wide / thickness)


def skin(body: Body, membrane_kg_m2: float) -> tuple[float, float, float]:
    """Mass, resistance and stiffness per area of the skin with the membrane on it.

    A third of the skin's mass moves with its surface (Rayleigh). Besides the material's loss,
    waves leave downwards as into a cone, whose dashpot is ρc (Meek & Wolf, J. Geotech. Eng. 118,
    1992), as far as there is more than skin.
    """
    material = body.material
    stiffness = 1 / body.skin_flexibility
    mass = membrane_kg_m2 + material.density_kg_m3 * (body.height - body.core) / 3
    wave = np.sqrt(material.density_kg_m3 * material.young_pa)
    inner = material.loss * np.sqrt(stiffness * mass)
    return mass, float(inner + wave * body.core / body.height), stiffness


def stack(
    body: Body,
    membrane_kg_m2: float,
    support: tuple[float, float] = (np.inf, 0.0),
    bed: Bed | None = None,
) -> Stack:
    """Assemble the column; `support` is the stiffness (N/m) and loss of what it stands on."""
    flexibility, weight = _rods(body, 0.0, body.core, OBJECT_RODS)
    rods = np.stack([1 / flexibility, np.full(OBJECT_RODS, body.material.loss), weight], axis=1)
    if bed is not None:
        rods = np.concatenate([rods, _grain_rods(bed, body)])
    mass, stiffness, damping = _chain(rods)
    _, cap = _rods(body, body.core, body.height, 8)
    mass[OBJECT_RODS, OBJECT_RODS] += membrane_kg_m2 * body.imprint_m2 + cap.sum()
    first = 1 if np.isinf(support[0]) else 0
    if not first:
        stiffness[0, 0] += support[0]
        damping[0, 0] += support[0] * support[1]
    free = slice(first, None)
    return Stack(mass[free, free], stiffness[free, free], damping[free, free], OBJECT_RODS - first)


def grain_stack(body: Body, bed: Bed) -> Stack:
    """Assemble the grains on their seat alone; the first node is the imprint, and free."""
    return Stack(*_chain(_grain_rods(bed, body)), contact=0)


def _chain(rods: Real) -> tuple[Real, Real, Real]:
    """Mass, stiffness and damping of rods (n, 3) of spring, loss and mass, one on another."""
    spring, loss, weight = rods.T
    nodes = len(rods) + 1
    mass, stiffness, damping = np.zeros((3, nodes, nodes))
    lower, upper = np.arange(nodes - 1), np.arange(1, nodes)
    for matrix, value, across in (
        (stiffness, spring, -spring),
        (damping, loss * spring, -loss * spring),
        (mass, weight / 3, weight / 6),
    ):
        matrix[lower, lower] += value
        matrix[upper, upper] += value
        matrix[lower, upper] = matrix[upper, lower] = across
    return mass, stiffness, damping


def _rods(body: Body, low: float, high: float, count: int) -> tuple[Real, Real]:
    """Flexibility (m/N) and mass (kg) of `count` equal elements from `low` to `high` (m).

    Between parts of a compound that do not touch there is no section: what carries the load there
    has its mass, or nodes without any would have no frequency.
    """
    step = (high - low) / count
    # Three points of Gauss in each element resolve the cones.
    nodes, weights = leggauss(3)
    z = low + (np.arange(count)[:, None] + (nodes + 1) / 2) * step
    carrying, section = rod_areas(body, z), body.section(z)
    flexibility = (weights / 2 / carrying).sum(1) * step / body.material.young_pa
    solid = np.where(section > 0, section, carrying)
    mass = (weights / 2 * solid).sum(1) * step * body.material.density_kg_m3
    return flexibility, mass


def _grain_rods(bed: Bed, body: Body) -> Real:
    """The seat, in series with the skin under it, and the grains: spring, loss, mass."""
    area, step = body.imprint_m2, bed.depth / GRAIN_RODS
    frame, seat = bed.frame, bed.seat
    rod = (frame.modulus_pa * area / step, frame.loss, frame.density * area * step)
    give = 1 / seat.stiffness_n_m3 + body.skin_flexibility
    loss = seat.loss / seat.stiffness_n_m3 + body.material.loss * body.skin_flexibility
    return np.array([(area / give, loss / give, 0.0), *[rod] * GRAIN_RODS])


def solve(column: Stack) -> StackModes:
    """Return all modes of the column; each has the loss of its strain energy (Johnson & Kienholz
    1982)."""
    square, vectors = eigh(column.stiffness, column.mass)
    # What is as heavy as it is soft has frequencies that drown in rounding, below zero too.
    square, shape = np.maximum(square, np.finfo(float).eps * square[-1]), vectors.T
    loss = _energy(column.damping, shape) / _energy(column.stiffness, shape)
    return StackModes(square, loss, shape[:, column.contact :])


def _energy(matrix: Real, shape: Real) -> Real:
    """Twice the strain energy (N,) of `shape` in a chain of springs, summed spring by spring, so
    that stiff springs that hardly move do not drown the soft ones."""
    springs = -np.diag(matrix, 1)
    ground = matrix[0, 0] - springs[0] if len(springs) else matrix[0, 0]
    return ground * shape[:, 0] ** 2 + (springs * np.diff(shape, axis=1) ** 2).sum(1)


def bent_modes(
    modes: PlateModes, shapes: Real, area: Real, body: Body, bed: Bed | None
) -> StackModes:
    """Return the modes of a plate on a rim, and of the grains on it if there is a `bed`.

    On a line of support a plate bends as it bounces: its own modes (`bending.ring_modes`) stand in
    for the column below the imprint.

    `shapes` (N, columns) are the plate's over the columns of the imprint, of `area` (m²). In its
    modal coordinates the plate has unit masses and the springs ω²; the imprint moves by the mean of
    the shapes, through which the grains are joined to it.
    """
    mean = shapes @ area / area.sum()
    if bed is None:
        return StackModes(modes.square, modes.loss, mean[:, None], shapes)
    grains, count = grain_stack(body, bed), len(modes.square)
    joined = np.zeros((len(grains.mass), count + len(grains.mass) - 1))
    joined[0, :count] = mean
    joined[1:, count:] = np.eye(len(grains.mass) - 1)
    mass, stiffness, damping = (
        joined.T @ matrix @ joined + np.diag(np.pad(of_plate, (0, len(matrix) - 1)))
        for matrix, of_plate in (
            (grains.mass, np.ones(count)),
            (grains.stiffness, modes.square),
            (grains.damping, modes.loss * modes.square),
        )
    )
    square, vectors = eigh(stiffness, mass)
    square = np.maximum(square, np.finfo(float).eps * square[-1])
    loss = np.einsum("in,ij,jn->n", vectors, damping, vectors) / square
    return StackModes(square, loss, (joined @ vectors).T, vectors[:count].T @ shapes)
