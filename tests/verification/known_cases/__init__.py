"""The virtual gripper against what is known exactly: one small class for each claim."""

from __future__ import annotations

from collections.abc import Sequence

from ajgdata.types.table import Column, Table, Value
from known_cases.case import Case, CaseResult
from known_cases.identities import (
    EnergyConstant,
    EnergyNeverGrows,
    Reciprocity,
    SinglePrecision,
    WaveDispersion,
)
from known_cases.membrane import ReciprocityOfMembrane
from known_cases.moving import (
    EnergyConstantWithModes,
    EnergyNeverGrowsWithModes,
    StaticPressure,
)
from known_cases.piston import PISTONS, OnePiston, Piston
from known_cases.resonances import BoxOffGrid, BoxOnGrid
from known_cases.time_step import TimeStep
from known_cases.tube import BedLayer

#: By name, in the order of the report.
CASES: dict[str, Case] = {
    case.name: case
    for case in (
        EnergyConstant(),
        EnergyNeverGrows(),
        EnergyConstantWithModes(),
        EnergyNeverGrowsWithModes(),
        Reciprocity(),
        ReciprocityOfMembrane(),
        WaveDispersion(),
        TimeStep(),
        StaticPressure(),
        BoxOnGrid(),
        BoxOffGrid(),
        BedLayer("plastic"),
        BedLayer("coffee"),
        *(Piston(piston) for piston in PISTONS),
        OnePiston(),
        SinglePrecision(),
    )
}


def tables(quick: bool = False) -> list[Table]:
    """Run every case: what each measured against its limits, and the points of the refinements."""
    results = [case.run(quick) for case in CASES.values()]
    return [_summary(results), _convergence(results)]


def _summary(results: Sequence[CaseResult]) -> Table:
    columns = (
        Column("case", "case"),
        Column("title", "claim"),
        Column("kind", "kind"),
        Column("value", "measured"),
        Column("cap", "at most"),
        Column("order", "order"),
        Column("least_order", "at least"),
        Column("derived", "the limit follows from"),
        Column("passed", "holds"),
    )
    note = (
        "Relative numbers. An identity holds at round-off on every grid; a refinement must reach "
        "its order and, on the finest grid, stay below its cap."
    )
    rows = tuple({column.key: getattr(f, column.key) for column in columns} for f in results)
    return Table("verification", "What holds, and how well", note, columns, rows)


def _convergence(results: Sequence[CaseResult]) -> Table:
    columns = (
        Column("case", "case"),
        Column("title", "claim"),
        Column("dx_mm", "grid", "mm"),
        Column("error", "relative error"),
    )
    rows: tuple[dict[str, Value], ...] = tuple(
        {"case": f.case, "title": f.title, "dx_mm": 1e3 * h, "error": error}
        for f in results
        for h, error in f.points
    )
    note = "The points that the orders above are fitted to."
    return Table("convergence", "Error against grid spacing", note, columns, rows)
