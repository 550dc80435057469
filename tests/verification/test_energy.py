"""The discrete energy: constant without losses, never growing with them."""

import numpy as np
import pytest

from ajgdata.studies.discrete_operator import energies
from ajgdata.studies.domains import BOWL, bowl, closed, random_state
from ajgdata.studies.verification.identities import (
    EnergyConstant,
    EnergyNeverGrows,
    WideEnergyConstant,
    WideEnergyNeverGrows,
)


@pytest.mark.parametrize("case", [EnergyConstant, WideEnergyConstant])
def test_it_is_constant_in_a_closed_cavity_with_cut_cells(case):
    # There are cut cells that need the stabilisation.
    assert case().system(4e-3).raised_cells > 0.02
    finding = case().run(quick=True)
    assert finding.passed, finding


class OneCellOff(EnergyConstant):
    """A cell whose pressure yields a thousandth more than its volume says."""

    def system(self, h):
        system = super().system(h)
        system.capacities.yield_[np.argmax(system.mass)] *= 1.001
        return system


def test_a_cell_in_error_is_found():
    assert not OneCellOff().run(quick=True).passed


@pytest.mark.parametrize("case", [EnergyNeverGrows, WideEnergyNeverGrows])
def test_it_never_grows_with_drag_relaxation_and_walls(case):
    finding = case().run(quick=True)
    assert finding.passed, finding


def test_the_energy_without_the_later_velocity_wobbles():
    """Why it is not ½‖p‖² + ½‖U‖²: the check has something to see."""
    _, system = closed(bowl(), 4e-3, *BOWL)
    state = random_state(system)
    naive = []
    for _ in range(50):
        kinetic = sum(
            np.sum(system.dt / gain[gain > 0] * u[gain > 0] ** 2)
            for u, gain in zip(state[1:4], system.faces[3:], strict=True)
        )
        naive.append(np.sum(system.mass.ravel() * state.p**2) + kinetic)
        energies(system, state, 1)
    assert np.ptp(naive) > 1e-3 * naive[0]
