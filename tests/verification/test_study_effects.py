"""What the study of effects says of changes whose effect is known beforehand."""

import pytest

from ajgdata.gripper import Scene
from ajgdata.gripper.object_library import MATERIAL_SET, OBJECTS, PLATE_TOLERANCE_MM
from ajgdata.studies.effects import EFFECTS, Effect, effect_row, heard

DX_MM = 6.0


def test_every_change_changes_a_scene_that_can_be():
    for effect in EFFECTS:
        before, after = (
            Scene.model_validate({"object": effect.thing, **given})
            for given in (effect.before, effect.after)
        )
        assert before != after, effect
        assert effect.what in ("default", "range", "variant")
        # What is the default is what a scene has that says nothing.
        if effect.what == "default":
            assert after == Scene.model_validate({"object": effect.thing})


def test_nothing_changed_is_nothing_heard_and_rougher_is_more():
    none = effect_row(Effect("none", "plate_wood", "variant", {}, {}), DX_MM)
    assert none["change"] == none["change_low"] == 0 and not none["worth"]
    assert none["scatter"] > 0.01
    thin, thick = (
        effect_row(Effect("film", "plate_wood", "range", _film(0.0), _film(film)), DX_MM)
        for film in (0.5, 4.0)
    )
    assert thick["change"] > 2 * thin["change"] > 0
    assert thick["worth"] and thick["change"] > thick["tolerance"]


def _film(thickness):
    return {"gripper": {"membrane": {"film": thickness}}}


def test_plates_stay_within_their_tolerance_and_lie_on_rubber():
    for name in MATERIAL_SET:
        middle, thin, thick = (
            OBJECTS[f"plate_{name}{end}"].shape.height_mm for end in ("", "_thin", "_thick")
        )
        assert (thin + thick) / 2 == pytest.approx(middle) == 5.0
        assert thick - thin == pytest.approx(2 * PLATE_TOLERANCE_MM[name])
    rubber = {"support": {"kind": "concave"}}
    one, other = (heard("plate_wood", given, dx_mm=DX_MM).feature for given in ({}, rubber))
    assert (one == other).all()
