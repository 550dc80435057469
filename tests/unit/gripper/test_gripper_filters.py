"""Filters of the gripper against those of scipy.signal, which takes too long to import."""

import platform
import subprocess
import sys

import numpy as np
import pytest
from scipy.signal import bilinear as bilinear_of_scipy
from scipy.signal import firwin, freqz, kaiserord, sosfilt

from ajgdata.gripper import SignalChain
from ajgdata.gripper.filters import bilinear, filtered, kaiser_lowpass, kaiser_taps
from ajgdata.gripper.signal_chain import transducers

RATE_HZ = 44_100


def test_sections_filter_as_those_of_scipy_to_the_last_bit():
    sections = transducers(SignalChain())
    samples = np.random.default_rng(1).standard_normal(3_000)
    before = samples.copy()
    ours, known = filtered(sections, samples), sosfilt(sections, samples)
    if platform.machine() == "x86_64":
        assert ours.tobytes() == known.tobytes()
    # Elsewhere a compiler may round a product and a sum once: an ulp a step, which the poles keep
    # for less than all samples.
    np.testing.assert_allclose(ours, known, rtol=0, atol=3_000 * 2.0**-52 * np.abs(known).max())
    assert samples.tobytes() == before.tobytes()


@pytest.mark.parametrize(
    "section", [((0, 0, 1), (0, 1, 3e3)), ((1, 2e3, 4e8), (1, 5e3, 4e8)), ((0, 1, 0), (1, 7, 9e6))]
)
def test_the_bilinear_rule_is_that_of_scipy(section):
    def known(polynomials):
        over, under = (np.trim_zeros(np.array(one, float), "f") for one in polynomials)
        return freqz(*bilinear_of_scipy(over, under, RATE_HZ), worN=64)[1]

    ours = bilinear(*section, RATE_HZ)
    np.testing.assert_allclose(freqz(ours[:3], ours[3:], worN=64)[1], known(section), rtol=1e-9)


@pytest.mark.parametrize("width", [0.02, 0.05])
def test_the_low_pass_is_that_of_scipy(width):
    taps, beta = kaiserord(80.0, 2 * width)
    assert kaiser_taps(80.0, width) == taps
    half = taps // 2
    known = firwin(2 * half + 1, 0.1, window=("kaiser", beta), fs=1)
    np.testing.assert_allclose(kaiser_lowpass(half, 0.1, 80.0), known, atol=1e-15)


def test_a_scene_is_solved_and_played_without_scipy_signal():
    code = (
        "import sys; import numpy as np; from ajgdata import gripper as g;"
        "scene = {'object': 'cube_20p7', 'numerics': {'dx_mm': 6, 'max_time_s': 0.004}};"
        "g.record(g.simulate(g.Scene.model_validate(scene)), np.ones(100));"
        "assert 'scipy.signal' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
