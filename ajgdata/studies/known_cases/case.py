"""Base classes of the known cases: identities at round-off, and refinements of the grid."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np

EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class KnownCaseResult:
    """Result of a case, with its limits.

    `value` must not be above `cap`, and `order` must not be below `least_order`. `points` are the
    pairs of grid spacing (m) and error to which the order is fitted. `limit_type` is `round-off`,
    `rate and cap` or `bound`.
    """

    case: str
    title: str
    limit_type: str
    value: float
    cap: float
    derived: str
    order: float | None = None
    least_order: float | None = None
    points: tuple[tuple[float, float], ...] = ()

    @property
    def passed(self) -> bool:
        """Whether both limits hold; a value that is not a number never passes."""
        if self.order is not None and self.least_order is not None:
            return bool(self.value <= self.cap and self.order >= self.least_order)
        return bool(self.value <= self.cap)


@dataclass(eq=False)
class KnownCase(ABC):
    """One claim about the solver, with a limit that is derived independently of the result.

    The fields of a subclass select a variant of the claim, for example the piston. Values that
    differ from the default are part of the name and the title of the variant.
    """

    title: ClassVar[str]
    derived: ClassVar[str]
    limit_type: ClassVar[str]

    @property
    def name(self) -> str:
        """Name of the class in snake case, with the values of the variant."""
        words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", type(self).__name__).lower()
        return "_".join([words, *self._variant().values()])

    def _variant(self) -> dict[str, str]:
        values = {field.name: (getattr(self, field.name), field.default) for field in fields(self)}
        return {name: value for name, (value, default) in values.items() if value != default}

    def result(self, value: float, cap: float, **refinement: Any) -> KnownCaseResult:
        """Return a result with the name and the title of this case."""
        variant = [f"{setting} {name}" for name, setting in self._variant().items()]
        title = ", ".join([self.title, *variant])
        return KnownCaseResult(
            self.name, title, self.limit_type, value, cap, self.derived, **refinement
        )

    @abstractmethod
    def run(self, quick: bool = False) -> KnownCaseResult:
        """Measure the case; `quick` takes fewer steps and coarser grids."""


class Identity(KnownCase):
    """A claim that holds up to rounding on every grid: up to `roundings` times ε."""

    limit_type = "round-off"
    roundings: ClassVar[float]

    @abstractmethod
    def deviation(self, quick: bool) -> float:
        """Return the measured deviation from the identity."""

    def cap(self, quick: bool) -> float:
        """Return the largest deviation that passes; `derived` gives its derivation."""
        return self.roundings * EPS

    def run(self, quick: bool = False) -> KnownCaseResult:
        """Measure the deviation, and compare it with the largest that passes."""
        return self.result(self.deviation(quick), self.cap(quick))


class Refinement(KnownCase):
    """An error that decreases with the grid spacing; `sizes` are the spacings (m), coarse first."""

    limit_type = "rate and cap"
    sizes: ClassVar[tuple[float, ...]]
    quick_sizes: ClassVar[tuple[float, ...]]

    @property
    @abstractmethod
    def least_order(self) -> float:
        """The smallest order of convergence that passes."""

    @abstractmethod
    def error(self, h: float) -> float:
        """Return the error on a grid of spacing `h` (m)."""

    @abstractmethod
    def cap(self, h: float) -> float:
        """Return the largest error that passes on the finest grid, of spacing `h` (m)."""

    def run(self, quick: bool = False) -> KnownCaseResult:
        """Measure the error on each grid, and fit the order of convergence."""
        sizes = self.quick_sizes if quick else self.sizes
        errors = [self.error(h) for h in sizes]
        return self.result(
            errors[-1],
            self.cap(sizes[-1]),
            order=fitted_order(sizes, errors),
            least_order=self.least_order,
            points=tuple(zip(sizes, errors, strict=True)),
        )


def fitted_order(sizes: Sequence[float], errors: Sequence[float]) -> float:
    """Return the slope of the least-squares line through log error against log size."""
    return float(np.polyfit(np.log(sizes), np.log(errors), 1)[0])
