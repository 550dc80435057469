"""The filmed field is the solver's own, cut at y = 0."""

import numpy as np
import pytest

from ajgdata.gripper import Scene, build_plan
from ajgdata.gripper.medium import Air
from ajgdata.gripper.pressure_slices import pulse, slices
from ajgdata.gripper.solver import at_rest, march

SCENE = Scene.model_validate(
    {"medium": {"kind": "air"}, "numerics": {"dx_mm": 5, "precision": "float64"}}
)


@pytest.fixture(scope="module")
def plan():
    return build_plan(SCENE)


def test_a_film_is_the_marched_field_whatever_the_chunks(plan):
    film, fine = slices(plan, every=6, frames=5), slices(plan, every=1, frames=30)
    np.testing.assert_array_equal(film.frames, fine.frames[5::6])
    np.testing.assert_allclose(film.times_s, fine.times_s[5::6])
    state = at_rest(plan.system)
    drive = pulse(plan.system.dt, 4_000.0)[:30]
    march(plan.system, state, plan.speaker, plan.microphone, drive, 30)
    middle = int(np.argmin(np.abs(plan.cells.y)))
    expected = state.p.reshape(plan.system.shape)[:, middle]
    # Frames are float32, and the film is driven at another level.
    np.testing.assert_allclose(film.frames[-1], expected, rtol=1e-6, atol=1e-12)
    assert np.abs(film.frames[-1]).max() > 0 and not film.frames[:, ~film.open].any()


def test_the_wave_crosses_the_cavity_at_the_speed_of_sound(plan):
    """Onset of the direct sound under the roof: a threshold that falls as 1/r, as the wave does."""
    film = slices(plan, every=1, frames=110)
    roof = int(np.flatnonzero(film.open.any(axis=1))[-1])
    source = np.array([-35e-3, 3e-3, 45e-3])
    onsets, distances = [], []
    for x in (-0.010, 0.030):
        cell = int(np.argmin(np.abs(film.across_m - x)))
        place = np.array([film.across_m[cell], 0.0, film.up_m[roof]])
        distances.append(np.linalg.norm(place - source))
        loud = np.abs(film.frames[:, roof, cell]) * distances[-1]
        if not onsets:
            threshold = 1e-3 * loud.max()
        onsets.append(film.times_s[np.argmax(loud > threshold)])
    expected = (distances[1] - distances[0]) / Air(22.0).sound_speed
    # Each onset is known to a step.
    assert onsets[1] - onsets[0] == pytest.approx(expected, abs=2 * plan.system.dt)
