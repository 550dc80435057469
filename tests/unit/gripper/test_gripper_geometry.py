import numpy as np
import pytest

from ajgdata.gripper.fields import RandomField
from ajgdata.gripper.geometry import RASTER_M, SceneError, cavity
from ajgdata.gripper.scene import Scene

CALM = {"roughness_mm": 0, "slope_deg": 0, "packing": 0, "force": 0, "temperature_k": 0}


def _scene(shape, **grasp):
    return Scene.model_validate({"object": shape, "grasp": {"nuisance": CALM} | grasp})


SHAPES = [
    {"kind": "cube", "edge_mm": 10},
    {"kind": "cube", "edge_mm": 30},
    {"kind": "cylinder", "diameter_mm": 25, "height_mm": 18},
    {"kind": "ellipsoid", "diameters_mm": [30, 30, 30]},
    {"kind": "ellipsoid", "diameters_mm": [80, 80, 80]},
    {"kind": "box", "length_mm": 270, "width_mm": 44, "height_mm": 15},
]


@pytest.mark.parametrize("shape", SHAPES)
def test_the_gripper_sinks_until_force_and_stiffness_agree(shape):
    found = cavity(_scene(shape))
    # 8 N / 4e5 N/m3; smoothing the membrane's kink along the contact may add a little.
    assert found.displaced_m3 == pytest.approx(2e-5, rel=0.03)
    assert np.all(found.floor <= 0.041)


@pytest.mark.parametrize("shape", SHAPES)
def test_grains_keep_their_volume(shape):
    scene = _scene(shape)
    found, free = cavity(scene), cavity(_scene(None))
    volumes = [
        np.sum(np.clip(np.minimum(c.surface, c.roof) - c.floor, 0, None)) * RASTER_M**2
        for c in (found, free)
    ]
    assert volumes[0] == pytest.approx(volumes[1], rel=1e-5)
    assert np.max(found.surface) > np.max(free.surface[free.roof > 0.01])  # it rises


def test_the_free_balloon_is_a_half_ellipsoid():
    found = cavity(_scene(None))
    volume = -np.sum(found.floor) * RASTER_M**2
    assert volume == pytest.approx(2 / 3 * np.pi * 0.05**2 * 0.045, rel=1e-3)
    cone = np.sum(found.roof) * RASTER_M**2
    exact = np.pi * 0.045 / 3 * (0.05**2 + 0.05 * 0.04 + 0.04**2)
    assert cone == pytest.approx(exact, rel=1e-3)
    assert not found.contact.any()


def test_the_membrane_is_nowhere_steeper_than_it_drapes():
    found = cavity(_scene({"kind": "cube", "edge_mm": 20}))
    inner = np.hypot(*np.meshgrid(found.axis, found.axis)) < 0.03
    steepest = np.hypot(*np.gradient(found.floor, RASTER_M))[inner].max()
    assert 0.5 * np.tan(np.deg2rad(72)) < steepest <= np.tan(np.deg2rad(72)) * 1.02


def test_turning_a_cube_by_a_right_angle_changes_nothing_and_a_box_much():
    cube, box = {"kind": "cube", "edge_mm": 20}, {**SHAPES[-1], "length_mm": 60, "width_mm": 20}
    assert np.allclose(
        cavity(_scene(cube)).floor, cavity(_scene(cube, angle_deg=90)).floor, atol=1e-9
    )
    straight, turned = (cavity(_scene(box, angle_deg=a)).floor for a in (0, 90))
    assert np.allclose(straight, turned.T, atol=1e-6)
    assert np.max(np.abs(straight - turned)) > 5e-3


def test_a_slab_wider_than_the_gripper_is_as_good_as_the_table():
    slab = {"kind": "box", "length_mm": 300, "width_mm": 300, "height_mm": 40}
    thin = {**slab, "height_mm": 1}
    assert np.allclose(cavity(_scene(slab)).floor, cavity(_scene(thin)).floor, atol=1e-8)


@pytest.mark.parametrize(
    ("shape", "grasp", "named"),
    [
        ({"kind": "cylinder", "diameter_mm": 4, "height_mm": 150}, {"force_n": 40}, "pinches"),
        (
            {"kind": "box", "length_mm": 30, "width_mm": 30, "height_mm": 100},
            {"offset_x_mm": 49, "force_n": 16},
            "rim",
        ),
    ],
)
def test_what_does_not_fit_is_refused(shape, grasp, named):
    with pytest.raises(SceneError, match=named):
        cavity(_scene(shape, **grasp))


def test_random_fields_live_in_space_and_have_their_statistics():
    field = RandomField.draw(3, "packing", 3, 0.005)
    x = np.linspace(-0.2, 0.2, 81)
    coarse, fine = field.on_axes(x[::4], x[::4], x[::2]), field.on_axes(x[::4], x[::4], x)
    assert np.allclose(coarse, fine[:, :, ::2], atol=1e-12)
    ensemble = np.array(
        [
            RandomField.draw(s, "roughness", 2, 0.006).on_axes(np.zeros(1), np.array([0, 0.006]))[0]
            for s in range(3_000)
        ]
    )
    # Standard errors of 3,000 draws: 1/√3000 = 0.018 for the mean, √(2/3000) = 0.026 for the rest.
    assert abs(ensemble.mean(0)).max() < 4 * 0.018
    assert ensemble.var(0) == pytest.approx([1, 1], abs=4 * 0.026)
    assert np.mean(ensemble[:, 0] * ensemble[:, 1]) == pytest.approx(np.exp(-0.5), abs=4 * 0.026)
    other = RandomField.draw(4, "packing", 3, 0.005)
    assert not np.allclose(other.phases, field.phases)
