"""Stability of stiff and extreme systems: energy of trials, long runs, and known limits.

Each trial runs on the default grid and on the two neighbouring grids of the study of accuracy, in
float64 and float32. The cases whose energy grows fastest run for 10⁶ steps.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.scene import Numerics
from ajgdata.gripper.solver import at_rest, march
from ajgdata.studies.accuracy import GRIDS_MM
from ajgdata.studies.energy import energies, largest_growth
from ajgdata.studies.extreme_cases import LONG_STEPS, Ends, Trial, trials
from ajgdata.studies.limit import Limit, LimitResult
from ajgdata.studies.limits import LIMITS, UNREACHED
from ajgdata.types.table import Column, Table

Real = NDArray[np.floating]
Row = dict[str, Any]
#: Half an ulp of each precision. Each step rounds its coefficients by up to this share, always in
#: the same way. In the worst case, a step gains this share of the energy, and a run the sum of all
#: steps.
UNIT_ROUNDOFF = {np.float64: 2.0**-53, np.float32: 2.0**-24}
#: Smallest number of steps between two energies. The rounding of the energies themselves, a few
#: ulp, is then small per step.
INTERVAL = 100
#: Number of cases with a long run.
LONG_RUNS = 3
#: Steps of a long run in a quick run of the study.
QUICK_LONG_STEPS = 10_000
#: Grid spacing (mm) of the limits in a quick run.
QUICK_DX_MM = 6.0


def neighbouring_grids(grids_mm: Sequence[float], default_mm: float) -> tuple[float, ...]:
    """Return the next coarser grid, the default grid, and the next finer grid (mm).

    >>> neighbouring_grids((5.2, 4.2, 3.75, 3.3), 4.2)
    (5.2, 4.2, 3.75)
    """
    ordered = sorted(grids_mm, reverse=True)
    place = ordered.index(default_mm)
    return tuple(ordered[max(place - 1, 0) : place + 2])


class EnergyRun(NamedTuple):
    """Pressure at the receiver (steps,), and the energy (J) before some steps (records,)."""

    pressure: Real
    step: NDArray[np.int64]
    energy: Real

    @property
    def growth(self) -> float:
        """Return the last energy relative to the first, which is the energy after the pulse."""
        return float(self.energy[-1] / self.energy[0])

    @property
    def gain(self) -> float:
        """Return the largest relative gain of energy per step, as a mean over an interval."""
        relative = np.diff(self.energy) / np.abs(self.energy[:-1])
        return float(np.max(relative / np.diff(self.step)))

    def is_bounded(self, rounding: float) -> bool:
        """Return whether all values are finite, and no step gains more energy than `rounding`."""
        finite = np.isfinite(self.pressure).all() and np.isfinite(self.energy).all()
        largest = 1 + self.step[-1] * rounding
        return bool(finite and abs(self.growth) <= largest and self.gain <= rounding)


def recorded_steps(steps: int) -> NDArray[np.int64]:
    """Return the first step, then 1, 2 and 5 times the powers of ten from `INTERVAL` to `steps`.

    >>> recorded_steps(1_000).tolist()
    [1, 100, 200, 500, 1000]
    """
    decades = np.arange(np.log10(INTERVAL), np.log10(steps) + 1)
    places = np.multiply.outer(10**decades, (1, 2, 5)).round().astype(int).ravel()
    return np.unique([1, *places[places <= steps], steps])


def energy_run(ends: Ends, steps: int) -> EnergyRun:
    """Simulate `steps` steps after a pulse at the source, and record the energy."""
    system, source, receiver = ends
    state = at_rest(system)
    march(system, state, source, receiver, np.ones(1), 1)
    recorded = recorded_steps(steps)
    energy = [energies(system, state, 1)[0]]
    pressure = []
    # `energies` takes a step, too.
    for number in np.diff(recorded):
        pressure.append(march(system, state, source, receiver, np.zeros(0), int(number) - 1))
        energy.append(energies(system, state, 1)[0])
    return EnergyRun(np.concatenate(pressure), recorded, np.array(energy))


def judge(trial: Trial) -> Row:
    """Return a row of `TRIAL_COLUMNS` on a trial; its outcome is "bounded" or "grows".

    The row has the bound of the growth of all states in float64, and the results of runs in float64
    and float32.
    """
    built = {dtype: trial.build(dtype) for dtype in UNIT_ROUNDOFF}
    runs = {dtype: energy_run(ends, trial.steps) for dtype, ends in built.items()}
    double = runs[np.float64]
    single = runs[np.float32]
    system = built[np.float64][0]
    transient = largest_growth(system)
    bounded = all(runs[dtype].is_bounded(rounding) for dtype, rounding in UNIT_ROUNDOFF.items())
    passed = bounded and bool(np.isfinite(transient))
    change = np.linalg.norm(single.pressure - double.pressure) / np.linalg.norm(double.pressure)
    return {
        "group": trial.group,
        "name": trial.name,
        "dx_mm": trial.dx_mm,
        "outcome": "bounded" if passed else "grows",
        "passed": passed,
        "steps": trial.steps,
        "transient": transient,
        "growth": double.growth,
        "growth_single": single.growth,
        "gain": double.gain,
        "gain_single": single.gain,
        "added_volume": max(0.0, system.added_volume),
        "raised_cells": system.raised_cells,
        "difference_single": float(change),
    }


def rounding_share(row: Row) -> float:
    """Return the largest growth of a row of `judge`, relative to that which rounding allows."""
    growths = zip((row["growth"], row["growth_single"]), UNIT_ROUNDOFF.values(), strict=True)
    return max((growth - 1) / (row["steps"] * rounding) for growth, rounding in growths)


def worst_trials(tested: Sequence[Trial], rows: Sequence[Row], count: int) -> list[Trial]:
    """Return the trials of the `count` cases whose energy grew most, by `rounding_share`.

    A case with trials on several grids counts once, on the grid where its energy grew most.
    """
    order = sorted(range(len(rows)), key=lambda number: -rounding_share(rows[number]))
    worst: dict[tuple[str, str], Trial] = {}
    for number in order:
        trial = tested[number]
        worst.setdefault((trial.group, trial.name), trial)
    return list(worst.values())[:count]


def long_runs(cases: Iterable[Trial], steps: int) -> Iterator[tuple[str, str, EnergyRun, float]]:
    """Yield name, precision, run and allowed gain per step for each case and precision."""
    for trial in cases:
        for dtype, rounding in UNIT_ROUNDOFF.items():
            run = energy_run(trial.build(dtype), steps)
            case = f"{trial.group}: {trial.name}, {trial.dx_mm:g} mm"
            yield case, np.dtype(dtype).name, run, rounding


def tables(quick: bool = False) -> list[Table]:
    """Return limits, long runs and trials, with the points of their figure.

    It takes a minute and a half on one core, and seconds if it is `quick`.
    """
    default_mm = Numerics().dx_mm
    grids_mm = (default_mm,) if quick else neighbouring_grids(GRIDS_MM, default_mm)
    tested = [trial for dx_mm in grids_mm for trial in trials(quick, dx_mm)]
    rows = [judge(trial) for trial in tested]
    cases = worst_trials(tested, rows, LONG_RUNS)
    runs = list(long_runs(cases, QUICK_LONG_STEPS if quick else LONG_STEPS))
    dx_mm = QUICK_DX_MM if quick else default_mm
    limits = measured_limits(LIMITS, dx_mm)
    unreached = measured_limits(UNREACHED, dx_mm)
    return [
        limit_table(limits),
        unreached_table(unreached),
        long_run_table(runs),
        trial_table(rows),
        energy_table(runs),
        distance_table(limits),
    ]


def measured_limits(
    limit_classes: Iterable[type[Limit]], dx_mm: float
) -> list[tuple[Limit, LimitResult]]:
    """Return each limit on a grid of `dx_mm` (mm), with its result."""
    limits = [limit_class(dx_mm) for limit_class in limit_classes]
    return [(limit, limit.run()) for limit in limits]


def limit_table(limits: Sequence[tuple[Limit, LimitResult]]) -> Table:
    """Return the limits that the model reaches, with orders and tolerances."""
    note = (
        "Distance: relative L2 distance of the response (0.1 to 6 kHz, float64) at the last value"
        " of the parameter to the expected response. Order: power of the parameter in the distance,"
        " between the last two values. The tolerances follow from the first value."
        " Other limits, which the model does not reach, are in the"
        " next table."
    )
    columns = (
        Column("title", "Limit"),
        Column("order", "Order, theory"),
        Column("measured_order", "Order, measured"),
        Column("distance", "Distance at the last value"),
        Column("cap", "Largest allowed distance"),
        Column("passed", "Holds"),
        Column("parameter", "Parameter"),
        Column("unit", "Unit"),
        Column("first", "First value"),
        Column("last", "Last value"),
        Column("order_tolerance", "Tolerance of the order"),
        Column("first_order", "Order between the first two values"),
        Column("first_tolerance", "Tolerance of that order"),
        Column("reason", "Reason for the order"),
    )
    rows = tuple(
        {
            "title": limit.title,
            "order": result.last.expected if result.last else None,
            "measured_order": result.last.value if result.last else None,
            "distance": result.distance,
            "cap": result.cap,
            "passed": result.passed,
            "parameter": limit.parameter,
            "unit": limit.unit,
            "first": limit.values[0],
            "last": limit.values[-1],
            "order_tolerance": result.last.tolerance if result.last else None,
            "first_order": result.first.value if result.first else None,
            "first_tolerance": result.first.tolerance if result.first else None,
            "reason": limit.reason,
        }
        for limit, result in limits
    )
    return Table("limits", "Limits", note, columns, rows)


def unreached_table(limits: Sequence[tuple[Limit, LimitResult]]) -> Table:
    """Return the limits that the model does not reach."""
    note = (
        "In these limits, two parts of the model do not agree, so a distance to the expected system"
        " remains. The distances do not depend on the parameter."
    )
    columns = (
        Column("title", "Limit"),
        Column("distance", "Remaining distance"),
        Column("before", "Distance at the value before"),
        Column("last", "Last value"),
        Column("reason", "Reason"),
    )
    rows = tuple(
        {
            "title": limit.title,
            "distance": result.distances[-1],
            "before": result.distances[-2],
            "last": limit.values[-1],
            "reason": limit.reason,
        }
        for limit, result in limits
    )
    return Table("unreached", "Limits that the model does not reach", note, columns, rows)


def long_run_table(runs: Sequence[tuple[str, str, EnergyRun, float]]) -> Table:
    """Return one row per case and precision of the long runs."""
    note = (
        "Trials whose energy grew most on any grid, in units of what rounding allows. The"
        f" gain per step is a mean over at least {INTERVAL} steps. Allowed: half an ulp per step."
    )
    columns = (
        Column("case", "Case"),
        Column("precision", "Precision"),
        Column("steps", "Steps"),
        Column("growth", "Relative change of energy"),
        Column("gain", "Worst gain per step"),
        Column("allowed", "Allowed gain per step"),
        Column("passed", "Holds"),
    )
    rows = tuple(
        {
            "case": case,
            "precision": precision,
            "steps": int(run.step[-1]),
            "growth": run.growth - 1,
            "gain": run.gain,
            "allowed": rounding,
            "passed": run.is_bounded(rounding),
        }
        for case, precision, run, rounding in runs
    )
    return Table("long_runs", "Long runs of the worst cases", note, columns, rows)


TRIAL_COLUMNS = (
    Column("group", "Part"),
    Column("name", "Case"),
    Column("dx_mm", "Grid", "mm"),
    Column("outcome", "Outcome"),
    Column("passed", "Holds"),
    Column("steps", "Steps"),
    Column("transient", "Largest growth of stored energy, any state"),
    Column("growth", "Energy, last over first"),
    Column("growth_single", "Energy, float32"),
    Column("gain", "Worst gain per step"),
    Column("gain_single", "Worst gain per step, float32"),
    Column("added_volume", "Volume added"),
    Column("raised_cells", "Cells that took volume from others"),
    Column("difference_single", "float32 against float64"),
)


def trial_table(rows: Sequence[Row]) -> Table:
    """Return the trials, from the rows of `judge`."""
    note = (
        "Bounded: the discrete energy is positive for every state, and no energy of a run grows by"
        " more than rounding, in both precisions. The stored energy is the sum over pressure, flow,"
        " grains, walls and modes. It can rise at frequencies near the limit of the grid although"
        " the conserved energy does not."
    )
    return Table("stability", "Stiff and extreme cases", note, TRIAL_COLUMNS, tuple(rows))


def energy_table(runs: Sequence[tuple[str, str, EnergyRun, float]]) -> Table:
    """Return the energies of the long runs, which are points of the figure."""
    columns = (
        Column("case", "Case"),
        Column("precision", "Precision"),
        Column("step", "Step"),
        Column("change", "Relative change of energy"),
    )
    rows = tuple(
        {"case": case, "precision": precision, "step": int(step), "change": float(change)}
        for case, precision, run, _ in runs
        for step, change in zip(run.step, run.energy / run.energy[0] - 1, strict=True)
    )
    return Table("energy", "Energy of the long runs", "Points of the figure.", columns, rows)


def distance_table(limits: Sequence[tuple[Limit, LimitResult]]) -> Table:
    """Return the distances at all values, which are points of the figure."""
    columns = (
        Column("title", "Limit"),
        Column("parameter", "Parameter"),
        Column("unit", "Unit"),
        Column("value", "Value"),
        Column("small", "Small parameter, in units of the first"),
        Column("distance", "Distance"),
        Column("order", "Order, theory"),
    )
    rows = tuple(
        {
            "title": limit.title,
            "parameter": limit.parameter,
            "unit": limit.unit,
            "value": value,
            "small": limit.small(value) if result.last else None,
            "distance": distance,
            "order": result.last.expected if result.last else None,
        }
        for limit, result in limits
        for value, distance in zip(limit.values, result.distances, strict=True)
    )
    return Table("distances", "Distances to the limits", "Points of the figure.", columns, rows)
