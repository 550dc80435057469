"""The check of a card names known faults of a fake card, and accepts a good one."""

import numpy as np
import pytest
from fake_card import RATE_HZ, FakeLine, fake_card

from ajgdata.acquire.sound_card import CardCheck, check_card

GOOD = CardCheck((1_024, 1_024, 1_024), peak_dbfs=-9.0, clipped=0, repeated=0, snr_db=60.0)


@pytest.mark.parametrize(
    "changed, problem, fix",
    [
        ({"clipped": 7, "peak_dbfs": 0.0}, "7 samples are clipped", "lower output"),
        ({"peak_dbfs": -1.0}, "peak is too loud", "change output"),
        ({"peak_dbfs": -49.0}, "peak is too quiet", "change output"),
        ({"snr_db": 19.0}, "too much noise", "play louder"),
        (
            {"latency_samples": (5, 9, 5)},
            "latency differs by 4 samples between takes",
            "use another API",
        ),
        ({"repeated": 1}, "1 takes repeated", "close other programs"),
    ],
)
def test_each_issue_is_named(changed, problem, fix):
    (issue,) = GOOD._replace(**changed).issues
    assert issue[0] == problem
    assert issue[1].startswith(fix)


def test_a_good_card_is_measured_as_it_is():
    """Gain 0.3, white noise of 1e-4 and the time of the sweep in the band give the ratio."""
    check = check_card(fake_card(FakeLine(np.array([0.3]), noise=1e-4)))
    assert check.latency_samples == (1_024,) * 3
    assert check.peak_dbfs == pytest.approx(20 * np.log10(0.27), abs=0.05)
    noise = 1e-8 * (12_000 - 200) / (RATE_HZ / 2)
    seconds_in_band = np.log(12_000 / 200) / np.log(20_000 / 20)
    power = 0.27**2 / 2 * seconds_in_band / 1.1  # 1 s and a tail of 0.1 s
    assert check.snr_db == pytest.approx(10 * np.log10(power / noise), abs=0.3)
    assert check.issues == []
