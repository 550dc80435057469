"""Nothing is left out but what was measured to change little; all else is solved."""

from dataclasses import replace

import pytest

from ajgdata.gripper import Scene, build_plan
from ajgdata.gripper.objects import MATERIALS
from ajgdata.gripper.omissions import MARGIN, bounds, measured_table
from ajgdata.gripper.scene import PHYSICS_VERSION, as_met
from ajgdata.studies.omissions import (
    FIRST_SEED,
    PARTS,
    QUICK,
    omission_rows,
    sample,
    sphere,
)
from tools.omission_table import kinds

#: Coarser than the study: what a part changes depends little on the grid.
DX_MM = 6.0
COARSE = {case.name: replace(case, dx_mm=DX_MM) for case in sample()}
WOOD_IN_DISH = {"object": "sphere80_wood", "support": {"kind": "concave"}}


def check(rows):
    for row in rows:
        assert row["feature"] <= row["measured"]
        if not row["kept"]:  # None: all that is left out, together
            assert row["measured"] < row["tolerance"], row
        if row["bound"] is None:
            assert row["kept"] is not False
        else:
            assert row["measured"] < max(row["bound"], 1e-3), row


def test_what_is_left_out_changes_less_than_the_tolerance():
    check(omission_rows(COARSE[QUICK[1]]))


@pytest.mark.slow
@pytest.mark.parametrize("case", sample(), ids=lambda case: case.name)
def test_no_scene_of_the_sample_loses_more_than_the_tolerance(case):
    check(omission_rows(case))


def test_the_table_is_of_todays_physics_and_of_other_scenes_than_the_study():
    table = measured_table()
    assert table.physics == PHYSICS_VERSION, "run python tools/omission_table.py"
    assert len(table.kinds) == len(kinds())
    for kind, (shapes, support) in zip(table.kinds, kinds(), strict=True):
        for shape in (shapes[0], shapes[-1]):
            assert kind.holds(Scene.model_validate({"object": shape}).object, support)
        assert set(kind.change) == set(PARTS) and kind.scenes >= 3
    assert min(case.seed for case in sample()) == FIRST_SEED > 2


@pytest.mark.parametrize(
    "other",
    [
        {"object": sphere(80.1, "wood")},
        {"object": sphere(60, MATERIALS["wood"].model_dump())},
        {"support": {"kind": "concave", "thickness_mm": 4.0}},
        {"gripper": {"bed_depth_mm": 34.0}},
        {"medium": {"kind": "plastic", "porosity": 0.39}},
        {"grasp": {"offset_x_mm": 7.0}},
    ],
)
def test_what_the_table_does_not_hold_is_simulated(other):
    known = as_met(Scene.model_validate(WOOD_IN_DISH))
    assert MARGIN * measured_table().kinds[0].change["compliance"] > 0
    assert set(bounds(known)) == set(PARTS)
    scene = Scene.model_validate({**WOOD_IN_DISH, "numerics": {"dx_mm": DX_MM}, **other})
    assert bounds(as_met(scene)) == {}
    parts = {part.name: part for part in build_plan(scene).parts}
    for name in PARTS:
        # Of a material that is given by its numbers no surface is known.
        none = name == "film" and not isinstance(scene.object.material, str)
        assert parts[name].is_solved is not none and parts[name].effect is None


def test_parts_are_left_out_from_the_least_while_their_sum_is_below_the_tolerance():
    case = COARSE["67 mm sphere of wood on concave rubber"]
    limits = bounds(case.plan().scene)
    skin, frame = limits["compliance"], limits["frame"]
    assert limits["elastic"] < skin < frame < limits["film"]
    for tolerance, expected in (
        (skin, set()),
        (1.001 * skin, {"compliance"}),
        # The modes are those of the frame, too: they are the last, however little they change.
        (1.001 * (skin + frame), {"compliance", "frame"}),
        (1.001 * (skin + frame + limits["elastic"]), {"compliance", "frame", "elastic"}),
    ):
        parts = case.plan(tolerance=tolerance).parts
        omitted = (part for part in parts if part.name in PARTS and not part.is_solved)
        absent = {part.name: part.effect for part in omitted}
        assert set(absent) == expected and sum(absent.values()) < tolerance
    everything = case.plan(tolerance=1.0)
    assert not everything.system.modes.inertia.size
