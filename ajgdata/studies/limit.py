"""Limits of the virtual gripper: an extreme system must approach a known system.

With a small parameter ε (the parameter, or 1 over it), the response is p(ε) = p(0) + ε p' + …,
because it is an analytic function of ε at complex frequencies s = σ + iω with σ > 0: all systems
are passive, so their operators have no eigenvalue there. The distance is a ε (1 + c ε + …).
The sequences begin where the second term is at most half of the first: |c| ε₁ ≤ 1/2. Without
higher terms, this assumption gives all tolerances:

- The last distance is at most twice the first, times (ε_K / ε₁) to the power of the order.
- The order between the last two values deviates by at most (ε_{K-1} / ε₁) / ln q, q = ε_{K-1}/ε_K,
  because |ln(1 + x)| ≤ 2 |x| for |x| ≤ 1/2, and both terms have the same sign.

The order between the first two values tests the assumption: it deviates by at most ln 2 / ln q.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper import Scene, build_plan
from ajgdata.gripper.medium import Packing
from ajgdata.gripper.objects import ObjectPart
from ajgdata.gripper.scene import Numerics
from ajgdata.gripper.solver import Probe, at_rest, march
from ajgdata.gripper.system import System
from ajgdata.studies.extreme_cases import Ends, at_cell, from_bowl
from ajgdata.studies.noise_free import relative_error

Real = NDArray[np.floating]
Complex = NDArray[np.complexfloating]
#: Frequency band (Hz) in which the default grid is accurate.
ACCURATE_BAND_HZ = (100.0, 6_000.0)
#: The response is multiplied by a decay to e^-DECAY at its last step, so frequencies are complex.
DECAY = 6.0


def response(ends: Ends, steps: int) -> Complex:
    """Return the spectrum of the pressure at the receiver after a pulse at the source.

    The frequencies, (frequencies,), are those in `ACCURATE_BAND_HZ` with the imaginary part of
    `DECAY`.
    """
    pressure = pulse_response(ends, steps)
    decay = np.exp(-DECAY * np.arange(steps) / steps)
    frequency = np.fft.rfftfreq(steps, ends[0].dt)
    inside = (frequency >= ACCURATE_BAND_HZ[0]) & (frequency <= ACCURATE_BAND_HZ[1])
    return np.fft.rfft(pressure * decay)[inside]


def pulse_response(ends: Ends, steps: int) -> Real:
    """Return the pressure at the receiver after a pulse at the source, (steps,)."""
    system, source, receiver = ends
    return march(system, at_rest(system), source, receiver, np.ones(1), steps)


def powers(first: float, last: float, count: int = 5) -> tuple[float, ...]:
    """Return `count` values in a geometric sequence."""
    return tuple(np.geomspace(first, last, count).tolist())


@dataclass(frozen=True)
class MeasuredOrder:
    """Power of the parameter in the distance between two values, with the expected power."""

    value: float
    expected: float
    tolerance: float

    @property
    def holds(self) -> bool:
        """Return whether the measured order is within the tolerance of the expected order."""
        return abs(self.value - self.expected) <= self.tolerance


@dataclass(frozen=True)
class LimitResult:
    """Distances (values,) to a limit, and the largest distance that the theory allows, `cap`.

    `last` and `first` are the orders between the last two and between the first two values. A limit
    that all values reach has no orders, and its largest distance counts.
    """

    distances: tuple[float, ...]
    cap: float
    last: MeasuredOrder | None = None
    first: MeasuredOrder | None = None

    @property
    def distance(self) -> float:
        """Return the distance that is compared with the cap."""
        return max(self.distances) if self.last is None else self.distances[-1]

    @property
    def passed(self) -> bool:
        """Return whether the distance and both orders are within their tolerances."""
        orders = (order for order in (self.first, self.last) if order is not None)
        return self.distance <= self.cap and all(order.holds for order in orders)


@dataclass(frozen=True)
class Limit(ABC):
    """A parameter whose extreme has a known result, on a grid of `dx_mm` (mm).

    `title` has the parameter and the expected system, and `reason` the derivation of the order.
    """

    title: ClassVar[str]
    parameter: ClassVar[str]
    unit: ClassVar[str]
    values: ClassVar[tuple[float, ...]]
    reason: ClassVar[str]
    steps: ClassVar[int] = 2_048
    dx_mm: float = Numerics().dx_mm

    @property
    def h(self) -> float:
        """Return the spacing of the grid (m)."""
        return self.dx_mm * 1e-3

    @abstractmethod
    def system(self, value: float) -> Ends:
        """Return the system at a value of the parameter."""

    @abstractmethod
    def expected(self, value: float) -> Ends:
        """Return the expected system, which depends on the value only for some limits."""

    @abstractmethod
    def run(self) -> LimitResult:
        """Measure the distance at each value, and compute the tolerances."""

    def distance(self, value: float) -> float:
        """Return the relative L2 distance of the responses in `ACCURATE_BAND_HZ`."""
        expected = response(self.expected(value), self.steps)
        return relative_error(response(self.system(value), self.steps), expected)

    def small(self, value: float) -> float:
        """Return the small parameter ε at a value, relative to ε at the first value."""
        ratio = value / self.values[0]
        return min(ratio, 1 / ratio)


class PowerLimit(Limit):
    """A limit whose distance is proportional to the power `order` of the parameter."""

    order: ClassVar[float]

    def run(self) -> LimitResult:
        """See `Limit`."""
        distances = tuple(self.distance(value) for value in self.values)
        small = [self.small(value) for value in self.values]
        orders = np.diff(np.log(distances)) / np.diff(np.log(self.values))
        log_ratio = float(np.log(small[-2] / small[-1]))
        return LimitResult(
            distances,
            cap=2 * distances[0] * small[-1] ** abs(self.order),
            last=MeasuredOrder(float(orders[-1]), self.order, small[-2] / log_ratio),
            first=MeasuredOrder(float(orders[0]), self.order, float(np.log(2)) / log_ratio),
        )


class FromBowl(PowerLimit):
    """A limit of the lossless bowl of air, with walls or modes that the pressure moves."""

    #: Arguments of `from_bowl` for the expected system.
    known: ClassVar[dict[str, Any]] = {}

    @abstractmethod
    def moving(self, value: float) -> dict[str, Any]:
        """Return the arguments of `from_bowl` at a value."""

    def system(self, value: float) -> Ends:
        """See `Limit`."""
        return bowl_ends(self.h, **self.moving(value))

    def expected(self, value: float) -> Ends:
        """See `Limit`."""
        return bowl_ends(self.h, **self.known)


def bowl_ends(h: float, packing: Packing | None = None, **parts: Any) -> Ends:
    """Return the bowl in float64 on a grid of `h` (m), without grains if there is no packing."""
    return from_bowl(packing=packing, h=h, **parts)(np.float64)


class FromScene(PowerLimit):
    """A limit of a complete scene."""

    #: Settings of the expected scene.
    known: ClassVar[dict[str, Any]]
    omit: ClassVar[tuple[ObjectPart, ...]] = ()

    @abstractmethod
    def settings(self, value: float) -> dict[str, Any]:
        """Return the settings of the scene at a value."""

    def system(self, value: float) -> Ends:
        """See `Limit`."""
        return self._ends(self.settings(value))

    def expected(self, value: float) -> Ends:
        """See `Limit`."""
        return self._ends(self.known)

    def _ends(self, settings: dict[str, Any]) -> Ends:
        numerics = {
            "dx_mm": self.dx_mm,
            "precision": "float64",
            "omit": self.omit,
        }
        plan = build_plan(Scene.model_validate({**settings, "numerics": numerics}))
        return plan.system, plan.speaker, plan.microphone


def probes_apart_from(system: System, avoided: Real) -> tuple[Probe, Probe]:
    """Return source and receiver in open cells where `avoided` (nz, ny, nx) is zero."""
    live = np.flatnonzero((system.mass.ravel() > 0) & (avoided.ravel() == 0))
    return at_cell(int(live[len(live) // 4])), at_cell(int(live[-len(live) // 4]))
