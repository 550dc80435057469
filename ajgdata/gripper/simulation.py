"""Scene -> impulse response, or the pressure in a plane while it moves.

Marched in time, the staggered leapfrog turns s into (2/Δt) sinh(sΔt/2) wherever the equations
differentiate: a response at ω appears at ω' = (2/Δt) arcsin(ωΔt/2). That is known exactly, does not
depend on the medium, and is undone by reading the marched spectrum at ω' (time-dispersion
transform, Koene et al. 2018, Geophysical Journal International 213).

Exact this is for the leapfrog. What is averaged over a step, by the exponential drag and the
trapezoidal rule, keeps an error that is known as well: of the drag, of walls' resistances and of
relaxation times about (ωΔt)²/8 (1.6 % at 10 kHz with four steps a sample), of walls' masses twice
that, of the grains' density (γΔt)²/12 with γ the drag over the density, at all frequencies alike
(`ajgdata/studies/known_cases/time_step.py` has the terms, and measures that nothing else is left).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.fft import fft, irfft, next_fast_len
from scipy.special import i0

from ajgdata.gripper.outside import diffuse_gain, patch_velocity
from ajgdata.gripper.scene import SAMPLE_RATE_HZ, Numerics, Scene, scene_digest
from ajgdata.gripper.signal_chain import ImpulseResponse
from ajgdata.gripper.solver import Patches, at_rest, march
from ajgdata.gripper.solver_plan import Plan, build_plan

Real = NDArray[np.floating]
Complex = NDArray[np.complexfloating]
PASS_HZ = 20_000.0
#: Of the Kaiser-Bessel kernel on a twofold oversampled grid: errs by less than 1e-9.
TAPS = 12
SHAPE = 2.30 * TAPS


def undisperse(marched: Real, factor: int, latency: int) -> Real:
    """Samples (n // factor,) at 44.1 kHz of a response `marched` (n,) with `factor` steps a sample.

    `latency`, in samples, is that of the source pulse; it is kept. The source acts half a step
    before the pressure that is heard: that half step is taken out. The band ends smoothly between
    20 and 22.05 kHz.
    """
    count = len(marched) // factor
    length = next_fast_len(count + 4 * latency + 64, real=True)
    hertz = np.fft.rfftfreq(length, 1 / SAMPLE_RATE_HZ)
    step = 1 / (SAMPLE_RATE_HZ * factor)
    omega = 2 * np.pi * hertz
    warped = 2 * np.arcsin(omega * step / 2)
    delay = latency * factor
    spectrum = transform(marched, warped) * np.exp(
        1j * (warped * (delay - 0.5) - omega * step * delay)
    )
    edge = np.clip((hertz - PASS_HZ) / (SAMPLE_RATE_HZ / 2 - PASS_HZ), 0, 1)
    return irfft(spectrum * np.cos(np.pi / 2 * edge) ** 2, length)[:count] / factor


def transform(signal: Real, radians: Real) -> Complex:
    """Σ signal[n] e^{-i radians n}, (m,), of a signal (n,) at any angular frequencies (m,), per
    sample.

    Non-uniform fast Fourier transform with a Kaiser-Bessel kernel (Fessler & Sutton 2003).
    """
    count = len(signal)
    length = next_fast_len(2 * count)
    place = np.arange(count) - count // 2
    bend = np.sqrt(SHAPE**2 - (np.pi * TAPS * place / length) ** 2)
    spread = np.zeros(length)
    spread[place % length] = signal * bend / (TAPS * np.sinh(bend))
    grid = fft(spread)
    where = radians * length / (2 * np.pi)
    nearest = np.ceil(where - TAPS / 2).astype(np.int64)[:, None] + np.arange(TAPS)
    offset = (where[:, None] - nearest) / (TAPS / 2)
    weight = i0(SHAPE * np.sqrt(np.clip(1 - offset**2, 0, None)))
    return np.asarray(
        (weight * grid[nearest % length]).sum(1) * np.exp(-1j * radians * (count // 2))
    )


#: What folds down to below 20 kHz lies above this.
STOP_HZ = SAMPLE_RATE_HZ - PASS_HZ
STOP_DB = 80.0
#: The energy is looked at once a millisecond of this many samples.
CHUNK_SAMPLES = 44


def simulate(what: Scene | Plan) -> ImpulseResponse:
    """Return the impulse response of a scene or its plan, (n,) at 44.1 kHz in Pa per m³/s.

    One scene gives the same bytes each time. Raises SceneError (a ValueError) before anything runs
    if the object does not fit.

    >>> short = {"numerics": {"dx_mm": 6, "max_time_s": 0.01}}
    >>> response = simulate(Scene.model_validate({"object": "cube_20p7", **short}))
    >>> response.sample_rate_hz, response.latency_samples, response.samples.dtype
    (44100, 28, dtype('float64'))
    >>> response.provenance["dx_mm"]
    6.0
    """
    model = what if isinstance(what, Plan) else build_plan(what)
    scene = model.scene
    samples, static, steps, latency, outside = _impulse(model, scene.numerics)
    provenance = {
        "scene_sha256": scene_digest(scene),
        "dx_mm": scene.numerics.dx_mm,
        "dt_s": model.system.dt,
        "steps": steps,
        "cells": int(np.count_nonzero(model.system.mass)),
    }
    return ImpulseResponse(samples, static, SAMPLE_RATE_HZ, latency, provenance, outside)


def _impulse(model: Plan, numerics: Numerics) -> tuple[Real, float, int, int, Real]:
    """Response less what it settles at, that, the number of steps, the latency in samples, and the
    gain of sound from outside.

    Speaker and microphone change places: by reciprocity the response is the same, and what is felt
    on the membrane meanwhile is how sound from outside is heard. What is played is the low-pass
    filter that decimation needs, instead of a pulse that would be filtered afterwards: the same
    response, but no energy is put where it is not heard.
    """
    system, factor = model.system, model.steps_per_sample
    pulse, latency = lowpass(factor)
    state = at_rest(system)
    # Far from where float32 loses its digits to denormal numbers.
    scale = 1e9 / float(np.max(system.capacities.yield_))
    pieces: list[Real] = []
    patches = Patches(model.skin.cell, model.skin.patch, model.skin.area)
    pushes: list[Real] = []
    strongest, level = 0.0, 0.0
    # Never less than the pulse takes to enter.
    longest = max(numerics.max_time_s * SAMPLE_RATE_HZ, len(pulse) / factor)
    for n in range(int(np.ceil(longest / CHUNK_SAMPLES))):
        drive = scale * pulse[n * CHUNK_SAMPLES * factor : (n + 1) * CHUNK_SAMPLES * factor]
        push = np.zeros((len(model.skin.centre), CHUNK_SAMPLES))
        pressure = march(
            system,
            state,
            model.microphone,
            model.speaker,
            drive,
            CHUNK_SAMPLES * factor,
            patches,
            push,
        )
        pieces.append(pressure)
        pushes.append(push)
        before, (level, unrest) = level, _moments(system.mass.ravel(), state.p)
        if not np.isfinite(unrest):
            raise FloatingPointError("the wave field is not finite: this is a fault of the solver")
        energy = unrest + (level - before) ** 2
        strongest = max(strongest, energy)
        if not len(drive) and energy < strongest * 10 ** (-numerics.decay_db / 10):
            break
    samples, static = _settled(pieces, pulse, factor, latency)
    velocity = patch_velocity(np.hstack(pushes) / scale, model.skin.motion, 1 / SAMPLE_RATE_HZ)
    outside = diffuse_gain(velocity, model.skin.centre, model.air, 1 / SAMPLE_RATE_HZ)
    return samples / scale, static / scale, sum(map(len, pieces)), latency, outside


def _settled(pieces: list[Real], pulse: Real, factor: int, latency: int) -> tuple[Real, float]:
    """Return the marched response at 44.1 kHz less what it settles at, and that.

    That is the mean where it stops, so that nothing jumps: the slowest resonance of the balloon
    continues below the band of the transducers.
    """
    static = float(pieces[-1][-len(pieces[-1]) // 2 :].mean())
    response = np.concatenate(pieces)
    # The static pressure enters with the pulse, as its running sum.
    entered = np.cumsum(pulse) / factor
    response[: len(entered)] -= static * entered
    response[len(entered) :] -= static
    return undisperse(response, factor, latency), static


@njit(nogil=True, cache=True)
def _moments(mass, p):
    """Mean pressure, and ‖p - mean‖²_M per capacity."""
    total = level = unrest = 0.0
    for i in range(len(mass)):
        total += mass[i]
        level += mass[i] * p[i]
    level /= total
    for i in range(len(mass)):
        unrest += mass[i] * (p[i] - level) ** 2
    return level, unrest / total


@cache
def lowpass(factor: int) -> tuple[Real, int]:
    """Linear-phase low pass (taps,) at `factor` times 44.1 kHz and its delay in samples at 44.1
    kHz.

    Flat to 20 kHz, 80 dB down from 24.1 kHz on, which is what folds back below 20 kHz (Kaiser
    1974; Oppenheim & Schafer, section 7.6).
    The delay is a whole number of samples, so that taking every `factor`-th step is exact; the
    gain is `factor`, because a source sampled at 44.1 kHz is that many steps wide.
    """
    if factor == 1:
        return np.ones(1), 0
    rate = SAMPLE_RATE_HZ * factor
    width, middle = (STOP_HZ - PASS_HZ) / rate, (STOP_HZ + PASS_HZ) / rate
    # Taps that hold STOP_DB beyond the transition, and the window's shape, above 50 dB.
    count = int(np.ceil((STOP_DB - 7.95) / (2.285 * 2 * np.pi * width) + 1))
    latency = int(np.ceil(count / 2 / factor))
    n = np.arange(-latency * factor, latency * factor + 1)
    taps = np.sinc(middle * n) * np.kaiser(len(n), 0.1102 * (STOP_DB - 8.7))
    pulse = factor * (taps / taps.sum())
    pulse.flags.writeable = False
    return pulse, latency


@dataclass(frozen=True)
class PressureFrames:
    """Pressure (Pa) in the plane y = 0: `frames` (n, up, across) float32 at `times_s` (n,).

    `across_m` and `up_m` are the centres of the cells, `open` (up, across) says which hold fluid;
    elsewhere the frames are 0.
    """

    across_m: Real
    up_m: Real
    open: NDArray[np.bool_]
    times_s: Real
    frames: Real


def ricker_wavelet(dt_s: float, peak_hz: float) -> Real:
    """Ricker wavelet sampled every `dt_s`, (n,): no mean, strongest at `peak_hz`.

    (1 - 2a) e^-a with a = (π f (t - t0))² (Ricker 1953), cut where it has fallen to 2e-7.
    """
    half = int(np.ceil(1.4 / (peak_hz * dt_s)))
    a = (np.pi * peak_hz * dt_s * np.arange(-half, half + 1)) ** 2
    return (1 - 2 * a) * np.exp(-a)


def slices(plan: Plan, every: int, frames: int, peak_hz: float = 4_000.0) -> PressureFrames:
    """Play a Ricker wavelet of volume velocity (peak 1 m³/s) at the speaker and keep every
    `every`-th step of the pressure in the cells of the plane y = 0, `frames` times.

    4 kHz is what the default grid resolves: what moves is the wave, not the grid.
    """
    cells, system = plan.cells, plan.system
    index = int(np.argmin(np.abs(cells.y)))
    live = np.asarray(system.mass[:, index] > 0)
    drive = ricker_wavelet(system.dt, peak_hz)
    state = at_rest(system)
    # Far from where float32 loses its digits to denormal numbers.
    scale = 1e9 / float(np.max(system.capacities.yield_))
    pressures = np.empty((frames, *live.shape), np.float32)
    for n in range(frames):
        now = scale * drive[n * every : (n + 1) * every]
        march(system, state, plan.speaker, plan.microphone, now, every)
        pressures[n] = np.where(live, state.p.reshape(system.shape)[:, index], 0) / scale
    times_s = system.dt * every * np.arange(1, frames + 1)
    return PressureFrames(cells.x, cells.z, live, times_s, pressures)
