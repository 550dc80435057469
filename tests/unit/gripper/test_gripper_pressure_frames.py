"""A plan's walls and memory; and the filmed field, which is the solver's own, cut at y = 0."""

import numpy as np
import pytest

from ajgdata.gripper import Scene, build_plan
from ajgdata.gripper.pressure_frames import pressure_frames, ricker_wavelet
from ajgdata.gripper.solver import at_rest, march

CONTENT = {"medium": {"kind": "air"}, "numerics": {"dx_mm": 5, "precision": "float64"}}


@pytest.fixture(scope="module")
def plan():
    return build_plan(Scene.model_validate(CONTENT))


def test_a_film_is_the_marched_field_whatever_the_chunks(plan):
    film = pressure_frames(plan, every=6, frames=5)
    fine = pressure_frames(plan, every=1, frames=30)
    np.testing.assert_array_equal(film.frames, fine.frames[5::6])
    np.testing.assert_allclose(film.times_s, fine.times_s[5::6])
    state = at_rest(plan.system)
    drive = ricker_wavelet(plan.system.dt, 4_000.0)[:30]
    march(plan.system, state, plan.speaker, plan.microphone, drive, 30)
    middle = int(np.argmin(np.abs(plan.cells.y)))
    expected = state.p.reshape(plan.system.shape)[:, middle]
    # Frames are float32, and the film is driven at another level.
    np.testing.assert_allclose(film.frames[-1], expected, rtol=1e-6, atol=1e-12)
    assert np.abs(film.frames[-1]).max() > 0 and not film.frames[:, ~film.open].any()


def test_the_memory_of_a_plan_is_that_of_its_arrays_and_of_what_is_marched(plan):
    system = plan.system
    fields = (system.faces, system.reach, system.capacities, system.walls, system.modes)
    arrays = [system.mass, *(array for field in fields for array in field), *at_rest(system)]
    assert plan.bytes == sum(array.nbytes for array in arrays) > 1e6


def test_neither_the_housing_nor_the_vacuum_port_is_a_spring(plan):
    """So the port is open to slow changes of pressure."""
    loose = {"membrane": {"stiffness_n_m3": 0}}
    without = build_plan(Scene.model_validate(CONTENT | {"gripper": loose}))
    assert plan.system.walls.half_spring.any() and not without.system.walls.half_spring.any()
