"""Objects and grippers by name."""

from collections import Counter
from pathlib import Path

import pytest
import yaml

from ajgdata.gripper import Scene, scene_digest
from ajgdata.gripper.grippers import GRIPPERS
from ajgdata.gripper.object_library import HOUSEHOLD, OBJECTS
from ajgdata.gripper.objects import material_of


def test_the_paper_s_objects_are_all_there():
    assert Counter(spec.category for spec in OBJECTS.values()) == {
        "cube": 16,
        "sphere": 8,
        "plate": 4,
        # On edge, flat, and off the axis.
        "bar": 3,
        "spherical": 6,
        "cylindrical": 6,
        "other": 4,
    }
    assert len(HOUSEHOLD) == 16
    edges = [OBJECTS[name].shape.size_mm[0] for name in OBJECTS if name.startswith("cube")]
    assert (min(edges), max(edges), len(set(edges))) == (10, 30, 16)
    # Length, width, height, in the order in which the paper gives them.
    assert OBJECTS["bar"].shape.size_mm == (270, 15, 44)
    assert OBJECTS["bar_flat"].shape.size_mm == (270, 44, 15)
    assert OBJECTS["bar_eccentric"].shape.size_mm == (270, 15, 44)
    assert all(spec.source for spec in OBJECTS.values())


#: Those whose mass is published and whose material has a density.
WEIGHED = [n for n, o in HOUSEHOLD.items() if o.mass_g and o.shape.material != "rigid"]


@pytest.mark.parametrize("name", WEIGHED)
def test_shape_wall_and_material_give_the_published_mass(name):
    spec = HOUSEHOLD[name]
    # Sizes are published to a millimetre or so: of a wall of 2.5 mm, of a bolt's shaft, a tenth.
    density = material_of(spec.shape.material).density_kg_m3
    assert 1e-6 * density * spec.shape.volume_mm3 == pytest.approx(spec.mass_g, rel=0.1)


def test_a_name_stands_for_what_it_names():
    named = Scene.model_validate({"object": "cube_20p7", "gripper": "deep"})
    spelt = Scene.model_validate(
        {
            "object": {"kind": "cube", "edge_mm": 20.7, "material": "pla"},
            "gripper": {"height_mm": 60, "balloon_depth_mm": 50, "bed_depth_mm": 39},
        }
    )
    assert named == spelt and scene_digest(named) == scene_digest(spelt)
    again = Scene.model_validate_json(named.model_dump_json())
    assert scene_digest(again) == scene_digest(named)
    larger = Scene.model_validate({"object": {"kind": "cube", "edge_mm": 20.700001}})
    assert scene_digest(larger) != scene_digest(Scene.model_validate({"object": "cube_20p7"}))


def test_the_scene_of_the_documentation_is_one_and_names_are_all_documented():
    page = (Path(__file__).parents[3] / "docs/virtual-gripper.md").read_text(encoding="utf-8")
    scene = Scene.model_validate(yaml.safe_load(page.split("```yaml")[1].split("```")[0]))
    assert scene.gripper == GRIPPERS["small"] and scene.support.kind == "concave"
    assert [name for name in GRIPPERS if f"`{name}`" not in page] == []
