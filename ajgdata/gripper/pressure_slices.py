"""The pressure field in a plane while it moves, for pictures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.solver import at_rest, march
from ajgdata.gripper.solver_plan import Plan

Real = NDArray[np.floating]


@dataclass(frozen=True)
class Film:
    """Pressure (Pa) in the plane y = 0: `frames` (n, up, across) float32 at `times_s` (n,).

    `across_m` and `up_m` are the centres of the cells, `open` (up, across) says which hold fluid;
    elsewhere the frames are 0.
    """

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


def slices(plan: Plan, every: int, frames: int, peak_hz: float = 4_000.0) -> Film:
    """Play a Ricker wavelet of volume velocity (peak 1 m³/s) at the speaker and keep every
    `every`-th step of the pressure in the cells of the plane y = 0, `frames` times.

    4 kHz is what the default grid resolves: what moves is the wave, not the grid.
    """
    cells, system = plan.cells, plan.system
    index = int(np.argmin(np.abs(cells.y)))
    live = np.asarray(system.mass[:, index] > 0)
    drive = pulse(system.dt, peak_hz)
    state = at_rest(system)
    # Far from where float32 loses its digits to denormal numbers.
    scale = 1e9 / float(np.max(system.capacities.yield_))
    kept = np.empty((frames, *live.shape), np.float32)
    for n in range(frames):
        now = scale * drive[n * every : (n + 1) * every]
        march(system, state, plan.speaker, plan.microphone, now, every)
        kept[n] = np.where(live, state.p.reshape(system.shape)[:, index], 0) / scale
    times_s = system.dt * every * np.arange(1, frames + 1)
    return Film(cells.x, cells.z, live, times_s, kept)
