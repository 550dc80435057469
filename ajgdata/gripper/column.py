"""The stack ground - support - object - membrane - grains under the imprint, as a column of rods.

One-dimensional finite elements: the object with its cross-section, narrowed near the imprint and
near the foot to the cone along which a load spreads, so that a half-space, a slender block and a
sphere on its point all yield as they should; the membrane as a mass between object and grains; the
grains as a solid of modulus M under lateral restraint. Displacements and forces count downwards.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from ajgdata.gripper.materials import Material

Real = NDArray[np.floating]
Complex = NDArray[np.complexfloating]
OBJECT_RODS = 32
GRAIN_RODS = 16


@dataclass(frozen=True)
class Frame:
    """The grains as a solid: density (kg/m³), modulus under lateral restraint (Pa), loss factor."""

    density: float
    modulus_pa: float
    loss: float


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


@dataclass(frozen=True)
class Stack:
    """Matrices of the column: `mass` M, `stiffness` K (N/m) and `damping` ηK; node `contact` is
    the imprint, the nodes above it are grains at the fractions `rise` of their depth."""

    mass: Real
    stiffness: Real
    damping: Real
    contact: int
    rise: Real


@dataclass(frozen=True)
class StackModes:
    """Mass-normalised modes in order of frequency: ω² (N,), loss factor (N,), shapes (N, nodes)
    from the imprint upwards; `flexibility` (m/N) is that of the imprint, all modes together."""

    square: Real
    loss: Real
    shape: Real
    rise: Real
    flexibility: float

    @property
    def residual(self) -> Real:
        """Flexibility of the imprint that remains after 0, 1, 2, … modes (MacNeal 1971)."""
        taken = np.cumsum(self.shape[:, 0] ** 2 / self.square)
        return np.maximum(self.flexibility - np.concatenate([[0.0], taken]), 0.0)


def spread(poisson: float) -> float:
    """Slope at which the cone of a load widens: the mean displacement under a uniform load on a
    circle of a half-space, 16 (1-ν²) p a / (3π E) (Johnson 1985, section 3.4)."""
    return 3 * np.pi / (16 * (1 - poisson**2))


def rod_areas(body: Body, z: Real) -> Real:
    """Area (m²) that carries the load at the heights `z`: the section within both cones."""
    slope = spread(body.material.poisson)
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
    wide = radius * (radius + spread(rubber.poisson) * thickness) * np.pi
    return float(1 / (1 / shape + 1 / bulk) * wide / thickness)


def stack(
    body: Body,
    membrane_kg_m2: float,
    support: tuple[float, float] = (np.inf, 0.0),
    frame: Frame | None = None,
    depth: float = 0.0,
) -> Stack:
    """Assemble the column; `support` is its stiffness (N/m) and loss, `depth` (m) of the grains."""
    rods = _object_rods(body)
    if frame is not None and depth > 0:
        rods = np.concatenate([rods, _grain_rods(frame, body.imprint_m2, depth)])
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
    mass[OBJECT_RODS, OBJECT_RODS] += membrane_kg_m2 * body.imprint_m2
    first = 0
    if np.isinf(support[0]):
        first = 1
    else:
        stiffness[0, 0] += support[0]
        damping[0, 0] += support[0] * support[1]
    keep = slice(first, None)
    rise = np.linspace(0.0, 1.0, nodes - OBJECT_RODS) if nodes > OBJECT_RODS + 1 else np.zeros(1)
    return Stack(
        mass[keep, keep], stiffness[keep, keep], damping[keep, keep], OBJECT_RODS - first, rise
    )


def _object_rods(body: Body) -> Real:
    """Spring (N/m), loss and mass (kg) of each element from the foot up."""
    step = body.height / OBJECT_RODS
    # Three points of Gauss in each element resolve the cones.
    nodes, weights = np.polynomial.legendre.leggauss(3)
    z = (np.arange(OBJECT_RODS)[:, None] + (nodes + 1) / 2) * step
    flexibility = (weights / 2 / rod_areas(body, z)).sum(1) * step / body.material.young_pa
    weight = (weights / 2 * body.section(z)).sum(1) * step * body.material.density_kg_m3
    return np.stack([1 / flexibility, np.full(OBJECT_RODS, body.material.loss), weight], axis=1)


def _grain_rods(frame: Frame, area: float, depth: float) -> Real:
    step = depth / GRAIN_RODS
    rod = (frame.modulus_pa * area / step, frame.loss, frame.density * area * step)
    return np.tile(rod, (GRAIN_RODS, 1))


def solve(column: Stack) -> StackModes:
    """All modes of the column; each has the loss of its strain energy (Johnson & Kienholz 1982)."""
    square, vectors = eigh(column.stiffness, column.mass)
    shape = vectors.T
    loss = np.einsum("ni,ij,nj->n", shape, column.damping, shape) / square
    seen = shape[:, column.contact :]
    flexibility = float(np.sum(seen[:, 0] ** 2 / square))
    return StackModes(square, loss, seen, column.rise, flexibility)
