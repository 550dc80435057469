"""Verification of the virtual gripper: identities at round-off, and convergence with the grid."""

from __future__ import annotations

from collections.abc import Sequence

from ajgdata.studies.known_cases.case import KnownCase, KnownCaseResult
from ajgdata.studies.known_cases.identities import (
    EnergyConstant,
    EnergyNeverGrows,
    Reciprocity,
    SinglePrecision,
    WaveDispersion,
)
from ajgdata.studies.known_cases.membrane import ReciprocityOfMembrane
from ajgdata.studies.known_cases.moving import (
    EnergyConstantWithModes,
    EnergyNeverGrowsWithModes,
    StaticPressure,
)
from ajgdata.studies.known_cases.piston import PISTONS, OnePiston, Piston
from ajgdata.studies.known_cases.resonances import BoxOffGrid, BoxOnGrid
from ajgdata.studies.known_cases.time_step import TimeStep
from ajgdata.studies.known_cases.tube import BedLayer
from ajgdata.types.table import Column, Table, Value

#: All cases by name, in the order of the report.
CASES: dict[str, KnownCase] = {
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
    """Run every case, and return the results with their limits and the points of refinements."""
    results = [case.run(quick) for case in CASES.values()]
    return [_result_table(results), _convergence_table(results)]


def _result_table(results: Sequence[KnownCaseResult]) -> Table:
    """Return one row per case: its value and its order of convergence, with the limits of both."""
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
    rows = tuple(
        {
            "case": result.case,
            "title": result.title,
            "kind": result.limit_type,
            "value": result.value,
            "cap": result.cap,
            "order": result.order,
            "least_order": result.least_order,
            "derived": result.derived,
            "passed": result.passed,
        }
        for result in results
    )
    return Table("verification", "What holds, and how well", note, columns, rows)


def _convergence_table(results: Sequence[KnownCaseResult]) -> Table:
    """Return one row per grid of a refinement: the spacing of the grid and the error on it."""
    columns = (
        Column("case", "case"),
        Column("title", "claim"),
        Column("dx_mm", "grid", "mm"),
        Column("error", "relative error"),
    )
    rows: tuple[dict[str, Value], ...] = tuple(
        {"case": result.case, "title": result.title, "dx_mm": 1e3 * h, "error": error}
        for result in results
        for h, error in result.points
    )
    note = "The points that the orders above are fitted to."
    return Table("convergence", "Error against grid spacing", note, columns, rows)
