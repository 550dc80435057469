"""Objects by name: what the paper grasps, as shapes.

Sizes of the household objects are those of the YCB object set (Calli et al. 2015, IEEE Robotics &
Automation Magazine 22(3), list of objects) unless the source says otherwise; walls of hollow ones
follow from the published mass and the density of the material. Materials are the nearest ones.
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
    """A named object. Categories of household objects are the paper's."""

    shape: Object
    category: Category
    source: str = Field(description="where the sizes are from, and what is estimated")
    mass_g: Annotated[float, Field(gt=0)] | None = Field(None, description="as published")


#: The paper names 16 cubes of 10 to 30 mm, not their sizes: evenly spaced here.
CUBE_EDGES_MM = tuple(round(10 + 20 * n / 15, 1) for n in range(16))
#: The paper's four materials.
MATERIAL_SET: dict[str, MaterialName] = {
    "metal": "steel",
    "wood": "wood",
    "plastic": "plastic",
    "styrofoam": "styrofoam",
}


#: Thickness of plates, mm: the paper's "about 5".
PLATE_MM = 5.0


def _cubes() -> dict[str, ObjectSpec]:
    source = f"{PAPER}: 16 PLA cubes of 10-30 mm; spacing assumed even"
    return {
        f"cube_{edge:.1f}".replace(".", "p"): ObjectSpec(
            shape=Cube(kind="cube", edge_mm=edge, material="pla"), category="cube", source=source
        )
        for edge in CUBE_EDGES_MM
    }


def _materials() -> dict[str, ObjectSpec]:
    """Spheres and plates of the paper's four materials."""
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
    content = {"kind": "compound", "parts": parts, "material": material, "shell_mm": shell_mm}
    return Compound.model_validate(content)


def _part(shape: Any, x: float = 0.0, y: float = 0.0, lift: float = 0.0, angle: float = 0.0) -> Any:
    return {"shape": shape, "x_mm": x, "y_mm": y, "lift_mm": lift, "angle_deg": angle}


def _rod(diameter: float, length: float) -> Rod:
    return Rod(kind="rod", diameter_mm=diameter, length_mm=length)


def _box(length: float, width: float, height: float) -> Box:
    return Box(kind="box", length_mm=length, width_mm=width, height_mm=height)


def _banana() -> Compound:
    """Five rods along an arc, all with their axes at half the height of the thickest."""
    diameters, step, bend = (24.0, 33.0, 36.0, 33.0, 24.0), 39.5, 22.0
    radius = step / (2 * math.sin(math.radians(bend) / 2))
    parts = []
    for n, diameter in enumerate(diameters):
        turn = math.radians((n - 2) * bend)
        x, y = radius * math.sin(turn), radius * (math.cos(turn) - 1)
        lift = (max(diameters) - diameter) / 2
        parts.append(_part(_rod(diameter, step), x, y, lift, -(n - 2) * bend))
    return _compound("plastic", *parts, shell_mm=2.6)


def _ycb(
    shape: Object, category: Category, mass_g: float | None, note: str = "", source: str = YCB
) -> ObjectSpec:
    return ObjectSpec(
        shape=shape,
        category=category,
        source=f"{source}{'; ' if note else ''}{note}",
        mass_g=mass_g,
    )


def _ball(diameter: float, material: MaterialName, shell_mm: float | None = None) -> Sphere:
    return Sphere(kind="sphere", diameter_mm=diameter, material=material, shell_mm=shell_mm)


def _spherical() -> dict[str, ObjectSpec]:
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
    # 28 g in 50 x 75 x 50 mm: denser than upholstery foam, otherwise like it.
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


#: The paper's 16 household objects; it names 15, and by its categories the last is an "other".
HOUSEHOLD: dict[str, ObjectSpec] = _spherical() | _cylindrical() | _other()


#: Distance from the middle line of a bar to the axis about which it is turned; not in the paper.
BAR_ECCENTRIC_RANGE_MM = (0.0, 6.0)


def _bars() -> dict[str, ObjectSpec]:
    """The paper's 270 x 15 x 44 mm as length, width and height, lying flat, and off its axis: all
    longer than the gripper is wide."""
    edge, flat = (
        Box(kind="box", length_mm=270, width_mm=width, height_mm=height, material="wood")
        for width, height in ((15, 44), (44, 15))
    )
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
