"""What a plan leaves out is worth as little as it says; what it keeps, as much."""

import numpy as np
import pytest

from ajgdata.gripper import Scene, build_plan, simulate
from ajgdata.gripper.object_materials import MATERIALS
from ajgdata.studies.omissions import (
    ALL,
    MECHANICS,
    NOTHING,
    QUICK,
    TOTAL,
    OmissionCase,
    heard,
    omission_rows,
)

#: Coarser than the study: the plan does not depend on the grid, nor does what a part is worth.
DX_MM = 6.0


@pytest.mark.parametrize(("thing", "support"), [*QUICK, ("bar", "rigid")])
def test_all_that_is_left_out_stays_below_the_tolerance(thing, support):
    rows = {row["part"]: row for row in omission_rows(OmissionCase(thing, support, DX_MM))}
    assert rows[TOTAL]["measured"] < rows[TOTAL]["tolerance"]
    for part in ALL:
        # Stated: within a factor of four, or too little to matter by ten.
        assert rows[part]["measured"] < max(4 * rows[part]["estimate"], 1e-3), part


def test_soft_objects_keep_their_skin_and_hard_ones_need_nothing():
    kept = {
        thing: {
            part.name
            for part in OmissionCase(thing, "rigid").plan(tolerance=0.02).parts
            if part.kept
        }
        for thing in ("sphere80_styrofoam", "sphere80_metal")
    }
    assert {"compliance", "film", "motion", "elastic", "frame"} <= kept["sphere80_styrofoam"]
    assert not kept["sphere80_metal"] & set(MECHANICS)


def test_the_plan_says_why_and_the_response_what_was_left_out():
    plan = OmissionCase("sphere80_metal", "rigid", DX_MM).plan(tolerance=0.02)
    frame = next(part for part in plan.parts if part.name == "frame")
    assert not frame.kept and 0 < frame.effect < 0.02 and "stress through the grains" in frame.why
    left_out = simulate(plan).provenance["left_out"]
    assert any(said.startswith("frame (effect about") for said in left_out)
    asked = OmissionCase("sphere80_metal", "rigid", DX_MM).plan(keep=("frame",))
    assert next(part for part in asked.parts if part.name == "frame").kept
    assert plan.bytes < asked.bytes
    assert plan.describe()["modes"] == 0 < asked.describe()["modes"]


def test_a_harder_object_comes_nearer_to_a_rigid_one_as_its_stiffness_grows():
    def response(material):
        shape = {"kind": "cube", "edge_mm": 20, "material": material}
        numerics = {
            "dx_mm": DX_MM,
            "keep": ["membrane", "motion", "elastic", "compliance"],
            "tolerance": NOTHING,
            "precision": "float64",
            "max_time_s": 0.02,
        }
        return simulate(Scene.model_validate({"object": shape, "numerics": numerics})).samples

    steel, rigid = MATERIALS["steel"], response("rigid")
    moduli = np.array([2e11, 2e12, 2e13])
    distance = [
        float(np.linalg.norm(response(steel.model_copy(update={"young_pa": float(e)})) - rigid))
        for e in moduli
    ]
    # All that yields is a spring far above the band: the change is its flexibility, 1/E.
    slope = np.polyfit(np.log(moduli), np.log(distance), 1)[0]
    assert slope == pytest.approx(-1, abs=0.02)
    assert distance[-1] < 1e-5 * np.linalg.norm(rigid)


def test_what_a_rigid_object_rests_on_changes_nothing():
    rigid = Scene.model_validate(
        {"object": {"kind": "cube", "edge_mm": 20}, "numerics": {"dx_mm": DX_MM}}
    )
    on_rubber = rigid.model_copy(
        update={"support": rigid.support.model_copy(update={"kind": "rubber"})}
    )
    one, other = (simulate(scene).samples.tobytes() for scene in (rigid, on_rubber))
    assert one == other
    assert not build_plan(rigid).system.modes.inertia.size


def test_the_error_stays_below_whatever_tolerance_is_asked_for():
    case = OmissionCase("sphere80_styrofoam", "rigid", DX_MM)
    whole = heard(case.plan(ALL)).feature
    errors = [
        np.linalg.norm(heard(case.plan(("membrane",), limit)).feature - whole)
        for limit in (0.001, 0.03, 0.3)
    ]
    assert errors[0] < 0.001 < errors[1] < 0.03 < errors[2] < 0.3
