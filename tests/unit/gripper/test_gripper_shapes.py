"""Sizes, volumes and masses of shapes; what cannot be a shape."""

import math

import pytest
from pydantic import TypeAdapter, ValidationError

from ajgdata.gripper.objects import Object

SHAPE = TypeAdapter(Object)
BALL = {"kind": "sphere", "diameter_mm": 40.0}
CYLINDER, ROD = ({"kind": kind, "diameter_mm": 20.0} for kind in ("cylinder", "rod"))
SLAB = {"kind": "box", "length_mm": 40.0, "width_mm": 20.0, "height_mm": 10.0}


def shape(given):
    return SHAPE.validate_python(given)


def compound(*parts, **keys):
    return {"kind": "compound", "parts": list(parts)} | keys


@pytest.mark.parametrize(
    ("given", "size", "volume", "hollow"),
    [
        ({"kind": "cube", "edge_mm": 10.0}, (10, 10, 10), 1000, 8**3),
        (SLAB, (40, 20, 10), 8000, 38 * 18 * 8),
        (CYLINDER | {"height_mm": 30.0}, (20, 20, 30), math.pi * 100 * 30, math.pi * 81 * 28),
        (ROD | {"length_mm": 30.0}, (30, 20, 20), math.pi * 100 * 30, math.pi * 81 * 28),
        (BALL, (40, 40, 40), 4 / 3 * math.pi * 20**3, 4 / 3 * math.pi * 19**3),
        (
            {"kind": "ellipsoid", "diameters_mm": [40, 20, 10]},
            (40, 20, 10),
            math.pi / 6 * 8000,
            math.pi / 6 * 38 * 18 * 8,
        ),
        (
            compound({"shape": SLAB}, {"shape": SLAB, "x_mm": 40}),
            (80, 20, 10),
            16000,
            2 * 38 * 18 * 8,
        ),
    ],
)
def test_volumes_are_those_of_the_textbook(given, size, volume, hollow):
    solid = shape(given)
    shell = shape(given | {"shell_mm": 1.0})
    assert solid.size_mm == pytest.approx(size)
    assert solid.volume_mm3 == pytest.approx(volume)
    assert shell.volume_mm3 == pytest.approx(volume - hollow)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (BALL | {"diameter_mm": 0.4}, "greater than or equal to 0.5"),
        (BALL | {"shell_mm": 20.0}, "shell_mm 20 fills a sphere"),
        (BALL | {"radius_mm": 20.0}, "radius_mm"),
        (compound({"shape": BALL, "lift_mm": 3}), "no part rests on the table: lower every"),
        (compound({"shape": BALL | {"material": "steel"}}), "belong to the compound"),
        (compound({"shape": BALL}, {"shape": SLAB}, shell_mm=6.0), "fills the part box"),
    ],
)
def test_what_cannot_be_is_refused_by_name(given, said):
    with pytest.raises(ValidationError, match=said):
        shape(given)
