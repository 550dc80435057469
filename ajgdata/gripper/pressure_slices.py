"""The pressure field in a plane while it moves, for pictures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.solver import at_rest, march
from ajgdata.gripper.solver_plan import Plan

Real = NDArray[np.floating]
Plane = Literal["xz", "yz", "xy"]
#: Axis of the (z, y, x) grid that stands still, and the two that are shown.
_AXES: dict[Plane, tuple[int, str, str]] = {
    "xz": (1, "x", "z"),
    "yz": (2, "y", "z"),
    "xy": (0, "x", "y"),
}


@dataclass(frozen=True)
class Film:
    """Pressure (Pa) in one plane: `frames` (n, up, across) float32 at the times `times_s` (n,).

    `across_m` and `up_m` are the centres of the cells, `open` (up, across) says which hold fluid;
    elsewhere the frames are 0. `at_m` is where the plane cuts the axis that is not shown.
    """

    plane: Plane
    at_m: float
    across_m: Real
    up_m: Real
    open: NDArray[np.bool_]
    times_s: Real
    frames: Real


def pulse(dt_s: float, peak_hz: float) -> Real:
    """Ricker wavelet sampled every `dt_s`, (n,): no mean, strongest at `peak_hz`.

    (1 - 2a) e^-a with a = (π f (t - t0))² (Ricker 1953), cut where it has fallen to 2e-7.
    """
    half = int(np.ceil(1.4 / (peak_hz * dt_s)))
    a = (np.pi * peak_hz * dt_s * np.arange(-half, half + 1)) ** 2
    return (1 - 2 * a) * np.exp(-a)


def slices(
    plan: Plan,
    plane: Plane = "xz",
    *,
    at_m: float = 0.0,
    every: int = 4,
    frames: int = 100,
    peak_hz: float = 4_000.0,
) -> Film:
    """Play a Ricker wavelet of volume velocity (peak 1 m³/s) at the speaker and keep every
    `every`-th step of the pressure in the cells that the plane at `at_m` cuts.

    4 kHz is what the default grid resolves: what moves is the wave, not the grid. Raises
    ValueError for a plane that misses the grid and for counts below 1.
    """
    if every < 1 or frames < 1:
        raise ValueError(f"every = {every} and frames = {frames} must be at least 1")
    axis, across, up = _AXES[plane]
    cells, system = plan.cells, plan.system
    ticks = (cells.z, cells.y, cells.x)[axis]
    if not ticks[0] <= at_m <= ticks[-1]:
        raise ValueError(f"the plane at {at_m:g} m misses the grid: {ticks[0]:g} to {ticks[-1]:g}")
    index = int(np.argmin(np.abs(ticks - at_m)))
    live = np.asarray((system.mass > 0).take(index, axis))
    drive = pulse(system.dt, peak_hz)
    state = at_rest(system)
    # Far from where float32 loses its digits to denormal numbers.
    scale = 1e9 / float(np.max(system.capacities.yield_))
    kept = np.empty((frames, *live.shape), np.float32)
    for n in range(frames):
        now = scale * drive[n * every : (n + 1) * every]
        march(system, state, plan.speaker, plan.microphone, now, every)
        kept[n] = np.where(live, state.p.reshape(system.shape).take(index, axis), 0) / scale
    return Film(
        plane,
        float(ticks[index]),
        getattr(cells, across),
        getattr(cells, up),
        live,
        system.dt * every * np.arange(1, frames + 1),
        kept,
    )
