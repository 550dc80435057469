"""Verdicts: a published number inside or outside of wide and narrow intervals, and statements."""

import math

import pytest

from ajgdata.evaluate.agreement import (
    UNDEFINED,
    Interval,
    compare,
    difference,
    is_better_than_chance,
    is_better_than_placebo,
    statement,
    together,
)

MM = {"chance": 8.0, "perfect": 0.0}  # narrow: below 2 mm
PER_CENT = {"chance": 20.0, "perfect": 100.0}  # narrow: below 20 %


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [
        (2.0, 3.0, "agrees"), (2.6, 4.5, "agrees"), (0.7, 2.6, "agrees"),
        (1.0, 3.1, "inconclusive"), (2.6, 4.7, "inconclusive"),
        (2.7, 9.0, "worse"), (0.0, 2.5, "better"), (0.1, 0.2, "better"),
    ],
)  # fmt: skip
def test_an_error_agrees_with_the_published_one_only_by_a_narrow_interval(low, high, verdict):
    assert compare((low + high) / 2, Interval(low, high), 2.6, **MM) == verdict


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [
        (80, 95, "agrees"), (70, 95, "inconclusive"), (91, 100, "better"), (30, 89, "worse"),
        (90, 100, "agrees"),
    ],
)  # fmt: skip
def test_more_accuracy_is_better(low, high, verdict):
    assert compare((low + high) / 2, Interval(low, high), 90.0, **PER_CENT) == verdict


def test_statements_hold_beyond_their_interval():
    assert statement(Interval(0.1, 3.0)) == "agrees"
    assert statement(Interval(-0.1, 3.0)) == "inconclusive"
    assert statement(Interval(-2.0, -0.1)) == "disagrees"
    assert statement(UNDEFINED) == "inconclusive"


@pytest.mark.parametrize(
    ("verdicts", "joint"),
    [
        (["agrees", "agrees"], "agrees"), (["agrees", "disagrees"], "partly agrees"),
        (["agrees", "inconclusive"], "partly agrees"), (["inconclusive", "disagrees"], "disagrees"),
        (["inconclusive"], "inconclusive"),
    ],
)  # fmt: skip
def test_verdicts_on_parts_become_one(verdicts, joint):
    assert together(verdicts) == joint


def test_better_than_chance_needs_the_whole_interval():
    assert is_better_than_chance(30.0, Interval(22, 40), **PER_CENT)
    assert not is_better_than_chance(30.0, Interval(19, 40), **PER_CENT)
    assert not is_better_than_chance(54.0, UNDEFINED, 41.0, 0.0)  # withheld angles
    assert not is_better_than_chance(40.0, Interval(35, 45), 41.0, 0.0)
    assert is_better_than_chance(30.0, Interval(25, 35), 41.0, 0.0)
    assert is_better_than_chance(54.0, UNDEFINED, math.nan, 0.0)


def test_the_interval_of_a_difference_is_that_of_newcombe():
    """56 of 70 and 48 of 80 with Wilson intervals: Newcombe 1998, Statistics in Medicine 17, 873,
    table II, (a), method 10: 0.0524 to 0.3339."""
    first, second = Interval(0.6918, 0.8770), Interval(0.4904, 0.7003)
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
    options = {"chance": 0.0, "perfect": 1.0}
    assert compare(0.9, ours, 0.96, published_interval=published, **options) == verdict


def test_a_lower_error_is_better_if_both_have_intervals():
    options = {"chance": 8.0, "perfect": 0.0}
    near, far = Interval(1.9, 2.1), Interval(3.8, 4.2)
    assert compare(2.0, near, 4.0, published_interval=far, **options) == "better"
    assert compare(4.0, far, 2.0, published_interval=near, **options) == "worse"


def test_a_placebo_counts_with_its_interval():
    """80 ± 8 % against 60 ± 10 %: the difference has ± 13 points; against 70 %, 0 is inside."""
    ours = Interval(0.72, 0.88)
    assert is_better_than_placebo(0.8, ours, 0.6, Interval(0.5, 0.7), 1.0)
    assert not is_better_than_placebo(0.8, ours, 0.7, Interval(0.6, 0.8), 1.0)
    assert is_better_than_placebo(0.8, ours, 0.7, UNDEFINED, 1.0)  # then it counts as exact
    assert is_better_than_placebo(2.0, Interval(1.5, 2.5), 6.0, Interval(5.0, 7.0), 0.0)
    assert not is_better_than_placebo(5.0, Interval(4, 6), 6.0, Interval(5.0, 7.0), 0.0)
