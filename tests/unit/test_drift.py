"""The watch over references: its false alarms are those that it states, and warmth is heard."""

import numpy as np
import pytest

from ajgdata.live.drift import DriftWatch, references_needed


def share_of_alarms(n: int, m: int, allowed: float, trials: int = 1000) -> tuple[float, float]:
    """Return the measured and the stated rate, of heavy-tailed references of three numbers."""
    generator = np.random.default_rng(n + m)
    alarms = 0
    for _ in range(trials):
        spectra = np.exp(generator.standard_t(3, (n + m, 3)) * 0.1)
        watch = DriftWatch(spectra[:n], allowed, in_a_row=m)
        alarms += [watch.observe(one) for one in spectra[n:]][-1] > 1
    return alarms / trials, watch.false_alarm


def test_an_unchanged_gripper_raises_no_more_alarms_than_are_stated():
    """The rate is at most what is stated (a reference of day 1 is scored by one fewer, which makes
    its score larger), within three standard deviations of as many trials."""
    measured, stated = share_of_alarms(n=20, m=2, allowed=0.1)
    assert 0.05 < stated <= 0.1
    assert measured < stated + 3 * np.sqrt(stated / 1000)
    assert measured > stated / 3  # and it is no watch that sleeps


def test_how_many_references_a_rate_needs():
    """1 / C(n + m, m) <= 0.01: C(100, 1) = 100; C(14, 2) = 91, C(15, 2) = 105; C(10, 3) = 120,
    C(9, 3) = 84."""
    assert [references_needed(0.01, m) for m in (1, 2, 3)] == [99, 13, 7]
    assert references_needed(0.5, 1) == 3  # fewer have no standard deviation that could be trusted
    some = np.random.default_rng(0).uniform(1, 2, (12, 4))
    assert DriftWatch(some).in_a_row == 3
    with pytest.raises(ValueError, match=r"12 references .* 0\.01: record 1 more of the empty"):
        DriftWatch(some, in_a_row=2)
    with pytest.raises(ValueError, match="record 3 more"):
        DriftWatch(some[:4])


def test_the_limit_is_the_largest_score_that_keeps_the_rate():
    """30 references, 2 in a row: C(j + 1, 2) / C(32, 2) is 1, 3 and 6 of 496 for j = 1, 2, 3, and
    6 is more than 0.01. The limit lies below the largest score and above the third."""
    some = np.random.default_rng(0).uniform(1, 2, (30, 4))
    watch = DriftWatch(some)
    assert watch.false_alarm == 3 / 496
    scale = np.abs(some).mean()
    left_out = []
    for row, one in enumerate(np.arcsinh(some / scale)):
        others = np.arcsinh(np.delete(some, row, 0) / scale)
        distance = (one - others.mean(0)) / others.std(0, ddof=1)
        left_out.append(np.sqrt(np.mean(distance**2)))
    assert watch.limit == pytest.approx(sorted(left_out)[-2])


def test_one_odd_reference_is_no_alarm_and_a_change_is_told_until_it_is_gone():
    some = np.random.default_rng(0).uniform(1, 2, (30, 4))
    watch, usual, odd = DriftWatch(some), np.full(4, 1.5), np.full(4, 9.0)
    far = float(watch.score(odd)) / watch.limit
    told = [watch.observe(one) for one in (odd, odd, usual, odd, odd, odd)]
    assert far > 1
    assert told[0] == 1  # too early for an alarm
    assert told[1] == told[4] == told[5] == pytest.approx(far)
    assert max(told[2:4]) < 1


def test_what_is_no_reference_is_refused_and_leaves_the_watch_as_it_was():
    watch = DriftWatch(np.random.default_rng(0).uniform(1, 2, (13, 4)))
    watch.observe(np.full(4, 9.0))
    with pytest.raises(ValueError, match="4 finite"):
        watch.observe(np.full(4, np.nan))
    assert watch.observe(np.full(4, 9.0)) > 1
