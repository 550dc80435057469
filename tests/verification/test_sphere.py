"""The dipole mode of a sphere: its root, and the grid's approach to it."""

import pytest
from scipy.optimize import brentq
from scipy.special import spherical_jn

from ajgdata.studies.domains import AIR
from ajgdata.studies.verification.resonances import SphereDipole, WideSphereDipole


@pytest.mark.parametrize("case", [SphereDipole, WideSphereDipole])
def test_the_dipole_mode_converges(case):
    finding = case().run(quick=True)
    assert finding.passed, finding
    assert finding.cap < 1e-2


def test_the_root_is_that_of_the_bessel_function():
    root = brentq(lambda ka: spherical_jn(1, ka, derivative=True), 1.5, 2.5)
    exact = root * AIR.sound_speed / (2 * 3.141592653589793 * SphereDipole.radius)
    assert abs(SphereDipole()._exact() / exact - 1) < 1e-9
