"""What walls take from the sound: the boundary layer, and the decay it gives a cavity."""

import numpy as np
import pytest

from ajgdata.gripper.grid import cut_cells
from ajgdata.gripper.medium import Air, air_fluid
from ajgdata.gripper.solver import at_rest
from ajgdata.gripper.system import assemble
from ajgdata.gripper.walls import WallList, boundary_layer_admittance
from ajgdata.studies.discrete_energy import energies
from ajgdata.studies.domains import AIR, box, time_step


def test_the_boundary_layer_attenuates_sound_in_a_duct_as_tables_say():
    """Along a wide tube of radius a the attenuation is Re(ρc/z)/a: 3.0e-5 √f / a nepers a metre
    (Fletcher & Rossing, The Physics of Musical Instruments, section 8.2), in two digits."""
    frequency = np.array([250.0, 1_000.0, 4_000.0])
    attenuation = boundary_layer_admittance(frequency, Air(22.0), sine_squared=1.0)
    np.testing.assert_allclose(attenuation, 3.0e-5 * np.sqrt(frequency), rtol=0.02)


def test_friction_vanishes_at_normal_incidence_and_heat_does_not():
    air = Air(20.0)
    heat, both = (boundary_layer_admittance(1e3, air, sine) for sine in (0.0, 1.0))
    assert both / heat == pytest.approx(1 + np.sqrt(air.prandtl) / (air.gamma - 1))


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
