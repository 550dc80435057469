"""The harness of all verification cases: identities at round-off, and refinements of the grid."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np

EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class CaseResult:
    """The outcome of a case: `value` must not exceed `cap`, nor `order` fall below `least_order`.

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
        """True if both limits hold; never for a value that is not a number."""
        enough = self.order is None or self.least_order is None or self.order >= self.least_order
        return bool(self.value <= self.cap and enough)


@dataclass(eq=False)
class Case(ABC):
    """One claim about the solver, with a limit derived from something other than the result.

    Fields of a subclass, such as the scheme, make variants of the claim; those that are not at
    their default stand in the variant's name and title.
    """

    title: ClassVar[str]
    derived: ClassVar[str]
    kind: ClassVar[str]

    @property
    def name(self) -> str:
        """The class's name in snake case and the values that make the variant."""
        words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", type(self).__name__).lower()
        return "_".join([words, *self._variant().values()])

    def _variant(self) -> dict[str, str]:
        values = {field.name: (getattr(self, field.name), field.default) for field in fields(self)}
        return {name: value for name, (value, default) in values.items() if value != default}

    def result(self, value: float, cap: float, **refined: Any) -> CaseResult:
        """Return what was measured under the name and title of this case."""
        title = ", ".join([self.title, *(f"{v} {name}" for name, v in self._variant().items())])
        return CaseResult(self.name, title, self.kind, value, cap, self.derived, **refined)

    @abstractmethod
    def run(self, quick: bool = False) -> CaseResult:
        """Measure; `quick` on fewer steps and coarser grids."""


class Bound(Case):
    """One number, `deviation(quick)`, and its limit, `cap(quick)`."""

    kind = "bound"

    def run(self, quick: bool = False) -> CaseResult:
        """See Case."""
        return self.result(self.deviation(quick), self.cap(quick))


class Identity(Bound):
    """Holds up to rounding, on every grid: `roundings` of one ε each."""

    kind = "round-off"
    roundings: ClassVar[float]

    def cap(self, quick: bool) -> float:
        """See `derived`."""
        return self.roundings * EPS


class Refinement(Case):
    """An error that falls with the grid spacing.

    Subclasses have `error(h)` on a grid of spacing `h` (m), `least_order`, the least order that the
    error must fall with, and `cap(h)`, the largest error allowed on the finest grid.
    """

    kind = "rate and cap"
    sizes: ClassVar[tuple[float, ...]]
    quick_sizes: ClassVar[tuple[float, ...]]

    def run(self, quick: bool = False) -> CaseResult:
        """See Case."""
        sizes = self.quick_sizes if quick else self.sizes
        points = tuple((h, self.error(h)) for h in sizes)
        return self.result(
            points[-1][1],
            self.cap(sizes[-1]),
            order=fitted_order(sizes, [error for _, error in points]),
            least_order=self.least_order,
            points=points,
        )


def fitted_order(sizes: Sequence[float], errors: Sequence[float]) -> float:
    """Slope of the least-squares line through log error over log size."""
    return float(np.polyfit(np.log(sizes), np.log(errors), 1)[0])
