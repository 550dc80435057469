"""Verdicts: a published number inside or outside of wide and narrow intervals, and statements."""

import math

import pytest

from ajgdata.evaluate.agreement import (
    UNDEFINED,
    Estimate,
    Interval,
    compare_with_published,
    difference,
    joint_verdict,
    judge_published,
    placebo_test,
    statement_verdict,
    wilson_interval,
)

MM = {"chance": 8.0, "perfect": 0.0}  # narrow: below 2 mm
PER_CENT = {"chance": 20.0, "perfect": 100.0}  # narrow: below 20 %


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [
        (2.0, 3.0, "agrees"),
        (2.6, 4.5, "agrees"),
        (0.7, 2.6, "agrees"),
        (1.0, 3.1, "inconclusive"),
        (2.6, 4.7, "inconclusive"),
        (2.7, 9.0, "worse"),
        (0.0, 2.5, "better"),
        (0.1, 0.2, "better"),
    ],
)
def test_an_error_agrees_with_the_published_one_only_by_a_narrow_interval(low, high, verdict):
    rmse = Estimate((low + high) / 2, Interval(low, high), **MM)
    assert compare_with_published(rmse, 2.6) == verdict


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [
        (80, 95, "agrees"),
        (70, 95, "inconclusive"),
        (91, 100, "better"),
        (30, 89, "worse"),
        (90, 100, "agrees"),
    ],
)
def test_more_accuracy_is_better(low, high, verdict):
    accuracy = Estimate((low + high) / 2, Interval(low, high), **PER_CENT)
    assert compare_with_published(accuracy, 90.0) == verdict


def test_statements_hold_beyond_their_interval():
    assert statement_verdict(Interval(0.1, 3.0)) == "agrees"
    assert statement_verdict(Interval(-0.1, 3.0)) == "inconclusive"
    assert statement_verdict(Interval(-2.0, -0.1)) == "disagrees"
    assert statement_verdict(UNDEFINED) == "inconclusive"


@pytest.mark.parametrize(
    ("verdicts", "joint"),
    [
        (["agrees", "agrees"], "agrees"),
        (["agrees", "disagrees"], "partly agrees"),
        (["agrees", "inconclusive"], "partly agrees"),
        (["inconclusive", "disagrees"], "disagrees"),
        (["inconclusive"], "inconclusive"),
    ],
)
def test_verdicts_on_parts_become_one(verdicts, joint):
    assert joint_verdict(verdicts) == joint


def test_better_than_chance_needs_the_whole_interval():
    assert Estimate(30.0, Interval(22, 40), **PER_CENT).is_better_than_chance
    assert not Estimate(30.0, Interval(19, 40), **PER_CENT).is_better_than_chance
    angle = {"chance": 41.0, "perfect": 0.0}
    assert not Estimate(54.0, UNDEFINED, **angle).is_better_than_chance  # withheld angles
    assert not Estimate(40.0, Interval(35, 45), **angle).is_better_than_chance
    assert Estimate(30.0, Interval(25, 35), **angle).is_better_than_chance
    assert Estimate(54.0, UNDEFINED, math.nan, 0.0).is_better_than_chance


def test_the_interval_of_a_difference_is_that_of_newcombe():
    """56 of 70 and 48 of 80 with Wilson intervals: Newcombe 1998, Statistics in Medicine 17, 873,
    table II, (a), method 10: 0.0524 to 0.3339."""
    first = Interval(0.6918, 0.8770)
    second = Interval(0.4904, 0.7003)
    gap = difference(56 / 70, first, 48 / 80, second)
    assert gap.low == pytest.approx(0.0524, abs=1e-4)
    assert gap.high == pytest.approx(0.3339, abs=1e-4)


@pytest.mark.parametrize(
    ("ours", "published", "verdict"),
    [
        # neither interval contains the other value, but the difference may be 0
        (Interval(0.86, 0.94), Interval(0.91, 0.99), "agrees"),
        (Interval(0.86, 0.94), Interval(0.955, 0.965), "worse"),
        (Interval(0.89, 0.91), Interval(0.70, 1.0), "inconclusive"),
        (Interval(0.70, 1.0), Interval(0.955, 0.965), "inconclusive"),
        (UNDEFINED, Interval(0.9, 0.99), "inconclusive"),
    ],
)
def test_a_published_interval_counts_in_the_verdict(ours, published, verdict):
    accuracy = Estimate(0.9, ours, chance=0.0, perfect=1.0)
    assert compare_with_published(accuracy, 0.96, published) == verdict


def test_a_lower_error_is_better_if_both_have_intervals():
    near = Interval(1.9, 2.1)
    far = Interval(3.8, 4.2)
    assert compare_with_published(Estimate(2.0, near, **MM), 4.0, far) == "better"
    assert compare_with_published(Estimate(4.0, far, **MM), 2.0, near) == "worse"


def accuracy(value: float, interval: Interval, chance: float = 0.25) -> Estimate:
    return Estimate(value, interval, chance, perfect=1.0)


def test_a_placebo_counts_with_its_interval():
    """80 ± 8 % against 60 ± 10 %: the difference has ± 13 points; against 70 %, 0 is inside."""
    score = accuracy(0.8, Interval(0.72, 0.88))
    better = placebo_test(score, accuracy(0.6, Interval(0.5, 0.7)))
    assert better.is_better
    assert better.gap == pytest.approx((0.2 - math.hypot(0.08, 0.1), 0.2 + math.hypot(0.08, 0.1)))
    assert not placebo_test(score, accuracy(0.7, Interval(0.6, 0.8))).is_better
    exact = placebo_test(score, accuracy(0.7, UNDEFINED))  # then it counts as exact
    assert exact.is_better and exact.gap == pytest.approx((0.02, 0.18))
    unknown = placebo_test(accuracy(0.8, UNDEFINED), accuracy(0.7, Interval(0.6, 0.8)))
    assert unknown.is_better and not unknown.gap.is_defined


def test_a_lower_error_than_that_of_the_placebo_is_better():
    placebo = Estimate(6.0, Interval(5.0, 7.0), **MM)
    assert placebo_test(Estimate(2.0, Interval(1.5, 2.5), **MM), placebo).is_better
    assert not placebo_test(Estimate(5.0, Interval(4.0, 6.0), **MM), placebo).is_better


def test_without_a_known_chance_level_the_placebo_alone_decides():
    score = accuracy(0.9, Interval(0.85, 0.95), chance=math.nan)
    low = accuracy(0.3, Interval(0.2, 0.4), chance=math.nan)
    assert placebo_test(score, low).is_better
    assert not placebo_test(low, score).is_better
    small = Estimate(2.0, Interval(1.5, 2.5), math.nan, 0.0)
    large = Estimate(6.0, Interval(5.0, 7.0), math.nan, 0.0)
    assert placebo_test(small, large).is_better
    assert not placebo_test(large, small).is_better


def test_without_a_known_chance_level_a_higher_accuracy_than_the_published_one_is_better():
    accurate = accuracy(0.9, Interval(0.85, 0.95), chance=math.nan)
    assert compare_with_published(accurate, 0.7) == "better"
    assert compare_with_published(accurate, 1.0) == "worse"
    error = Estimate(2.0, Interval(1.5, 2.5), math.nan, 0.0)
    assert compare_with_published(error, 3.0) == "better"
    assert compare_with_published(error, 1.0) == "worse"


def test_no_score_is_better_than_a_perfect_placebo():
    placebo = accuracy(1.0, Interval(0.91, 1.0))
    assert not placebo_test(accuracy(0.8, Interval(0.7, 0.85)), placebo).is_better
    assert not placebo_test(placebo, placebo).is_better


def test_a_score_at_chance_is_not_better_than_a_lower_placebo():
    placebo = accuracy(0.05, Interval(0.0, 0.1))
    assert not placebo_test(accuracy(0.3, Interval(0.2, 0.4)), placebo).is_better


def test_a_placebo_of_two_names_is_compared_at_the_chance_of_four_classes():
    """75 % of two names and 62.5 % of four classes are half of the way from chance to perfect."""
    placebo = accuracy(0.75, Interval(0.6, 0.9), chance=0.5)
    result = placebo_test(accuracy(0.7, Interval(0.65, 0.75)), placebo)
    assert result.placebo.value == pytest.approx(0.625)
    assert result.placebo.interval == pytest.approx((0.4, 0.85))
    assert not result.is_better


def test_a_verdict_that_depends_on_the_size_of_the_published_test_is_inconclusive():
    score = accuracy(0.80, Interval(0.77, 0.83))
    intervals = {trials: wilson_interval(0.9, trials) for trials in (40, 80, 160)}
    judgement = judge_published(score, 0.9, intervals=intervals)
    by_trials = {40: "inconclusive", 80: "worse", 160: "worse"}
    assert judgement == ("inconclusive", by_trials, True)
    assert judge_published(score, 0.9) == ("worse", {}, True)


def test_a_verdict_that_another_computer_changes_is_inconclusive():
    score = Estimate(3.0, Interval(2.7, 3.3), **MM)
    assert judge_published(score, 2.6, spread=0.09) == ("worse", {}, True)
    assert judge_published(score, 2.6, spread=0.2) == ("inconclusive", {}, False)
