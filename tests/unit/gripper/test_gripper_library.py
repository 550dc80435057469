"""Objects and grippers by name."""

import math
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from ajgdata.gripper import Scene, SceneError, parse_scene, scene_digest, simulate
from ajgdata.gripper.geometry import cavity
from ajgdata.gripper.grippers import GRIPPERS
from ajgdata.gripper.object_library import HOUSEHOLD, MATERIAL_SET, OBJECTS

#: One object of each shape that differs from the others to a membrane.
SHAPES = [n for n in OBJECTS if n.split("_")[-1] not in MATERIAL_SET or n.endswith("_metal")]
TYPICAL = ["cube_10p0", "cube_30p0", "sphere80_metal", "bar", "spam_can", "screw", "padlock"]


def test_the_paper_s_objects_are_all_there():
    assert Counter(spec.category for spec in OBJECTS.values()) == {
        "cube": 16,
        "sphere": 8,
        # Of each material also the thinnest and the thickest.
        "plate": 12,
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


def test_the_eccentric_bar_is_the_bar_moved_across_its_length():
    """At any angle: it turns with the bar, as a placement beside the axis does not."""
    numerics = {"dx_mm": 6, "max_time_s": 0.005, "tolerance": 0}  # every part is solved
    for angle in (0.0, 30.0):
        turn = math.radians(angle)
        aside = {"offset_x_mm": -3 * math.sin(turn), "offset_y_mm": 3 * math.cos(turn)}
        eccentric, moved = (
            simulate(
                Scene.model_validate(
                    {"object": name, "grasp": {"angle_deg": angle, **where}, "numerics": numerics}
                )
            ).samples
            for name, where in (("bar_eccentric", {}), ("bar", aside))
        )
        # One geometry but for the rounding of 3 mm sin 30° to 1e-16 m, marched in single precision.
        np.testing.assert_allclose(eccentric, moved, rtol=0, atol=1e-6 * abs(moved).max())


#: Those whose mass is published and whose material has a density.
WEIGHED = [n for n, o in HOUSEHOLD.items() if o.mass_g and o.shape.material != "rigid"]


@pytest.mark.parametrize("name", WEIGHED)
def test_shape_wall_and_material_give_the_published_mass(name):
    spec = HOUSEHOLD[name]
    # Sizes are published to a millimetre or so: of a wall of 2.5 mm, of a bolt's shaft, a tenth.
    assert 1e3 * spec.shape.mass_kg == pytest.approx(spec.mass_g, rel=0.1)


@pytest.mark.parametrize("name", SHAPES)
def test_the_default_gripper_holds_every_object_however_it_is_placed(name):
    for seed, angle, x, y in ((0, 0.0, 0.0, 0.0), (1, 77.0, 10.0, -10.0)):
        grasp = {"seed": seed, "angle_deg": angle, "offset_x_mm": x, "offset_y_mm": y}
        found = cavity(Scene.model_validate({"object": name, "grasp": grasp}))
        assert found.held.max() > 0.9
        assert (found.roof - found.floor)[found.contact > 0.5].min() > 4e-3


@pytest.mark.parametrize("gripper", sorted(set(GRIPPERS) - {"default"}))
def test_every_gripper_holds_what_fits_and_names_what_does_not(gripper):
    held = 0
    for name in TYPICAL:
        scene = Scene.model_validate({"object": name, "gripper": gripper})
        try:
            found = cavity(scene)
        except SceneError as refusal:
            assert str(refusal).startswith(f"object {OBJECTS[name].shape.title}")
        else:
            held += 1
            displaced = found.force_n / scene.gripper.stiffness_n_m3
            # brentq stops within 1 nm of the height, times the area of the widest rim.
            assert found.displaced_m3 == pytest.approx(displaced, abs=1e-9 * 0.0125)
    assert held >= len(TYPICAL) - 2


def test_the_grippers_are_all_different_and_valid():
    assert len(GRIPPERS) >= 7
    assert len({gripper.model_dump_json() for gripper in GRIPPERS.values()}) == len(GRIPPERS)
    assert GRIPPERS["default"] == Scene().gripper
    assert GRIPPERS["small"].rim_radius_mm == pytest.approx(40)
    assert GRIPPERS["small"].speaker_mm == pytest.approx((-28, 2.4))


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


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        ({"object": "cube_20"}, "no object is called 'cube_20': try cube_2"),
        ({"object": "bananna"}, "try banana"),
        ({"gripper": "tiny"}, "no gripper is called 'tiny'"),
    ],
)
def test_an_unknown_name_is_told_its_neighbours(scene, said):
    with pytest.raises(ValidationError, match=said):
        Scene.model_validate(scene)


def test_scenes_are_read_from_yaml_and_json():
    text = "object: golf_ball\ngrasp: {angle_deg: 30}\nmedium: {kind: metal}\n"
    scene = parse_scene(text)
    assert scene.object == OBJECTS["golf_ball"].shape and scene.medium.kind == "metal"
    assert parse_scene(scene.model_dump_json()) == scene


def test_the_scene_of_the_documentation_is_one_and_names_are_all_documented():
    page = (Path(__file__).parents[3] / "docs/virtual-gripper.md").read_text(encoding="utf-8")
    scene = parse_scene(page.split("```yaml")[1].split("```")[0])
    assert scene.gripper == GRIPPERS["small"] and scene.support.kind == "concave"
    assert [name for name in GRIPPERS if f"`{name}`" not in page] == []


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("object: {kind: cube, edge_mm: -1}", "object.cube.edge_mm: .* greater .*, got -1"),
        ("object: {kind: cube, edge_mm: .nan}", "object.cube.edge_mm: .*, got nan"),
        ("object: bananna", "object: .*'bananna': try banana"),
        ("object: {kind: cub}", "object: no 'kind' is called 'cub': one of 'cube', 'box'"),
        ("object: {edge_mm: 1}", "object: 'kind' is missing$"),
        (
            "object: {kind: cube, edge_mm: 9, material: {density_kg_m3: -1, young_pa: 1, "
            "poisson: 0, loss: 0}}",
            r"object.cube.material.*density_kg_m3: .* greater .*, got -1$",
        ),
        ("object: {kind: cube, edge_mm: 9, material: iron}", "'steel', .*, got 'iron'$"),
        ("grasp: {force: 1}\nmedium: {kind: sand}", r"medium.kind: .*\(and 1 more\)"),
        ("[1, 2]", "must hold keys"),
        ("object: [", "not YAML or JSON"),
        ("object: golf_ball\ngrasp: {offset_x_mm: 80}", "^scene: .*offset_x_mm"),
    ],
)
def test_a_text_that_is_no_scene_is_refused_in_one_line(text, said):
    with pytest.raises(SceneError, match=said) as refusal:
        parse_scene(text)
    assert "\n" not in str(refusal.value)
