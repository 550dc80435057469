"""Windows are those of SciPy, bit for bit, and nobody pays for its import."""

from typing import get_args

import numpy as np
import pytest
from scipy.signal import get_window

from ajgdata.features.windows import COEFFICIENTS, periodic_window
from ajgdata.types import FeatureSettings


@pytest.mark.parametrize("shape", COEFFICIENTS)
@pytest.mark.parametrize("length", [16, 17, 1000, 2048])
def test_every_window_is_scipy_s(shape, length):
    assert np.array_equal(periodic_window(shape, length), get_window(shape, length, fftbins=True))


def test_every_shape_that_can_be_asked_for_has_coefficients():
    assert set(COEFFICIENTS) == set(
        get_args(FeatureSettings.model_fields["window_shape"].annotation)
    )


def test_a_job_of_features_and_an_acquisition_begin_without_what_takes_half_a_second(run_python):
    """`scipy.signal` brings `scipy.stats` with it, and takes twice as long as all the rest."""
    code = (
        "import sys, ajgdata.pipeline.extract_features, ajgdata.pipeline.acquire_live;"
        "print(*sys.modules)"
    )
    assert not {"scipy.signal", "scipy.stats", "scipy.optimize"} & set(run_python(code).split())
