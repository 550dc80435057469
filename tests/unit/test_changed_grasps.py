"""The factor of the scatter applies to everything that differs between two grasps."""

from ajgdata.acquire.changed_grasps import changed_setup
from ajgdata.types.variants import ChosenGrasps


def test_scatter_scales_the_drift_of_the_air_and_the_nuisances():
    setup = {"object": None, "grasp": {"temperature_k": 0.7, "placed_deg": 1.0}}
    for factor in (0.0, 0.5, 2.0):
        grasp = changed_setup(setup, ChosenGrasps(scatter=factor, pose=1), {})["grasp"]
        assert grasp["temperature_k"] == factor * 0.7
        assert grasp["nuisance"]["roughness_mm"] == factor * 1.0
        assert grasp["placed_deg"] == 1.0
    assert changed_setup(setup, ChosenGrasps(pose=1), {})["grasp"]["temperature_k"] == 0.7
