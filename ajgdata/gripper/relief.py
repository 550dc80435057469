"""Objects as the membrane sees them: heights over the table, with the membrane draped over."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.drape import bridged
from ajgdata.gripper.numba_cache import njit
from ajgdata.gripper.scene import Scene
from ajgdata.gripper.scene_model import MM
from ajgdata.gripper.shapes import (
    Box,
    Compound,
    Cube,
    Cylinder,
    Ellipsoid,
    Object,
    Placed,
    Rod,
    Sphere,
)

RASTER_M = 0.5e-3
Real = NDArray[np.floating]
#: Steps of the raster in half of all directions within 5 pixels: their cone is round to 0.2 %.
_HALF_RING = np.array(
    [
        (i, j)
        for i, j in product(range(6), range(-5, 6))
        if np.gcd(i, j) == 1 and i * i + j * j <= 26 and (i > 0 or j > 0)
    ]
)


#: A membrane of 0.3 mm this near is as good as on the object: the air below is far stiffer than it.
LYING_M = RASTER_M / 4
#: Steepest wall that the raster holds: what stands upright leans by this instead.
WALL_DEG = 85.0


@dataclass(frozen=True)
class Relief:
    """An object on the table as the membrane sees it: `height` falls off steeply beside it, below
    the table as well, until a membrane is draped over both; `inside` is its footprint with
    antialiased edges, `touching` the part of the footprint where the membrane lies on it, `beside`
    the part of the table that the membrane reaches."""

    height: Real
    inside: Real
    touching: Real
    beside: Real


def relief(scene: Scene, x: Real, y: Real) -> Relief:
    """Return the relief of the scene's object over the table on the grid x, y (m), both (ny, nx).

    Where the gripper has a drape angle it is the membrane; where not, what `draped` takes.
    """
    shape, grasp = scene.object, scene.grasp
    assert shape is not None
    angle = scene.gripper.drape_deg
    steepest = float(np.tan(np.deg2rad(WALL_DEG if angle is None else angle)))
    placed = (grasp.offset_x_mm * MM, grasp.offset_y_mm * MM, grasp.angle_deg)
    parts = [
        (top + lift, inside)
        for top, inside, lift in _parts(shape, *_turned(x, y, *placed), steepest)
    ]
    height = np.max([top for top, _ in parts], axis=0)
    if angle is not None and any(_curved(primitive) for primitive in _primitives(shape)):
        _drape(height, steepest * RASTER_M, _HALF_RING)
    touching = np.zeros_like(height)
    for top, inside in parts:
        touching = np.maximum(touching, inside * np.clip(1 - (height - top) / RASTER_M, 0, 1))
    inside = np.max([inside for _, inside in parts], axis=0)
    beside = np.clip(0.5 - height / (steepest * RASTER_M), 0, 1)
    return Relief(height, inside, touching, beside)


def draped(bare: Relief, radius: float) -> Relief:
    """Return the relief with a membrane of bending `radius` T/p (m) draped over it and the table.

    It lies where it is less than LYING_M off, gradually, so that no edge of contact jumps.
    """
    ground = np.maximum(bare.height, 0)
    height = bridged(ground, RASTER_M, radius)
    lying = np.clip(1 - (height - ground) / LYING_M, 0, 1)
    table = np.clip(0.5 - bare.height / RASTER_M, 0, 1)
    return Relief(height, bare.inside, bare.inside * lying, table * lying)


def _primitives(shape: Object) -> Iterator[Object]:
    yield from (part.shape for part in shape.parts) if isinstance(shape, Compound) else (shape,)


def _curved(shape: Object) -> bool:
    """True if the top of a shape may be steeper than the drape, so that the raster must drape."""
    return isinstance(shape, Rod | Sphere | Ellipsoid)


def _turned(x: Real, y: Real, x0: float, y0: float, angle_deg: float) -> tuple[Real, Real]:
    """Coordinates in a frame at x0, y0, turned by an angle."""
    turn = np.deg2rad(angle_deg)
    px, py = x - x0, y - y0
    return px * np.cos(turn) + py * np.sin(turn), py * np.cos(turn) - px * np.sin(turn)


def _parts(shape: Object, u: Real, v: Real, steepest: float) -> Iterator[tuple[Real, Real, float]]:
    """Top, footprint and lift of each primitive; the top goes on at the drape angle outside."""
    if isinstance(shape, Compound):
        for part in shape.parts:
            yield _placed(part, u, v, steepest)
    else:
        yield *_top(shape, u, v, steepest), 0.0


def _placed(part: Placed, u: Real, v: Real, steepest: float) -> tuple[Real, Real, float]:
    local = _turned(u, v, part.x_mm * MM, part.y_mm * MM, part.angle_deg)
    return *_top(part.shape, *local, steepest), part.lift_mm * MM


def _top(shape: Object, u: Real, v: Real, steepest: float) -> tuple[Real, Real]:
    """Top of a primitive over its underside, and its antialiased footprint.

    Outside a flat top the height is the exact drape of its edge. Outside a curved one it is a
    lower bound, continuous at the edge, which draping on the raster raises to the exact one.
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
    return top - steepest * np.clip(outside, 0, None), np.clip(0.5 - outside / RASTER_M, 0, 1)


def _box_distance(u: Real, v: Real, length: float, width: float) -> Real:
    """Signed distance to a rectangle, negative inside."""
    du, dv = np.abs(u) - length / 2, np.abs(v) - width / 2
    outer = np.hypot(np.clip(du, 0, None), np.clip(dv, 0, None))
    return outer + np.minimum(np.maximum(du, dv), 0)


@njit(nogil=True, cache=True)
def _drape(height, drop, ring):
    """Raise `height` in place to the lowest surface above it nowhere steeper than `drop` a pixel.

    Two sequential passes, as in a chamfer distance transform (Borgefors 1986).
    """
    rows, columns = height.shape
    fall = np.array([drop * np.sqrt(i * i + j * j) for i, j in ring])
    for way in (1, -1):
        for n in range(rows):
            row = n if way > 0 else rows - 1 - n
            for m in range(columns):
                column = m if way > 0 else columns - 1 - m
                highest = height[row, column]
                for k in range(len(ring)):
                    i, j = row - way * ring[k, 0], column - way * ring[k, 1]
                    if 0 <= i < rows and 0 <= j < columns:
                        highest = max(highest, height[i, j] - fall[k])
                height[row, column] = highest
