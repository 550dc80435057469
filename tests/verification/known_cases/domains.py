"""Boxes and a lossy bowl that the known cases march, and the resonances of a system."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, eigsh

from ajgdata.gripper.grid import Cells, cut_cells
from ajgdata.gripper.medium import air_fluid, fit_fluid
from ajgdata.gripper.solver_plan import wide_weight
from ajgdata.gripper.system import Packed, System, assemble
from ajgdata.gripper.walls import NO_WALLS, WallList
from ajgdata.studies.energy import symmetric_operator
from ajgdata.studies.extreme_cases import AIR, BOWL, PLASTIC, Heights, Region, bowl, time_step

Real = NDArray[np.floating]


def box(width: float, depth: float, height: float, bed: float = 0.0, turn: float = 0.0) -> Region:
    """A box standing on z = 0, centred on the axis, turned by `turn` (rad), grains below `bed`."""

    def heights(x: Real, y: Real) -> Heights:
        u, v = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
        inside = (np.abs(u) < width / 2) & (np.abs(v) < depth / 2)
        return 0.0, np.where(inside, height, 0.0), bed

    return Region(heights)


def lossy_bowl(h: float, dtype: type = np.float64) -> System:
    """Grains with varying packing, light, stiff, heavy and resistive walls."""
    cells = cut_cells(bowl(), h, *BOWL)
    ratio = 1 + 0.1 * np.sin(np.arange(np.prod(cells.shape))).reshape(cells.shape)
    walls = (
        WallList.uniform(cells.membrane, 0.3, 450.0, 1e5)
        + WallList.uniform(cells.membrane, 1e-4, 0.0, 1e9)
        + WallList.uniform(cells.housing, 0.0, 2e5, 0.0)
    )
    grains = Packed(fit_fluid(PLASTIC, AIR), PLASTIC.porosity, ratio)
    weight = wide_weight(h)
    return assemble(cells, air_fluid(AIR), time_step(h, weight), grains, walls, dtype, wide=weight)


def closed(
    region: Region,
    h: float,
    half: float,
    bottom: float,
    top: float,
    courant: float = 0.0,
    dtype: type = np.float64,
) -> tuple[Cells, System]:
    """Lossless air in rigid walls, at the usual time step or at a fraction of the largest."""
    cells = cut_cells(region, h, half, bottom, top)
    weight = wide_weight(h)
    dt = time_step(h, weight)
    if courant:
        dt = courant * h / (np.sqrt(3) * AIR.sound_speed * (1 + 4 * weight))
    return cells, assemble(cells, air_fluid(AIR), dt, walls=NO_WALLS, dtype=dtype, wide=weight)


def frequencies(system: System, count: int, *, steps_exact: bool = False) -> Real:
    """Return the lowest resonances (Hz), (count,), of the lossless `system` as marched, but the
    static one; with `steps_exact`, as heard where the dispersion of the time steps is taken out of
    the response.

    Lanczos on the symmetric form of what is marched, in which the static pressure, known exactly,
    is moved to the other end of the spectrum.
    """
    matrix, root = symmetric_operator(system)
    static = root / np.linalg.norm(root)
    deflated = LinearOperator(
        matrix.shape, matvec=lambda x: matrix @ x + 4 * static * (static @ x), dtype=float
    )
    start = np.random.default_rng(0).standard_normal(len(root))
    squares = eigsh(
        deflated, count, which="SA", v0=start, ncv=4 * count + 40, tol=1e-4,
        return_eigenvectors=False,
    )  # fmt: skip
    half = np.sqrt(np.sort(squares)) / 2
    omega = 2 / system.dt * (half if steps_exact else np.arcsin(half))
    return omega / (2 * np.pi)
