"""Objects as the membrane sees them: heights over the table, with the membrane draped over."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.drape import bridged
from ajgdata.gripper.scene import Scene
from ajgdata.gripper.scene_model import MM
from ajgdata.gripper.shapes import (
    Box,
    Compound,
    Cube,
    Cylinder,
    Ellipsoid,
    Object,
    Rod,
    Sphere,
)

RASTER_M = 0.5e-3
Real = NDArray[np.floating]
#: A membrane of 0.3 mm this near is as good as on the object: the air below is far stiffer than it.
LYING_M = RASTER_M / 4
#: Slope of the steepest wall that the raster holds: what stands upright leans by 85° instead.
STEEPEST = float(np.tan(np.deg2rad(85.0)))


@dataclass(frozen=True)
class Relief:
    """An object on the table: `height` falls off steeply beside it, below the table as well;
    `inside` is its footprint with antialiased edges."""

    height: Real
    inside: Real


@dataclass(frozen=True)
class Draped(Relief):
    """A relief as the membrane sees it: `touching` is the part of the footprint where the membrane
    lies on the object, `beside` the part of the table that the membrane reaches."""

    touching: Real
    beside: Real


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
