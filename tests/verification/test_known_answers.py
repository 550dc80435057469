"""What the cases are compared with, and what holds on one grid: boxes, a sphere, a still bowl."""

import numpy as np
import pytest
from known_cases.domains import box, closed, frequencies
from known_cases.resonances import SphereDipole, box_modes
from scipy.optimize import brentq
from scipy.special import spherical_jn

from ajgdata.gripper.grid import cut_cells
from ajgdata.gripper.medium import air_fluid
from ajgdata.gripper.modes import ModeList
from ajgdata.gripper.system import assemble
from ajgdata.studies.discrete_operator import operator
from ajgdata.studies.domains import AIR, BOWL, bowl, time_step

BOX = (0.060, 0.050, 0.040)


def test_a_uniform_pressure_does_not_move():
    _, system = closed(bowl(), 6e-3, *BOWL)
    matrix = operator(system)
    # Each row has one entry per neighbour; their sum may round once each.
    assert abs(matrix.sum(axis=1)).max() < 8 * 2.3e-16 * abs(matrix).max()


@pytest.mark.parametrize("h", [4.7e-3, 3.9e-3, 3.1e-3])
def test_parallel_walls_off_the_grid_are_off_by_a_sample(h):
    _, system = closed(box(*BOX), h, 0.031, 0.0, BOX[2])
    exact = box_modes(BOX, 3_500)
    # Sampling four times finer places a wall within h/8 at either side; the volume that keeps
    # the cut cells stable lowers a frequency by at most its own share.
    cap = h / 4 / min(BOX[:2]) + system.added_volume
    assert np.max(np.abs(frequencies(system, len(exact)) / exact - 1)) < cap


def test_the_root_of_the_sphere_is_that_of_the_bessel_function():
    root = brentq(lambda ka: spherical_jn(1, ka, derivative=True), 1.5, 2.5)
    exact = root * AIR.sound_speed / (2 * np.pi * SphereDipole.radius)
    assert abs(SphereDipole()._exact() / exact - 1) < 1e-9


def test_modes_that_cannot_be_told_apart_are_refused():
    cells = cut_cells(bowl(), 6e-3, *BOWL)
    modes = ModeList(np.flatnonzero(cells.bed)[:5], np.ones((2, 5)), *np.zeros((3, 2)))
    with pytest.raises(ValueError, match="without mass, resistance and stiffness"):
        assemble(cells, air_fluid(AIR), time_step(6e-3), modes=modes)
