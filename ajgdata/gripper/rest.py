"""Cross-sections of objects, what they stand on, and how stiff the rubber under them is.

A round object lies at the bottom of a concave piece of rubber, as a sphere that is flatter by the
dish's curvature on a layer (Hertz for the gap, Johnson 1985, section 4.2; Dimitriadis for the
layer); a wide flat one, or a sphere too large for the dish, on its rim, a ring of rubber.
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.bending import Ring
from ajgdata.gripper.column import pad_stiffness
from ajgdata.gripper.contact import layer_approach, layer_stiffness, plane_modulus
from ajgdata.gripper.objects import (
    MATERIALS,
    MM,
    Box,
    Compound,
    Cube,
    Cylinder,
    Ellipsoid,
    Material,
    Object,
    Rod,
    Sphere,
    Support,
)

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
            limit = pi / 4 * length * width
            return float(min(pi * np.cbrt(3 * force * radius / (4 * modulus)) ** 2, limit))
        case Rod():
            half = np.sqrt(4 * force * width / 2 / (pi * modulus * length))
            return float(min(2 * half, width) * length)
        case Cylinder():
            return pi / 4 * length**2
        case _:
            return length * width


RUBBER = MATERIALS["rubber"]


class Footing(NamedTuple):
    """What an object stands on: its foot (m²), stiffness (N/m, infinite on the rigid ground) and
    loss factor under it."""

    foot_m2: float
    stiffness: float
    loss: float


def rest_on(support: Support, thing: Object, material: Material, load: float) -> Footing:
    """Return what `thing` of `material` stands on, pressed by `load` (N), its weight included."""
    own = plane_modulus(material.young_pa, material.poisson)
    if support.kind == "rigid":
        return Footing(foot_area(thing, load, float(own)), np.inf, 0.0)
    if lies_on_rim(support, thing):
        return _on_rim(support, thing)
    if isinstance(thing, Sphere | Ellipsoid):
        return _in_dish(support, thing, load)
    both = 1 / (1 / own + 1 / plane_modulus(RUBBER.young_pa, RUBBER.poisson))
    foot = foot_area(thing, load, float(both))
    return Footing(foot, pad_stiffness(RUBBER, support.thickness_mm * MM, foot), RUBBER.loss)


def lies_on_rim(support: Support, thing: Object) -> bool:
    """Return whether a concave piece carries an object on its rim: what is flat and as wide, or a
    ball that is too large for the dish."""
    if support.kind != "concave":
        return False
    if isinstance(thing, Sphere | Ellipsoid):
        return _radius(thing) >= support.dish_radius_mm * MM
    wide = isinstance(thing, Box | Cube | Cylinder)
    return wide and min(thing.size_mm[:2]) / 2 >= support.rim_radius_mm


def rim_of(support: Support) -> Ring:
    """Return the rim of a concave piece as a ring: stiffness per length E' w/h of its edge of width
    w on rubber of height h.

    E' = 4/3 E (1 + S²) with the shape factor S = w/2h of a bonded strip, in series with the bulk
    (Gent & Lindley, Proc. Inst. Mech. Eng. 173, 1959).
    """
    width = support.rim_width_mm * MM
    height = (support.thickness_mm + support.dish_depth_mm) * MM
    shape = 4 / 3 * RUBBER.young_pa * (1 + (width / (2 * height)) ** 2)
    bulk = RUBBER.young_pa / (3 * (1 - 2 * RUBBER.poisson))
    stiffness = width / height / (1 / shape + 1 / bulk)
    return Ring(support.rim_radius_mm * MM, stiffness, RUBBER.loss)


def _on_rim(support: Support, thing: Object) -> Footing:
    ring = rim_of(support)
    around = 2 * np.pi * ring.radius
    # A flat underside bends over the rim (bending.ring_modes); it is not squeezed through it.
    flat = not isinstance(thing, Sphere | Ellipsoid)
    length, width = (size * MM for size in thing.size_mm[:2])
    foot = length * width if flat else around * support.rim_width_mm * MM
    return Footing(foot, float(ring.stiffness_n_m2 * around), ring.loss)


def _in_dish(support: Support, thing: Sphere | Ellipsoid, load: float) -> Footing:
    thickness, rim = support.thickness_mm * MM, support.rim_radius_mm * MM
    radius = 1 / (1 / _radius(thing) - 1 / (support.dish_radius_mm * MM))
    layer = load, radius, thickness, RUBBER.young_pa
    patch = np.sqrt(radius * layer_approach(*layer))
    widest = min(rim, np.sqrt(thing.size_mm[0] * thing.size_mm[1]) * MM / 2)
    if patch < widest:
        return Footing(float(np.pi * patch**2), layer_stiffness(*layer), RUBBER.loss)
    foot = float(np.pi * widest**2)
    return Footing(foot, pad_stiffness(RUBBER, thickness, foot), RUBBER.loss)


def _radius(thing: Sphere | Ellipsoid) -> float:
    """Geometric mean of the radii of curvature at the foot, m."""
    length, width, height = (size * MM for size in thing.size_mm)
    return length * width / (2 * height)
