"""Domain with losses that several known cases simulate."""

from __future__ import annotations

import numpy as np

from ajgdata.gripper.medium import air_fluid, fit_fluid
from ajgdata.gripper.solver_plan import wide_weight
from ajgdata.gripper.system import Packed, System, assemble
from ajgdata.gripper.walls import WallList
from ajgdata.studies.extreme_cases import AIR, PLASTIC, bowl_cells, time_step


def lossy_bowl(h: float, dtype: type = np.float64) -> System:
    """Return a bowl of grains with varying packing, and light, stiff, heavy and resistive walls.

    `h` is the grid spacing (m).
    """
    cells = bowl_cells(h)
    ratio = 1 + 0.1 * np.sin(np.arange(np.prod(cells.shape))).reshape(cells.shape)
    walls = (
        WallList.uniform(cells.membrane, 0.3, 450.0, 1e5)
        + WallList.uniform(cells.membrane, 1e-4, 0.0, 1e9)
        + WallList.uniform(cells.housing, 0.0, 2e5, 0.0)
    )
    grains = Packed(fit_fluid(PLASTIC, AIR), PLASTIC.porosity, ratio)
    weight = wide_weight(h)
    return assemble(cells, air_fluid(AIR), time_step(h, weight), grains, walls, dtype, wide=weight)
