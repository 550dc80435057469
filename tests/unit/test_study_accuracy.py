"""The study of error against run time, on grids too coarse to be quoted."""

import numpy as np
import pytest

from ajgdata.studies.accuracy import decibels, feature, relative_error, tables


def test_the_tables_hold_what_they_promise():
    sweep, checks, settings = tables(quick=True)
    for table in (sweep, checks, settings):
        keys = [column.key for column in table.columns]
        assert table.rows and all(list(row) == keys for row in table.rows)
    errors = dict(zip(zip(sweep.column("scheme"), sweep.column("dx_mm"), strict=True),
                      sweep.column("error"), strict=True))  # fmt: skip
    assert errors["wide", 5.2] < errors["wide", 6.0] < errors["second", 6.0]
    assert errors["wide", 5.2] < errors["second", 5.0] / 2
    assert all(time > 0 for time in sweep.column("time_s"))
    change = dict(zip(settings.column("poles"), settings.column("change"), strict=True))
    assert change[2] == 0.0 < change[0]


def test_errors_are_relative_and_levels_are_decibels():
    reference = np.linspace(1.0, 2.0, 1025)
    assert relative_error(1.1 * reference, reference) == pytest.approx(0.1)
    assert decibels(2 * reference, reference) == pytest.approx([20 * np.log10(2)] * 4)


def test_a_feature_is_that_of_a_tone():
    tone = np.sin(2 * np.pi * 100 / 2048 * np.arange(44_100))
    found = feature(tone)
    assert np.linalg.norm(found) == pytest.approx(1.0)
    # A Hann window spreads a tone on a bin over that and, by half, the next at either side.
    assert found[99:102] / found[100] == pytest.approx([0.5, 1.0, 0.5], abs=1e-3)
