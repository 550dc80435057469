"""The judgement of a trial: bound the growth of any state, then march one in both precisions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from ajgdata.gripper import SceneError
from ajgdata.gripper.solver import Probe, at_rest, march
from ajgdata.gripper.system import System
from ajgdata.studies.discrete_energy import energies
from ajgdata.studies.stability.transient import transient
from ajgdata.types import describe

Real = NDArray[np.floating]
Ends = tuple[System, Probe, Probe]
#: A step rounds its coefficients by up to half an ulp, always the same way: at worst it gains that
#: much of its energy each time, and a run what they add up to.
ROUNDING = {np.float32: 2.0**-24, np.float64: 2.0**-53}


@dataclass(frozen=True)
class Trial:
    """One extreme: `build` makes the system in a precision; ValueError is a refusal."""

    group: str
    name: str
    build: Callable[[type], Ends]
    steps: int
    expected: str = "bounded"


@dataclass(frozen=True)
class Run:
    """One precision: pressure heard; energy at the end over that after the strike; change of the
    mean pressure between the last two quarters, over the peak."""

    heard: Real
    growth: float
    drift: float

    @property
    def finite(self) -> bool:
        """True if every pressure is a number."""
        return bool(np.isfinite(self.heard).all()) and bool(np.isfinite(self.growth))


@dataclass(frozen=True)
class Verdict:
    """Outcome of a trial: "bounded", "grows" or "refused" with the message; `gain` and `transient`
    are the bounds of `Transient`."""

    group: str
    name: str
    expected: str
    outcome: str
    message: str = ""
    steps: int | None = None
    gain: float | None = None
    transient: float | None = None
    growth: float | None = None
    growth_single: float | None = None
    drift: float | None = None
    drift_single: float | None = None
    added_volume: float | None = None
    raised_cells: float | None = None
    difference_single: float | None = None


def run(ends: Ends, steps: int) -> Run:
    """Strike the source once and march."""
    system, source, receiver = ends
    state = at_rest(system)
    march(system, state, source, receiver, np.ones(1), 1)
    first = energies(system, state, 1)[0]
    heard = march(system, state, source, receiver, np.zeros(0), steps)
    last = energies(system, state, 1)[0]
    quarters = heard[len(heard) % 4 :].reshape(4, -1)
    peak = float(np.max(np.abs(heard)))
    drift = float(abs(quarters[3].mean() - quarters[2].mean()) / peak) if peak > 0 else 0.0
    return Run(heard, float(last / first), drift)


def judge(trial: Trial) -> Verdict:
    """Bound the growth of all states in float64, and run the trial in float64 and float32."""
    try:
        built = {dtype: trial.build(dtype) for dtype in (np.float64, np.float32)}
    except ValidationError as error:
        return Verdict(
            trial.group, trial.name, trial.expected, "refused", str(describe(error, "scene"))
        )
    except SceneError as error:
        return Verdict(trial.group, trial.name, trial.expected, "refused", str(error))
    double, single = (run(ends, trial.steps) for ends in built.values())
    bounds = transient(built[np.float64][0])
    bounded = bounds.bounded and all(
        r.finite and r.growth <= 1 + trial.steps * ROUNDING[dtype]
        for dtype, r in zip(built, (double, single), strict=True)
    )
    difference = np.linalg.norm(single.heard - double.heard) / np.linalg.norm(double.heard)
    return Verdict(
        trial.group,
        trial.name,
        trial.expected,
        "bounded" if bounded else "grows",
        "",
        trial.steps,
        bounds.gain,
        bounds.growth,
        double.growth,
        single.growth,
        double.drift,
        single.drift,
        max(0.0, built[np.float64][0].added_volume),
        built[np.float64][0].raised_cells,
        float(difference),
    )
