import pytest
from pydantic import ValidationError

from ajgdata.gripper.scene import Scene, derive_seed, scene_digest

CUBE = {"kind": "cube", "edge_mm": 20}
SOLID = {"density_kg_m3": 1e3, "young_pa": 1e9, "poisson": 0.3, "loss": 0.1}


@pytest.mark.parametrize(
    ("scene", "named"),
    [
        ({"object": {"kind": "cube", "edge_mm": float("nan")}}, "edge_mm"),
        ({"gripper": {"speaker_mm": [39, 10]}}, "speaker_mm"),
        ({"numerics": {"dx": 3}}, "dx"),
        ({"environment": {"temperature_c": 61}}, "temperature_c"),
        ({"gripper": {"bed_depth_mm": 90}}, "bed_depth_mm 90 overfills"),
        ({"medium": {"porosity": 0.9}}, "porosity 0.9 leaves no grains .*packing below 0.037"),
        ({"object": {**CUBE, "material": {**SOLID, "young_pa": 0}}}, "material.numbers.young_pa"),
    ],
)
def test_a_scene_that_cannot_be_is_refused_by_name(scene, named):
    with pytest.raises(ValidationError, match=named):
        Scene.model_validate(scene)


def test_a_medium_brings_its_grains_unless_told_otherwise():
    metal = Scene.model_validate({"medium": {"kind": "metal"}}).medium
    assert (metal.grain_diameter_mm, metal.porosity) == (4.5, 0.40)
    fine = Scene.model_validate({"medium": {"kind": "metal", "grain_diameter_mm": 2}}).medium
    assert fine.grain_diameter_mm == 2


def test_the_digest_knows_values_not_spelling():
    written = Scene.model_validate({"object": CUBE, "medium": {"kind": "plastic"}})
    again = Scene.model_validate_json(written.model_dump_json())
    implied = Scene.model_validate({"object": {"edge_mm": 20.0, "kind": "cube"}})
    assert scene_digest(written) == scene_digest(again) == scene_digest(implied)
    larger = Scene.model_validate({"object": {"kind": "cube", "edge_mm": 20.000001}})
    assert scene_digest(larger) != scene_digest(written)


def test_seeds_are_known_and_do_not_run_together():
    # SHA-256 of '[7, "cube_10", 3]', first 8 bytes, halved.
    assert derive_seed(7, "cube_10", 3) == 4718857417853082337
    assert len({derive_seed("a", "bc"), derive_seed("ab", "c"), derive_seed("abc")}) == 3
    assert derive_seed(1) != derive_seed("1")
