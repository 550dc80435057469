"""Stiff and extreme cases: does the solver stay bounded, and at what cost?"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.solver import at_rest, march
from ajgdata.studies.energy import energies, largest_growth
from ajgdata.studies.extreme_cases import Ends, Trial, trials
from ajgdata.types.table import Column, Table

Real = NDArray[np.floating]
#: A step rounds its coefficients by up to half an ulp, always the same way: at worst it gains that
#: much of its energy each time, and a run what they add up to.
ROUNDING = {np.float32: 2.0**-24, np.float64: 2.0**-53}
COLUMNS = (
    Column("group", "what"),
    Column("name", "case"),
    Column("outcome", "outcome"),
    Column("passed", "holds"),
    Column("steps", "steps"),
    Column("transient", "largest growth of stored energy, any state"),
    Column("growth", "energy, last over first"),
    Column("growth_single", "energy, float32"),
    Column("added_volume", "volume added"),
    Column("raised_cells", "cells helped out by others"),
    Column("difference_single", "float32 against float64"),
)


class Run(NamedTuple):
    """One precision: pressure at the receiver, and energy at the end over that after the strike."""

    pressure: Real
    growth: float

    @property
    def finite(self) -> bool:
        """True if every pressure is a number."""
        return bool(np.isfinite(self.pressure).all()) and bool(np.isfinite(self.growth))


def run(ends: Ends, steps: int) -> Run:
    """Strike the source once and march."""
    system, source, receiver = ends
    state = at_rest(system)
    march(system, state, source, receiver, np.ones(1), 1)
    first = energies(system, state, 1)[0]
    pressure = march(system, state, source, receiver, np.zeros(0), steps)
    last = energies(system, state, 1)[0]
    return Run(pressure, float(last / first))


def judge(trial: Trial) -> dict[str, Any]:
    """Bound the growth of all states in float64, and run the trial in float64 and float32.

    Returns a row of `COLUMNS`: the outcome is "bounded" or "grows".
    """
    built = {dtype: trial.build(dtype) for dtype in (np.float64, np.float32)}
    double, single = (run(ends, trial.steps) for ends in built.values())
    system = built[np.float64][0]
    growth = largest_growth(system)
    bounded = np.isfinite(growth) and all(
        result.finite and abs(result.growth) <= 1 + trial.steps * ROUNDING[dtype]
        for dtype, result in zip(built, (double, single), strict=True)
    )
    change = np.linalg.norm(single.pressure - double.pressure) / np.linalg.norm(double.pressure)
    return {
        "group": trial.group,
        "name": trial.name,
        "outcome": "bounded" if bounded else "grows",
        "passed": bool(bounded),
        "steps": trial.steps,
        "transient": growth,
        "growth": double.growth,
        "growth_single": single.growth,
        "added_volume": max(0.0, system.added_volume),
        "raised_cells": system.raised_cells,
        "difference_single": float(change),
    }


def tables(quick: bool = False) -> list[Table]:
    """Every trial with its outcome, `quick` on a twentieth of the steps."""
    rows = tuple(judge(trial) for trial in trials(quick))
    note = (
        "Bounded: the discrete energy is positive for every state, and at the end of a run, in "
        "both precisions, at most that after its strike, up to rounding. Stored energy is that of "
        "pressure, flow, grains, walls and modes added up; it can rise at frequencies near the "
        "limit of the grid although the conserved energy does not."
    )
    return [Table("stability", "Stiff and extreme cases", note, COLUMNS, rows)]
