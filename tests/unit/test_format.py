"""Bars of a score: their lengths below and above the mean."""

import math

import pytest

from ajgdata.report.format import Score


@pytest.mark.parametrize(
    ("score", "below", "above"),
    [
        (Score(5.0, 0.3, low=4.0, high=8.0), 1.0, 3.0),  # the ends of an interval
        (Score(5.0, 0.3), 0.3, 0.3),  # one standard deviation
        (Score(5.0, 0.3, low=4.0), 0.3, 0.3),  # one end alone is no interval
        (Score(5.0, math.nan), 0.0, 0.0),
        (Score(5.0, 0.3, low=5.5, high=8.0), 0.0, 3.0),  # the mean lies below its interval
    ],
)
def test_bars_reach_the_ends_of_the_interval(score, below, above):
    assert score.bars() == [[pytest.approx(below)], [pytest.approx(above)]]
    assert score.bars(-100.0) == [[pytest.approx(100 * below)], [pytest.approx(100 * above)]]
