"""Stiff and extreme cases: does the solver stay bounded, and at what cost?"""

from __future__ import annotations

from dataclasses import asdict

from ajgdata.studies.stability import time_step_limit
from ajgdata.studies.stability.extreme_cases import trials
from ajgdata.studies.stability.trial import judge
from ajgdata.types.table import Column, Table

COLUMNS = (
    Column("group", "what"),
    Column("name", "case"),
    Column("expected", "expected"),
    Column("outcome", "outcome"),
    Column("message", "message"),
    Column("steps", "steps"),
    Column("growth", "energy, last over first"),
    Column("step_growth", "largest growth in a step"),
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
        "Each system is struck once and marched; relative numbers. Bounded: the discrete energy "
        "at the end is at most that after the strike, up to rounding, in both precisions."
    )
    table = Table("stability", "Stiff and extreme cases", note, COLUMNS, rows)
    return [table, time_step_limit.table()]
