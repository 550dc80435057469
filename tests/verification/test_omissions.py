"""What the plan leaves out saves time and changes little; all else is solved."""

from dataclasses import replace

import pytest

from ajgdata.gripper import Scene, build_plan
from ajgdata.gripper.objects import ObjectPart
from ajgdata.studies.omissions import (
    COMPLETE,
    LARGEST_BAND_CHANGE,
    LARGEST_CHANGE,
    Case,
    box,
    cube,
    sample,
    sound,
)

#: Coarser than the study: what a part changes depends little on the grid.
DX_MM = 6.0
FRAME: tuple[ObjectPart, ...] = ("frame", "motion", "elastic")
CASES = {case.name: replace(case, dx_mm=DX_MM) for case in sample()}
#: Blocks of other sizes than those of the study.
BLOCKS = [
    cube(10),
    cube(20),
    cube(30),
    box(60, 15, 30, "wood"),
    box(40, 12, 12, "steel"),
]


def solved(scene: dict) -> set[str]:
    """Return the parts of the object that the plan of a scene solves."""
    plan = build_plan(Scene.model_validate({"numerics": {"dx_mm": DX_MM}, **scene}))
    return {part.name for part in plan.parts if part.is_solved}


@pytest.mark.parametrize("shape", BLOCKS, ids=lambda shape: f"{shape['kind']} {shape['material']}")
def test_the_frame_of_the_grains_changes_little_on_hard_blocks(shape):
    case = Case("blocks", "block", shape, "rigid", seed=7, dx_mm=DX_MM)
    assert not {*FRAME} & solved({"object": shape})
    change = sound(case.plan()).change(sound(case.plan(FRAME)))
    assert change["feature"] < LARGEST_CHANGE
    assert change["measured"] < LARGEST_BAND_CHANGE


@pytest.mark.parametrize(
    "scene",
    [
        {"object": "foam_brick"},
        {"object": "sphere80_metal"},
        {"object": "plate_metal"},
        {"object": cube(20), "support": {"kind": "concave"}},
        {"object": cube(20) | {"shell_mm": 2}},
        {"object": cube(20), "numerics": {"dx_mm": DX_MM, "omit": []}},
    ],
    ids=["soft", "ball", "plate", "on rubber", "hollow", "complete"],
)
def test_the_frame_is_solved_in_all_other_scenes(scene):
    assert {*FRAME} <= solved(scene)


@pytest.mark.parametrize("name", ["67 mm sphere of wood", "plate of steel", "tennis ball"])
def test_modes_above_8_khz_change_little(name):
    case = CASES[name]
    complete = case.plan()
    default = replace(case, solver=COMPLETE | {"modes_hz": 8_000.0}).plan()
    assert default.system.modes.inertia.size < complete.system.modes.inertia.size
    change = sound(complete).change(sound(default))
    assert change["feature"] < 0.002
    assert change["measured"] < 0.01


def test_a_part_that_is_named_is_left_out():
    scene = {"object": "sphere80_wood", "support": {"kind": "concave"}}
    everything = solved(scene)
    numerics = {"dx_mm": DX_MM, "omit": ["film", "motion"]}
    # With the frame of the grains the object moves.
    assert everything - solved({**scene, "numerics": numerics}) == {"film"}
    numerics["omit"] = ["frame", "motion"]
    assert everything - solved({**scene, "numerics": numerics}) == {"frame", "motion"}
