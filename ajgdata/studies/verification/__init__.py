"""The virtual gripper against what is known exactly: one small class for each claim."""

from __future__ import annotations

from collections.abc import Sequence

from ajgdata.studies.verification.case import Case, Finding
from ajgdata.studies.verification.endurance import (
    LongRunDriven,
    LongRunLossless,
    LongRunLosslessSingle,
    SinglePrecision,
    StaticDrift,
    StaticDriftSingle,
)
from ajgdata.studies.verification.identities import (
    Adjoint,
    BoxDispersion,
    EnergyConstant,
    EnergyNeverGrows,
    Linearity,
    Reciprocity,
    Unused,
    WaveDispersion,
    WideAdjoint,
    WideEnergyConstant,
    WideEnergyNeverGrows,
)
from ajgdata.studies.verification.moving import (
    EnergyConstantWithModes,
    EnergyNeverGrowsWithModes,
    ReciprocityWithModes,
    StaticPressure,
)
from ajgdata.studies.verification.piston import PISTON_CASES, OnePiston
from ajgdata.studies.verification.resonances import (
    BoxOffGrid,
    BoxOnGrid,
    SphereDipole,
    WideBoxOffGrid,
    WideBoxOnGrid,
    WideSphereDipole,
)
from ajgdata.studies.verification.tube import (
    BedAgainstTheory,
    BedLayer,
    CoffeeBedLayer,
    MetalBedLayer,
    WideBedLayer,
)
from ajgdata.types.table import Column, Table, Value

CASES: tuple[type[Case], ...] = (
    EnergyConstant,
    WideEnergyConstant,
    EnergyNeverGrows,
    WideEnergyNeverGrows,
    EnergyConstantWithModes,
    EnergyNeverGrowsWithModes,
    Adjoint,
    WideAdjoint,
    Reciprocity,
    ReciprocityWithModes,
    Linearity,
    BoxDispersion,
    WaveDispersion,
    StaticPressure,
    Unused,
    BoxOnGrid,
    WideBoxOnGrid,
    BoxOffGrid,
    WideBoxOffGrid,
    SphereDipole,
    WideSphereDipole,
    BedLayer,
    WideBedLayer,
    MetalBedLayer,
    CoffeeBedLayer,
    BedAgainstTheory,
    *PISTON_CASES,
    OnePiston,
    LongRunLossless,
    LongRunLosslessSingle,
    StaticDrift,
    StaticDriftSingle,
    LongRunDriven,
    SinglePrecision,
)


def tables(quick: bool = False) -> list[Table]:
    """Run every case: what each measured against its limits, and the points of the refinements."""
    findings = [case().run(quick) for case in CASES]
    return [_summary(findings), _convergence(findings)]


def _summary(findings: Sequence[Finding]) -> Table:
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
    rows = tuple(_row(finding, columns) for finding in findings)
    return Table("verification", "What holds, and how well", note, columns, rows)


def _row(finding: Finding, columns: Sequence[Column]) -> dict[str, Value]:
    return {column.key: getattr(finding, column.key) for column in columns}


def _convergence(findings: Sequence[Finding]) -> Table:
    columns = (
        Column("case", "case"),
        Column("title", "claim"),
        Column("dx_mm", "grid", "mm"),
        Column("error", "relative error"),
    )
    rows: tuple[dict[str, Value], ...] = tuple(
        {"case": f.case, "title": f.title, "dx_mm": 1e3 * h, "error": error}
        for f in findings
        for h, error in f.points
    )
    note = "The points that the orders above are fitted to."
    return Table("convergence", "Error against grid spacing", note, columns, rows)
