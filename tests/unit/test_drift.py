"""The watch over references: its false alarms are those that it states, and a change is noticed."""

import numpy as np
import pytest

from ajgdata.live.drift import DriftWatch


def references(count):
    return np.random.default_rng(0).uniform(1, 2, (count, 4))


def test_an_unchanged_gripper_raises_no_more_alarms_than_are_stated():
    """The rate is at most what is stated (a reference of day 1 is scored by one fewer, which makes
    its score larger), within three standard deviations of as many trials."""
    generator, trials, alarms = np.random.default_rng(20), 1000, 0
    for _ in range(trials):  # heavy-tailed references of three numbers
        spectra = np.exp(generator.standard_t(3, (14, 3)) * 0.1)
        watch = DriftWatch(spectra[:11])
        alarms += [watch.observe(one) for one in spectra[11:]][-1] > 1
    assert watch.false_alarm == 1 / 364  # C(4, 3) / C(14, 3) = 4 / 364 is more than 0.01
    assert 0 < alarms / trials < watch.false_alarm + 3 * np.sqrt(watch.false_alarm / trials)


def test_too_few_references_say_how_many_are_missing():
    """1 / C(n + 3, 3): C(10, 3) = 120, C(9, 3) = 84."""
    assert DriftWatch(references(7)).false_alarm == 1 / 120
    with pytest.raises(ValueError, match=r"4 references .* 0\.01: record 3 more of the empty"):
        DriftWatch(references(4))


def test_the_limit_is_the_largest_score_that_keeps_the_rate():
    """30 references: C(j + 2, 3) / C(33, 3) is 1, 4, 10, 20, 35, 56 of 5456 for j = 1 to 6, and 56
    is more than 0.01. The limit is the fifth largest score."""
    watch = DriftWatch(references(30))
    assert watch.false_alarm == 35 / 5456
    compressed = np.arcsinh(references(30) / np.abs(references(30)).mean())
    left_out = []
    for row, one in enumerate(compressed):
        others = np.delete(compressed, row, 0)
        distance = (one - others.mean(0)) / others.std(0, ddof=1)
        left_out.append(np.sqrt(np.mean(distance**2)))
    assert watch.limit == pytest.approx(sorted(left_out)[-5])


def test_one_odd_reference_is_no_alarm_and_a_change_is_told_until_it_is_gone():
    watch, usual, odd = DriftWatch(references(30)), np.full(4, 1.5), np.full(4, 9.0)
    far = float(watch.score(odd)) / watch.limit
    ratios = [watch.observe(one) for one in (odd, odd, odd, usual, odd, odd, odd)]
    assert far > 1
    assert ratios[:2] == [1, 1]  # too early for an alarm
    assert ratios[2] == ratios[6] == pytest.approx(far)
    assert max(ratios[3:6]) < 1


def test_what_is_no_reference_is_refused_and_leaves_the_watch_as_it_was():
    watch = DriftWatch(references(13))
    for _ in range(2):
        watch.observe(np.full(4, 9.0))
    with pytest.raises(ValueError, match="4 finite"):
        watch.observe(np.full(4, np.nan))
    assert watch.observe(np.full(4, 9.0)) > 1
