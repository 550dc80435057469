"""The harness of all verification cases: identities at round-off, and refinements of the grid."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np


@dataclass(frozen=True)
class Finding:
    """What a case measured: `value` must not exceed `cap`, nor `order` fall below `least_order`.

    `points` are the pairs of grid spacing (m) and error that the order is fitted to.
    """

    case: str
    title: str
    kind: str
    value: float
    cap: float
    derived: str
    order: float | None = None
    least_order: float | None = None
    points: tuple[tuple[float, float], ...] = ()

    @property
    def passed(self) -> bool:
        """Whether both limits hold; never for a value that is not a number."""
        enough = self.order is None or self.least_order is None or self.order >= self.least_order
        return bool(self.value <= self.cap and enough)


class Case(ABC):
    """One claim about the solver, with a limit derived from something other than the result."""

    title: ClassVar[str]
    derived: ClassVar[str]
    kind: ClassVar[str]

    @property
    def name(self) -> str:
        """The class's name in snake case."""
        return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", type(self).__name__).lower()

    @abstractmethod
    def run(self, quick: bool = False) -> Finding:
        """Measure; `quick` on fewer steps and coarser grids."""


class Bound(Case):
    """One number and what it may be at most."""

    kind = "bound"

    @abstractmethod
    def deviation(self, quick: bool) -> float:
        """The number, relative unless the title says otherwise."""

    @abstractmethod
    def cap(self, quick: bool) -> float:
        """Its limit."""

    def run(self, quick: bool = False) -> Finding:
        """See Case."""
        value, cap = self.deviation(quick), self.cap(quick)
        return Finding(self.name, self.title, self.kind, value, cap, self.derived)


class Identity(Bound):
    """Holds up to rounding, on every grid."""

    kind = "round-off"


class Refinement(Case):
    """An error that falls with the grid spacing: with a rate, and below a cap on the finest."""

    kind = "rate and cap"
    sizes: ClassVar[tuple[float, ...]]
    quick_sizes: ClassVar[tuple[float, ...]]
    least_order: ClassVar[float]

    @abstractmethod
    def error(self, h: float) -> float:
        """Error on a grid of spacing `h` (m)."""

    @abstractmethod
    def cap(self, h: float) -> float:
        """What the finest grid, of spacing `h`, may err by."""

    def run(self, quick: bool = False) -> Finding:
        """See Case."""
        sizes = self.quick_sizes if quick else self.sizes
        points = tuple((h, self.error(h)) for h in sizes)
        return Finding(
            self.name,
            self.title,
            self.kind,
            points[-1][1],
            self.cap(sizes[-1]),
            self.derived,
            fitted_order(sizes, [error for _, error in points]),
            self.least_order,
            points,
        )


def fitted_order(sizes: Sequence[float], errors: Sequence[float]) -> float:
    """Slope of the least-squares line through log error over log size."""
    return float(np.polyfit(np.log(sizes), np.log(errors), 1)[0])
