"""The check of a card names known faults of a fake card, and accepts a good one."""

import re
from dataclasses import replace

import numpy as np
import pytest
from fake_card import RATE_HZ, FakeLine, fake_card

from ajgdata.acquire.card_check import CardCheck, check_card

GOOD = CardCheck(
    latency_samples=(1_024, 1_024, 1_024),
    peak_dbfs=-9.0,
    clipped=0,
    xruns=0,
    repeated=0,
    snr_db=60.0,
)


@pytest.mark.parametrize(
    "changed, level, text",
    [
        ({}, "good", "the card is ready: record"),
        ({"clipped": 7}, "bad", "7 samples are clipped; lower output"),
        ({"peak_dbfs": -1.0}, "change", "peak -1.0 dBFS is too loud; lower .* -9 dBFS"),
        ({"peak_dbfs": -49.0}, "change", "too quiet; raise"),
        ({"snr_db": 1.0}, "bad", "the sweep is 1 dB above the noise"),
        ({"latency_samples": (5, 9, 5)}, "change", "latency differs by 4 samples"),
        ({"repeated": 1, "xruns": 2}, "change", "reported 2 xruns, 1 takes were repeated"),
    ],
)
def test_verdict(changed, level, text):
    (advice,) = replace(GOOD, **changed).verdict
    assert advice.level == level
    assert re.search(text, f"{advice.problem}; {advice.fix}")


def test_the_worst_comes_first():
    verdict = replace(GOOD, peak_dbfs=-1.0, snr_db=1.0, latency_samples=(1, 2, 1)).verdict
    assert [advice.level for advice in verdict] == ["bad", "change", "change"]


def test_a_good_card_is_measured_as_it_is():
    """Gain 0.3, white noise of 1e-4: the ratio at 1.55 kHz, the median band, follows from these."""
    check = check_card(fake_card(FakeLine(np.array([0.3]), noise=1e-4)))
    assert check.latency_samples == (1_024,) * 3
    assert check.peak_dbfs == pytest.approx(20 * np.log10(0.27), abs=0.05)
    noise = 1e-8 * 1_550 * (10**0.05 - 10**-0.05) / (RATE_HZ / 2)
    assert check.snr_db == pytest.approx(10 * np.log10(0.27**2 / 2 / noise), abs=1)
    assert [advice.level for advice in check.verdict] == ["good"]
