from itertools import pairwise

import numpy as np
import pytest
from pydantic import ValidationError

from ajgdata.gripper import Scene, SceneError, simulate
from ajgdata.gripper.geometry import cavity
from ajgdata.gripper.random_fields import RandomField
from ajgdata.gripper.relief import RASTER_M, relief

CALM = {"roughness_mm": 0, "slope_deg": 0, "packing": 0, "force": 0, "temperature_k": 0}


def _scene(shape, **grasp):
    return Scene.model_validate({"object": shape, "grasp": {"nuisance": CALM} | grasp})


SHAPES = [
    {"kind": "cube", "edge_mm": 10},
    {"kind": "cube", "edge_mm": 30},
    {"kind": "cylinder", "diameter_mm": 25, "height_mm": 18},
    {"kind": "ellipsoid", "diameters_mm": [30, 30, 30]},
    {"kind": "ellipsoid", "diameters_mm": [80, 80, 80]},
    {"kind": "rod", "diameter_mm": 18, "length_mm": 121},
    {
        "kind": "compound",
        "parts": [
            {"shape": {"kind": "box", "length_mm": 40, "width_mm": 20, "height_mm": 9}},
            {"shape": {"kind": "rod", "diameter_mm": 9, "length_mm": 30}, "y_mm": 14, "lift_mm": 2},
        ],
    },
    {"kind": "box", "length_mm": 270, "width_mm": 44, "height_mm": 15},
]


@pytest.mark.parametrize("shape", SHAPES)
def test_the_gripper_sinks_until_force_and_stiffness_agree(shape):
    found = cavity(_scene(shape))
    # 8 N / 4e5 N/m3; brentq stops within 1 nm of height over the rim's area.
    assert found.displaced_m3 == pytest.approx(2e-5, abs=1e-9 * np.pi * 0.05**2)
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


def test_the_membrane_is_nowhere_steeper_than_the_angle_it_drapes_at():
    cube = {"kind": "cube", "edge_mm": 20}
    found = cavity(Scene.model_validate({"object": cube, "gripper": {"drape_deg": 72}}))
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


def test_only_what_is_under_the_membrane_matters():
    """A tin of twice the height holds the gripper up just the same, and so does a longer bar."""
    tin, bar = {"kind": "cylinder", "diameter_mm": 60}, {"kind": "rod", "diameter_mm": 30}
    low, high = (cavity(_scene(tin | {"height_mm": h})) for h in (100, 200))
    short, long = (cavity(_scene(bar | {"length_mm": 200 * n}, angle_deg=20)) for n in (1, 2))
    for one, other in ((low, high), (short, long)):
        for name in ("floor", "surface", "contact", "held"):
            assert np.allclose(getattr(one, name), getattr(other, name), atol=1e-8)
    assert high.table_m == pytest.approx(low.table_m - 0.1)


def _relief(shape, **keys):
    scene = Scene.model_validate({"object": shape, **keys})
    axis = np.arange(-120, 121) * RASTER_M
    return axis, relief(scene, *np.meshgrid(axis, axis))


@pytest.mark.parametrize("diameter", [6.0, 20.0, 45.0])
def test_the_membrane_leaves_a_sphere_and_a_rod_where_they_are_as_steep_as_it(diameter):
    r, steep = diameter / 2 * 1e-3, np.deg2rad(72.0)
    left = r * np.sin(steep)
    for shape in (
        {"kind": "sphere", "diameter_mm": diameter},
        {"kind": "rod", "diameter_mm": diameter, "length_mm": 110},
    ):
        axis, found = _relief(shape, gripper={"drape_deg": 72})
        profile = found.height[:, 120]
        away = np.abs(axis)
        exact = np.where(
            away < left,
            r + np.sqrt(np.clip(r**2 - axis**2, 0, None)),
            r + r * np.cos(steep) - np.tan(steep) * (away - left),
        )
        # The cone is round to 0.2 %, and half a raster step beside the tangent point the circle,
        # of curvature 1/(r cos^3), is lower than its tangent by this.
        miss = (RASTER_M / 2) ** 2 / (2 * r * np.cos(steep) ** 3)
        assert np.allclose(profile, exact, atol=miss + 0.002 * np.tan(steep) * 0.06)
        assert np.all(found.touching[120 + int(np.ceil(left / RASTER_M)) + 2 :, 120] < 0.5)
        assert np.all(found.touching[120, 118:123] == 1)


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
        _, found = _relief(shape, grasp={"angle_deg": 31, "offset_x_mm": 3})
        assert np.allclose(found.height, expected.height, atol=1e-12)
    ball = {"kind": "ellipsoid", "diameters_mm": [20, 20, 20]}
    _, round_ = _relief({"kind": "sphere", "diameter_mm": 20})
    assert np.array_equal(_relief(ball)[1].height, round_.height)


PIN = {"kind": "cylinder", "diameter_mm": 4, "height_mm": 150}
POST = {"kind": "box", "length_mm": 30, "width_mm": 30, "height_mm": 100}
APART = {
    "kind": "compound",
    "parts": [{"shape": {"kind": "cube", "edge_mm": 20}, "x_mm": x} for x in (-90, 90)],
}
BLOCK = {"kind": "box", "length_mm": 47, "width_mm": 20, "height_mm": 12}
SWEEPS = {
    "edge of a cube": lambda t: ({"kind": "cube", "edge_mm": 17.13 + t}, {}),
    "length of a rod": lambda t: (
        {"kind": "rod", "diameter_mm": 17, "length_mm": 40 + t},
        {"angle_deg": 17},
    ),
    "diameter of a sphere": lambda t: ({"kind": "sphere", "diameter_mm": 27.13 + t}, {}),
    "angle of a rod": lambda t: (
        {"kind": "rod", "diameter_mm": 17, "length_mm": 40},
        {"angle_deg": 17 + 5 * t},
    ),
    "angle of a compound": lambda t: (
        {
            "kind": "compound",
            "parts": [
                {"shape": BLOCK},
                {"shape": {"kind": "rod", "diameter_mm": 9, "length_mm": 39}, "y_mm": 14},
            ],
        },
        {"angle_deg": 17 + 5 * t},
    ),
    "place of an ellipsoid": lambda t: (
        {"kind": "ellipsoid", "diameters_mm": [60, 25, 20]},
        {"offset_y_mm": t},
    ),
}


@pytest.mark.parametrize("name", SWEEPS)
def test_nothing_jumps_as_sizes_and_angles_change(name):
    """Steps of a tenth of the raster: the whole change is the sum of equal ones."""
    found = []
    for t in np.arange(5) * RASTER_M * 1e3 / 10:
        shape, grasp = SWEEPS[name](t)
        found.append(cavity(_scene(shape, **grasp)))
    for field in ("floor", "surface", "contact", "held"):
        values = [getattr(one, field) for one in found]
        steps = [np.linalg.norm(b - a) for a, b in pairwise(values)]
        whole = np.linalg.norm(values[-1] - values[0])
        # Samples that jump from 0 to 1, at other places in each step, give a whole of 0.7 to 0.85
        # of the steps and steps that differ by 2.5 to 4 (measured without antialiasing).
        assert whole > 0.9 * sum(steps)
        assert max(steps) < 2 * min(steps)


@pytest.mark.parametrize(
    ("shape", "grasp", "gripper", "named"),
    [
        (PIN, {"force_n": 40}, {}, "pinches the cavity to its clearance: make it lower or wider"),
        (
            PIN,
            {"force_n": 40, "offset_x_mm": -34},
            {},
            r"stand in the transducer at gripper.speaker_mm \(-35, 3\)",
        ),
        (POST, {"offset_x_mm": 49, "force_n": 16}, {}, "stand against the housing's rim"),
        (POST, {"offset_x_mm": 30, "force_n": 30}, {}, "pinches .* mm of at least 4 mm"),
        (
            {"kind": "sphere", "diameter_mm": 1},
            {"force_n": 40},
            {"stiffness_n_m3": 5e4},
            "lets the rim stand on the table",
        ),
        (APART, {}, {}, "lies outside the rim: reduce grasp.offset_x_mm"),
        (None, {}, {"bed_depth_mm": 85}, "bury the speaker .*: lower gripper.bed_depth_mm 85"),
        (POST, {"force_n": 20}, {"bed_depth_mm": 84}, "no longer fit: lower gripper.bed_depth_mm"),
    ],
)
def test_what_does_not_fit_is_refused(shape, grasp, gripper, named):
    scene = Scene.model_validate({"object": shape, "grasp": grasp, "gripper": gripper})
    with pytest.raises(SceneError, match=named) as refusal:
        cavity(scene)
    assert "\n" not in str(refusal.value)


def test_a_crumb_is_held_and_felt():
    felt, smaller = (cavity(_scene({"kind": "cube", "edge_mm": e})) for e in (1.0, 0.5))
    assert felt.displaced_m3 == pytest.approx(2e-5, rel=1e-6)
    assert np.max(felt.floor - smaller.floor) > 5e-5


def test_random_fields_live_in_space_and_have_their_statistics():
    field = RandomField(3, "packing", 3, 0.005)
    x = np.linspace(-0.2, 0.2, 81)
    coarse, fine = field.on_axes(x[::4], x[::4], x[::2]), field.on_axes(x[::4], x[::4], x)
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


def test_cases_of_transducers_hang_from_the_roof_and_look_at_the_axis():
    bodies = {"side_mm": 8.0, "depth_mm": 4.0, "tilt_deg": 25.0}
    gripper = {"speaker_mm": [-30.0, 0.0], "microphone_mm": [0.0, 28.0]}
    plain, hung = (
        cavity(Scene.model_validate({"object": None, "gripper": {**gripper, "bodies": given}}))
        for given in (None, bodies)
    )
    depth = plain.roof - hung.roof
    x, y = np.meshgrid(hung.axis, hung.axis)
    # The faces' edges are a sample wide, and the tilt adds on one side what it takes on the other.
    assert depth.sum() * RASTER_M**2 == pytest.approx(2 * 0.008**2 * 0.004, rel=0.02)
    for toward, across in ((-x - 0.030, y), (y - 0.028, x)):
        face = (np.abs(toward) < 3.6e-3) & (np.abs(across) < 3.6e-3)
        expected = 0.004 + np.tan(np.deg2rad(25)) * toward[face]
        np.testing.assert_allclose(depth[face], expected, atol=1e-12)
        beside = (np.hypot(toward, across) > 6.5e-3) & (np.hypot(toward, across) < 9e-3)
        assert not depth[beside].any()


def test_cases_without_depth_and_tilt_are_none():
    short = {"dx_mm": 6.0, "max_time_s": 0.01}
    flat = {"bodies": {"depth_mm": 0.0, "tilt_deg": 0.0}}
    plain, none, hung = (
        simulate(Scene.model_validate({"gripper": gripper, "numerics": short})).samples
        for gripper in ({}, flat, {"bodies": {}})
    )
    assert np.array_equal(plain, none)
    assert np.linalg.norm(hung - plain) > 0.01 * np.linalg.norm(plain)
    with pytest.raises(ValidationError, match="what hangs from it"):
        Scene.model_validate({"gripper": {"height_mm": 20.0, "bodies": {"depth_mm": 15.0}}})
