"""What objects stand on: known stiffnesses and resonances."""

import numpy as np
import pytest
from pydantic import ValidationError

from ajgdata.gripper import Scene
from ajgdata.gripper.column import solve
from ajgdata.gripper.contact import layer_stiffness
from ajgdata.gripper.geometry import grasp_cavity
from ajgdata.gripper.grasped_object import mode_weights, object_body, object_stack, rim_modes
from ajgdata.gripper.grid import cut_cells
from ajgdata.gripper.imprint import find_imprint
from ajgdata.gripper.object_library import OBJECTS
from ajgdata.gripper.objects import MATERIALS, Support
from ajgdata.gripper.rest import lies_on_rim, pad_stiffness, rest_on, rim_of

RUBBER = MATERIALS["rubber"]
STEEL = MATERIALS["steel"]
CUP = Support(kind="concave")
BALL = OBJECTS["sphere80_metal"].shape


def test_a_flat_dish_is_a_layer_and_one_as_round_as_the_ball_a_pad():
    load = 20.0
    flat = CUP.model_copy(update={"dish_radius_mm": 1e9})
    layer = layer_stiffness(load, 0.04, 5e-3, RUBBER.young_pa)
    assert rest_on(flat, BALL, STEEL, load).stiffness == pytest.approx(layer, rel=1e-6)
    round_ = CUP.model_copy(update={"dish_radius_mm": 40.0 * (1 + 1e-7)})
    rest = rest_on(round_, BALL, STEEL, load)
    assert rest.foot_m2 == pytest.approx(np.pi * 0.035**2)
    assert rest.stiffness == pytest.approx(pad_stiffness(RUBBER, 5e-3, rest.foot_m2))
    # The closer the fit, the wider the foot and the stiffer the rest.
    feet, stiff = np.array(
        [
            rest_on(CUP.model_copy(update={"dish_radius_mm": r}), BALL, STEEL, load)[:2]
            for r in (400.0, 80.0, 50.0, 41.0)
        ]
    ).T
    assert np.all(np.diff(feet) > 0) and np.all(np.diff(stiff) > 0)


def test_a_ball_in_its_dish_rings_as_a_mass_on_a_spring():
    scene = Scene(object=BALL, support=CUP)
    shape = grasp_cavity(scene)
    where = find_imprint(shape, cut_cells(shape, 4e-3, 0.05, -0.045, 0.045))
    body, rest = object_body(BALL, STEEL, CUP, where, shape.force_n)
    modes = solve(object_stack(scene, BALL, body, rest, None))
    mass = STEEL.density_kg_m3 * np.pi / 6 * 0.08**3
    exact = np.sqrt(rest.stiffness / mass) / (2 * np.pi)
    # Steel under its foot gives way a hundred thousand times less; the membrane adds its 0.3 kg/m².
    assert np.sqrt(modes.omega_squared[0]) / (2 * np.pi) == pytest.approx(exact, rel=1e-2)
    assert 30 < exact < 70
    assert modes.loss[0] == pytest.approx(RUBBER.loss, rel=1e-2)


def test_each_layer_of_air_takes_up_what_evenly_compressed_grains_leave_it():
    shape = grasp_cavity(Scene(object=BALL))
    cells = cut_cells(shape, 4e-3, 0.05, -0.045, 0.045)
    where = find_imprint(shape, cells)
    _, ny, nx = cells.shape
    # The object moves by 1, the grains on it by 1, 1/2 and 0 from their seat to their surface.
    cell, weight = mode_weights(where, cells, np.array([[1.0, 1.0, 0.5, 0.0]]))
    taken = np.zeros(cells.shape)
    np.add.at(taken.reshape(-1), cell, weight[0])
    low = cells.z[:, None] - cells.h / 2
    column = where.column
    within = (low > where.floor) & (low + cells.h < where.surface)
    within &= np.arange(len(cells.z))[:, None] > where.lowest
    share = where.area * cells.h / (where.surface - where.floor)
    layers = taken.reshape(-1, ny * nx)[:, column]
    assert within.sum() > 1_000
    assert layers[within] == pytest.approx(np.broadcast_to(share, within.shape)[within])
    assert layers.sum(0) == pytest.approx(where.area)


@pytest.mark.parametrize(("height_mm", "is_plate"), [(7.99, True), (8.01, False)])
def test_what_is_a_tenth_as_thick_as_wide_does_not_bend_on_the_rim(height_mm, is_plate):
    size = {"length_mm": 120, "width_mm": 80, "height_mm": height_mm}
    scene = Scene(object={"kind": "box", "material": "wood", **size}, support=CUP)
    shape = grasp_cavity(scene)
    cells = cut_cells(shape, 6e-3, 0.05, -0.045, 0.045)
    where = find_imprint(shape, cells)
    modes = rim_modes(scene, MATERIALS["wood"], where, cells)
    assert (modes is not None) == is_plate


def test_what_is_wide_and_flat_lies_on_the_rim():
    def on(name):
        return lies_on_rim(CUP, OBJECTS[name].shape)

    assert [on(n) for n in ("plate_wood", "cube_30p0", "sphere80_wood", "bar")] == [1, 0, 0, 0]


def test_the_rim_is_a_strip_of_gent_and_lindley():
    # Far wider than high it is a bonded layer, E S² 4/3 up to the bulk; narrow, 4/3 E w/h.
    narrow = rim_of(CUP.model_copy(update={"rim_width_mm": 0.5}))
    height = 5e-3 + CUP.dish_depth_mm * 1e-3
    assert CUP.dish_depth_mm == pytest.approx(80 - np.sqrt(80**2 - 35**2))
    # 4/3 E beside the bulk E/(3 (1 - 2ν)) = 8.3 E, S = 0.02.
    plane = 1 / (1 / (4 / 3) + 3 * (1 - 2 * RUBBER.poisson))
    expected = plane * RUBBER.young_pa * 0.5e-3 / height
    assert narrow.stiffness_n_m2 == pytest.approx(expected, rel=1e-3)
    assert narrow.radius == 0.035 and narrow.loss == RUBBER.loss


def test_a_concave_support_is_checked():
    with pytest.raises(ValidationError, match="a dish is at most half a sphere"):
        Support(kind="concave", rim_radius_mm=50, dish_radius_mm=40)
