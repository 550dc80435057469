"""A sound on the page: peaks, spectrogram and bytes with known answers."""

import io

import numpy as np
import pytest
import soundfile
from worlds import RATE_HZ, tone, write_tone

from ajgdata.browse.site import byte_range
from ajgdata.browse.sounds import (
    COLUMNS,
    RANGE_DB,
    ROWS,
    level_dbfs,
    peaks,
    read_channel,
    spectrogram,
    wav_bytes,
)
from ajgdata.store.audio import AudioError
from ajgdata.types import WHOLE_FILE, Segment


def test_peaks_of_more_samples_than_columns():
    samples = np.arange(12, dtype=np.float32)
    assert peaks(samples, count=3).tolist() == [[0, 4, 8], [3, 7, 11]]


def test_peaks_of_a_short_sound_are_its_samples():
    assert peaks(np.array([0.5, -0.5], np.float32)).tolist() == [[0.5, -0.5], [0.5, -0.5]]


@pytest.mark.parametrize("hz", [200.0, 1000.0, 3000.0])
def test_the_largest_level_of_a_tone_is_at_its_frequency(hz):
    drawn = spectrogram(tone(hz).astype(np.float32), RATE_HZ)
    row = drawn.levels.mean(axis=1).argmax()
    step = (drawn.high_hz / drawn.low_hz) ** (1 / ROWS)
    shown_hz = drawn.low_hz * step ** (row + 0.5)
    # Half a bin of 8000 / 256 Hz, and half a row.
    assert abs(shown_hz - hz) <= RATE_HZ / 256 / 2 + hz * (step - 1) / 2
    assert drawn.levels.max() == 255


def test_a_level_is_linear_in_db():
    """A tone that is 20 dB weaker in the second half is 20 / RANGE_DB of the range darker."""
    samples = tone(1000.0, 8000)
    samples[4000:] *= 0.1
    drawn = spectrogram(samples.astype(np.float32), RATE_HZ)
    row = drawn.levels[:, 0].argmax()
    first, last = drawn.levels[row, [2, -3]].astype(int)
    assert first - last == pytest.approx(255 * 20 / RANGE_DB, abs=1)


@pytest.mark.parametrize("count", [1, 100, 50_000])
def test_the_size_of_a_spectrogram_is_bounded(count):
    drawn = spectrogram(np.zeros(count, np.float32), RATE_HZ)
    assert drawn.levels.shape[0] == ROWS
    assert 1 <= drawn.levels.shape[1] <= COLUMNS
    assert drawn.levels.max() == 0


def test_a_played_segment_has_the_samples_of_the_file(tmp_path):
    write_tone(tmp_path / "a.wav", 500.0)
    channel = read_channel(tmp_path / "a.wav", Segment(0.1, 0.2))
    played, rate_hz = soundfile.read(io.BytesIO(wav_bytes(channel)), dtype="float32")
    expected, _ = soundfile.read(tmp_path / "a.wav", dtype="float32")
    assert rate_hz == RATE_HZ
    np.testing.assert_array_equal(played, expected[800:1600])


def test_each_channel_is_played_alone_and_clipped(tmp_path):
    samples = np.array([[0.25, 2.0], [0.5, -2.0], [0.75, np.nan]], np.float32)
    soundfile.write(tmp_path / "a.wav", samples, RATE_HZ, subtype="FLOAT")
    second = read_channel(tmp_path / "a.wav", WHOLE_FILE, 2)
    assert second.info.channels == 2
    played, _ = soundfile.read(io.BytesIO(wav_bytes(second)))
    np.testing.assert_allclose(played, [1, -1, 0], atol=2**-22)
    with pytest.raises(AudioError, match="uses microphone 3"):
        read_channel(tmp_path / "a.wav", WHOLE_FILE, 3)


def test_a_changed_file_is_read_again(tmp_path):
    write_tone(tmp_path / "a.wav", 500.0)
    first = read_channel(tmp_path / "a.wav", WHOLE_FILE)
    assert read_channel(tmp_path / "a.wav", WHOLE_FILE) is first
    write_tone(tmp_path / "a.wav", 500.0, 3_000)
    assert len(read_channel(tmp_path / "a.wav", WHOLE_FILE).samples) == 3_000


def test_peak_level():
    assert level_dbfs(np.array([0.0, -0.1], np.float32)) == pytest.approx(-20, abs=1e-5)
    assert level_dbfs(np.zeros(3, np.float32)) is None


def test_a_sound_without_samples_has_no_level_and_no_peaks():
    samples = np.empty(0, np.float32)
    assert level_dbfs(samples) is None
    assert peaks(samples).shape == (2, 0)
    assert spectrogram(samples, RATE_HZ).levels.max() == 0


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        ("", None),
        ("bytes=0-0", range(1)),
        ("bytes=0-", range(10)),
        ("bytes=5-100", range(5, 10)),
        ("bytes=-4", range(6, 10)),
        ("bytes=-40", range(10)),
        ("bytes=10-", range(0)),
        ("bytes=7-3", range(0)),
        ("bytes=-", None),
        ("bytes=0-1,3-4", None),
        ("lines=0-1", None),
    ],
)
def test_byte_range(header, expected):
    assert byte_range(header, 10) == expected
