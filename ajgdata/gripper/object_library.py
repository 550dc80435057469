"""Objects by name: the objects of the paper as shapes.

Sizes of household objects are those of the YCB object set (Calli et al. 2015, IEEE Robotics &
Automation Magazine 22(3), list of objects) if `source` does not name another one. Walls of hollow
objects follow from the published mass and the density of the material. Each object has the most
similar material of `objects.MATERIALS`.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field

from ajgdata.gripper.objects import (
    MATERIALS,
    Box,
    Compound,
    Cube,
    Ellipsoid,
    MaterialName,
    Object,
    Rod,
    SceneModel,
    Sphere,
)

Category = Literal["cube", "sphere", "plate", "bar", "spherical", "cylindrical", "other"]
PAPER = "paper"
YCB = "YCB object set"


class ObjectSpec(SceneModel):
    """A named object; the categories of household objects are those of the paper."""

    shape: Object
    category: Category
    source: str = Field(description="source of the sizes, and estimates")
    mass_g: Annotated[float, Field(gt=0)] | None = Field(None, description="published mass")


#: Edges of the cubes. The paper names 16 cubes of 10 to 30 mm; even spacing is our assumption.
CUBE_EDGES_MM = tuple(round(10 + 20 * n / 15, 1) for n in range(16))
#: The paper's four materials.
MATERIAL_SET: dict[str, MaterialName] = {
    "metal": "steel",
    "wood": "wood",
    "plastic": "plastic",
    "styrofoam": "styrofoam",
}


#: Thickness of plates, mm: "about 5" in the paper.
PLATE_MM = 5.0


def _cubes() -> dict[str, ObjectSpec]:
    """Return the cubes of the paper."""
    source = f"{PAPER}: 16 PLA cubes of 10-30 mm; spacing assumed even"
    return {
        f"cube_{edge:.1f}".replace(".", "p"): ObjectSpec(
            shape=Cube(kind="cube", edge_mm=edge, material="pla"), category="cube", source=source
        )
        for edge in CUBE_EDGES_MM
    }


def _materials() -> dict[str, ObjectSpec]:
    """Return spheres and plates of the paper's four materials."""
    objects = {}
    for name, material in MATERIAL_SET.items():
        for diameter in (80, 30):
            objects[f"sphere{diameter}_{name}"] = ObjectSpec(
                shape=Sphere(kind="sphere", diameter_mm=diameter, material=material),
                category="sphere",
                source=PAPER,
            )
        plate = Box(kind="box", length_mm=100, width_mm=100, height_mm=PLATE_MM, material=material)
        assumed = f"{PAPER}: about 5 mm thick; 100 x 100 mm assumed"
        objects[f"plate_{name}"] = ObjectSpec(shape=plate, category="plate", source=assumed)
    return objects


def _compound(material: Any, *parts: dict[str, Any], shell_mm: float | None = None) -> Compound:
    """Return a compound of `_part`s."""
    content = {"kind": "compound", "parts": parts, "material": material, "shell_mm": shell_mm}
    return Compound.model_validate(content)


def _part(shape: Any, x: float = 0.0, y: float = 0.0, lift: float = 0.0, angle: float = 0.0) -> Any:
    """Return a part of a compound: middle and height of the underside in mm, angle in degrees."""
    return {"shape": shape, "x_mm": x, "y_mm": y, "lift_mm": lift, "angle_deg": angle}


def _rod(diameter: float, length: float) -> Rod:
    return Rod(kind="rod", diameter_mm=diameter, length_mm=length)


def _box(length: float, width: float, height: float) -> Box:
    return Box(kind="box", length_mm=length, width_mm=width, height_mm=height)


def _banana() -> Compound:
    """Return five rods along an arc, with their axes at half the height of the thickest rod."""
    diameters = (24.0, 33.0, 36.0, 33.0, 24.0)
    step = 39.5  # length of a rod, mm
    bend = 22.0  # angle between neighbours, degrees
    radius = step / (2 * math.sin(math.radians(bend) / 2))
    parts = []
    for n, diameter in enumerate(diameters):
        angle = math.radians((n - 2) * bend)
        x = radius * math.sin(angle)
        y = radius * (math.cos(angle) - 1)
        lift = (max(diameters) - diameter) / 2
        parts.append(_part(_rod(diameter, step), x, y, lift, -(n - 2) * bend))
    return _compound("plastic", *parts, shell_mm=2.6)


def _ycb(
    shape: Object, category: Category, mass_g: float | None, note: str = "", source: str = YCB
) -> ObjectSpec:
    """Return a household object with the published mass (g) and a `note` on its source."""
    if note:
        source = f"{source}; {note}"
    return ObjectSpec(shape=shape, category=category, source=source, mass_g=mass_g)


def _ball(diameter: float, material: MaterialName, shell_mm: float | None = None) -> Sphere:
    return Sphere(kind="sphere", diameter_mm=diameter, material=material, shell_mm=shell_mm)


def _spherical() -> dict[str, ObjectSpec]:
    """Return the household objects of the category "spherical"."""
    strawberry = Ellipsoid(
        kind="ellipsoid", diameters_mm=(55, 43.8, 43.8), material="plastic", shell_mm=2.4
    )
    return {
        "orange": _ycb(_ball(73, "plastic", 2.5), "spherical", 47),
        "baseball": _ycb(_ball(75, "wood"), "spherical", 148, "wound wool and cork as wood"),
        "tennis_ball": _ycb(_ball(64.7, "rubber", 4.6), "spherical", 58),
        "racquetball": _ycb(_ball(55.3, "rubber", 4.6), "spherical", 41),
        "golf_ball": _ycb(_ball(42.7, "plastic"), "spherical", 46),
        "strawberry": _ycb(strawberry, "spherical", 18, "lying"),
    }


def _cylindrical() -> dict[str, ObjectSpec]:
    """Return the household objects of the category "cylindrical"."""
    screw = _compound("plastic", _part(_rod(8, 35), 4, 0, 3.5), _part(_rod(15, 8), -17.5))
    spoon = _compound(
        "steel",
        _part(Ellipsoid(kind="ellipsoid", diameters_mm=(62, 40, 14)), -66),
        _part(_box(133, 12, 2), 31, 0, 8),
        shell_mm=0.3,
    )
    case = Ellipsoid(kind="ellipsoid", diameters_mm=(160, 62, 42), material="plastic", shell_mm=2)
    marker = Rod(kind="rod", diameter_mm=18, length_mm=121, material="plastic", shell_mm=2)
    screwdriver = _compound(
        "plastic", _part(_rod(31, 105), -55), _part(_rod(6, 110), 52.5, 0, 12.5)
    )
    return {
        "screw": _ycb(screw, "cylindrical", 3.6, "the set's plastic bolt, lying"),
        "spoon": _ycb(spoon, "cylindrical", None, "upside down; bowl 62 x 40 mm estimated"),
        "glasses_case": _ycb(case, "cylindrical", None, "rounded hard case", "estimate"),
        "marker": _ycb(marker, "cylindrical", 15.8, "the large one"),
        "screwdriver": _ycb(
            screwdriver, "cylindrical", 97, "Phillips; 105 mm handle, 6 mm shaft estimated"
        ),
        "banana": _ycb(_banana(), "cylindrical", 66, "bend estimated"),
    }


def _other() -> dict[str, ObjectSpec]:
    """Return the household objects of the category "other"."""
    # 28 g in 50 x 75 x 50 mm: denser than upholstery foam, with the same stiffness and loss.
    foam = MATERIALS["foam"].model_copy(update={"density_kg_m3": 150.0})
    brick = Box(kind="box", length_mm=75, width_mm=50, height_mm=50, material=foam)
    spam = _box(97, 50, 82)
    padlock = _compound(
        "steel",
        _part(_box(47, 37, 24)),
        _part(_rod(9, 28), -15, 27.5, 7.5, 90),
        _part(_rod(9, 28), 15, 27.5, 7.5, 90),
        _part(_rod(9, 39), 0, 42, 7.5),
        shell_mm=3.4,
    )
    gelatin = Box(kind="box", length_mm=85, width_mm=73, height_mm=28)
    return {
        "foam_brick": _ycb(brick, "other", 28),
        "spam_can": _ycb(spam, "other", 370, "potted meat can, standing; full, hence rigid"),
        "padlock": _ycb(padlock, "other", 208, "lying; shackle 9 mm estimated"),
        "gelatin_box": _ycb(
            gelatin, "other", 97, "the paper does not name its sixteenth object; full, hence rigid"
        ),
    }


#: The 16 household objects. The paper names 15, and its categories show that the last is "other".
HOUSEHOLD: dict[str, ObjectSpec] = _spherical() | _cylindrical() | _other()


#: Least and largest distance (mm) from the middle line of a bar to the axis about which it is
#: turned; not in the paper.
BAR_ECCENTRIC_RANGE_MM = (0.0, 6.0)


def _bars() -> dict[str, ObjectSpec]:
    """Return the paper's bar of 270 x 15 x 44 mm: on its edge, flat, and off its axis.

    It is longer than the gripper is wide.
    """
    edge = Box(kind="box", length_mm=270, width_mm=15, height_mm=44, material="wood")
    flat = Box(kind="box", length_mm=270, width_mm=44, height_mm=15, material="wood")
    order = f"{PAPER}: 270 x 15 x 44 mm"
    low, high = BAR_ECCENTRIC_RANGE_MM
    aside = {"shape": edge.model_copy(update={"material": "rigid"}), "y_mm": (low + high) / 2}
    return {
        "bar": ObjectSpec(
            shape=edge, category="bar", source=f"{order}, read as length, width, height: on edge"
        ),
        "bar_flat": ObjectSpec(shape=flat, category="bar", source=f"{order}, laid flat"),
        "bar_eccentric": ObjectSpec(
            shape=_compound("wood", aside),
            category="bar",
            source=f"{order}, on edge; its middle line {(low + high) / 2:g} mm off the axis about"
            f" which it is turned, the middle of {low:g} to {high:g} mm: a bar of 15 mm that is"
            " centred by eye is off by less than half its width; estimate",
        ),
    }


OBJECTS: dict[str, ObjectSpec] = {**_cubes(), **_materials(), **_bars(), **HOUSEHOLD}
