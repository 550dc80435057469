"""Resonances of a rigid box, c/2 √(Σ (m/L)²), on the grid and off it."""

import numpy as np
import pytest

from ajgdata.studies.discrete_operator import frequencies
from ajgdata.studies.domains import AIR, box, closed
from ajgdata.studies.verification.resonances import (
    BoxOffGrid,
    BoxOnGrid,
    WideBoxOffGrid,
    WideBoxOnGrid,
    box_modes,
)

BOX = (0.060, 0.050, 0.040)


@pytest.mark.parametrize("case", [BoxOnGrid, WideBoxOnGrid])
def test_walls_on_the_grid_converge_with_the_order_of_the_scheme(case):
    finding = case().run(quick=True)
    assert finding.passed, finding


@pytest.mark.parametrize("case", [BoxOffGrid, WideBoxOffGrid])
def test_walls_that_cut_cells_stay_below_the_cap(case):
    finding = case().run(quick=True)
    assert finding.passed, finding


@pytest.mark.parametrize("h", [4.7e-3, 3.9e-3, 3.1e-3])
def test_parallel_walls_off_the_grid_are_off_by_a_sample(h):
    _, system = closed(box(*BOX), h, 0.031, 0.0, BOX[2])
    exact = box_modes(BOX, 3_500)
    # Sampling four times finer places a wall within h/8 at either side; the volume that keeps
    # the cut cells stable lowers a frequency by at most its own share.
    cap = h / 4 / min(BOX[:2]) + system.added_volume
    assert np.max(np.abs(frequencies(system, len(exact)) / exact - 1)) < cap


def test_the_first_modes_are_those_of_the_longest_edge():
    modes = box_modes((0.4, 0.1, 0.1), 1_000)
    assert modes == pytest.approx([AIR.sound_speed / 0.8, AIR.sound_speed / 0.4])
