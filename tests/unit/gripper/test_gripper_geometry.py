import numpy as np
import pytest

from ajgdata.gripper import Scene, SceneError
from ajgdata.gripper.geometry import grasp_cavity
from ajgdata.gripper.random_fields import RandomField
from ajgdata.gripper.relief import RASTER_M, STEEPEST, relief

CALM = {"roughness_mm": 0, "slope_deg": 0, "packing": 0, "force": 0}


def _scene(shape, **grasp):
    return Scene.model_validate({"object": shape, "grasp": {"nuisance": CALM} | grasp})


SHAPES = [
    {"kind": "cube", "edge_mm": 10},
    {
        "kind": "compound",
        "parts": [
            {"shape": {"kind": "box", "length_mm": 40, "width_mm": 20, "height_mm": 9}},
            {"shape": {"kind": "rod", "diameter_mm": 9, "length_mm": 30}, "y_mm": 14, "lift_mm": 2},
        ],
    },
]


@pytest.mark.parametrize("shape", SHAPES)
def test_the_gripper_sinks_until_force_and_stiffness_agree_and_grains_keep_their_volume(shape):
    result = grasp_cavity(_scene(shape))
    free = grasp_cavity(_scene(None))
    # 8 N / 4e5 N/m3; brentq stops within 1 nm of height over the rim's area.
    assert result.displaced_m3 == pytest.approx(2e-5, abs=1e-9 * np.pi * 0.05**2)
    volumes = [
        np.sum(np.clip(np.minimum(c.surface, c.roof) - c.floor, 0, None)) for c in (result, free)
    ]
    assert volumes[0] == pytest.approx(volumes[1], rel=1e-5)
    assert np.max(result.surface) > np.max(free.surface[free.roof > 0.01])  # it rises


def test_the_free_balloon_is_a_half_ellipsoid():
    balloon = grasp_cavity(_scene(None))
    volume = -np.sum(balloon.floor) * RASTER_M**2
    assert volume == pytest.approx(2 / 3 * np.pi * 0.05**2 * 0.045, rel=1e-3)
    cone = np.sum(balloon.roof) * RASTER_M**2
    exact = np.pi * 0.045 / 3 * (0.05**2 + 0.05 * 0.04 + 0.04**2)
    assert cone == pytest.approx(exact, rel=1e-3)
    assert not balloon.contact.any()
    assert np.array_equal(balloon.floor, balloon.floor[::-1, ::-1])


def _relief(shape, **keys):
    scene = Scene.model_validate({"object": shape, **keys})
    axis = np.arange(-120, 121) * RASTER_M
    return axis, relief(scene, *np.meshgrid(axis, axis))


def test_a_compound_is_what_its_parts_are():
    half = {"kind": "box", "length_mm": 20, "width_mm": 24, "height_mm": 15}
    whole = half | {"length_mm": 40}
    parts = [{"shape": half, "x_mm": -10}, {"shape": half, "x_mm": 10, "angle_deg": 180}]
    stacked = [
        {"shape": whole | {"height_mm": 5}},
        {"shape": whole | {"height_mm": 10}, "lift_mm": 5},
    ]
    _, expected = _relief(whole, grasp={"angle_deg": 31, "offset_x_mm": 3})
    for compound in (parts, stacked, [{"shape": whole}]):
        shape = {"kind": "compound", "parts": compound}
        _, result = _relief(shape, grasp={"angle_deg": 31, "offset_x_mm": 3})
        assert np.allclose(result.height, expected.height, atol=1e-12)
    ball = {"kind": "ellipsoid", "diameters_mm": [20, 20, 20]}
    _, round_ = _relief({"kind": "sphere", "diameter_mm": 20})
    assert np.array_equal(_relief(ball)[1].height, round_.height)


def test_beside_a_ball_the_relief_falls_off_from_its_edge():
    axis, result = _relief({"kind": "sphere", "diameter_mm": 20})
    away = np.hypot(*np.meshgrid(axis, axis))
    flank = (away > 0.01) & (away < 0.02)
    expected = 0.01 - STEEPEST * (away - 0.01)  # from the equator, 10 mm high
    assert result.height[flank] == pytest.approx(expected[flank], abs=1e-12)
    # Half of the sample is inside that the edge goes through.
    edge = np.abs(away - 0.01) < RASTER_M / 2
    assert result.inside[edge] == pytest.approx((0.5 - (away - 0.01) / RASTER_M)[edge], abs=1e-9)


# The roof leaves 45 - 4 mm, so the rim stays 38 mm above the table. The half-ellipsoid reaches 7 mm
# below that: with the pin 9 of the 20 cm³ that 8 N displace. At 30 mm it would reach 15: 35 cm³.
PIN = {"kind": "cylinder", "diameter_mm": 4, "height_mm": 79}
POST = {"kind": "box", "length_mm": 30, "width_mm": 30, "height_mm": 100}
APART = {
    "kind": "compound",
    "parts": [{"shape": {"kind": "cube", "edge_mm": 20}, "x_mm": x} for x in (-90, 90)],
}


@pytest.mark.parametrize(
    ("shape", "grasp", "gripper", "named"),
    [
        (PIN, {}, {}, "pinches the cavity to its clearance: make it lower or wider"),
        (POST, {"offset_x_mm": 49, "force_n": 16}, {}, "stand against the housing's rim"),
        (APART, {}, {}, "lies outside the rim: reduce grasp.offset_x_mm"),
        (None, {}, {"bed_depth_mm": 85}, "bury the speaker .*: lower gripper.bed_depth_mm 85"),
    ],
)
def test_what_does_not_fit_is_refused(shape, grasp, gripper, named):
    scene = Scene.model_validate({"object": shape, "grasp": grasp, "gripper": gripper})
    with pytest.raises(SceneError, match=named) as refusal:
        grasp_cavity(scene)
    assert "\n" not in str(refusal.value)


def test_random_fields_live_in_space_and_have_their_statistics():
    field = RandomField(3, "packing", 3, 0.005)
    x = np.linspace(-0.2, 0.2, 81)
    coarse = field.on_axes(x[::4], x[::4], x[::2])
    fine = field.on_axes(x[::4], x[::4], x)
    assert np.allclose(coarse, fine[:, :, ::2], atol=1e-12)
    ensemble = np.array(
        [
            RandomField(s, "roughness", 2, 0.006).on_axes(np.zeros(1), np.array([0, 0.006]))[0]
            for s in range(3_000)
        ]
    )
    # Standard errors of 3,000 draws: 1/√3000 = 0.018 for the mean, √(2/3000) = 0.026 for the rest.
    assert abs(ensemble.mean(0)).max() < 4 * 0.018
    assert ensemble.var(0) == pytest.approx([1, 1], abs=4 * 0.026)
    assert np.mean(ensemble[:, 0] * ensemble[:, 1]) == pytest.approx(np.exp(-0.5), abs=4 * 0.026)
    other = RandomField(4, "packing", 3, 0.005)
    assert not np.allclose(other.on_axes(x[:2], x[:2], x), field.on_axes(x[:2], x[:2], x))
