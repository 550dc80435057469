"""Modes in a cavity with everything else: what they must not change."""

import numpy as np
import pytest

from ajgdata.gripper.grid import cut_cells
from ajgdata.gripper.medium import air_fluid
from ajgdata.gripper.modes import ModeList
from ajgdata.gripper.system import assemble
from ajgdata.studies.domains import AIR, BOWL, bowl, time_step
from ajgdata.studies.verification.moving import (
    EnergyConstantWithModes,
    EnergyNeverGrowsWithModes,
    ReciprocityWithModes,
)


@pytest.mark.parametrize(
    "case", [EnergyConstantWithModes, EnergyNeverGrowsWithModes, ReciprocityWithModes]
)
def test_energy_and_reciprocity_hold_though_something_moves(case):
    finding = case().run(quick=True)
    assert finding.passed, finding


def test_modes_that_cannot_be_told_apart_are_refused():
    cells = cut_cells(bowl(), 6e-3, *BOWL)
    modes = ModeList(np.flatnonzero(cells.bed)[:5], np.ones((2, 5)), *np.zeros((3, 2)))
    with pytest.raises(ValueError, match="without mass, resistance and stiffness"):
        assemble(cells, air_fluid(AIR), time_step(6e-3), modes=modes)
