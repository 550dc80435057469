"""What a session added and multiplied is taken out again."""

import numpy as np
import pytest

from ajgdata.evaluate.new_session import referenced, standardised

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
    found = standardised(known, SESSIONS, same * gains(3), same * gains(3))
    # asinh differs from the logarithm by (scale / x)² / 4: 4 % at x = 2.5 scale, the least here
    np.testing.assert_allclose(found.known[:40], found.new, rtol=0.05)
    np.testing.assert_allclose(found.known[40:], found.new, rtol=0.05)
    middle = np.sqrt(gains(1) * gains(2))  # of logarithms
    np.testing.assert_allclose(found.new, same * middle, rtol=0.05)


def test_each_session_has_the_same_mean_and_deviation_afterwards():
    known, new = np.concatenate([spectra(0), spectra(1, gain=3.0)]), spectra(2, gain=gains(5, 0.2))
    found = standardised(known, SESSIONS, new, new)
    scale = 0.1 * known.mean()
    parts = [np.arcsinh(x / scale) for x in (found.known[:40], found.known[40:], found.new)]
    for one in parts[1:]:  # float32 keeps seven digits
        np.testing.assert_allclose(one.mean(axis=0), parts[0].mean(axis=0), rtol=1e-5)
        np.testing.assert_allclose(one.std(axis=0), parts[0].std(axis=0), rtol=1e-4)


def test_what_is_tested_tells_nothing_of_its_session():
    known, pool = np.concatenate([spectra(0), spectra(1)]), spectra(2)
    every = standardised(known, SESSIONS, pool, spectra(3)).new
    some = standardised(known, SESSIONS, pool, spectra(3)[:3]).new
    np.testing.assert_array_equal(some, every[:3])


def test_one_recording_or_still_bins_are_only_shifted():
    known = np.concatenate([spectra(0), spectra(1)])
    known[:, 3] = 7.0
    found = standardised(known, SESSIONS, spectra(2)[:1], spectra(2))
    assert np.isfinite(found.known).all() and np.isfinite(found.new).all()
    np.testing.assert_allclose(found.known[:, 3], 7.0, rtol=1e-6)


def test_references_take_out_the_gain_of_every_session():
    """Gains of each session divide out by what they do to recordings of nothing."""
    nothing = spectra(9, 3)
    by_session = {"a": nothing * gains(1), "b": nothing * gains(2)}
    same = spectra(0)
    known = np.concatenate([same * gains(1), same * gains(2)])
    found = referenced(
        known, SESSIONS, by_session, same * gains(3), nothing * gains(3),
        hz=np.arange(float(BINS)), remedy="ratio", normalisation="l1",
    )  # fmt: skip
    np.testing.assert_allclose(found.known[:40], found.new, rtol=1e-5)  # float32
    np.testing.assert_allclose(found.known[40:], found.new, rtol=1e-5)
    np.testing.assert_allclose(found.new.sum(axis=1), 1, rtol=1e-5)


def test_without_references_the_reason_is_told():
    known = np.concatenate([spectra(0), spectra(1)])
    given = {"hz": np.arange(float(BINS)), "remedy": "ratio"}
    with pytest.raises(ValueError, match="1 references before and 3 after"):
        referenced(known, SESSIONS, {"a": spectra(2, 1)}, spectra(3), spectra(4, 3), **given)
    with pytest.raises(ValueError, match="0 references before"):
        referenced(known, SESSIONS, {}, spectra(3), spectra(4, 3), **given)
