"""Extreme systems approach known systems, with the order that the theory gives."""

from typing import ClassVar

import numpy as np
import pytest

from ajgdata.gripper.medium import Air, Packing
from ajgdata.studies.extreme_cases import AIR, from_bowl
from ajgdata.studies.limit import LimitResult, MeasuredOrder, powers, response
from ajgdata.studies.limits import LIMITS, UNREACHED, FinePowder, HeavyWall, LoosePacking

#: The coarsest grid of a scene, mm.
DX_MM = 6.0


class FinePowderOnACoarserGrid(FinePowder):
    """The layer of powder on twice the spacing, for a quarter of the time."""

    steps = 8_192
    spacing = 1e-4
    values = powers(0.04, 0.01, 3)


def marked(kind):
    """A limit as a parameter of a test; that of the fine grid takes seconds."""
    return pytest.param(kind, marks=[pytest.mark.slow] if kind is FinePowder else [])


@pytest.mark.parametrize("kind", [FinePowderOnACoarserGrid, *map(marked, LIMITS)])
def test_the_limit_is_reached_at_its_order(kind):
    result = kind(DX_MM).run()
    assert result.passed, result
    if result.last is not None:
        assert np.all(np.diff(result.distances) < 0)
        # Far from rounding, which has no order.
        assert result.distances[-1] > 1e4 * 2.0**-53


@pytest.mark.slow
@pytest.mark.parametrize("dx_mm", [3.75, 4.2, 5.2])
def test_the_limits_do_not_depend_on_the_grid(dx_mm):
    results = {kind.__name__: kind(dx_mm).run() for kind in LIMITS if kind is not FinePowder}
    assert [name for name, result in results.items() if not result.passed] == []


@pytest.mark.parametrize("kind", UNREACHED)
def test_the_distance_that_remains_does_not_depend_on_the_parameter(kind):
    """If the model changes so that it reaches the limit, move the class to `LIMITS`."""
    result = kind(DX_MM).run()
    assert not result.passed
    assert result.distances[-1] == pytest.approx(result.distances[-2], rel=1e-2)
    assert result.distances[-1] > 1e-4


class SecondOrder(HeavyWall):
    """A wrong order."""

    order = -2.0


class AnotherWall(HeavyWall):
    """A wrong limit: a wall that moves a little."""

    known: ClassVar = {"wall": (3e4, 0.0, 1e5)}


class TooEarly(HeavyWall):
    """A sequence that begins where the expansion does not hold."""

    values = powers(1e-2, 1.0, 3)


@pytest.mark.parametrize("kind", [SecondOrder, AnotherWall, TooEarly])
def test_a_wrong_claim_is_refuted(kind):
    assert not kind(DX_MM).run().passed


def test_tolerances_follow_from_the_expansion():
    """With the largest second term that the assumption allows, both tolerances hold."""
    small = np.array(powers(1.0, 1e-4))
    for second in (0.5, -0.5):
        distances = small * (1 + second * small)
        orders = np.diff(np.log(distances)) / np.diff(np.log(small))
        cap = 2 * distances[0] * small[-1]
        last = MeasuredOrder(orders[-1], 1.0, small[-2] / np.log(10))
        first = MeasuredOrder(orders[0], 1.0, np.log(2) / np.log(10))
        assert LimitResult(tuple(distances), cap, last, first).passed


def test_the_packing_of_the_model_is_linear_in_its_grains():
    """The exact medium, not its fit: density and compressibility over those of air."""
    omega = 2 * np.pi * np.array([1e3, 4e3])
    filled = np.array([1e-3, 1e-4])
    changes = []
    for share in filled:
        density, compressibility = Packing(6e-3, 1 - share).jca(omega, AIR)
        changes.append(
            [abs(density / AIR.density - 1), abs(compressibility / AIR.compressibility - 1)]
        )
    orders = np.log(np.divide(*changes)) / np.log(filled[0] / filled[1])
    np.testing.assert_allclose(orders, 1, atol=0.01)
    assert LoosePacking.order == 1


def test_pressure_is_proportional_to_that_of_the_air():
    """`ThinAir` compares responses at one pressure, because rigid walls scale with it."""
    thin, thick = (
        response(from_bowl(packing=None, air=Air(22.0, pascal))(np.float64), 512)
        for pascal in (1e3, 1e5)
    )
    np.testing.assert_allclose(thin * 100, thick, rtol=1e-9)
