"""What a plan leaves out is worth as little as it says; what it keeps, as much."""

import numpy as np
import pytest

from ajgdata.gripper import Scene, build_plan, simulate
from ajgdata.gripper.effect_estimates import (
    BANDS_HZ,
    EDGES,
    OMEGA,
    POINTS,
    SAFETY,
    WEIGHTS,
    Circuit,
)
from ajgdata.gripper.object_materials import MATERIALS
from ajgdata.studies.omissions import (
    ALL,
    NOTHING,
    QUICK,
    SAMPLE,
    TOTAL,
    OmissionCase,
    heard,
    omission_rows,
)

#: Coarser than the study: the plan does not depend on the grid, nor does what a part is worth.
DX_MM = 6.0


@pytest.mark.parametrize(("thing", "support"), [*QUICK, ("bar", "rigid")])
def test_all_that_is_left_out_stays_below_the_tolerance_in_every_third_octave(thing, support):
    rows = {row["part"]: row for row in omission_rows(OmissionCase(thing, support, DX_MM))}
    assert rows[TOTAL]["feature"] <= rows[TOTAL]["measured"] < rows[TOTAL]["tolerance"]
    for part in ALL:
        # Stated: within a factor of four, or too little to matter by ten.
        assert rows[part]["measured"] < max(4 * rows[part]["estimate"], 1e-3), part


@pytest.mark.slow
@pytest.mark.parametrize(("thing", "support"), sorted(set(SAMPLE) - set(QUICK)))
def test_no_scene_of_the_sample_loses_more_than_the_tolerance_in_a_band(thing, support):
    total = omission_rows(OmissionCase(thing, support))[-1]
    assert total["part"] == TOTAL and total["measured"] < total["tolerance"]


def test_a_ball_on_rubber_is_heard_where_it_bounces_and_not_where_the_feature_has_its_energy():
    rows = {
        row["part"]: row for row in omission_rows(OmissionCase("sphere80_wood", "concave", DX_MM))
    }
    motion = rows["motion"]
    assert motion["kept"] and motion["measured"] > motion["tolerance"] > 3 * motion["feature"]
    why = next(
        part.why
        for part in OmissionCase("sphere80_wood", "concave").plan(keep=("motion",)).parts
        if part.name == "motion"
    )
    bounce = float(why.split(",")[1].split()[0])
    low, high = EDGES[0] ** 3, EDGES[1] ** 3
    assert low < motion["band_hz"] / bounce < high


def test_bands_are_third_octaves_from_60_hz_up_without_a_gap():
    assert BANDS_HZ[[0, 12, -1]] == pytest.approx([63.1, 1000, 12589], rel=1e-3)
    assert EDGES[1] * BANDS_HZ[:-1] == pytest.approx(EDGES[0] * BANDS_HZ[1:], rel=1e-12)
    assert WEIGHTS.sum(axis=1) == pytest.approx(1, rel=1e-12)
    # Of a constant every mean is the constant.
    everywhere = Circuit(np.full(len(OMEGA), 1.0), None, 0.0, 1.0, np.zeros(len(OMEGA)))
    half = everywhere.effects(np.full(len(OMEGA), 0.1 + 0j))
    assert half == pytest.approx(SAFETY * 0.1 / 1.1, rel=1e-12)


def test_an_effect_in_one_band_alone_counts_as_much_as_one_in_all():
    one = Circuit(np.full(len(OMEGA), 1.0), None, 0.0, 1.0, np.zeros(len(OMEGA)))
    narrow = np.where(np.arange(len(OMEGA)) // POINTS == 3, 0.01, 0.0) + 0j
    effects = one.effects(narrow)
    assert effects[3] == one.effect(narrow) == pytest.approx(SAFETY * 0.01 / 1.01)
    assert effects[-1] == 0 and np.count_nonzero(effects) == 1


def test_a_resonance_too_narrow_for_the_points_is_not_overlooked():
    # Mean square over a band of a mode's velocity per force, 1/(2η ω₀³/…) in closed form: ∫|H|²dω =
    # π/(2 η ω₀ m²) for unit mass, wherever the resonance lies between the points.
    one = Circuit(np.full(len(OMEGA), 1.0), None, 0.0, 1.0, np.zeros(len(OMEGA)))
    loss = np.array([0.002])
    for centre in (1000.0, 1004.0, 1011.0):
        natural = np.array([(2 * np.pi * centre) ** 2])
        admittance = one.bent(natural, loss, np.array([1e-6]), np.array([0.0]))[0]
        width = 2 * np.pi * 1000 * (EDGES[1] - EDGES[0])
        exact = 1e-6**2 * np.sqrt(np.pi / (2 * loss[0] * np.sqrt(natural[0])) / width)
        # A peak as wide as the points are apart is met by one or two of them.
        assert WEIGHTS[12] @ np.abs(admittance) ** 2 == pytest.approx(exact**2, rel=0.5)


def test_soft_objects_keep_their_skin_and_hard_ones_what_moves_them():
    kept = {
        thing: {
            part.name
            for part in OmissionCase(thing, "rigid").plan(tolerance=0.02).parts
            if part.kept
        }
        for thing in ("sphere80_styrofoam", "sphere80_metal")
    }
    assert {"compliance", "film", "motion", "elastic", "frame"} <= kept["sphere80_styrofoam"]
    assert "compliance" not in kept["sphere80_metal"]


def test_the_plan_says_why_and_the_response_what_was_left_out():
    loose = OmissionCase("sphere80_metal", "rigid", DX_MM).plan(tolerance=0.3)
    frame = next(part for part in loose.parts if part.name == "frame")
    assert not frame.kept and 0 < frame.effect < 0.3 and "stress through the grains" in frame.why
    left_out = simulate(loose).provenance["left_out"]
    assert any(said.startswith("frame (effect about") for said in left_out)
    asked = OmissionCase("sphere80_metal", "rigid", DX_MM).plan(keep=("frame",))
    assert next(part for part in asked.parts if part.name == "frame").kept
    assert loose.bytes < asked.bytes
    assert loose.describe()["modes"] == 0 < asked.describe()["modes"]


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
    whole = heard(case.plan(ALL))
    limits = (0.001, 0.03, 0.3)
    errors = [max(whole.change(heard(case.plan(("membrane",), limit)))[:2]) for limit in limits]
    assert errors == sorted(errors) and errors[2] > 0.01
    assert all(error < limit for error, limit in zip(errors, limits, strict=True))
