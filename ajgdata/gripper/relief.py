"""Relief of an object on the table, and of the membrane that is draped over it.

A pressure p presses a membrane of tension T on an obstacle. The height w of the membrane obeys
T ∇·(∇w/√(1+|∇w|²)) = p where it touches nothing, and is that of the obstacle elsewhere (Laplace
1806; obstacle problem, Kinderlehrer & Stampacchia 1980). The membrane is a cylinder of radius T/p
next to a straight edge, and a sphere of radius 2T/p over a round hole.
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
#: Distance of the samples of a relief, m.
RASTER_M = 0.5e-3
#: A membrane of 0.3 mm at this distance counts as lying on the object, because the air between
#: them is far stiffer than the membrane.
LYING_M = RASTER_M / 4
#: Slope of the steepest wall on the raster: upright walls have an inclination of 85°.
STEEPEST = float(np.tan(np.deg2rad(85.0)))
#: Distances of the samples of each level of the solution, in units of RASTER_M. Each level starts
#: from the solution of the level before.
LEVELS = (8, 4, 2, 1)
#: Sweeps on each level.
SWEEPS = {8: 80, 4: 60, 2: 60, 1: 16}
#: Sweeps between two updates of the slopes.
SLOPE_SWEEPS = 4
#: Factor of successive over-relaxation (Young 1954), for gaps of about 20 samples.
OMEGA = 1.7


@dataclass(frozen=True)
class Relief:
    """An object on the table: heights (m) and footprint on a raster (ny, nx).

    `height` is over the table. Next to the object, it falls steeply, also below the table.
    `inside` is 1 in the footprint, 0 outside, and between at its edges.
    """

    height: Real
    inside: Real


@dataclass(frozen=True)
class Draped(Relief):
    """A relief with the membrane on it.

    `touching` is the share of the footprint where the membrane lies on the object, and `adjacent`
    the share of the table that the membrane reaches, both (ny, nx).
    """

    touching: Real
    adjacent: Real


def relief(scene: Scene, x: Real, y: Real) -> Relief:
    """Return the relief of the scene's object at x, y (m), both (ny, nx)."""
    shape = scene.object
    grasp = scene.grasp
    assert shape is not None
    u, v = _turned(x, y, grasp.offset_x_mm * MM, grasp.offset_y_mm * MM, grasp.angle_deg)
    parts = list(_parts(shape, u, v))
    height = np.max([part.height for part in parts], axis=0)
    return Relief(height, np.max([part.inside for part in parts], axis=0))


def _turned(x: Real, y: Real, x0: float, y0: float, angle_deg: float) -> tuple[Real, Real]:
    """Return the points x, y in a frame at x0, y0 that is turned by an angle."""
    angle = np.deg2rad(angle_deg)
    dx = x - x0
    dy = y - y0
    return dx * np.cos(angle) + dy * np.sin(angle), dy * np.cos(angle) - dx * np.sin(angle)


def _parts(shape: Object, u: Real, v: Real) -> Iterator[Relief]:
    """Yield the relief of each primitive of an object."""
    if not isinstance(shape, Compound):
        yield _primitive(shape, u, v)
        return
    for part in shape.parts:
        local = _turned(u, v, part.x_mm * MM, part.y_mm * MM, part.angle_deg)
        standing = _primitive(part.shape, *local)
        yield Relief(standing.height + part.lift_mm * MM, standing.inside)


def _primitive(shape: Object, u: Real, v: Real) -> Relief:
    """Return the relief of a primitive, with heights over its underside.

    Outside the footprint, the height falls with the slope STEEPEST, without a step at the edge.
    """
    length, width, height = (size * MM for size in shape.size_mm)
    match shape:
        case Cube() | Box():
            outside = _rectangle_distance(u, v, length, width)
            top = np.full_like(u, height)
        case Cylinder():
            outside = np.hypot(u, v) - length / 2
            top = np.full_like(u, height)
        case Rod():
            outside = _rectangle_distance(u, v, length, width)
            top = height / 2 + np.sqrt(np.clip((height / 2) ** 2 - v**2, 0, None))
        case Sphere() | Ellipsoid():
            radius = np.hypot(2 * u / length, 2 * v / width)
            # The distance along the ray from the middle: at least that of the edge.
            beyond = np.hypot(u, v) * (1 - 1 / np.maximum(radius, 1))
            outside = np.where(radius > 1, beyond, (radius - 1) * min(length, width) / 2)
            top = height / 2 * (1 + np.sqrt(np.clip(1 - radius**2, 0, None)))
        case _:
            raise TypeError(f"no relief for {shape!r}")
    inside = np.clip(0.5 - outside / RASTER_M, 0, 1)
    return Relief(top - STEEPEST * np.clip(outside, 0, None), inside)


def _rectangle_distance(u: Real, v: Real, length: float, width: float) -> Real:
    """Return the signed distance to a rectangle, negative inside."""
    du = np.abs(u) - length / 2
    dv = np.abs(v) - width / 2
    outer = np.hypot(np.clip(du, 0, None), np.clip(dv, 0, None))
    return outer + np.minimum(np.maximum(du, dv), 0)


def draped(bare: Relief, radius: float) -> Draped:
    """Return a relief with a membrane of bending `radius` T/p (m) draped over it and the table.

    The contact decreases gradually up to a distance of LYING_M, so that its edges do not jump.
    """
    ground = np.maximum(bare.height, 0)
    height = bridged(ground, RASTER_M, radius)
    lying = np.clip(1 - (height - ground) / LYING_M, 0, 1)
    table = np.clip(0.5 - bare.height / RASTER_M, 0, 1)
    return Draped(height, bare.inside, bare.inside * lying, table * lying)


def bridged(obstacle: Real, step: float, radius: float) -> Real:
    """Return the height (m) of a membrane over the heights `obstacle` (m), both (ny, nx).

    `step` (m) is the distance of samples, `radius` is T/p in m. At the border, the membrane is
    level across it. The number of sweeps is fixed, so the height follows the obstacle without
    jumps.
    """
    height: Real = np.zeros((1, 1))
    for coarser in LEVELS:
        below = np.ascontiguousarray(obstacle[::coarser, ::coarser])
        is_first = height.size == 1
        height = below.copy() if is_first else np.maximum(_finer(height, below.shape), below)
        coarse_step = coarser * step
        _relax(height, below, coarse_step**2 / radius, coarse_step, SWEEPS[coarser])
    return height


def _finer(height: Real, shape: tuple[int, int]) -> Real:
    """Return heights on a raster of half the step, of `shape`: new samples are means."""
    fine = np.repeat(np.repeat(height, 2, axis=0), 2, axis=1)
    fine[1:-1:2] = (fine[1:-1:2] + fine[2::2]) / 2
    fine[:, 1:-1:2] = (fine[:, 1:-1:2] + fine[:, 2::2]) / 2
    return fine[: shape[0], : shape[1]]


# The error model "numpy" has no test for a division by zero, which would keep loops from
# vectorising.
@njit(nogil=True, cache=True, error_model="numpy")
def _relax(height, obstacle, load, step, sweeps):
    """Apply sweeps of projected over-relaxation in place, red samples before black ones.

    All samples of a row are computed, because such a loop vectorises; those of one colour are
    stored.
    """
    rows, columns = height.shape
    right = np.zeros((rows, columns + 1))
    down = np.zeros((rows + 1, columns))
    share = np.zeros((rows, columns))
    balanced = np.zeros(columns)
    for sweep in range(sweeps):
        if sweep % SLOPE_SWEEPS == 0:
            _set_pulls(height, step, right, down)
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


@njit(nogil=True, cache=True, error_model="numpy")
def _set_pulls(height, step, right, down):
    """Set 1/√(1+|∇w|²) between neighbouring samples; at the border it stays 0.

    `right` (rows, columns + 1) is between the samples j - 1 and j of a row, and `down` (rows + 1,
    columns) between the samples i - 1 and i of a column.
    """
    rows, columns = height.shape
    square = step * step
    for i in range(rows):
        above = max(i - 1, 0)
        below = min(i + 1, rows - 1)
        for j in range(columns - 1):
            along = height[i, j + 1] - height[i, j]
            across = height[below, j] + height[below, j + 1] - height[above, j]
            across = (across - height[above, j + 1]) / 4
            right[i, j + 1] = 1 / np.sqrt(1 + (along * along + across * across) / square)
    last = columns - 1
    for i in range(rows - 1):
        down[i + 1, 0] = _pull_below(height, i, 0, 0, 1, square)
        down[i + 1, last] = _pull_below(height, i, last, last - 1, last, square)
        for j in range(1, columns - 1):
            down[i + 1, j] = _pull_below(height, i, j, j - 1, j + 1, square)


@njit(nogil=True, cache=True, error_model="numpy")
def _pull_below(height, i, j, left, beyond, square):
    """Return 1/√(1+|∇w|²) between the samples i and i + 1 of a column, whose neighbours are the
    columns `left` and `beyond`."""
    along = height[i + 1, j] - height[i, j]
    across = height[i, beyond] + height[i + 1, beyond] - height[i, left]
    across = (across - height[i + 1, left]) / 4
    return 1 / np.sqrt(1 + (along * along + across * across) / square)


@njit(nogil=True, cache=True)
def _balance(height, right, down, share, load, i, balanced):
    """Set `balanced` (columns,) to the height that each sample of row `i` would have without an
    obstacle; nothing pulls at the border."""
    rows, columns = height.shape
    above = max(i - 1, 0)
    below = min(i + 1, rows - 1)
    for j in (0, columns - 1):
        left = max(j - 1, 0)
        beyond = min(j + 1, columns - 1)
        balanced[j] = _pulled(height, right, down, share, load, i, j, above, below, left, beyond)
    for j in range(1, columns - 1):
        balanced[j] = _pulled(height, right, down, share, load, i, j, above, below, j - 1, j + 1)


@njit(nogil=True, cache=True)
def _pulled(height, right, down, share, load, i, j, above, below, left, beyond):
    """Return the height that a sample would have without an obstacle."""
    # Differences instead of heights: what is level stays level to the last bit.
    here = height[i, j]
    pull = right[i, j] * (height[i, left] - here) + right[i, j + 1] * (height[i, beyond] - here)
    pull += down[i, j] * (height[above, j] - here) + down[i + 1, j] * (height[below, j] - here)
    return here + share[i, j] * (pull - load)
