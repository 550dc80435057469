"""The stream itself: frames are counted, devices named exactly, and nobody waits for ever."""

import sys

import numpy as np
import pytest
from fake_portaudio import FakePortAudio, device

from ajgdata.acquire import line
from ajgdata.acquire.line import Duplex, devices, load_portaudio
from ajgdata.types import DataError

SOUND = np.random.default_rng(0).uniform(-1, 1, 5_000).astype(np.float32)


def opened(fake: FakePortAudio, **settings) -> Duplex:
    usual = {"device": "fake", "sample_rate_hz": 44_100, "output_channel": 1, "microphone": 1}
    return Duplex(fake, {**usual, **settings})


def test_every_frame_is_there_once_however_the_driver_cuts_them():
    """The fake adds all outputs, and gives them garbage before each callback, as drivers do."""
    fake = FakePortAudio([device("fake", outputs=2)], latency=1_024, blocks=(256, 1, 1_000, 63))
    stream = opened(fake, output_channel=2)
    expected = np.zeros(7_001, dtype=np.float32)
    expected[1_024:6_024] = SOUND
    for _ in range(3):
        recording, flags = stream.play(SOUND, 7_001)
        np.testing.assert_array_equal(recording, expected)
        assert flags == ()
    stream._stream.abort()


def test_flags_of_a_take_are_reported():
    fake = FakePortAudio(flags={0: "output_underflow"}, pause_s=0.001)
    stream = opened(fake)
    stream.play(SOUND, 60_000)
    fake.flags = {stream._frames + 20_000: "input_overflow"}
    assert stream.play(SOUND, 60_000)[1] == ("input_overflow",)
    assert stream.play(SOUND, 6_000)[1] == ()
    stream._stream.abort()


@pytest.mark.parametrize("name", ["fake", "fake, ALSA"])
def test_devices_are_found_by_their_exact_name(name):
    fake = FakePortAudio([device("fake two"), device("fake")])
    stream = opened(fake, device=name)
    assert fake.opened["device"] == 1 and stream.describe()["api"] == "ALSA"
    assert fake.opened["blocksize"] == 0 and fake.opened["dtype"] == "float32"
    stream._stream.abort()


TWO = [device("fake", api=0), device("fake", api=1), device("mic", outputs=0)]


@pytest.mark.parametrize(
    "settings, said",
    [
        ({"device": "zzz"}, "zzz: there is no such device. .*see `ajgdata device list`"),
        ({}, '2 devices have this name. Use "fake, ALSA" or "fake, JACK Audio Connection Kit"'),
        ({"device": "mic"}, "mic: --output-channel 1 of 0 outputs. Change --output-channel"),
        ({"device": "fake, ALSA", "microphone": 2}, "--microphone 2 of 1 inputs"),
        (
            {"device": "fake, ALSA", "sample_rate_hz": 48_000},
            "does not support 48000 Hz. Use its own rate, 44100 Hz",
        ),
    ],
)
def test_what_cannot_be_opened_is_said_in_one_line(settings, said):
    with pytest.raises(DataError, match=said) as raised:
        opened(FakePortAudio(TWO), **settings)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    "fake, said",
    [
        (FakePortAudio(stops_after=0), "the driver did not request sound within"),
        (FakePortAudio(stops_after=3_000), "was disconnected while it played. Plug it in again"),
    ],
)
def test_whoever_waits_for_a_dead_stream_is_told(fake, said, monkeypatch):
    monkeypatch.setattr(line, "STALLED_S", 0.2)
    with pytest.raises(DataError, match=said):
        opened(fake).play(SOUND, 6_000)


def test_devices_are_listed_with_their_channels_and_rate():
    first, second = devices(FakePortAudio([device("a", rate=48_000), device("b", outputs=0)]))
    assert first == {"name": "a", "api": "ALSA", "inputs": 1, "outputs": 1, "rate_hz": 48_000}
    assert (second["outputs"], second["rate_hz"]) == (0, 44_100)


def test_the_one_package_that_is_missing_is_named(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "sounddevice", None)
    with pytest.raises(DataError, match=r'pip install "ajgdata\[live\]"'):
        load_portaudio()
    monkeypatch.delitem(sys.modules, "sounddevice")
    (tmp_path / "sounddevice.py").write_text("raise OSError('PortAudio library not found')")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(DataError, match="sudo apt-get install libportaudio2"):
        load_portaudio()
