"""What walls take from the sound: the decay that they give a cavity."""

import numpy as np
import pytest
from known_cases.domains import box

from ajgdata.gripper.grid import cut_cells
from ajgdata.gripper.medium import air_fluid
from ajgdata.gripper.solver import at_rest
from ajgdata.gripper.system import assemble
from ajgdata.gripper.walls import WallList
from ajgdata.studies.discrete_energy import energies
from ajgdata.studies.domains import AIR, time_step


def test_an_axial_mode_decays_by_what_its_walls_take():
    """In a box whose walls all have the admittance β the energy of the mode sin(πx/L) about the
    middle falls at the rate βc ∫p² dS/∫p² dV = βc (4/L + 2/W + 2/H); to first order in β, whose
    square is 1e-4, and up to the half cell between the ends and where they hear: (πh/2L)²,
    1.7 %."""
    length, side, beta, h = 0.048, 0.032, 0.01, 4e-3
    region = box(length, side, side)
    cells = cut_cells(region, h, length / 2, 0.0, side)
    impedance = AIR.density * AIR.sound_speed / beta
    areas = ((cells.area_x, 2), (cells.area_y, 1), (cells.area_z, 0))
    shut = sum(2 * h**2 - area - np.roll(area, 1, axis) for area, axis in areas)
    every = np.where(cells.volume > 0, shut, 0.0)
    assert every.sum() == pytest.approx(2 * (2 * length * side + side**2))
    walls = WallList.uniform(every, 0.0, impedance, 0.0)
    system = assemble(cells, air_fluid(AIR), time_step(h), walls=walls)
    state = at_rest(system)
    mode = np.sin(np.pi * cells.x / length) * (cells.volume > 0)
    state.p[:] = mode.ravel()
    steps = round(4 * 2 * length / AIR.sound_speed / system.dt)
    energy = energies(system, state, steps)
    # Four periods, so that what is taken in each phase of one averages out.
    rate = -np.log(energy[-1] / energy[0]) / ((steps - 1) * system.dt)
    expected = AIR.sound_speed * beta * (4 / length + 4 / side)
    assert rate == pytest.approx(expected, rel=0.017)
