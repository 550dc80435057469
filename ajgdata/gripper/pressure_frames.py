"""The pressure in a vertical plane while a pulse moves through the cavity, for pictures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.simulation import field_scale
from ajgdata.gripper.solver import at_rest, march
from ajgdata.gripper.solver_plan import Plan

Real = NDArray[np.floating]


@dataclass(frozen=True)
class PressureFrames:
    """Pressure (Pa) in the plane y = 0: `frames` (n, up, across) float32 at `times_s` (n,).

    `across_m` and `up_m` are the centres of the cells. `open` (up, across) is True in cells with
    fluid; in all other cells, the frames are 0.
    """

    across_m: Real
    up_m: Real
    open: NDArray[np.bool_]
    times_s: Real
    frames: Real


def pressure_frames(
    plan: Plan, every: int, frames: int, peak_hz: float = 4_000.0
) -> PressureFrames:
    """Return the pressure in the plane y = 0 in every `every`-th step, `frames` times.

    The speaker plays a Ricker wavelet with a peak volume velocity of 1 m³/s. The default grid
    resolves its 4 kHz, so the frames show the wave and not the grid.
    """
    cells = plan.cells
    system = plan.system
    index = int(np.argmin(np.abs(cells.y)))
    is_open = np.asarray(system.mass[:, index] > 0)
    drive = ricker_wavelet(system.dt, peak_hz)
    state = at_rest(system)
    scale = field_scale(plan)
    pressures = np.empty((frames, *is_open.shape), np.float32)
    for n in range(frames):
        part = scale * drive[n * every : (n + 1) * every]
        march(system, state, plan.speaker, plan.microphone, part, every)
        pressures[n] = np.where(is_open, state.p.reshape(system.shape)[:, index], 0) / scale
    times_s = system.dt * every * np.arange(1, frames + 1)
    return PressureFrames(cells.x, cells.z, is_open, times_s, pressures)


def ricker_wavelet(dt_s: float, peak_hz: float) -> Real:
    """Return a Ricker wavelet (n,), sampled every `dt_s`: no mean, strongest at `peak_hz`.

    It is (1 - 2a) e^-a with a = (π f (t - t0))² (Ricker 1953), and ends where it is below 2e-7.
    """
    half = int(np.ceil(1.4 / (peak_hz * dt_s)))
    a = (np.pi * peak_hz * dt_s * np.arange(-half, half + 1)) ** 2
    return (1 - 2 * a) * np.exp(-a)
