"""Levels in bands are shares of the mean square, and only a jump is a jump."""

import numpy as np
import pytest

from ajgdata.acquire.band_levels import (
    JUMP_DB,
    LOWEST_HZ,
    Level,
    band_edges_hz,
    jump_db,
    level_of,
    usual,
)

RATE_HZ = 44_100


def tone(hz: float, amplitude: float) -> np.ndarray:
    return amplitude * np.sin(2 * np.pi * hz * np.arange(RATE_HZ) / RATE_HZ)


def test_edges_are_half_octaves_below_half_the_rate():
    edges = band_edges_hz(RATE_HZ)
    assert len(edges) == 20 and edges[0] == LOWEST_HZ
    np.testing.assert_allclose(edges[1:] / edges[:-1], np.sqrt(2), rtol=1e-12)
    assert edges[-1] < RATE_HZ / 2 < edges[-1] * np.sqrt(2)


@pytest.mark.parametrize("hz", [50, 1_000, 12_345])
def test_a_tone_has_its_mean_square_in_its_band(hz):
    level = level_of(tone(hz, 0.1), RATE_HZ)
    band = int(np.searchsorted(band_edges_hz(RATE_HZ), hz)) - 1
    # A whole number of periods: no leakage, hence round-off alone.
    assert level.bands_db[band] == pytest.approx(20 * np.log10(0.1 / np.sqrt(2)), abs=1e-6)
    assert level.bands_db[band] - np.delete(level.bands_db, band).max() > 90
    assert level.peak_dbfs == pytest.approx(-20, abs=0.05)  # samples may miss the very top


def test_bands_add_up_to_the_mean_square():
    noise = np.random.default_rng(0).standard_normal(RATE_HZ) * 0.05
    spectrum = np.fft.rfft(noise)
    hz = np.fft.rfftfreq(len(noise), 1 / RATE_HZ)
    edges = band_edges_hz(RATE_HZ)
    spectrum[(hz < edges[0]) | (hz >= edges[-1])] = 0
    within = np.fft.irfft(spectrum, len(noise))
    total = (10 ** (level_of(noise, RATE_HZ).bands_db / 10)).sum()
    assert total == pytest.approx(np.mean(within**2), rel=1e-9)


def test_silence_has_a_floor_and_no_warning():
    level = level_of(np.zeros(1_000), RATE_HZ)
    assert level.peak_dbfs == -120 and set(level.bands_db) == {-120}


def test_the_usual_is_a_median_and_a_jump_is_beyond_its_limit():
    assert usual([]) is None
    levels = [Level(peak, np.array([peak, 0.0])) for peak in (-20.0, -22.0, -60.0)]
    known = usual(levels)
    assert known.peak_dbfs == -22 and known.bands_db.tolist() == [-22, 0]
    for difference in (-JUMP_DB, 0.0, JUMP_DB):
        assert jump_db(Level(-22 + difference, np.zeros(2)), known) == 0
    assert jump_db(Level(-22 + JUMP_DB + 1, np.zeros(2)), known) == JUMP_DB + 1
    assert jump_db(Level(-40.0, np.zeros(2)), known) == -18
    assert jump_db(Level(-40.0, np.zeros(2)), None) == 0
