"""Boxes, tubes and spheres with rigid walls, and resonances of simulated systems."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, eigsh

from ajgdata.gripper.grid import Cells, cut_cells
from ajgdata.gripper.medium import air_fluid
from ajgdata.gripper.solver_plan import wide_weight
from ajgdata.gripper.system import System, assemble
from ajgdata.gripper.walls import NO_WALLS
from ajgdata.studies.energy import symmetric_operator
from ajgdata.studies.extreme_cases import AIR, Heights, Region, time_step

Real = NDArray[np.floating]


def box(width: float, depth: float, height: float, bed: float = 0.0, turn: float = 0.0) -> Region:
    """Return a box on z = 0, centred on the axis and turned by `turn` (rad).

    It has grains below the height `bed`; all lengths are in m.
    """

    def heights(x: Real, y: Real) -> Heights:
        u = x * np.cos(turn) + y * np.sin(turn)
        v = y * np.cos(turn) - x * np.sin(turn)
        inside = (np.abs(u) < width / 2) & (np.abs(v) < depth / 2)
        return 0.0, np.where(inside, height, 0.0), bed

    return Region(heights)


def upright_tube(radius: float, length: float) -> Region:
    """Return a circular tube from z = 0 to z = `length`; lengths in m."""

    def heights(x: Real, y: Real) -> Heights:
        return 0.0, np.where(np.hypot(x, y) < radius, length, 0.0), 0.0

    return Region(heights)


def ball(radius: float) -> Region:
    """Return a sphere around the origin; `radius` in m."""

    def heights(x: Real, y: Real) -> Heights:
        half = np.sqrt(np.clip(radius**2 - x**2 - y**2, 0, None))
        return -half, half, -radius

    return Region(heights)


def closed(
    region: Region,
    h: float,
    half: float,
    bottom: float,
    top: float,
    courant: float = 0.0,
    dtype: type = np.float64,
) -> tuple[Cells, System]:
    """Return the cells and the system of lossless air in rigid walls.

    `half`, `bottom` and `top` are the half width and the heights of the box around the region (m).
    The time step is that of scenes on a grid of `h` (m), or that of a Courant number.
    """
    cells = cut_cells(region, h, half, bottom, top)
    weight = wide_weight(h)
    dt = time_step(h, weight)
    if courant:
        dt = courant * h / (np.sqrt(3) * AIR.sound_speed * (1 + 4 * weight))
    return cells, assemble(cells, air_fluid(AIR), dt, walls=NO_WALLS, dtype=dtype, wide=weight)


def frequencies(system: System, count: int, *, steps_exact: bool = False) -> Real:
    """Return the lowest resonances (Hz), (count,), of a lossless `system`, without the static one.

    With `steps_exact`, the dispersion of the time steps is removed, as from every response.
    """
    squares, _ = _lowest(system, count, with_shapes=False)
    return _hertz(squares, system.dt, steps_exact)


def resonances(system: System, count: int) -> tuple[Real, Real]:
    """Return the lowest resonances (Hz), (count,), and their shapes, (open cells, count).

    The resonances are those of `frequencies` with `steps_exact`. The shapes are orthonormal: the
    pressure times the root of the capacity of the cell.
    """
    squares, shapes = _lowest(system, count, with_shapes=True)
    return _hertz(squares, system.dt, steps_exact=True), shapes


def _lowest(system: System, count: int, *, with_shapes: bool) -> tuple[Real, Real]:
    """Return the smallest eigenvalues of the system in ascending order, and the eigenvectors.

    Lanczos iteration on the symmetric form. The static pressure, which is known exactly, is moved
    to the other end of the spectrum.
    """
    matrix, root = symmetric_operator(system)
    static = root / np.linalg.norm(root)
    deflated = LinearOperator(
        matrix.shape, matvec=lambda x: matrix @ x + 4 * static * (static @ x), dtype=float
    )
    start = np.random.default_rng(0).standard_normal(len(root))
    settings = {"which": "SA", "v0": start, "ncv": 4 * count + 40, "tol": 1e-4}
    if not with_shapes:
        values = eigsh(deflated, count, return_eigenvectors=False, **settings)
        return np.sort(values), np.zeros((len(root), 0))
    values, vectors = eigsh(deflated, count, **settings)
    order = np.argsort(values)
    return values[order], vectors[:, order]


def _hertz(squares: Real, dt: float, steps_exact: bool) -> Real:
    """Return the frequencies (Hz) of eigenvalues 4 sin²(ωΔt/2)."""
    half = np.sqrt(squares) / 2
    omega = 2 / dt * (half if steps_exact else np.arcsin(half))
    return omega / (2 * np.pi)
