"""What became of a gripper, from recordings of nothing; and undone, on spectra known beforehand."""

import numpy as np
import pytest

from ajgdata.evaluate.reference_correction import change, stretched
from ajgdata.types import NotPossibleError

HZ = np.linspace(0, 22_050, 1025)
RNG = np.random.default_rng(0)


def spectrum(factor: float = 1.0, gain: float | np.ndarray = 1.0, peaks=(900, 2500, 6100, 9000)):
    """Resonances at `factor` times `peaks` Hz over a floor, with the gain of each bin, l1 norm."""
    level = 0.05 + sum(1 / (1 + ((HZ / factor - peak) / 150) ** 2) for peak in peaks)
    return gain * level / np.sum(gain * level)


def noisy(one: np.ndarray, count: int) -> np.ndarray:
    return one * np.exp(0.01 * RNG.standard_normal((count, len(one))))


@pytest.mark.parametrize("warmer_k", [-20.0, -3.0, 0.0, 5.0, 13.0])
def test_the_stretch_is_that_of_the_speed_of_sound(warmer_k):
    """√(T/T₀); the width of a peak, 150 Hz at 9 kHz, is seven bins: a tenth of one is 2e-4."""
    factor = np.sqrt((295.15 + warmer_k) / 295.15)
    found = change(noisy(spectrum(), 10), noisy(spectrum(factor), 3), HZ)
    assert found.stretch == pytest.approx(factor, abs=4e-4)


def test_a_stretch_is_undone_for_other_spectra_too():
    """What was found on references holds for spectra with resonances of their own; what is left is
    the error of reading between bins 21.5 Hz wide."""
    factor, held = 1.02, (700, 3300, 5000, 8000)
    found = change(noisy(spectrum(), 10), noisy(spectrum(factor), 5), HZ)
    new, old = spectrum(factor, peaks=held), spectrum(peaks=held)
    assert np.abs(found.undone(new[None])[0] - old).sum() < 0.1 * np.abs(new - old).sum()


def test_a_gain_is_divided_out():
    gain = np.exp(0.5 * np.sin(HZ / 3000))
    before, after = np.array([spectrum()] * 2), np.array([spectrum(gain=gain)])
    found = change(before * [[0.99], [1.01]], after, HZ)
    held = (700, 3300, 5000, 8000)
    new, old = spectrum(gain=gain, peaks=held), spectrum(peaks=held)
    assert np.abs(found.undone(new[None])[0] - old).sum() < 0.1 * np.abs(new - old).sum()


def test_where_nothing_has_changed_nothing_is_done():
    references = noisy(spectrum(), 20)
    found = change(references, references, HZ)
    held = spectrum(peaks=(700, 3300)).astype(np.float32)
    assert found.stretch == pytest.approx(1, abs=1e-4)
    tolerance = 0.01 * held.max()  # of a stretch of 1e-4: a bin's twentieth, a hundredth of a peak
    np.testing.assert_allclose(found.undone(held[None])[0], held, atol=tolerance)


@pytest.mark.parametrize(("normalisation", "norm"), [("l1", 1), ("l2", 2), ("max", np.inf)])
def test_corrected_features_have_the_norm_of_features_and_nothing_below_zero(normalisation, norm):
    found = change(noisy(spectrum(), 5), noisy(spectrum(1.01), 5), HZ)
    undone = found.undone(noisy(spectrum(1.01, peaks=(700, 3300)), 4), normalisation)
    assert undone.dtype == np.float32 and undone.min() >= 0
    np.testing.assert_allclose(np.linalg.norm(undone, norm, axis=1), 1, rtol=1e-5)


def test_reading_at_other_frequencies_is_linear_and_ends_at_the_last_bin():
    hz = np.array([100.0, 200, 300])
    np.testing.assert_allclose(stretched([[1.0, 2, 4]], hz, 1.25), [[1.25, 3, 4]])
    np.testing.assert_allclose(stretched([1.0, 2, 4], hz, 0.75), [1, 1.5, 2.5])


def test_too_few_references_are_said():
    with pytest.raises(NotPossibleError, match="1 references before and 1 after"):
        change([spectrum()], [spectrum()], HZ)
    with pytest.raises(NotPossibleError, match="0 after"):
        change([spectrum()] * 2, np.empty((0, 1025)), HZ)
