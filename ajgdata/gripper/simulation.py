"""Scene -> impulse response."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import firwin, kaiserord

from ajgdata.gripper.fields import RandomField
from ajgdata.gripper.geometry import MM, SceneError, cavity
from ajgdata.gripper.grid import Cells, cut_cells
from ajgdata.gripper.medium import Air, Packing, air_fluid, fit_fluid
from ajgdata.gripper.scene import HOTTEST_C, Numerics, Scene, derive_seed, scene_digest
from ajgdata.gripper.solver import Probe, State, at_rest, march
from ajgdata.gripper.system import Packed, System, WallList, assemble

Real = NDArray[np.floating]
SAMPLE_RATE_HZ = 44_100
PASS_HZ = 20_000.0
#: What folds down to below 20 kHz lies above this.
STOP_HZ = SAMPLE_RATE_HZ - PASS_HZ
#: The energy is looked at once a millisecond of this many samples.
CHUNK = 44
LEFT_OUT = ("motion of the object", "frame-borne path through the grains", "air behind the drape")


@dataclass(frozen=True)
class ImpulseResponse:
    """Pressure (Pa) at the microphone per volume velocity (m³/s) at the speaker.

    p[n] = Σ samples[m] q[n - m + latency_samples]; the latency is that of the linear-phase
    decimation filter. `static` is what the response settles at, for ever on this time scale,
    because the balloon holds the volume that the speaker pushed in; `samples` goes on to zero
    without it. Convolve the input with `samples`, then add `static` times its running sum.
    `provenance` says how it was computed; it is as deterministic as `samples`.
    """

    samples: Real
    static: float
    sample_rate_hz: int
    latency_samples: int
    provenance: dict[str, Any]


@dataclass(frozen=True)
class Model:
    """A scene ready to march."""

    cells: Cells
    system: System
    speaker: Probe
    microphone: Probe
    steps_per_sample: int
    displaced_m3: float


def steps_per_sample(dx_m: float, cfl: float) -> int:
    """Steps per sample at 44.1 kHz: the same for all scenes, by the sound speed at 30 °C."""
    fastest = Air(HOTTEST_C).sound_speed
    return int(np.ceil(fastest * np.sqrt(3) / (cfl * dx_m * SAMPLE_RATE_HZ)))


def compile_scene(scene: Scene) -> Model:
    """Geometry, grid, medium and walls of `scene`. Raises SceneError (a ValueError)."""
    gripper, h = scene.gripper, scene.numerics.dx_mm * MM
    shape = cavity(scene)
    cells = cut_cells(
        shape, h, gripper.rim_radius_mm * MM, -gripper.balloon_depth_mm * MM, gripper.height_mm * MM
    )
    air = _air(scene)
    grains = _grains(scene, cells, air)
    per_sample = steps_per_sample(h, scene.numerics.cfl)
    dtype = np.float32 if scene.numerics.precision == "float32" else np.float64
    system = assemble(
        cells,
        air_fluid(air),
        1 / (SAMPLE_RATE_HZ * per_sample),
        grains,
        _walls(scene, cells, air),
        dtype,
    )
    roof, sigma = gripper.height_mm * MM, gripper.transducer_sigma_mm * MM
    speaker, microphone = (
        probe(cells, system, (x * MM, y * MM, roof), sigma)
        for x, y in (gripper.speaker_mm, gripper.microphone_mm)
    )
    return Model(cells, system, speaker, microphone, per_sample, shape.displaced_m3)


def _air(scene: Scene) -> Air:
    """The air of this grasp; never warmer than what the time step allows."""
    nuisance = scene.grasp.nuisance
    draw = np.random.default_rng(derive_seed(scene.grasp.seed, "temperature")).standard_normal()
    temperature = scene.environment.temperature_c + nuisance.temperature_k * float(draw)
    return Air(min(temperature, HOTTEST_C), scene.environment.pressure_pa)


def _grains(scene: Scene, cells: Cells, air: Air) -> Packed | None:
    medium, nuisance = scene.medium, scene.grasp.nuisance
    if medium.kind == "air":
        return None
    field = RandomField.draw(
        scene.grasp.seed, "packing", 3, nuisance.packing_correlation_mm * MM
    ).on_axes(cells.z, cells.y, cells.x)
    ratio = 1 + nuisance.packing * np.clip(field, -3, 3)
    packing = Packing(medium.grain_diameter_mm * MM, medium.porosity)
    return Packed(fit_fluid(packing, air), medium.porosity, ratio)


def _walls(scene: Scene, cells: Cells, air: Air) -> WallList:
    gripper, membrane = scene.gripper, scene.gripper.membrane
    impedance = air.density * air.sound_speed
    walls = WallList.uniform(
        cells.membrane, membrane.mass_kg_m2, membrane.resistance_pa_s_m, membrane.stiffness_n_m3
    )
    if gripper.wall_admittance > 0:
        walls += WallList.uniform(cells.housing, 0.0, impedance / gripper.wall_admittance, 0.0)
    # The hose is long and lossy: beyond the inert fitting it sends nothing back.
    bore = gripper.port_bore_mm * MM / 2
    x, y = (c * MM for c in gripper.port_mm)
    spot = _gaussian(cells, (x, y, gripper.height_mm * MM), max(bore, cells.h / 2))
    area = np.pi * bore**2 * spot * (cells.volume > 0)
    area[area < 1e-3 * area.max()] = 0.0
    area *= np.pi * bore**2 / area.sum()
    inert = air.density * gripper.port_length_mm * MM
    return walls + WallList.uniform(area, inert, impedance, 0.0)


def _gaussian(cells: Cells, position: tuple[float, float, float], sigma: float) -> Real:
    x, y, z = position
    square = (
        (cells.z[:, None, None] - z) ** 2
        + (cells.y[None, :, None] - y) ** 2
        + (cells.x[None, None, :] - x) ** 2
    )
    return np.exp(-square / (2 * sigma**2))


def probe(
    cells: Cells, system: System, position: tuple[float, float, float], sigma: float
) -> Probe:
    """Gaussian volume of width `sigma` (m) at x, y, z (m), inside the open cells."""
    weight = _gaussian(cells, position, sigma) * cells.volume * (system.mass > 0)
    weight[weight < 1e-4 * weight.max()] = 0.0
    cell = np.flatnonzero(weight)
    if not len(cell):
        raise SceneError(f"no open cell near {position}: the transducer is outside the cavity")
    return Probe(cell.astype(np.uint64), weight.ravel()[cell] / weight.sum())


def simulate(scene: Scene) -> ImpulseResponse:
    """Impulse response of `scene` at 44.1 kHz; the same scene gives the same bytes.

    Raises SceneError (a ValueError) before anything runs if the object does not fit.
    """
    model = compile_scene(scene)
    samples, static, steps, latency = _impulse(model, scene.numerics)
    provenance = {
        "scene_sha256": scene_digest(scene),
        "dx_mm": scene.numerics.dx_mm,
        "dt_s": model.system.dt,
        "steps": steps,
        "cells": int(np.count_nonzero(model.system.mass)),
        "cfl": float(Air(HOTTEST_C).sound_speed * np.sqrt(3) * model.system.dt / model.cells.h),
        "added_volume": model.system.added_volume,
        "raised_cells": model.system.raised_cells,
        "displaced_volume_m3": model.displaced_m3,
        "precision": scene.numerics.precision,
        "left_out": list(LEFT_OUT),
    }
    return ImpulseResponse(samples, static, SAMPLE_RATE_HZ, latency, provenance)


def _impulse(model: Model, numerics: Numerics) -> tuple[Real, float, int, int]:
    """Response less what it settles at, that, the number of steps, and the latency in samples.

    The speaker plays the low-pass filter that decimation needs, instead of a pulse that would be
    filtered afterwards: the same response, but no energy is put where it is not heard.
    """
    system, factor = model.system, model.steps_per_sample
    pulse, latency = lowpass(factor)
    state = at_rest(system)
    # Far from where float32 loses its digits to denormal numbers.
    scale = 1e9 / float(np.max(system.capacities.yield_))
    pieces: list[Real] = []
    strongest, level = 0.0, 0.0
    for n in range(int(np.ceil(numerics.max_time_s * SAMPLE_RATE_HZ / CHUNK))):
        drive = scale * pulse[n * CHUNK * factor : (n + 1) * CHUNK * factor]
        heard = march(system, state, model.speaker, model.microphone, drive, CHUNK * factor)
        pieces.append(heard[::factor])
        before, (level, unrest) = level, _mean_and_unrest(system, state)
        if not np.isfinite(unrest):
            raise FloatingPointError("the wave field is not finite: this is a fault of the solver")
        energy = unrest + (level - before) ** 2
        strongest = max(strongest, energy)
        if not len(drive) and energy < strongest * 10 ** (-numerics.decay_db / 10):
            break
    static = float(heard[-len(heard) // 2 :].mean())
    samples = np.concatenate(pieces)
    # The static pressure enters with the pulse, as its running sum.
    entering = np.cumsum(pulse)[::factor]
    samples[: len(entering)] -= static * entering
    samples[len(entering) :] -= static
    return samples / scale, static / scale, CHUNK * factor * len(pieces), latency


def _mean_and_unrest(system: System, state: State) -> tuple[float, float]:
    """Mean pressure, and ‖p - mean‖²_M per capacity."""
    mass, p = system.mass.ravel(), state.p.astype(np.float64)
    mean = float(np.sum(mass * p) / mass.sum())
    return mean, float(np.sum(mass * (p - mean) ** 2) / mass.sum())


def lowpass(factor: int) -> tuple[Real, int]:
    """Linear-phase low pass at `factor` times 44.1 kHz and its delay in samples at 44.1 kHz.

    Flat to 20 kHz, 80 dB down from 24.1 kHz on, which is what folds back below 20 kHz (Kaiser).
    The delay is a whole number of samples, so that taking every `factor`-th step is exact; the
    gain is `factor`, because a source sampled at 44.1 kHz is that many steps wide.
    """
    if factor == 1:
        return np.ones(1), 0
    rate = SAMPLE_RATE_HZ * factor
    taps, beta = kaiserord(80.0, (STOP_HZ - PASS_HZ) / (rate / 2))
    latency = int(np.ceil(taps / 2 / factor))
    cutoff = (PASS_HZ + STOP_HZ) / 2
    pulse = firwin(2 * latency * factor + 1, cutoff, window=("kaiser", beta), fs=rate)
    return factor * pulse, latency
