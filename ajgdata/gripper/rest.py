"""Support of an object: its cross-sections, its foot, and the stiffness of the rubber under it.

A concave piece of rubber carries a round object at the bottom of its dish: a sphere, flatter by the
curvature of the dish, on a layer (Hertz for the gap, Johnson 1985, section 4.2; Dimitriadis for the
layer). It carries a wide flat object, or a sphere that is too large for the dish, on its rim, which
is a ring of rubber.
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.bending import Ring
from ajgdata.gripper.column import cone_slope
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
RUBBER = MATERIALS["rubber"]


class Footing(NamedTuple):
    """Support of an object: area of its foot (m²), stiffness under it (N/m, infinite on the rigid
    ground) and loss factor."""

    foot_m2: float
    stiffness: float
    loss: float


def rest_on(support: Support, shape: Object, material: Material, load: float) -> Footing:
    """Return the footing of an object of `material` that `load` (N), its own weight included,
    presses on a support."""
    own = plane_modulus(material.young_pa, material.poisson)
    if support.kind == "rigid":
        return Footing(foot_area(shape, load, float(own)), np.inf, 0.0)
    if lies_on_rim(support, shape):
        return _on_rim(support, shape)
    if isinstance(shape, Sphere | Ellipsoid):
        return _in_dish(support, shape, load)
    both = 1 / (1 / own + 1 / plane_modulus(RUBBER.young_pa, RUBBER.poisson))
    foot = foot_area(shape, load, float(both))
    return Footing(foot, pad_stiffness(RUBBER, support.thickness_mm * MM, foot), RUBBER.loss)


def lies_on_rim(support: Support, shape: Object) -> bool:
    """Return whether a concave piece carries an object on its rim.

    This is so for a flat object that is as wide as the rim, and for a ball that is too large for
    the dish.
    """
    if support.kind != "concave":
        return False
    if isinstance(shape, Sphere | Ellipsoid):
        return _foot_radius(shape) >= support.dish_radius_mm * MM
    is_flat = isinstance(shape, Box | Cube | Cylinder)
    return is_flat and min(shape.size_mm[:2]) / 2 >= support.rim_radius_mm


def _on_rim(support: Support, shape: Object) -> Footing:
    """Return the footing of an object on the rim of a concave piece."""
    ring = rim_of(support)
    circumference = 2 * np.pi * ring.radius
    if isinstance(shape, Sphere | Ellipsoid):
        foot = circumference * support.rim_width_mm * MM
    else:
        # A flat underside bends over the rim (bending.ring_modes); the rim does not indent it.
        length, width = (size * MM for size in shape.size_mm[:2])
        foot = length * width
    return Footing(foot, float(ring.stiffness_n_m2 * circumference), ring.loss)


def rim_of(support: Support) -> Ring:
    """Return the rim of a concave piece as a ring of stiffness E' w/h per length.

    The edge has the width w, and the rubber under it the height h. E' = 4/3 E (1 + S²), with the
    shape factor S = w/2h of a bonded strip, is in series with the bulk (Gent & Lindley, Proc. Inst.
    Mech. Eng. 173, 1959).
    """
    width = support.rim_width_mm * MM
    height = (support.thickness_mm + support.dish_depth_mm) * MM
    strip = 4 / 3 * RUBBER.young_pa * (1 + (width / (2 * height)) ** 2)
    bulk = RUBBER.young_pa / (3 * (1 - 2 * RUBBER.poisson))
    stiffness = width / height / (1 / strip + 1 / bulk)
    return Ring(support.rim_radius_mm * MM, stiffness, RUBBER.loss)


def _in_dish(support: Support, shape: Sphere | Ellipsoid, load: float) -> Footing:
    """Return the footing of a round object at the bottom of a dish; `load` is in N."""
    thickness = support.thickness_mm * MM
    radius = 1 / (1 / _foot_radius(shape) - 1 / (support.dish_radius_mm * MM))
    layer = (load, radius, thickness, RUBBER.young_pa)
    patch = np.sqrt(radius * layer_approach(*layer))
    object_radius = np.sqrt(shape.size_mm[0] * shape.size_mm[1]) * MM / 2
    widest = min(support.rim_radius_mm * MM, object_radius)
    if patch < widest:
        return Footing(float(np.pi * patch**2), layer_stiffness(*layer), RUBBER.loss)
    foot = float(np.pi * widest**2)
    return Footing(foot, pad_stiffness(RUBBER, thickness, foot), RUBBER.loss)


def _foot_radius(shape: Sphere | Ellipsoid) -> float:
    """Return the geometric mean of the radii of curvature at the foot, m."""
    length, width, height = (size * MM for size in shape.size_mm)
    return length * width / (2 * height)


def pad_stiffness(rubber: Material, thickness: float, foot_m2: float) -> float:
    """Return the stiffness (N/m) of a bonded sheet of rubber under a foot.

    Its modulus is E (1 + 2S²), with the shape factor S = a/2t of a disc, in series with the bulk
    (Gent & Lindley, Proc. Inst. Mech. Eng. 173, 1959). The load spreads in a cone under a small
    foot. A sheet of `thickness` 0 (m) has an infinite stiffness.
    """
    if thickness == 0:
        return np.inf
    radius = np.sqrt(foot_m2 / np.pi)
    disc = rubber.young_pa * (1 + 2 * (radius / (2 * thickness)) ** 2)
    bulk = rubber.young_pa / (3 * (1 - 2 * rubber.poisson))
    loaded_area = radius * (radius + cone_slope(rubber.poisson) * thickness) * np.pi
    return float(1 / (1 / disc + 1 / bulk) * loaded_area / thickness)


def foot_area(shape: Object, force: float, modulus: float) -> float:
    """Return the area (m²) on which an object stands if `force` (N) presses it.

    `modulus` is E* (Pa), the plane modulus of the contact.
    A flat underside touches completely. A sphere or an ellipsoid touches in Hertz's circle of
    radius (3FR/4E*)^(1/3), where R is the geometric mean of its radii. A lying cylinder touches in
    Hertz's strip of half-width √(4FR/(πE*L)) (Johnson 1985, eqs 4.22 and 4.43).
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


def section(shape: Object, z: Real) -> Real:
    """Return the area (m²) of the object's material at the heights `z` (m) over its foot.

    The result has the shape of `z`. Areas of parts of a compound are added, also if they overlap.
    """
    if isinstance(shape, Compound):
        parts = (_ring_area(p.shape, z - p.lift_mm * MM, shape.shell_mm) for p in shape.parts)
        return sum(parts, start=np.zeros_like(z))
    return _ring_area(shape, z, shape.shell_mm)


def _ring_area(shape: Object, z: Real, shell_mm: float | None) -> Real:
    """Return the area (m²) within the outline of a primitive, without its hollow."""
    outer = _outline_area(shape, z, 0.0)
    return outer if shell_mm is None else outer - _outline_area(shape, z, shell_mm * MM)


def _outline_area(shape: Object, z: Real, inset: float) -> Real:
    """Return the area (m²) within the outline of a primitive, moved inwards by `inset` (m)."""
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
