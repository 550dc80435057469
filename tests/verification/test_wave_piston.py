"""A piston of any mass, resistance and stiffness at the end of a tube."""

import numpy as np
import pytest
from wave_cases import AIR, box, check_convergence, time_step

from ajgdata.gripper.grid import cut_cells
from ajgdata.gripper.medium import air_fluid
from ajgdata.gripper.modes import NO_MODES, ModeList
from ajgdata.gripper.solver import Probe, at_rest, march
from ajgdata.gripper.system import assemble
from ajgdata.gripper.walls import NO_WALLS, WallList

LENGTH = 0.24
#: Transfer functions are taken at ω - iα: what is left of the response after TIME is e^-20.
TIME, FADE = 20e-3, 1_000.0
OMEGA = 2 * np.pi * np.linspace(100, 3_000, 30) - 1j * FADE
PISTONS = {  # mass kg/m2, resistance Pa s/m, stiffness N/m3; plates: rho H, eta sqrt(k m), E/H
    "latex": (0.3, 450.0, 1e5),
    "Styrofoam plate": (0.25, 0.06 * (5e8 * 0.25) ** 0.5, 5e8),
    "wood": (6.5, 0.02 * (8e11 * 6.5) ** 0.5, 8e11),
    "steel": (78.5, 0.002 * (2e13 * 78.5) ** 0.5, 2e13),
    "massless": (0.0, 0.0, 3e6),
    "1e5 kg/m2": (1e5, 0.0, 0.0),
    "resonance above Nyquist": (1e-9, 1e-3, 1e8),
    "stiffness 1e15": (1.0, 0.0, 1e15),
}


def _tube(h, piston, as_mode):
    """Pressure beside the piston after a pulse of one step at the far end; steps of `dt`."""
    cells = cut_cells(box(2 * h, 2 * h, LENGTH, 0.0), h, 2 * h, 0.0, LENGTH)
    end = int(np.flatnonzero(cells.volume.any((1, 2)))[0])
    area = np.where(np.arange(len(cells.z))[:, None, None] == end, cells.volume / h, 0.0)
    walls, modes = WallList.uniform(area, *piston), NO_MODES
    if as_mode:
        total = area.sum()
        parameters = [np.array([total * value]) for value in piston]
        modes = ModeList(walls.cell, walls.area[None, :], *parameters)
        walls = NO_WALLS
    system = assemble(cells, air_fluid(AIR), time_step(h), walls=walls, modes=modes)
    live = np.flatnonzero((cells.volume > 0).ravel())
    ends = [live[live // system.span.slab == k] for k in (end, len(cells.z) - 2)]
    near, far = (Probe(c.astype(np.uint64), np.full(len(c), 1 / len(c))) for c in ends)
    steps = int(TIME / system.dt)
    heard = march(system, at_rest(system), far, near, np.ones(1), steps)
    return heard, system.dt, (2 * h) ** 2


def _measured(h, piston):
    heard, dt, area = _tube(h, piston, as_mode=True)
    time = (np.arange(len(heard)) + 0.5) * dt
    return np.exp(-1j * OMEGA[:, None] * time) @ heard * area


def _exact(h, piston):
    """Pressure at the middle of the last cell per volume velocity per area at the far end."""
    mass, resistance, stiffness = piston
    k, z0 = OMEGA / AIR.sound_speed, AIR.density * AIR.sound_speed
    impedance = 1j * OMEGA * mass + resistance + stiffness / (1j * OMEGA)
    # p = impedance cos kx + i z0 sin kx up to a factor, u towards the piston by Euler's equation.
    inflow = (1j * impedance * np.sin(k * LENGTH) + z0 * np.cos(k * LENGTH)) / z0
    return (impedance * np.cos(k * h / 2) + 1j * z0 * np.sin(k * h / 2)) / inflow


@pytest.mark.parametrize("name", PISTONS)
def test_a_piston_has_its_analytic_transfer_function(name):
    sizes, errors = (12e-3, 8e-3, 6e-3), []
    for h in sizes:
        exact = _exact(h, PISTONS[name])
        difference = _measured(h, PISTONS[name]) - exact
        errors.append(float(np.linalg.norm(difference) / np.linalg.norm(exact)))
    # Dispersion shifts a resonance by (kh)²/24 of ω, which is damped by FADE: the change of the
    # response is the ratio of the two, taken at the top of the band.
    top = OMEGA[-1].real
    cap = top * (top / AIR.sound_speed * sizes[-1]) ** 2 / 24 / FADE
    # A wall softer than the air in front of it (ρc² over a cell) is seen half a cell too near,
    # because it acts on the cell's centre: first order, k h / 2 off.
    soft = PISTONS[name][2] < AIR.density * AIR.sound_speed**2 / sizes[-1] and not PISTONS[name][0]
    cap += soft * top / AIR.sound_speed * sizes[-1] / 2
    check_convergence(sizes, errors, order=1.0 if soft else 1.8, cap=cap)


@pytest.mark.parametrize("name", PISTONS)
def test_one_mode_and_local_walls_are_the_same_piston(name):
    local, _, _ = _tube(8e-3, PISTONS[name], as_mode=False)
    modal, _, _ = _tube(8e-3, PISTONS[name], as_mode=True)
    # The two orders of summation differ by an ulp a step, and in a tube with no losses nothing
    # forgets: at most one ulp more in each of the steps.
    bound = len(local) * np.finfo(float).eps * np.abs(local).max()
    assert np.abs(local).max() > 0
    assert np.abs(local - modal).max() < bound


@pytest.mark.parametrize("as_mode", [False, True])
def test_a_piston_of_nothing_holds_no_pressure(as_mode):
    heard, _, _ = _tube(8e-3, (0.0, 0.0, 0.0), as_mode)
    beside, _, _ = _tube(8e-3, PISTONS["steel"], as_mode)
    # Round-off as a mode; as a wall what its least impedance leaves, 1e-6 of 413 Pa s/m, twice.
    assert np.abs(heard).max() < 1e-8 * np.abs(beside).max()
