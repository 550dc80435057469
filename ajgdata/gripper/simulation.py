"""Scene -> impulse response."""

from __future__ import annotations

from functools import cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ajgdata.gripper.dispersion import PASS_HZ, undisperse
from ajgdata.gripper.outside import diffuse_gain, patch_velocity
from ajgdata.gripper.scene import SAMPLE_RATE_HZ, Numerics, Scene, scene_digest
from ajgdata.gripper.signal_chain import ImpulseResponse
from ajgdata.gripper.solver import Patches, at_rest, march
from ajgdata.gripper.solver_plan import Plan, build_plan

Real = NDArray[np.floating]
#: What folds down to below 20 kHz lies above this.
STOP_HZ = SAMPLE_RATE_HZ - PASS_HZ
STOP_DB = 80.0
#: The energy is looked at once a millisecond of this many samples.
CHUNK = 44


def simulate(what: Scene | Plan) -> ImpulseResponse:
    """Return the impulse response of a scene or its plan, (n,) at 44.1 kHz in Pa per m³/s.

    One scene gives the same bytes each time. Raises SceneError (a ValueError) before anything runs
    if the object does not fit.

    >>> short = {"numerics": {"dx_mm": 6, "max_time_s": 0.01}}
    >>> response = simulate(Scene.model_validate({"object": "cube_20p7", **short}))
    >>> response.sample_rate_hz, response.latency_samples, response.samples.dtype
    (44100, 28, dtype('float64'))
    >>> response.provenance["scheme"]
    'wide'
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
        "scheme": scene.numerics.scheme,
        "left_out": model.left_out,
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
    for n in range(int(np.ceil(longest / CHUNK))):
        drive = scale * pulse[n * CHUNK * factor : (n + 1) * CHUNK * factor]
        push = np.zeros((len(model.skin.centre), CHUNK))
        heard = march(
            system, state, model.microphone, model.speaker, drive, CHUNK * factor, patches, push
        )
        pieces.append(heard)
        pushes.append(push)
        before, (level, unrest) = level, _moments(system.mass.ravel(), state.p)
        if not np.isfinite(unrest):
            raise FloatingPointError("the wave field is not finite: this is a fault of the solver")
        energy = unrest + (level - before) ** 2
        strongest = max(strongest, energy)
        if not len(drive) and energy < strongest * 10 ** (-numerics.decay_db / 10):
            break
    # Where it stops, so that nothing jumps: the slowest resonance of the balloon goes on below
    # the band of the transducers.
    static = float(heard[-len(heard) // 2 :].mean())
    heard = np.concatenate(pieces)
    # The static pressure enters with the pulse, as its running sum.
    entered = np.cumsum(pulse) / factor
    heard[: len(entered)] -= static * entered
    heard[len(entered) :] -= static
    plain = numerics.scheme == "second"
    samples = heard[::factor] if plain else undisperse(heard, factor, latency)
    velocity = patch_velocity(np.hstack(pushes) / scale, model.skin.motion, 1 / SAMPLE_RATE_HZ)
    outside = diffuse_gain(velocity, model.skin.centre, model.air, 1 / SAMPLE_RATE_HZ)
    return samples / scale, static / scale, len(heard), latency, outside


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
