"""From a scene or its plan to the impulse response, without the dispersion of the time steps.

The staggered leapfrog replaces s by (2/Δt) sinh(sΔt/2) wherever the equations differentiate: a
response at ω appears at ω' = (2/Δt) arcsin(ωΔt/2). This relation is exact and does not depend on
the medium. To undo it, the spectrum of the leapfrog is read at ω' (time-dispersion transform, Koene
et al. 2018, Geophysical Journal International 213).

This is exact for the leapfrog. Exponential drag and trapezoidal rule average over a step, and have
errors that are also known: about (ωΔt)²/8 in the drag, the resistances of walls and the relaxation
times (1.6 % at 10 kHz with four steps per sample), twice as much in the masses of walls, and
(γΔt)²/12 at all frequencies in the density of the grains, where γ is the drag over the density
(`ajgdata/studies/known_cases/time_step.py` has the terms, and shows that no other error is left).
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.fft import fft, irfft, next_fast_len
from scipy.special import i0

from ajgdata.gripper.outside import diffuse_gain, patch_velocity
from ajgdata.gripper.scene import SAMPLE_RATE_HZ, Scene, scene_digest
from ajgdata.gripper.signal_chain import ImpulseResponse
from ajgdata.gripper.solver import Patches, at_rest, march
from ajgdata.gripper.solver_plan import Plan, build_plan

Real = NDArray[np.floating]
Complex = NDArray[np.complexfloating]
#: The response is flat up to this frequency.
PASS_HZ = 20_000.0
#: Least frequency of components that decimation would move below PASS_HZ, and their attenuation.
STOP_HZ = SAMPLE_RATE_HZ - PASS_HZ
STOP_DB = 80.0
#: Samples between two computations of the energy: one millisecond.
CHUNK_SAMPLES = 44
#: Width and shape of the Kaiser-Bessel kernel on a twofold oversampled grid, for an error below
#: 1e-9.
TAPS = 12
SHAPE = 2.30 * TAPS


def simulate(source: Scene | Plan) -> ImpulseResponse:
    """Return the impulse response of a scene or its plan, (n,) at 44.1 kHz in Pa per m³/s.

    Speaker and microphone change places: by reciprocity, the response is the same, and the pressure
    on the membrane gives the gain of sound from outside. The source plays the low-pass filter of
    the decimation instead of a pulse. This gives the same response as a filter after the pulse.

    A scene gives the same bytes each time. Raises SceneError (a ValueError) before the solver
    starts if the object does not fit.

    >>> short = {"numerics": {"dx_mm": 6, "max_time_s": 0.01}}
    >>> response = simulate(Scene.model_validate({"object": "cube_20p7", **short}))
    >>> response.sample_rate_hz, response.latency_samples, response.samples.dtype
    (44100, 28, dtype('float64'))
    >>> response.provenance["dx_mm"]
    6.0
    """
    plan = source if isinstance(source, Plan) else build_plan(source)
    factor = plan.steps_per_sample
    pulse, latency = lowpass(factor)
    scale = field_scale(plan)
    pressure, push = _march_pulse(plan, pulse, scale)
    # The mean at the end is the static pressure, so that nothing jumps there: the slowest resonance
    # of the balloon, below the band of the transducers, has not decayed.
    static = float(pressure[-CHUNK_SAMPLES * factor // 2 :].mean())
    samples = undisperse(_without_static(pressure, static, pulse, factor), factor, latency)
    velocity = patch_velocity(push / scale, plan.membrane.motion, 1 / SAMPLE_RATE_HZ)
    outside = diffuse_gain(velocity, plan.membrane.centre, plan.air, 1 / SAMPLE_RATE_HZ)
    provenance = {
        "scene_sha256": scene_digest(plan.scene),
        "dx_mm": plan.scene.numerics.dx_mm,
        "dt_s": plan.system.dt,
        "steps": len(pressure),
        "cells": int(np.count_nonzero(plan.system.mass)),
    }
    return ImpulseResponse(
        samples / scale, static / scale, SAMPLE_RATE_HZ, latency, provenance, outside
    )


def field_scale(plan: Plan) -> float:
    """Return a factor for the source with which float32 pressures do not become denormal numbers.

    The results of the solver are divided by it.
    """
    return 1e9 / float(np.max(plan.system.capacities.yield_))


def _march_pulse(plan: Plan, pulse: Real, scale: float) -> tuple[Real, Real]:
    """Play `pulse` times `scale` at the microphone, until the energy has decayed.

    Return the pressure (steps,) at the speaker in each step, and the force (patches, samples) on
    the patches of the membrane in each sample.
    """
    numerics = plan.scene.numerics
    factor = plan.steps_per_sample
    state = at_rest(plan.system)
    membrane = plan.membrane
    patches = Patches(membrane.cell, membrane.patch, membrane.area)
    mass = plan.system.mass.ravel()
    pressures: list[Real] = []
    pushes: list[Real] = []
    strongest = 0.0
    level = 0.0
    # At least the time in which the pulse enters.
    longest = max(numerics.max_time_s * SAMPLE_RATE_HZ, len(pulse) / factor)
    for n in range(int(np.ceil(longest / CHUNK_SAMPLES))):
        drive = scale * pulse[n * CHUNK_SAMPLES * factor : (n + 1) * CHUNK_SAMPLES * factor]
        push = np.zeros((len(membrane.centre), CHUNK_SAMPLES))
        pressure = march(
            plan.system,
            state,
            plan.microphone,
            plan.speaker,
            drive,
            CHUNK_SAMPLES * factor,
            patches,
            push,
        )
        pressures.append(pressure)
        pushes.append(push)
        earlier_level = level
        level, unrest = _moments(mass, state.p)
        if not np.isfinite(unrest):
            raise FloatingPointError("the wave field is not finite: this is a fault of the solver")
        energy = unrest + (level - earlier_level) ** 2
        strongest = max(strongest, energy)
        if not len(drive) and energy < strongest * 10 ** (-numerics.decay_db / 10):
            break
    return np.concatenate(pressures), np.hstack(pushes)


@njit(nogil=True, cache=True)
def _moments(mass, p):
    """Return mean and variance of the pressure in the cavity, weighted by the capacity `mass`."""
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
    """Return a linear-phase low pass (taps,) at `factor` times 44.1 kHz, and its delay in samples
    at 44.1 kHz.

    It is flat to 20 kHz. The attenuation is 80 dB from 24.1 kHz, because decimation moves these
    components below 20 kHz (Kaiser 1974; Oppenheim & Schafer, section 7.6). The delay is a whole
    number of samples, so that every `factor`-th step is a sample. The gain is `factor`, because a
    source that is sampled at 44.1 kHz lasts this number of steps.
    """
    if factor == 1:
        return np.ones(1), 0
    rate = SAMPLE_RATE_HZ * factor
    width = (STOP_HZ - PASS_HZ) / rate
    middle = (STOP_HZ + PASS_HZ) / rate
    # Kaiser's formulas for the number of taps and the shape of the window, valid above 50 dB.
    count = int(np.ceil((STOP_DB - 7.95) / (2.285 * 2 * np.pi * width) + 1))
    latency = int(np.ceil(count / 2 / factor))
    n = np.arange(-latency * factor, latency * factor + 1)
    taps = np.sinc(middle * n) * np.kaiser(len(n), 0.1102 * (STOP_DB - 8.7))
    pulse = factor * (taps / taps.sum())
    pulse.flags.writeable = False
    return pulse, latency


def _without_static(pressure: Real, static: float, pulse: Real, factor: int) -> Real:
    """Return the pressure (steps,) without its final value `static`, which enters with the pulse,
    as the running sum of the pulse."""
    entered = np.cumsum(pulse) / factor
    response = pressure.copy()
    response[: len(entered)] -= static * entered
    response[len(entered) :] -= static
    return response


def undisperse(marched: Real, factor: int, latency: int) -> Real:
    """Return samples (n // factor,) at 44.1 kHz of a response (n,) with `factor` steps per sample.

    `latency` is that of the source's pulse, in samples; it remains. The source acts half a step
    before the recorded pressure, and this half step is removed. The band ends smoothly between 20
    and 22.05 kHz.
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
    """Return Σ signal[n] e^{-i radians n}, (m,), of a signal (n,).

    `radians` (m,) are any angular frequencies per sample. The method is a non-uniform fast Fourier
    transform with a Kaiser-Bessel kernel (Fessler & Sutton 2003).
    """
    count = len(signal)
    length = next_fast_len(2 * count)
    position = np.arange(count) - count // 2
    bend = np.sqrt(SHAPE**2 - (np.pi * TAPS * position / length) ** 2)
    spread = np.zeros(length)
    spread[position % length] = signal * bend / (TAPS * np.sinh(bend))
    grid = fft(spread)
    index = radians * length / (2 * np.pi)
    nearest = np.ceil(index - TAPS / 2).astype(np.int64)[:, None] + np.arange(TAPS)
    offset = (index[:, None] - nearest) / (TAPS / 2)
    weight = i0(SHAPE * np.sqrt(np.clip(1 - offset**2, 0, None)))
    return np.asarray(
        (weight * grid[nearest % length]).sum(1) * np.exp(-1j * radians * (count // 2))
    )
