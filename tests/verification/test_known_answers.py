"""Modes without mass, resistance and stiffness."""

import numpy as np
import pytest

from ajgdata.gripper.grid import cut_cells
from ajgdata.gripper.medium import air_fluid
from ajgdata.gripper.modes import ModeList
from ajgdata.gripper.system import assemble
from ajgdata.studies.domains import AIR, BOWL, bowl, time_step


def test_modes_that_cannot_be_told_apart_are_refused():
    cells = cut_cells(bowl(), 6e-3, *BOWL)
    modes = ModeList(np.flatnonzero(cells.bed)[:5], np.ones((2, 5)), *np.zeros((3, 2)))
    with pytest.raises(ValueError, match="without mass, resistance and stiffness"):
        assemble(cells, air_fluid(AIR), time_step(6e-3), modes=modes)
