import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st

from ajgdata.features.align import delay_outliers, delay_samples, shift

RATE = 8_000
TIME_S = np.arange(RATE) / RATE
SWEEP = scipy.signal.chirp(TIME_S, 20, 1, 3_500, method="logarithmic")


def delayed(delay, samples=SWEEP):
    return shift(samples, -delay)


@settings(deadline=None)
@given(st.integers(-2000, 2000), st.floats(1e-6, 1e6), st.sampled_from([-1, 1]))
def test_a_delayed_sweep_is_found_whatever_its_amplitude_and_sign(delay, gain, sign):
    assert delay_samples(sign * gain * delayed(delay), SWEEP, 2000) == delay


def test_noise_hum_and_a_knock_do_not_decide():
    rng, delay = np.random.default_rng(0), -300
    heard = delayed(delay) + rng.standard_normal(RATE)  # 3 dB more noise than sweep
    heard += 30 * np.sin(2 * np.pi * 30.3 * TIME_S)  # within the sweep's band
    assert delay_samples(heard, SWEEP, 4000) == delay
    heard = delayed(delay) + 0.1 * rng.standard_normal(RATE)
    heard[500:2500] += 1000 * np.exp(-np.arange(2000) / 200) * rng.standard_normal(2000)
    assert delay_samples(heard, SWEEP, 4000) == delay


@pytest.mark.parametrize("bad", [np.zeros(RATE), np.r_[SWEEP, np.nan], np.zeros(0), SWEEP[None]])
def test_nothing_to_correlate(bad):
    for pair in ((bad, SWEEP), (SWEEP, bad)):
        with pytest.raises(ValueError, match=r"run the checks|shape"):
            delay_samples(*pair, 100)


def test_shift_moves_and_pads_with_silence():
    samples = np.array([1, 2, 3, 4], np.float32)
    np.testing.assert_array_equal(shift(samples, 1), [2, 3, 4, 0])
    np.testing.assert_array_equal(shift(samples, -3), [0, 0, 0, 1])
    np.testing.assert_array_equal(shift(samples, 0), samples)
    for far in (4, -4, 99):
        np.testing.assert_array_equal(shift(samples, far), np.zeros(4))
    assert shift(samples, 1).dtype == np.float32
    np.testing.assert_array_equal(samples, [1, 2, 3, 4])


@pytest.mark.parametrize(
    ("delays", "outliers"),
    [
        ([], []),
        ([7, 9000], []),  # two disagree: nobody knows which is wrong
        ([0, 0, 0, 220], []),  # 5 ms at 44.1 kHz are 220.5 samples
        ([0, 0, 0, -221], [3]),
        ([8800, 9000, 451, 9100, 8900], [2]),
        ([-1000, -1000, -1000, 0, 1000, 1000, 7400], []),  # 5 * 1.4826 * 1000 = 7413
        ([-1000, -1000, -1000, 0, 1000, 1000, 7420], [6]),
        ([1000, 3000, 5000, 7000, 9000, 11_000], []),  # a card without a common clock
    ],
)
def test_delays_that_do_not_belong_to_the_session(delays, outliers):
    assert np.flatnonzero(delay_outliers(delays, 44_100)).tolist() == outliers


def test_the_last_sample_is_within_reach_and_what_lies_beyond_is_not():
    """Lengths whose correlation fills the transform: one delay more on a side would be another."""
    first, last = np.eye(8)[0], np.eye(8)[7]
    assert delay_samples(last, first, 100) == 7
    assert delay_samples(first, last, 100) == -7
