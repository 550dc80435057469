"""Cross-sections and feet of objects, for the column that carries the grasp."""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.scene_model import MM
from ajgdata.gripper.shapes import Compound, Cylinder, Ellipsoid, Object, Rod, Sphere

Real = NDArray[np.floating]


def section(shape: Object, z: Real) -> Real:
    """Area (m²) of the object's material at the heights `z` (m) over its foot, of their shape.

    Where the parts of a compound overlap, the overlap counts once at most as the sum of both.
    """
    if isinstance(shape, Compound):
        parts = (_enclosed(p.shape, z - p.lift_mm * MM, shape.shell_mm) for p in shape.parts)
        return sum(parts, start=np.zeros_like(z))
    return _enclosed(shape, z, shape.shell_mm)


def _enclosed(shape: Object, z: Real, shell_mm: float | None) -> Real:
    outer = _outline(shape, z, 0.0)
    return outer if shell_mm is None else outer - _outline(shape, z, shell_mm * MM)


def _outline(shape: Object, z: Real, inset: float) -> Real:
    """Area within the outline moved inwards by `inset` (m)."""
    length, width, height = (size * MM - 2 * inset for size in shape.size_mm)
    # -1 at the underside, 1 at the top.
    level = (2 * (z - inset) - height) / height
    within = np.abs(level) <= 1
    round_ = np.clip(1 - level**2, 0, None)
    match shape:
        case Sphere() | Ellipsoid():
            return pi / 4 * length * width * round_
        case Rod():
            return length * width * np.sqrt(round_)
        case Cylinder():
            return pi / 4 * length**2 * within
        case _:
            return length * width * within


def foot_area(shape: Object, force: float, modulus: float) -> float:
    """Area (m²) on which the object stands, pressed by `force` (N); `modulus` is E* (Pa).

    A flat underside touches all over; a sphere or an ellipsoid in Hertz's circle of radius
    (3FR/4E*)^(1/3), R the geometric mean of its radii; a lying cylinder in his strip of half-width
    √(4FR/(πE*L)) (Johnson 1985, eqs 4.22 and 4.43).
    """
    if isinstance(shape, Compound):
        standing = [part.shape for part in shape.parts if part.lift_mm == 0]
        return sum(foot_area(part, force / len(standing), modulus) for part in standing)
    length, width, height = (size * MM for size in shape.size_mm)
    match shape:
        case Sphere() | Ellipsoid():
            radius = length * width / (2 * height)
            most = pi / 4 * length * width
            return float(min(pi * np.cbrt(3 * force * radius / (4 * modulus)) ** 2, most))
        case Rod():
            half = np.sqrt(4 * force * width / 2 / (pi * modulus * length))
            return float(min(2 * half, width) * length)
        case Cylinder():
            return pi / 4 * length**2
        case _:
            return length * width
