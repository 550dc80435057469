"""What ablations found: hypotheses on why simulation and paper differ, and their verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ajgdata.types.table import Table

SUPPORTED = "supported"


@dataclass(frozen=True)
class Change:
    """One change with one model: the metric before and after it."""

    change: str
    model: str
    before: float
    after: float
    supported: bool


@dataclass(frozen=True)
class Reason:
    """A hypothesis on figures `of` the paper, and its tests. `link` leads to their table."""

    of: tuple[str, ...]
    claim: str
    link: str
    tests: tuple[Change, ...]

    def explains(self, low: bool) -> bool:
        """Whether a supported change raised the metric (where ours is `low`), or lowered it."""
        return any(one.supported and (one.after > one.before) is low for one in self.tests)


def reasons_of(tables: Sequence[Table], page: str) -> list[Reason]:
    """The hypotheses of the tables that hold verdicts, each with all its tests."""
    found: dict[tuple[str, str, str], list[Change]] = {}
    for table in tables:
        for row in table.rows if "verdict" in {c.key for c in table.columns} else ():
            before, after = float(row["before"] or 0), float(row["after"] or 0)
            supported = row["verdict"] == SUPPORTED
            one = Change(str(row["change"]), str(row["model"]), before, after, supported)
            found.setdefault((table.name, str(row["hypothesis"]), str(row["of"])), []).append(one)
    return [
        Reason(tuple(of.split()), claim, f"{page}.html#{table}", tuple(tests))
        for (table, claim, of), tests in found.items()
    ]
