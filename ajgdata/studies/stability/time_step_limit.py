"""The limit of the time step is sharp: below it nothing grows, above it everything does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ajgdata.gripper.solver import at_rest, march
from ajgdata.gripper.system import System
from ajgdata.studies.discrete_operator import fastest
from ajgdata.studies.domains import BOWL, bowl, closed, two_probes
from ajgdata.types.table import Column, Table, Value

RATIOS = (0.99, 0.999, 1.001, 1.01)
STEPS = 2_000


def at_ratio(system: System, ratio: float, largest: float) -> System:
    """`system`, whose largest eigenvalue is `largest`, as if its time step were `ratio` of the
    largest stable one and no cell were enlarged."""
    factor = 4 * ratio**2 / largest
    faces = system.faces
    gains = (faces.gain_x, faces.gain_y, faces.gain_z)
    scaled = dict(zip(("gain_x", "gain_y", "gain_z"), (factor * g for g in gains), strict=True))
    return replace(system, faces=faces._replace(**scaled))


def rate(system: System, steps: int = STEPS) -> float:
    """Growth of log |p| per step over the second half of a run."""
    source, receiver = two_probes(system)
    heard = np.abs(march(system, at_rest(system), source, receiver, np.ones(1), steps))
    quarter = steps // 4
    late, before = heard[-quarter:].max(), heard[-3 * quarter : -2 * quarter].max()
    return float(np.log(late / before) / (2 * quarter))


def expected(ratio: float) -> float:
    """Growth of the highest mode: sin(ωΔt/2) = ratio, above 1 e^{μ} a step, μ = 2 arcosh(ratio)."""
    return float(2 * np.arccosh(max(1.0, ratio)))


def table() -> Table:
    """Measured and expected growth on either side of the limit."""
    _, system = closed(bowl(), 5e-3, *BOWL)
    largest = fastest(system)
    rows: list[dict[str, Value]] = []
    for ratio in RATIOS:
        measured = rate(at_ratio(system, ratio, largest))
        rows.append({"ratio": ratio, "rate": measured, "expected": expected(ratio)})
    columns = (
        Column("ratio", "time step over its limit"),
        Column("rate", "growth per step, measured"),
        Column("expected", "growth per step, theory"),
    )
    note = (
        "The bowl with cut cells, the limit from the largest eigenvalue of what is marched. Scenes "
        "never get there: cells too small for the time step are enlarged beforehand."
    )
    return Table("limit", "The limit of the time step", note, columns, tuple(rows))
