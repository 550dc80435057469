"""Mean spectra of a data set as they are drawn."""

import numpy as np
import pytest
from report_samples import dataset

from ajgdata.report.spectra import spectra_figure


def test_spectra_are_decibels_of_the_highest_and_an_empty_bin_is_silent():
    data = dataset("size", "simulated")
    mean = data.spectra.mean
    mean[:, 5] = 0
    (axes,) = spectra_figure(data).axes
    for line, own in zip(axes.get_lines(), mean[:, 1:], strict=False):  # 0 Hz is not on a log axis
        expected = 20 * np.log10(np.maximum(own / mean[:, 1:].max(), 1e-6))
        assert line.get_ydata() == pytest.approx(expected, abs=1e-9)
