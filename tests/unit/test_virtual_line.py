"""The virtual gripper in this process: takes of a sound card, grasps that no recipe records."""

import numpy as np
import pytest
from test_plant import QUIET, RINGING, STEP

from ajgdata import gripper
from ajgdata.acquire.card import CardSettings
from ajgdata.acquire.plant import Plant, scene_response
from ajgdata.acquire.recipe import new_setup, plan_session
from ajgdata.acquire.robot import Placement
from ajgdata.acquire.sound_card import SoundCard
from ajgdata.acquire.virtual_line import PlantLine, VirtualHands, VirtualTable
from ajgdata.gripper import excitation_sweep
from ajgdata.types import DataError, Recipe

SWEEP = excitation_sweep(duration_s=0.3).astype(np.float32)
RECIPE = Recipe.model_validate(
    {
        "grasps_per_object": 2,
        "scene": {"numerics": {"dx_mm": 6, "max_time_s": 0.006}},
        "vary": {"angle_deg": [-20, 20]},
        "objects": [
            {"name": "cube", "shape": {"kind": "cube", "edge_mm": 20}, "grasp": {"force_n": 7}},
            {"name": "ball", "shape": {"kind": "sphere", "diameter_mm": 30}},
        ],
    }
)


@pytest.mark.parametrize("latency", [0, 64, 1_024])
def test_a_take_is_what_the_simulation_records(latency):
    """Cut by its loop-back, whatever the latency; `record` does not know how the speaker rings on
    within its latency from the end, and the card plays float32."""
    response = scene_response(RINGING, QUIET)
    settings = CardSettings(device="x", loopback_channel=2)
    card = SoundCard(PlantLine(Plant(response), latency), settings)
    known = len(SWEEP) - RINGING.latency_samples
    expected = gripper.record(RINGING, SWEEP, QUIET).samples[:known]
    bound = STEP + 2**-25 * np.abs(response).sum()
    for _ in range(2):  # the first take measures the latency
        taken = card.take(SWEEP)
        np.testing.assert_allclose(taken.samples[:known], expected, atol=bound, rtol=0)
        assert (taken.xruns, taken.attempts) == (0, 1)


def test_a_fresh_grasp_is_drawn_as_the_recipe_does_and_is_none_of_its_own():
    planned = plan_session(RECIPE, "d", "virtual-01", "")
    setup = new_setup(RECIPE, "cube", 5, 6)
    assert setup["object"] == {"kind": "cube", "edge_mm": 20}
    assert set(setup["grasp"]) == set(planned[0].setup["grasp"])
    assert -20 <= setup["grasp"]["angle_deg"] <= 20
    assert (setup["grasp"]["force_n"], setup["grasp"]["seed"]) == (7, 6)
    assert setup["grasp"]["angle_deg"] == new_setup(RECIPE, "cube", 5, 7)["grasp"]["angle_deg"]
    assert setup["grasp"]["angle_deg"] != new_setup(RECIPE, "cube", 8, 6)["grasp"]["angle_deg"]
    assert setup not in [grasp.setup for grasp in planned]
    assert new_setup(RECIPE, "", 5, 6)["object"] is None
    with pytest.raises(ValueError, match="no object 'rod': it has cube, ball"):
        new_setup(RECIPE, "rod", 5, 6)


def test_grasps_of_one_pose_differ_less_than_objects(tmp_path):
    """Two looks at the cube, a ball, and nothing: as spectra, in units of the first."""
    table = VirtualTable(RECIPE, seed=3, folder=tmp_path)
    hands, card = VirtualHands(table), table.card()
    heard = []
    for name, number, look in (("cube", 1, 1), ("cube", 1, 2), ("ball", 2, 1), ("", 3, 1)):
        force = hands.approach(Placement(f"g{number}_{look}", name, number, 8.0))
        assert force == 8.0
        heard.append(np.abs(np.fft.rfft(card.take(SWEEP).samples)))
    first, again, ball, nothing = heard
    far = [np.linalg.norm(one - first) / np.linalg.norm(first) for one in (again, ball, nothing)]
    assert 0 < far[0] < far[1] and far[0] < far[2]
    # The same grasp of another table is the same sound, but for the noise of the take.
    other = VirtualTable(RECIPE, seed=3, folder=tmp_path)
    other.place("cube", 1, "g1_1")
    same = np.abs(np.fft.rfft(other.card().take(SWEEP).samples))
    assert np.linalg.norm(same - first) / np.linalg.norm(first) < far[0] / 3


def test_another_robot_moves_along():
    said = []

    class Arm:
        def __getattr__(self, step):
            return lambda *about: said.append((step, *about)) or 7.5

    class Table:
        def place(self, *about):
            said.append(("table", *about))

    hands = VirtualHands(Table(), Arm())
    placement = Placement("g1", "cube", 1, 8.0)
    hands.loosen()
    assert hands.approach(placement) == 7.5
    hands.hold(0.5)
    hands.place("A")
    hands.halt("cube")
    assert said == [
        ("loosen",), ("approach", placement), ("table", "cube", 1, "g1"), ("hold", 0.5),
        ("place", "A"), ("halt", "cube"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    "signal, said",
    [({"motor": {}}, "motor"), ({"level_db_spl": None}, "silent")],
)
def test_what_a_response_cannot_give_is_refused(signal, said, tmp_path):
    with pytest.raises(DataError, match=said):
        VirtualTable(RECIPE.model_copy(update={"signal": signal}), 0, tmp_path)


def test_an_object_that_is_not_there_is_named(tmp_path):
    with pytest.raises(DataError, match="objects: the recipe has no object 'rod'"):
        VirtualTable(RECIPE, 0, tmp_path).place("rod", 1, "g")
