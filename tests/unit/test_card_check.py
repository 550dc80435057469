"""The check of a card: known faults of a fake one are named, and a good one is left in peace."""

import json
import re
from dataclasses import dataclass, replace

import numpy as np
import pytest
from fake_card import RATE_HZ, FakeLine, fake_card
from scipy.signal import resample_poly

from ajgdata.acquire.card import Heard
from ajgdata.acquire.card_check import Band, CardCheck, check_card
from ajgdata.acquire.card_measures import Hum

GOOD = CardCheck(
    device={"device": "fake"},
    sample_rate_hz=44_100,
    latency_samples=(1_024, 1_024, 1_024),
    peak_dbfs=-9.0,
    clipped=0,
    xruns=0,
    repeated=0,
    lost_frames=0,
    bands=tuple(Band(hz, -12.0, -90.0, 0.001) for hz in (100.0, 1_000.0, 8_000.0)),
    hum=(Hum(50, -110.0, 1.0), Hum(60, -112.0, 0.0)),
    drift_ppm=0.0,
    drift_error_ppm=0.0,
    clock_ppm=20.0,
    drift_s=60.0,
    unheard=0,
)


def bands(**changed) -> tuple[Band, ...]:
    return tuple(band._replace(**changed) for band in GOOD.bands)


@pytest.mark.parametrize(
    "changed, level, said",
    [
        ({}, "good", "the card is ready: record"),
        ({"clipped": 7}, "bad", "7 samples are clipped; lower the output"),
        ({"peak_dbfs": -1.0}, "change", "peak -1.0 dBFS: 8 dB too loud; lower .* is -9 dBFS"),
        ({"peak_dbfs": -49.0}, "change", "peak -49.0 dBFS: 40 dB too quiet; raise"),
        ({"bands": bands(noise_dbfs=-37.0)}, "change", "the sweep is 25 dB above the noise"),
        ({"bands": bands(noise_dbfs=-13.0)}, "bad", "the sweep is 1 dB above the noise"),
        ({"bands": bands(distortion=0.08)}, "change", "8 % harmonics at 1000 Hz; lower the output"),
        ({"hum": (Hum(50, -60, 30.0), Hum(60, -110, 1.0))}, "change", "hum of 50 Hz, -60 dBFS"),
        ({"latency_samples": (5, 9, 5)}, "change", "latency differs by 4 samples"),
        ({"lost_frames": 64}, "bad", "64 frames were lost within 60 s"),
        ({"repeated": 1, "xruns": 2}, "change", "reported 2 xruns, 1 takes were repeated"),
        ({"drift_ppm": -40.0}, "bad", "drift apart by -40 millionths: two clocks; .* one device"),
        ({"drift_ppm": -40.0, "drift_error_ppm": 9.0}, "good", "ready"),
        ({"unheard": 2}, "change", "2 pulses of 60 drown in the noise; play louder"),
        (
            {"unheard": 40, "drift_ppm": None, "lost_frames": None},
            "change",
            r"clocks and dropouts not measured: too noisy \(40 pulses of 60 drown",
        ),
    ],
)
def test_verdict(changed, level, said):
    (advice,) = replace(GOOD, **changed).verdict
    assert advice.level == level
    assert re.search(said, f"{advice.said}; {advice.fix}")


def test_the_worst_comes_first():
    found = replace(GOOD, peak_dbfs=-1.0, lost_frames=3, latency_samples=(1, 2, 1)).verdict
    assert [one.level for one in found] == ["bad", "change", "change"]


def test_a_good_card_is_measured_as_it_is():
    """Gain 0.3, noise 1e-4, no other fault: levels follow from these."""
    line = FakeLine(np.array([0.3]), noise=1e-4)
    check, sounds = check_card(fake_card(line), drift_s=5)
    assert check.latency_samples == (1_024,) * 3 and check.latency_spread == 0
    assert check.peak_dbfs == pytest.approx(20 * np.log10(0.27), abs=0.05)
    band = next(band for band in check.bands if 990 < band.centre_hz < 1_010)
    assert band.level_dbfs == pytest.approx(20 * np.log10(0.27), abs=0.3)
    width = band.centre_hz * (10**0.05 - 10**-0.05)
    expected = 10 * np.log10(2 * 1e-8 * width / (RATE_HZ / 2))
    # A band of 460 bins: five deviations of its power are 10 log10(1 + 5/sqrt(460)) = 0.9 dB.
    assert band.noise_dbfs == pytest.approx(expected, abs=0.9)
    assert check.drift_ppm == pytest.approx(0, abs=0.05) and check.lost_frames == 0
    assert len(sounds.delays) == 5 and len(sounds.take) == RATE_HZ + 4_410
    assert [one.level for one in check.verdict] == ["good"]


@dataclass
class Faulty(FakeLine):
    """Distorts, hums, and its recording clock runs ahead by so many hundred millionths."""

    square: float = 0.0
    limit: float = np.inf
    fan: float = 0.0  # noise that begins after the silence
    mains_hz: float = 0.0
    fast: int = 0
    loses: int = 0

    def play(self, sound, frames):
        played = np.clip(sound + self.square * sound**2, -self.limit, self.limit)
        heard = super().play(played.astype(np.float32), frames).samples
        time = np.arange(frames)[:, None] / RATE_HZ
        heard = heard + 0.003 * np.sin(2 * np.pi * self.mains_hz * time)
        if self.fan and len(sound) > 3 * RATE_HZ:
            heard = heard + self.fan * np.random.default_rng(0).standard_normal(heard.shape)
        if self.fast and len(sound) > 3 * RATE_HZ:  # the pulses: a sweep is too short to show it
            heard = resample_poly(heard, 10_000 + self.fast, 10_000, axis=0)[:frames]
        if self.loses and len(sound) > 3 * RATE_HZ:
            cut = 2 * RATE_HZ + 20_000
            heard = np.r_[heard[:cut], heard[cut + self.loses :], heard[: self.loses] * 0]
        return Heard(heard.astype(np.float32))


@pytest.mark.parametrize(
    "faults, topic, said",
    [
        ({"square": 0.2}, "distortion", "% harmonics at 251 Hz"),
        ({"limit": 0.1, "response": np.array([3.0])}, "distortion", "41 % harmonics at 3981 Hz"),
        ({"mains_hz": 60.0}, "hum", "hum of 60 Hz, -50 dBFS"),
        ({"fast": 1}, "clocks", "drift apart by 100 millionths"),
        ({"loses": 37}, "dropouts", "37 frames were lost within 6 s"),
    ],
)
def test_known_faults_are_named(faults, topic, said):
    line = Faulty(**{"response": np.array([0.3]), "noise": 1e-4, **faults})
    check, _ = check_card(fake_card(line), drift_s=6)
    (advice,) = check.verdict
    assert advice.topic == topic and said in advice.said


def test_a_noisy_room_is_called_noisy_and_nothing_else():
    """10 dB and 3 dB below the sweep's rms of 0.19; nothing is lost, and there is one clock."""
    for noise in (0.06, 0.13):
        check, _ = check_card(fake_card(FakeLine(np.array([0.3]), noise=noise)), drift_s=8)
        assert check.lost_frames in (0, None)
        topics = {one.topic for one in check.verdict if one.level == "bad"}
        assert not topics & {"clocks", "dropouts"}
    check, sounds = check_card(fake_card(Faulty(np.array([0.3]), noise=1e-4, fan=0.5)), drift_s=8)
    assert check.lost_frames is None and check.drift_ppm is None and check.unheard > 4
    assert np.count_nonzero(np.isnan(sounds.delays)) == check.unheard
    assert "clocks and dropouts not measured" in " ".join(one.said for one in check.verdict)


def test_what_the_session_keeps_is_plain():
    check, _ = check_card(fake_card(FakeLine(np.array([0.3]))), drift_s=0)
    kept = json.loads(json.dumps(check.summary(), allow_nan=False))
    assert kept["latency_samples"] == [1_024] * 3 and kept["device"]["api"] == "fake"
    assert kept["drift_ppm"] is None and kept["verdict"][0]["level"] == "good"
    assert len(kept["bands"]) == 29 and kept["bands"][0]["snr_db"] > 0
