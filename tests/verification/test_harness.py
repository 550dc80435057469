"""The harness itself: it fits the order, and it can say no."""

import math

import pytest
from known_cases.case import CaseResult, Refinement, fitted_order


class Parabola(Refinement):
    """An error of known order."""

    title = "an error of 3 h²"
    derived = "itself"
    sizes = (4.0, 2.0, 1.0)
    quick_sizes = (4.0, 2.0)
    least_order = 2.0

    def error(self, h):
        return 3 * h**self.least_order

    def cap(self, h):
        return 3.0 * h**2


def test_the_order_is_the_slope():
    assert fitted_order((4.0, 2.0, 1.0), (32.0, 4.0, 0.5)) == pytest.approx(3.0)


def test_a_refinement_is_judged_on_its_finest_grid():
    result = Parabola().run()
    assert result.case == "parabola"
    assert result.value == 3.0
    assert result.order == pytest.approx(2.0)
    assert result.points == ((4.0, 48.0), (2.0, 12.0), (1.0, 3.0))
    assert len(Parabola().run(quick=True).points) == 2


@pytest.mark.parametrize(
    ("value", "order", "passed"),
    [(1.0, 2.0, True), (1.1, 2.0, False), (1.0, 1.9, False), (math.nan, 2.0, False)],
)
def test_both_limits_count(value, order, passed):
    result = CaseResult("c", "t", "k", value, 1.0, "d", order, 2.0)
    assert result.passed is passed
