"""The study of error against run time, on grids too coarse to be quoted."""

import numpy as np
import pytest

from ajgdata.studies.accuracy import QUICK_GRIDS_MM, decibels, relative_error, tables


def test_a_finer_grid_has_a_smaller_error():
    (sweep,) = tables(quick=True)
    keys = [column.key for column in sweep.columns]
    assert all(list(row) == keys for row in sweep.rows)
    assert tuple(sweep.column("dx_mm")) == QUICK_GRIDS_MM[:-1]
    assert np.all(np.diff(sweep.column("error")) < 0)
    assert all(time > 0 for time in sweep.column("time_s")) and 1.0 in sweep.column("ratio")


def test_errors_are_relative_and_levels_are_decibels():
    reference = np.linspace(1.0, 2.0, 1025)
    assert relative_error(1.1 * reference, reference) == pytest.approx(0.1)
    levels = list(decibels(2 * reference, reference).values())
    assert levels == pytest.approx([20 * np.log10(2)] * 4)
