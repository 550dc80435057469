"""Objects as the membrane sees them: heights over the table, with the membrane draped over.

A membrane of tension T that a pressure p presses down has the height w, with
T ∇·(∇w/√(1+|∇w|²)) = p where it touches nothing, and w = the obstacle elsewhere (Laplace 1806;
obstacle problem, Kinderlehrer & Stampacchia 1980). Next to a straight edge it is a cylinder of
radius T/p, over a round hole a sphere of radius 2T/p.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ajgdata.gripper.objects import (
    MM,
    Box,
    Compound,
    Cube,
    Cylinder,
    Ellipsoid,
    Object,
    Rod,
    Sphere,
)
from ajgdata.gripper.scene import Scene

Real = NDArray[np.floating]
#: Coarsest first; each level begins with the one before, and ends nearer to the solution.
LEVELS = (8, 4, 2, 1)
#: Sweeps on each level, and between two looks at the slopes.
SWEEPS = {8: 80, 4: 60, 2: 60, 1: 16}
LOOK = 4
#: Of successive over-relaxation (Young 1954), for gaps of some 20 samples.
OMEGA = 1.7


def bridged(obstacle: Real, step: float, radius: float) -> Real:
    """Return the height (ny, nx) in m of a membrane over `obstacle`, of its shape and unit.

    `step` (m) is the distance of samples, `radius` T/p in m. At the border the membrane is level
    across it. A fixed number of sweeps: the height follows the obstacle without jumps.
    """
    height: Real = np.zeros((1, 1))
    for coarser in LEVELS:
        below = np.ascontiguousarray(obstacle[::coarser, ::coarser])
        first = height.size == 1
        height = below.copy() if first else np.maximum(_finer(height, below.shape), below)
        wide = coarser * step
        _relax(height, below, wide**2 / radius, wide, SWEEPS[coarser])
    return height


def _finer(height: Real, shape: tuple[int, int]) -> Real:
    """The heights at every second sample, filled in between them by the mean."""
    fine = np.repeat(np.repeat(height, 2, axis=0), 2, axis=1)
    fine[1:-1:2] = (fine[1:-1:2] + fine[2::2]) / 2
    fine[:, 1:-1:2] = (fine[:, 1:-1:2] + fine[:, 2::2]) / 2
    return fine[: shape[0], : shape[1]]


# By numpy's rules of division, because Python's test for zero would keep loops from vectorising.
@njit(nogil=True, cache=True, error_model="numpy")
def _slack(height, step, right, down):
    """1/√(1+|∇w|²) in the inner faces: right (rows, columns + 1) of samples j - 1 and j, and down
    (rows + 1, columns) of i - 1 and i; the border's stay 0."""
    rows, columns = height.shape
    square = step * step
    for i in range(rows):
        above, below = max(i - 1, 0), min(i + 1, rows - 1)
        for j in range(columns - 1):
            along = height[i, j + 1] - height[i, j]
            across = height[below, j] + height[below, j + 1] - height[above, j]
            across = (across - height[above, j + 1]) / 4
            right[i, j + 1] = 1 / np.sqrt(1 + (along * along + across * across) / square)
    for i in range(rows - 1):
        down[i + 1, 0] = _slack_below(height, i, 0, 0, 1, square)
        down[i + 1, columns - 1] = _slack_below(
            height, i, columns - 1, columns - 2, columns - 1, square
        )
        for j in range(1, columns - 1):
            down[i + 1, j] = _slack_below(height, i, j, j - 1, j + 1, square)


@njit(nogil=True, cache=True, error_model="numpy")
def _slack_below(height, i, j, left, beyond, square):
    along = height[i + 1, j] - height[i, j]
    across = height[i, beyond] + height[i + 1, beyond] - height[i, left]
    across = (across - height[i + 1, left]) / 4
    return 1 / np.sqrt(1 + (along * along + across * across) / square)


@njit(nogil=True, cache=True, error_model="numpy")
def _relax(height, obstacle, load, step, sweeps):
    """Projected over-relaxation in place, red samples before black ones.

    A row's samples are computed whatever their colour, which vectorises, and every second is kept.
    """
    rows, columns = height.shape
    right, down = np.zeros((rows, columns + 1)), np.zeros((rows + 1, columns))
    share, balanced = np.zeros((rows, columns)), np.zeros(columns)
    for sweep in range(sweeps):
        if sweep % LOOK == 0:
            _slack(height, step, right, down)
            for i in range(rows):
                for j in range(columns):
                    share[i, j] = OMEGA / (
                        right[i, j] + right[i, j + 1] + down[i, j] + down[i + 1, j]
                    )
        for colour in range(2):
            for i in range(rows):
                _balance(height, right, down, share, load, i, balanced)
                for j in range((i + colour) % 2, columns, 2):
                    height[i, j] = max(balanced[j], obstacle[i, j])


@njit(nogil=True, cache=True)
def _balance(height, right, down, share, load, i, balanced):
    """Height to which each sample of row `i` would go; faces of the border pull nothing."""
    rows, columns = height.shape
    above, below = max(i - 1, 0), min(i + 1, rows - 1)
    for j in (0, columns - 1):
        left, beyond = max(j - 1, 0), min(j + 1, columns - 1)
        balanced[j] = _pulled(height, right, down, share, load, i, j, above, below, left, beyond)
    for j in range(1, columns - 1):
        balanced[j] = _pulled(height, right, down, share, load, i, j, above, below, j - 1, j + 1)


@njit(nogil=True, cache=True)
def _pulled(height, right, down, share, load, i, j, above, below, left, beyond):
    # Differences and not heights, so that what is level stays level to the last bit.
    here = height[i, j]
    pull = right[i, j] * (height[i, left] - here) + right[i, j + 1] * (height[i, beyond] - here)
    pull += down[i, j] * (height[above, j] - here) + down[i + 1, j] * (height[below, j] - here)
    return here + share[i, j] * (pull - load)


RASTER_M = 0.5e-3
#: A membrane of 0.3 mm this near is as good as on the object: the air below is far stiffer than it.
LYING_M = RASTER_M / 4
#: Slope of the steepest wall that the raster holds: what stands upright leans by 85° instead.
STEEPEST = float(np.tan(np.deg2rad(85.0)))


@dataclass(frozen=True)
class Relief:
    """An object on the table: `height` falls off steeply next to it, below the table as well;
    `inside` is its footprint with antialiased edges."""

    height: Real
    inside: Real


@dataclass(frozen=True)
class Draped(Relief):
    """A relief as the membrane sees it: `touching` is the part of the footprint where the membrane
    lies on the object, `adjacent` the part of the table that the membrane reaches."""

    touching: Real
    adjacent: Real


def relief(scene: Scene, x: Real, y: Real) -> Relief:
    """Return the relief of the scene's object on the grid x, y (m), both (ny, nx)."""
    shape, grasp = scene.object, scene.grasp
    assert shape is not None
    placed = (grasp.offset_x_mm * MM, grasp.offset_y_mm * MM, grasp.angle_deg)
    parts = list(_parts(shape, *_turned(x, y, *placed)))
    height = np.max([top for top, _ in parts], axis=0)
    return Relief(height, np.max([inside for _, inside in parts], axis=0))


def draped(bare: Relief, radius: float) -> Draped:
    """Return the relief with a membrane of bending `radius` T/p (m) draped over it and the table.

    It lies where it is less than LYING_M off, gradually, so that no edge of contact jumps.
    """
    ground = np.maximum(bare.height, 0)
    height = bridged(ground, RASTER_M, radius)
    lying = np.clip(1 - (height - ground) / LYING_M, 0, 1)
    table = np.clip(0.5 - bare.height / RASTER_M, 0, 1)
    return Draped(height, bare.inside, bare.inside * lying, table * lying)


def _turned(x: Real, y: Real, x0: float, y0: float, angle_deg: float) -> tuple[Real, Real]:
    """Coordinates in a frame at x0, y0, turned by an angle."""
    turn = np.deg2rad(angle_deg)
    px, py = x - x0, y - y0
    return px * np.cos(turn) + py * np.sin(turn), py * np.cos(turn) - px * np.sin(turn)


def _parts(shape: Object, u: Real, v: Real) -> Iterator[tuple[Real, Real]]:
    """Top over the table and footprint of each primitive."""
    if not isinstance(shape, Compound):
        yield _top(shape, u, v)
        return
    for part in shape.parts:
        local = _turned(u, v, part.x_mm * MM, part.y_mm * MM, part.angle_deg)
        top, inside = _top(part.shape, *local)
        yield top + part.lift_mm * MM, inside


def _top(shape: Object, u: Real, v: Real) -> tuple[Real, Real]:
    """Top of a primitive over its underside, and its antialiased footprint.

    Outside the footprint the height falls off by STEEPEST, without a jump at the edge.
    """
    length, width, height = (size * MM for size in shape.size_mm)
    match shape:
        case Cube() | Box():
            outside = _box_distance(u, v, length, width)
            top = np.full_like(u, height)
        case Cylinder():
            outside = np.hypot(u, v) - length / 2
            top = np.full_like(u, height)
        case Rod():
            outside = _box_distance(u, v, length, width)
            top = height / 2 + np.sqrt(np.clip((height / 2) ** 2 - v**2, 0, None))
        case Sphere() | Ellipsoid():
            radius = np.hypot(2 * u / length, 2 * v / width)
            # Along the ray from the middle: no nearer than the edge is.
            beyond = np.hypot(u, v) * (1 - 1 / np.maximum(radius, 1))
            outside = np.where(radius > 1, beyond, (radius - 1) * min(length, width) / 2)
            top = height / 2 * (1 + np.sqrt(np.clip(1 - radius**2, 0, None)))
        case _:
            raise TypeError(f"no relief for {shape!r}")
    return top - STEEPEST * np.clip(outside, 0, None), np.clip(0.5 - outside / RASTER_M, 0, 1)


def _box_distance(u: Real, v: Real, length: float, width: float) -> Real:
    """Signed distance to a rectangle, negative inside."""
    du, dv = np.abs(u) - length / 2, np.abs(v) - width / 2
    outer = np.hypot(np.clip(du, 0, None), np.clip(dv, 0, None))
    return outer + np.minimum(np.maximum(du, dv), 0)
