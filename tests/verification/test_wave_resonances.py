"""Resonances of bodies with a closed solution: order and absolute cap."""

import numpy as np
import pytest
from wave_cases import AIR, box, check_convergence, closed, frequencies, sphere

BOX = (0.060, 0.050, 0.040)


def _box_modes(highest: float) -> np.ndarray:
    orders = np.stack(np.meshgrid(*[np.arange(4)] * 3), -1).reshape(-1, 3)
    modes = np.sort(AIR.sound_speed / 2 * np.sqrt(((orders / BOX) ** 2).sum(1)))[1:]
    return modes[modes < highest]


def test_box_resonances_on_the_grid_converge_with_order_two():
    exact = _box_modes(6_000)
    sizes = (5e-3, 10e-3 / 3, 2.5e-3)
    errors = []
    for h in sizes:
        _, system = closed(box(*BOX), h, 0.031, 0.0, BOX[2])
        errors.append(np.max(np.abs(frequencies(system, len(exact)) / exact - 1)))
    # Numerical dispersion of a plane wave along an axis, (k h)²/24: the worst direction.
    worst = (2 * np.pi * 6_000 / AIR.sound_speed * sizes[-1]) ** 2 / 24
    check_convergence(sizes, errors, order=1.9, cap=worst)


@pytest.mark.parametrize("h", [4.7e-3, 3.9e-3, 3.1e-3])
def test_walls_off_the_grid_stay_within_the_cap(h):
    _, system = closed(box(*BOX), h, 0.031, 0.0, BOX[2])
    exact = _box_modes(3_500)
    # Sampling four times finer places a wall within h/8 at either side; the volume that keeps
    # the cut cells stable lowers a frequency by at most its own share.
    cap = h / 4 / min(BOX[:2]) + system.added_volume
    assert np.max(np.abs(frequencies(system, len(exact)) / exact - 1)) < cap


def test_the_dipole_mode_of_a_sphere_converges():
    radius = 0.03
    exact = 2.081_575_977_8 * AIR.sound_speed / (2 * np.pi * radius)  # j1'(ka) = 0
    sizes = (6e-3, 4.2e-3, 3e-3, 2.1e-3)
    errors = []
    for h in sizes:
        _, system = closed(sphere(radius), h, 0.031, -0.031, radius + 0.3 * h, courant=0.9)
        three = frequencies(system, 3)
        errors.append(np.max(np.abs(three / exact - 1)))
    # First order: the volume added to cut cells is proportional to the surface times h. The cap
    # is that share, and the dispersion (k h)²/24 of a plane wave along an axis.
    dispersion = (2 * np.pi * exact / AIR.sound_speed * sizes[-1]) ** 2 / 24
    cap = system.added_volume + dispersion
    check_convergence(sizes, errors, order=0.9, cap=cap)
    assert cap < 6e-3
