"""Stiff and extreme cases: does the solver stay bounded, and at what cost?"""

from __future__ import annotations

from dataclasses import asdict

from ajgdata.studies.stability.extreme_cases import trials
from ajgdata.studies.stability.transient import STEPS
from ajgdata.studies.stability.trial import judge
from ajgdata.types.table import Column, Table

COLUMNS = (
    Column("group", "what"),
    Column("name", "case"),
    Column("expected", "expected"),
    Column("outcome", "outcome"),
    Column("message", "message"),
    Column("steps", "steps"),
    Column("gain", "largest gain of energy per step, any state"),
    Column("transient", f"largest growth of stored energy in {STEPS:,} steps, any state"),
    Column("growth", "energy, last over first"),
    Column("growth_single", "energy, float32"),
    Column("drift", "drift of the mean"),
    Column("drift_single", "drift, float32"),
    Column("added_volume", "volume added"),
    Column("raised_cells", "cells helped out by others"),
    Column("difference_single", "float32 against float64"),
)


def tables(quick: bool = False) -> list[Table]:
    """Every trial with its outcome, `quick` on a twentieth of the steps."""
    rows = tuple(asdict(judge(trial)) for trial in trials(quick))
    note = (
        "Bounded: no state gains energy in any step, so that none grows; and the discrete energy "
        "at the end of a run is at most that after its strike, in both precisions; both up to "
        "rounding. Stored energy is that of pressure, flow, grains, walls and modes added up; it "
        "can rise at frequencies near the limit of the grid although the conserved energy does not."
    )
    return [Table("stability", "Stiff and extreme cases", note, COLUMNS, rows)]
