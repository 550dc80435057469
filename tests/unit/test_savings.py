"""What a scene's plan leaves out, and what this saves."""

import re

from ajgdata.gripper import Scene, build_plan
from ajgdata.pipeline.savings import complete, measured_savings, omitted_physics

COARSE = {"dx_mm": 6, "max_time_s": 0.02}


def scene(name, **numerics):
    return Scene.model_validate({"object": name, "numerics": {**COARSE, **numerics}})


def test_a_complete_plan_saves_nothing():
    assert measured_savings(complete(scene("cube_20p7"))) is None
    assert measured_savings(Scene.model_validate({"numerics": COARSE})) is None


def test_omitted_modes_are_named_with_their_lower_end_and_change_the_sound():
    savings = measured_savings(scene("foam_brick"))
    assert savings.omitted == ("modes above 8 kHz",)
    assert 0 < savings.error < 0.05
    rough = measured_savings(scene("foam_brick", modes_hz=500))
    assert rough.omitted == ("modes above 0.5 kHz",)
    assert rough.error > savings.error
    assert re.fullmatch(r"left out: modes above 8 kHz; time [+-]\d+ %; error 0\.\d+", str(savings))


def test_parts_that_the_object_does_not_have_are_not_named():
    steel = Scene.model_validate(
        {"object": {"kind": "cube", "edge_mm": 20, "material": "steel"}, "numerics": COARSE}
    )
    plan = build_plan(steel)
    full = build_plan(complete(steel))
    solved = {part.name for part in full.parts if part.is_solved}
    assert set(omitted_physics(plan, full)) <= solved
