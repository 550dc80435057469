import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st

from ajgdata.features.spectrum import frequencies_hz, periodic_window, spectrum, within
from ajgdata.types import FeatureSettings

RATE = 44_100
U = 2.0**-24  # unit round-off of float32
RAW = FeatureSettings(normalisation="none")


def noise(n=RATE, seed=0):
    return np.random.default_rng(seed).standard_normal(n).astype(np.float32)


def reference(samples, settings):
    """Frames' transforms (bins, frames) in float64, by scipy.signal."""
    window = scipy.signal.get_window(settings.window_shape, settings.window)
    _, _, values = scipy.signal.stft(
        samples.astype(np.float64),
        1.0,
        window,
        settings.window,
        settings.window - settings.hop,
        boundary=None,
        padded=False,
    )
    return values * window.sum()


def bound(settings, frames):
    """Largest error of the sum over time relative to the sum of the frames' 2-norms.

    A float32 FFT of N points errs by at most eta log2 N in the 2-norm, eta = u (1 + 4 sqrt 2)
    (Higham, Accuracy and Stability of Numerical Algorithms, Theorem 24.2); window, product and
    magnitude add about 4 u, and a sum of `frames` magnitudes at most frames u.
    """
    return U * ((1 + 4 * np.sqrt(2)) * np.log2(settings.window) + 4 + frames)


@pytest.mark.parametrize("shape", ["hann", "hamming", "blackman", "boxcar"])
@pytest.mark.parametrize(("window", "hop"), [(2048, 512), (2048, 2048), (512, 100), (1000, 333)])
def test_magnitude_is_that_of_a_float64_reference(shape, window, hop):
    settings = FeatureSettings(window=window, hop=hop, window_shape=shape, normalisation="none")
    samples = noise()
    transforms = reference(samples, settings)
    error = spectrum(samples, RATE, settings) - np.abs(transforms).sum(axis=1)
    frame_norms = np.linalg.norm(transforms, axis=0).sum()
    in_one_sum = max(1, 65_536 // window)
    assert np.linalg.norm(error) < bound(settings, in_one_sum) * frame_norms


@pytest.mark.parametrize("normalisation", ["l1", "l2", "max"])
@pytest.mark.parametrize("quantity", ["magnitude", "power", "root_power"])
def test_normalised_features_of_white_noise(quantity, normalisation):
    """White noise and its errors spread evenly over the bins: the bound holds for each of them.

    Power doubles the relative error, and the norm adds the error of the spectrum once more.
    """
    settings = FeatureSettings(quantity=quantity, normalisation=normalisation)
    samples = noise()
    expected = (np.abs(reference(samples, settings)) ** (1 + (quantity != "magnitude"))).sum(axis=1)
    expected = np.sqrt(expected) if quantity == "root_power" else expected
    expected /= np.linalg.norm(expected, {"l1": 1, "l2": 2, "max": np.inf}[normalisation])
    got = spectrum(samples, RATE, settings)
    np.testing.assert_allclose(got, expected, rtol=4 * bound(settings, 32))


def frames_of(n, settings):
    return 1 + (n - settings.window) // settings.hop


@pytest.mark.parametrize("k", [5, 100, 1000])
def test_a_tone_at_a_bin_centre_fills_three_bins_of_a_hann_window(k):
    """Hann's transform is N/2 at 0, N/4 at +-1 and 0 at all other bins; a real tone has half."""
    tone = (0.3 * np.cos(2 * np.pi * k * np.arange(8192) / 2048 + 0.7)).astype(np.float32)
    expected = np.zeros(1025)
    expected[k - 1 : k + 2] = 0.3 * 2048 * np.array([1 / 8, 1 / 4, 1 / 8])
    expected *= frames_of(8192, RAW)
    tolerance = bound(RAW, 13) * np.linalg.norm(expected)
    np.testing.assert_allclose(spectrum(tone, RATE, RAW), expected, rtol=0, atol=tolerance)
    assert frequencies_hz(RATE, RAW)[k] == k * RATE / 2048


@pytest.mark.parametrize("quantity", ["magnitude", "power", "root_power"])
@pytest.mark.parametrize("exponent", [-60, -3, 1, 40])
def test_without_normalisation_the_amplitude_stays(quantity, exponent):
    settings = FeatureSettings(quantity=quantity, normalisation="none")
    power = 2 if quantity == "power" else 1
    louder = spectrum(np.ldexp(noise(5000), exponent), RATE, settings)
    expected = np.ldexp(spectrum(noise(5000), RATE, settings), power * exponent)
    np.testing.assert_array_equal(louder, expected)  # powers of two are exact


@settings(deadline=None)
@given(
    st.floats(1e-36, 1e36),
    st.sampled_from(["magnitude", "power", "root_power"]),
    st.sampled_from(["l1", "l2", "max"]),
    st.sampled_from([-1, 1]),
)
def test_normalised_features_do_not_depend_on_amplitude(scale, quantity, normalisation, sign):
    settings = FeatureSettings(window=256, hop=64, quantity=quantity, normalisation=normalisation)
    samples = noise(2000)
    scaled = np.float32(sign * scale) * samples  # rounds each sample by u
    np.testing.assert_allclose(
        spectrum(scaled, RATE, settings),
        spectrum(samples, RATE, settings),
        rtol=8 * bound(settings, frames_of(2000, settings)),
    )


def test_only_whole_frames_count():
    samples = noise(2048 + 512 * 3 + 511)
    changed = samples.copy()
    changed[-511:] = 99
    np.testing.assert_array_equal(spectrum(samples, RATE, RAW), spectrum(changed, RATE, RAW))
    changed[-512] = 99
    assert not np.array_equal(spectrum(samples, RATE, RAW), spectrum(changed, RATE, RAW))


@pytest.mark.parametrize("frames", [33, 101])  # a block has 32: the last one has one frame, or 5
def test_more_frames_than_fit_one_block_are_all_summed(frames):
    """A periodic signal has the same spectrum in every frame, however many there are."""
    period = noise(512)
    few = spectrum(np.tile(period, 8), RATE, RAW) / 5
    many = spectrum(np.tile(period, 3 + frames), RATE, RAW) / frames
    np.testing.assert_allclose(many, few, rtol=2 * 32 * U)


def test_band_keeps_its_bins_and_is_normalised_by_itself():
    band = FeatureSettings(band_hz=(1000, 5000), normalisation="none")
    frequencies = frequencies_hz(RATE, RAW)
    inside = (frequencies >= 1000) & (frequencies <= 5000)
    np.testing.assert_array_equal(frequencies_hz(RATE, band), frequencies[inside])
    cropped = spectrum(noise(), RATE, band)
    np.testing.assert_array_equal(cropped, spectrum(noise(), RATE, RAW)[inside])
    unit = spectrum(noise(), RATE, FeatureSettings(band_hz=(1000, 5000)))
    assert unit.sum() == pytest.approx(1, rel=len(unit) * U)
    edges = FeatureSettings(band_hz=(RATE / 2048 * 3, RATE / 2048 * 5))
    np.testing.assert_array_equal(frequencies_hz(RATE, edges), frequencies[3:6])
    with pytest.raises(ValueError, match="no bin lies within band_hz"):
        frequencies_hz(RATE, FeatureSettings(band_hz=(1, 2)))


@pytest.mark.parametrize(
    ("samples", "message"),
    [
        (np.ones(2047), "2047 samples are fewer than one window of 2048"),
        (np.ones((3000, 2)), r"shape \(n,\)"),
        (np.r_[np.ones(3000), np.nan], "NaN"),
    ],
)
def test_bad_samples(samples, message):
    with pytest.raises(ValueError, match=message):
        spectrum(samples, RATE, FeatureSettings())


def test_silence_is_zero_and_an_overflow_is_said():
    np.testing.assert_array_equal(spectrum(np.zeros(3000), RATE, FeatureSettings()), np.zeros(1025))
    settings = FeatureSettings(quantity="power", normalisation="none")
    with pytest.raises(ValueError, match="exceeds float32"):
        spectrum(noise(3000) * np.float32(1e20), RATE, settings)


def test_bins_at_both_ends_of_a_band_are_within_it():
    """The same bins as with `band_hz` in the settings: low <= frequency <= high."""
    shares = np.array([[0.4, 0.1, 0.3, 0.2]], np.float32)
    bins = np.array([0.0, 10.0, 20.0, 30.0])
    feature, frequencies = within(shares, bins, (10.0, 20.0), "l1")
    assert frequencies.tolist() == [10, 20]
    np.testing.assert_allclose(feature, [[0.25, 0.75]], rtol=1e-6)
    settings = FeatureSettings(band_hz=(RATE / 2048 * 3, RATE / 2048 * 5))
    full = spectrum(noise(), RATE, RAW)[np.newaxis]
    feature, frequencies = within(full, frequencies_hz(RATE, RAW), settings.band_hz, "l1")
    np.testing.assert_array_equal(frequencies, frequencies_hz(RATE, settings))
    np.testing.assert_allclose(feature[0], spectrum(noise(), RATE, settings), rtol=1e-6)
    with pytest.raises(ValueError, match="no bin of the feature lies within 11 to 19 Hz"):
        within(shares, bins, (11.0, 19.0), "l1")


@pytest.mark.parametrize("shape", ["hann", "hamming", "blackman", "boxcar"])
def test_windows_are_those_of_scipy(shape):
    for length in (16, 999, 2048):
        np.testing.assert_array_equal(
            periodic_window(shape, length), scipy.signal.get_window(shape, length)
        )
