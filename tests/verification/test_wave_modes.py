"""Modes in a cavity with everything else: what they must not change."""

import numpy as np
import pytest
from wave_cases import AIR, PLASTIC, bowl, energies, lossy_bowl, random_state, time_step

from ajgdata.gripper.grid import cut_cells
from ajgdata.gripper.medium import air_fluid, fit_fluid
from ajgdata.gripper.modes import ModeList
from ajgdata.gripper.solver import Probe, at_rest, march
from ajgdata.gripper.system import Packed, System, assemble
from ajgdata.gripper.walls import WallList

#: Modal m (kg), r (kg/s), k (N/m): massless, heavy, soft, stiff, resonant far above Nyquist, none.
EXTREMES = np.array(
    [
        (0.0, 0.0, 1e3),
        (1e6, 0.0, 0.0),
        (1e-2, 1.0, 1e5),
        (1e-9, 0.0, 1e15),
        (1e-3, 0.0, 0.0),
        (0.0, 1e4, 0.0),
        (0.0, 0.0, 0.0),
    ]
)


def _bowl(h: float, parameters: np.ndarray, loss: float = 1.0) -> System:
    """Grains, walls, and modes that share the cells of the floor and of the grains above it."""
    cells = cut_cells(bowl(), h, 0.031, -0.031, 0.036)
    grains = Packed(fit_fluid(PLASTIC, AIR), PLASTIC.porosity, np.ones(cells.shape))
    cell = np.flatnonzero((cells.bed > 0).ravel())
    weight = np.random.default_rng(0).uniform(-1, 1, (len(parameters), len(cell))) * h**2
    mass, resistance, stiffness = parameters.T
    modes = ModeList(cell, weight, mass, loss * resistance, stiffness)
    walls = WallList.uniform(cells.membrane, 0.3, loss * 450.0, 1e5)
    return assemble(
        cells, air_fluid(AIR), time_step(h), grains if loss else None, walls, modes=modes
    )


def _disturbed(system: System):
    state = random_state(system)
    # Each mode with mass has a tenth of the energy of the field: ½mv² = e, momentum 2mv/Δt.
    share = 0.1 * energies(system, random_state(system), 1)[0]
    state.motion[0] = 2 * np.sqrt(system.modes.inertia * share / system.dt)
    state.motion[2] = system.modes.weight @ state.p[system.modes.cell]
    return state


def test_energy_never_grows_with_modes():
    system = _bowl(4e-3, EXTREMES)
    energy = energies(system, _disturbed(system), 1_000)
    assert np.all(np.diff(energy) <= 1e-13 * energy[0])
    assert np.all(energy > 0)
    assert energy[-1] < 0.9 * energy[0]


def test_energy_is_constant_with_lossless_modes():
    system = _bowl(4e-3, EXTREMES[:5], loss=0.0)
    energy = energies(system, _disturbed(system), 2_000)
    # As in the empty cavity: a random walk of an ulp each step.
    assert np.ptp(energy) < 2_000**0.5 * 50 * np.finfo(float).eps * energy[0]


def test_speaker_and_microphone_may_change_places_though_an_object_moves():
    system = _bowl(4e-3, EXTREMES)
    live = np.flatnonzero(system.mass.ravel())
    ends = [Probe(np.array([live[n]], np.uint64), np.ones(1)) for n in (len(live) // 7, -50)]
    there, back = (
        march(system, at_rest(system), *pair, np.ones(1), 800) for pair in (ends, ends[::-1])
    )
    still = lossy_bowl(4e-3)
    without = march(still, at_rest(still), *ends, np.ones(1), 800)
    assert np.max(np.abs(there - without)) > 1e-3 * np.max(np.abs(there))
    assert np.max(np.abs(there - back)) < 1e-12 * np.max(np.abs(there))


def test_modes_that_cannot_be_told_apart_are_refused():
    twice = np.zeros((2, 3))
    cells = cut_cells(bowl(), 6e-3, 0.031, -0.031, 0.036)
    cell = np.flatnonzero(cells.bed)[:5]
    modes = ModeList(cell, np.ones((2, 5)), *twice.T)
    with pytest.raises(ValueError, match="without mass, resistance and stiffness"):
        assemble(cells, air_fluid(AIR), time_step(6e-3), modes=modes)
