"""What a session added and multiplied is taken out again."""

import numpy as np

from ajgdata.evaluate.few_grasps import standardised

BINS = 30


def spectra(seed: int, rows: int = 40, gain: np.ndarray | float = 1.0) -> np.ndarray:
    """Spectra far above where compression starts: there a gain is a shift."""
    return 1e4 * np.exp(np.random.default_rng(seed).normal(0, 0.3, (rows, BINS))) * gain


def gains(seed: int, spread: float = 0.3) -> np.ndarray:
    return np.exp(np.random.default_rng(seed).normal(0, spread, BINS))


SESSIONS = np.repeat(["a", "b"], 40)


def test_a_gain_of_each_bin_is_taken_out_by_recordings_without_labels():
    """The same grasps in three sessions, each with gains of its own: afterwards all are alike."""
    same = spectra(0)
    known = np.concatenate([same * gains(1), same * gains(2)])
    known_after, new_after = standardised(known, SESSIONS, same * gains(3), same * gains(3))
    # asinh differs from the logarithm by (scale / x)² / 4: 4 % at x = 2.5 scale, the least here
    np.testing.assert_allclose(known_after[:40], new_after, rtol=0.05)
    np.testing.assert_allclose(known_after[40:], new_after, rtol=0.05)
    middle = np.sqrt(gains(1) * gains(2))  # of logarithms
    np.testing.assert_allclose(new_after, same * middle, rtol=0.05)


def test_each_session_has_the_same_mean_and_deviation_afterwards():
    known, new = np.concatenate([spectra(0), spectra(1, gain=3.0)]), spectra(2, gain=gains(5, 0.2))
    known_after, new_after = standardised(known, SESSIONS, new, new)
    scale = 0.1 * known.mean()
    parts = [np.arcsinh(x / scale) for x in (known_after[:40], known_after[40:], new_after)]
    for one in parts[1:]:  # float32 keeps seven digits
        np.testing.assert_allclose(one.mean(axis=0), parts[0].mean(axis=0), rtol=1e-5)
        np.testing.assert_allclose(one.std(axis=0), parts[0].std(axis=0), rtol=1e-4)


def test_what_is_tested_tells_nothing_of_its_session():
    known, pool = np.concatenate([spectra(0), spectra(1)]), spectra(2)
    every = standardised(known, SESSIONS, pool, spectra(3))[1]
    some = standardised(known, SESSIONS, pool, spectra(3)[:3])[1]
    np.testing.assert_array_equal(some, every[:3])
