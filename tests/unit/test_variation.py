"""What a recipe's variation draws: by gripper, by session, by placement, in any order."""

import numpy as np
import pytest

from ajgdata.acquire.recipe import plan_session
from ajgdata.gripper import Scene
from ajgdata.gripper.variation import Variation
from ajgdata.types import Recipe

BASE = {
    "sessions": 2,
    "grasps_per_object": 3,
    "vary": {"offset_x_mm": [-2, 2]},
    "objects": [{"name": name, "shape": f"cube_{name}"} for name in ("10p0", "20p7")],
}
#: The draws that all committed recipes use; simulated sessions depend on them.
DEFAULT_GRIPPER = {
    "askew_mm": [1.8494, -0.7982],
    "fill_slope_deg": [0.0413, -0.4566],
    "speaker_moved_mm": [0.1727, -0.3951],
    "microphone_moved_mm": [-0.0129, 0.4359],
}
VARIED = BASE | {"order": "blocks", "variation": {}}


def planned(recipe: dict, session: str = "virtual-01", dataset: str = "d"):
    return plan_session(Recipe.model_validate(recipe), dataset, session, "code")


def scenes(grasps) -> list[Scene]:
    return [Scene.model_validate(grasp.setup) for grasp in grasps]


def test_two_sessions_share_the_gripper_and_differ_in_all_else():
    first, second = (scenes(planned(VARIED, name)) for name in ("virtual-01", "virtual-02"))
    assert len({scene.assembly for scene in first + second}) == 1
    for some in (first, second):
        assert len({scene.session for scene in some}) == 1
        assert [s.grasp.history.number for s in some] == list(range(6))
        assert len({s.grasp.history.seed for s in some}) == 1
        # One placement an object, one pose a grasp.
        assert len({(s.grasp.placed_mm, s.grasp.placed_deg) for s in some}) == 2
        assert some[0].grasp.placed_mm == some[2].grasp.placed_mm
        assert len({s.grasp.offset_x_mm for s in some}) == 6
    assert first[0].session != second[0].session
    assert first[0].grasp.history.seed != second[0].grasp.history.seed
    assert first[0].grasp.placed_mm != second[0].grasp.placed_mm


def test_a_gripper_is_the_same_in_every_data_set():
    here, there = (planned(VARIED, dataset=name)[0].setup for name in ("d", "e"))
    assert here["assembly"] == there["assembly"]
    assert here["session"] != there["session"]
    named = planned(VARIED | {"variation": {"gripper": {"name": "b"}}})[0].setup
    assert named["assembly"] != here["assembly"] and named["session"] == here["session"]


def test_what_the_recipe_says_itself_is_not_drawn():
    said = {
        "assembly": {"askew_mm": [1, 1]},
        "session": {"temperature_k": 0},
        "grasp": {"nuisance": {"grain_force": 0.5, "force": 0}, "placed_deg": 3},
    }
    setup = planned(VARIED | {"scene": said})[0].setup
    assert setup["assembly"]["askew_mm"] == [1, 1] and setup["assembly"]["fill_slope_deg"] != [0, 0]
    assert setup["session"]["temperature_k"] == 0 and setup["session"]["jig_mm"] != [0, 0]
    assert setup["grasp"]["nuisance"] == {"grain_force": 0.5, "force": 0}
    assert setup["grasp"]["placed_deg"] == 3


def test_grasps_that_come_later_change_none_that_came_before():
    rounds = VARIED | {"order": "rounds"}
    before = planned(rounds)
    after = planned(rounds | {"grasps_per_object": 5})
    assert len(after) > len(before)
    assert after[: len(before)] == before
    # What comes before changes the bed of all that follows, and nothing else of them.
    (_, *later) = planned(rounds | {"references": 1})
    for old, new in zip(before, later, strict=True):
        assert (
            old.setup["grasp"]["history"]["number"] + 1 == new.setup["grasp"]["history"]["number"]
        )
        assert {**old.setup, "grasp": 0} == {**new.setup, "grasp": 0}


def test_a_recipe_with_grasps_of_another_draws_its_grasps():
    same = Recipe.model_validate(VARIED | {"grasps_of": "d", "samples_per_grasp": 3})
    assert [g.setup for g in planned(VARIED)] == [
        g.setup for g in plan_session(same, "e", "virtual-01", "")
    ]


def test_each_amount_of_a_gripper_has_a_draw_of_its_own():
    """Speaker and microphone have the same amount and differ; a draw is linear in its amount."""
    drawn = Variation().assembly("default")
    amounts = {
        "askew_mm": 2.5,
        "fill_slope_deg": 2.5,
        "speaker_moved_mm": 0.5,
        "microphone_moved_mm": 0.5,
    }
    assert drawn.keys() == amounts.keys()
    shares = {key: tuple(np.array(drawn[key]) / amount) for key, amount in amounts.items()}
    assert len(set(shares.values())) == 4
    assert all(abs(share) <= 1 for pair in shares.values() for share in pair)
    wider = Variation.model_validate({"gripper": {"askew_mm": 5.0, "transducers_mm": 0.0}})
    expected = {
        **drawn,
        "askew_mm": pytest.approx([2 * value for value in drawn["askew_mm"]], abs=2e-4),
    }
    expected |= {"speaker_moved_mm": [0, 0], "microphone_moved_mm": [0, 0]}
    assert wider.assembly("default") == expected
    assert drawn == DEFAULT_GRIPPER


def test_the_air_drifts_smoothly_within_a_session():
    """Standard deviation and correlation are those that are declared; sessions are independent."""
    variation = Variation.model_validate({"session": {"drift_k": 0.5, "drift_grasps": 20}})
    drifts = np.array(
        [
            [variation.air(number, "d", session)["temperature_k"] for number in range(0, 60, 5)]
            for session in range(300)
        ]
    )
    assert drifts.std() == pytest.approx(0.5, rel=0.1)
    assert drifts.mean() == pytest.approx(0, abs=0.06)
    for apart, expected in ((1, np.exp(-(0.25**2) / 2)), (4, np.exp(-0.5)), (8, np.exp(-2.0))):
        product = (drifts[:, apart:] * drifts[:, :-apart]).mean() / 0.25
        assert product == pytest.approx(expected, abs=0.12)
    assert np.abs(np.corrcoef(drifts[0::2, 0], drifts[1::2, 0])[0, 1]) < 0.25


def test_grasps_of_a_session_are_in_drifting_air():
    temperatures = [scene.grasp.temperature_k for scene in scenes(planned(VARIED))]
    assert len({*temperatures}) > 1
    assert np.abs(np.diff(temperatures)).max() < 0.1
    calm = planned(VARIED | {"variation": {"session": {"drift_k": 0}}})
    assert {scene.grasp.temperature_k for scene in scenes(calm)} == {0.0}
