"""The membrane between the grains and the rim depends on the geometry, and not on the grid."""

import numpy as np
import pytest

from ajgdata.gripper import Scene
from ajgdata.gripper.geometry import RASTER_M, Cavity, grasp_cavity
from ajgdata.gripper.solver_plan import build_plan
from ajgdata.studies.accuracy import decibels, run

RIM_M = 0.05
CUBE = {"kind": "cube", "edge_mm": 20}
#: Grids (mm) of the convergence, and of the reference.
GRIDS_MM = (5.2, 4.2, 3.3, 2.75)
FINEST_MM = 2.0


def scene(dx_mm: float) -> Scene:
    numerics = {"dx_mm": dx_mm, "decay_db": 80.0}  # the stopping has no part in the error
    return Scene.model_validate({"object": CUBE, "numerics": numerics})


def bowl(fill_m: float) -> Cavity:
    """Return half of a sphere of the radius of the rim that is filled up to `fill_m` (< 0)."""
    half = int(RIM_M / RASTER_M) + 12
    axis = np.arange(-half, half + 1) * RASTER_M
    radius = np.hypot(axis[None, :], axis[:, None])
    floor = -np.sqrt(np.clip(RIM_M**2 - radius**2, 0, None))
    level = np.full_like(floor, fill_m)
    nothing = np.zeros_like(floor)
    return Cavity(axis, floor, -floor, level, nothing, nothing, None, 0.0, 0.0)


@pytest.mark.parametrize("fill_mm", [-40, -25, -10])
def test_the_bare_edge_of_a_sphere_is_a_zone(fill_mm):
    """Arc R asin(d/R) and area 2πRd of the zone of height d below the rim (Archimedes)."""
    depth = -fill_mm * 1e-3
    edge = bowl(-depth).bare_edge(RIM_M)
    assert edge.width_m == pytest.approx(RIM_M * np.arcsin(depth / RIM_M), rel=0.02)
    assert edge.area_m2 == pytest.approx(2 * np.pi * RIM_M * depth, rel=0.02)


def test_the_edge_has_the_same_stiffness_and_area_on_each_grid():
    edge = grasp_cavity(scene(4.2)).bare_edge(RIM_M)
    assert 5e-3 < edge.width_m < 20e-3
    for dx_mm in GRIDS_MM:
        plan = build_plan(scene(dx_mm))
        walls = plan.system.walls
        dt = plan.system.dt
        stiffness = np.asarray(walls.half_spring, float) * 2 / dt
        expected = 12 * scene(dx_mm).gripper.tension_n_m / edge.width_m**2  # a strip that sags
        bare = np.isclose(stiffness, expected, rtol=1e-5)
        assert bare.any()
        yields = np.asarray(plan.system.capacities.yield_, float)[walls.cell]
        area = np.asarray(walls.coupling, float) / (yields * np.asarray(walls.admittance, float))
        assert area[bare].sum() == pytest.approx(edge.area_m2, rel=1e-4)


def test_low_frequencies_converge():
    """With a width that was counted in cells, the error was .05 to .4 dB on GRIDS_MM."""
    reference = run(scene(FINEST_MM)).feature
    errors = [decibels(run(scene(dx_mm)).feature, reference)["db_0.1_1"] for dx_mm in GRIDS_MM]
    assert errors[1] < 0.06
    order = np.polyfit(np.log(GRIDS_MM), np.log(errors), 1)[0]
    assert order > 0.7, errors
