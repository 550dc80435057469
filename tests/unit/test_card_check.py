"""The check of a card names known faults of a fake card, and accepts a good one."""

import re
from dataclasses import dataclass, replace

import numpy as np
import pytest
from fake_card import RATE_HZ, FakeLine, fake_card
from scipy.signal import resample_poly

from ajgdata.acquire.card import Heard
from ajgdata.acquire.card_check import CardCheck, check_card

GOOD = CardCheck(
    latency_samples=(1_024, 1_024, 1_024),
    peak_dbfs=-9.0,
    clipped=0,
    xruns=0,
    repeated=0,
    snr_db=60.0,
    shifts=(0, 0),
    drift_s=60.0,
)


@pytest.mark.parametrize(
    "changed, level, text",
    [
        ({}, "good", "the card is ready: record"),
        ({"clipped": 7}, "bad", "7 samples are clipped; lower output"),
        ({"peak_dbfs": -1.0}, "change", "peak -1.0 dBFS is too loud; lower .* -9 dBFS"),
        ({"peak_dbfs": -49.0}, "change", "too quiet; raise"),
        ({"snr_db": 25.0}, "change", "the sweep is 25 dB above the noise"),
        ({"snr_db": 1.0}, "bad", "the sweep is 1 dB above the noise"),
        ({"latency_samples": (5, 9, 5)}, "change", "latency differs by 4 samples"),
        ({"repeated": 1, "xruns": 2}, "change", "reported 2 xruns, 1 takes were repeated"),
        ({"shifts": (0, 64)}, "bad", "64 frames were lost within 60 s"),
        ({"shifts": (-52, -53)}, "bad", "drift apart by -52 frames in 30 s; .* one device"),
        ({"shifts": (None, 0)}, "change", "not measured: too noisy; play louder"),
    ],
)
def test_verdict(changed, level, text):
    (advice,) = replace(GOOD, **changed).verdict
    assert advice.level == level
    assert re.search(text, f"{advice.problem}; {advice.fix}")


def test_the_worst_comes_first():
    verdict = replace(GOOD, peak_dbfs=-1.0, shifts=(3, 0), latency_samples=(1, 2, 1)).verdict
    assert [advice.level for advice in verdict] == ["bad", "change", "change"]


def test_a_good_card_is_measured_as_it_is():
    """Gain 0.3, white noise of 1e-4: the ratio at 1.55 kHz, the median band, follows from these."""
    check = check_card(fake_card(FakeLine(np.array([0.3]), noise=1e-4)), drift_s=6)
    assert check.latency_samples == (1_024,) * 3
    assert check.peak_dbfs == pytest.approx(20 * np.log10(0.27), abs=0.05)
    noise = 1e-8 * 1_550 * (10**0.05 - 10**-0.05) / (RATE_HZ / 2)
    assert check.snr_db == pytest.approx(10 * np.log10(0.27**2 / 2 / noise), abs=1)
    assert check.shifts == (0, 0)
    assert [advice.level for advice in check.verdict] == ["good"]


@dataclass
class Faulty(FakeLine):
    """A card with clocks that differ by so many hundred millionths, lost frames, or late noise."""

    fast: int = 0
    loses: int = 0
    late_noise: float = 0.0

    def play(self, sound, frames):
        heard = super().play(sound, frames).samples
        if len(sound) > 2 * RATE_HZ and np.any(sound):  # the long takes
            if self.fast:
                heard = resample_poly(heard, 10_000 + self.fast, 10_000, axis=0)[:frames]
            if self.loses:
                cut, self.loses = 2 * RATE_HZ, 0
                heard = np.r_[heard[:cut], heard[cut + 37 :], heard[:37] * 0]
            noise = np.random.default_rng(0).standard_normal(heard.shape)
            heard = heard + self.late_noise * noise
        return Heard(heard.astype(np.float32))


@pytest.mark.parametrize(
    "faults, topic, text",
    [
        ({"fast": 1}, "clocks", "drift apart by -14 frames in 3 s"),
        ({"loses": 37}, "dropouts", "37 frames were lost within 6 s"),
        ({"late_noise": 5.0}, "clocks", "clocks and dropouts not measured"),
        ({"noise": 0.05}, "noise", "above the noise"),
    ],
)
def test_known_faults_are_named(faults, topic, text):
    line = Faulty(**{"response": np.array([0.3]), "noise": 1e-4, **faults})
    (advice,) = check_card(fake_card(line), drift_s=6).verdict
    assert advice.topic == topic and text in advice.problem


def test_clocks_can_be_left_out():
    check = check_card(fake_card(FakeLine(np.array([0.3]))), drift_s=0)
    assert check.shifts == () and "not measured" in check.facts()["clocks"]
