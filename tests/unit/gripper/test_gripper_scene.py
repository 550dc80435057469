import pytest
from pydantic import ValidationError

from ajgdata.gripper.scene import Scene, derive_seed

CUBE = {"kind": "cube", "edge_mm": 20}
SOLID = {"density_kg_m3": 1e3, "young_pa": 1e9, "poisson": 0.3, "loss": 0.1}


@pytest.mark.parametrize(
    ("scene", "named"),
    [
        ({"object": {"kind": "cube", "edge_mm": float("nan")}}, "edge_mm"),
        ({"gripper": {"speaker_mm": [39, 10]}}, "speaker_mm"),
        ({"numerics": {"dx": 3}}, "dx"),
        ({"numerics": {"dx_mm": 5}, "gripper": {"height_mm": 9}}, "of 9 mm: at most 4.5"),
        ({"gripper": {"port_mm": [38.01, 0]}}, "lies outside the roof of radius 40 mm"),
        ({"environment": {"temperature_c": 61}}, "temperature_c"),
        ({"gripper": {"bed_depth_mm": 90}}, "bed_depth_mm 90 overfills"),
        ({"medium": {"porosity": 0.9}}, "porosity 0.9 leaves no grains .*packing below 0.037"),
        ({"object": "bananna"}, "'bananna': try banana"),
        ({"gripper": "tiny"}, "no gripper is called 'tiny'"),
        ({"session": {"fill_mm": 50}, "gripper": {"height_mm": 20}}, "overfills the gripper"),
        ({"assembly": {"askew_mm": [20, 20]}}, "askew_mm puts the balloon's tip"),
        ({"object": {**CUBE, "material": {**SOLID, "young_pa": 0}}}, "material.numbers.young_pa"),
    ],
)
def test_a_scene_that_cannot_be_is_refused_by_name(scene, named):
    with pytest.raises(ValidationError, match=named):
        Scene.model_validate(scene)


def test_a_port_of_4_mm_may_touch_the_edge_of_the_roof():
    scene = Scene.model_validate({"gripper": {"port_mm": [38, 0]}})
    assert scene.gripper.roof_radius_mm == 38 + scene.gripper.port_bore_mm / 2


def test_seeds_are_known_and_do_not_run_together():
    # SHA-256 of '[7, "cube_10", 3]', first 8 bytes, halved.
    assert derive_seed(7, "cube_10", 3) == 4718857417853082337
    assert len({derive_seed("a", "bc"), derive_seed("ab", "c"), derive_seed("abc")}) == 3
    assert derive_seed(1) != derive_seed("1")
