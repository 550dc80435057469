"""Impedance tube: a layer of grains on a rigid end, compared with the analytic porous layer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper.grid import cut_cells
from ajgdata.gripper.medium import Fluid, Packing, air_fluid, fit_fluid, wave
from ajgdata.gripper.solver import Probe, at_rest, march
from ajgdata.gripper.solver_plan import wide_weight
from ajgdata.gripper.system import Packed, assemble
from ajgdata.studies.extreme_cases import AIR, PLASTIC, time_step
from ajgdata.studies.known_cases.case import Refinement
from ajgdata.studies.rigid_domains import box

Real = NDArray[np.floating]
Complex = NDArray[np.complexfloating]
#: Thickness of the layer of grains (m).
LAYER_M = 0.040
#: Length of the air above the layer (m).
AIR_M = 2.0
#: Distance of source and receiver from the layer (m).
PROBE_M = 0.5
#: Start and end of the echo (s): it returns after 2.9 ms, that of the far end after 8.7 ms.
GATE_S, END_S = 2.3e-3, 8.4e-3
#: Standard deviation of the pulse (s).
PULSE_S = 1 / (2 * np.pi * 3_000)
BANDS_HZ = np.geomspace(200, 3_000, 40)
#: Grains by name. In ground coffee, drag is the largest force.
BEDS = {"plastic": PLASTIC, "coffee": Packing(0.7e-3, 0.50)}


def reflection(rho: Complex, compressibility: Complex, omega: Real) -> Complex:
    """Return the reflection (ω,) of a layer on a rigid wall, from air at normal incidence.

    Z = -i z cot(k L), R = (Z - ρc)/(Z + ρc) (Allard & Atalla 2009, section 2.3).
    """
    k, z = wave(rho, compressibility, omega)
    z = -1j * z / np.tan(k * LAYER_M)
    z0 = AIR.density * AIR.sound_speed
    return np.asarray((z - z0) / (z + z0))


def echo(h: float, fluid: Fluid | None, porosity: float) -> Real:
    """Return the echo (n,) of the layer, or of a rigid wall without `fluid`.

    Source and receiver are half a metre above it. `h` is the grid spacing (m).
    """
    layer = LAYER_M if fluid else 0.0
    width = 2 * h
    top = layer + np.round(AIR_M / h) * h
    cells = cut_cells(box(width, width, top, layer), h, width, 0.0, top)
    grains = Packed(fluid, porosity, np.ones(cells.shape)) if fluid else None
    weight = wide_weight(h)
    system = assemble(cells, air_fluid(AIR), time_step(h, weight), grains, wide=weight)
    slab = np.argmin(np.abs(cells.z - layer - (np.round(PROBE_M / h) + 0.5) * h))
    inside = np.flatnonzero((cells.volume > 0).ravel() & (system.mass.ravel() > 0))
    here = inside[inside // system.span.slab == slab]
    probe = Probe(here.astype(np.uint64), np.full(len(here), 1 / len(here)))
    sound = march(system, at_rest(system), probe, probe, _pulse(system.dt), int(END_S / system.dt))
    sound[: int(GATE_S / system.dt)] = 0.0
    return sound


def _pulse(dt: float) -> Real:
    """Return a Gaussian pulse, 108 dB down at 15 kHz, where coarse grids hardly transmit waves."""
    half = int(np.ceil(6 * PULSE_S / dt))
    return np.exp(-((np.arange(-half, half + 1) * dt / PULSE_S) ** 2) / 2)


def measured(h: float, fluid: Fluid, porosity: float) -> Complex:
    """Return the simulated reflection (ω,) of the layer, relative to a rigid wall, at BANDS_HZ.

    The responses are read at the frequencies to which the time steps move BANDS_HZ.
    """
    dt = time_step(h, wide_weight(h))
    omega = 2 / dt * np.arcsin(2 * np.pi * BANDS_HZ * dt / 2)
    kernel = np.exp(-1j * omega[:, None] * np.arange(int(END_S / dt)) * dt)
    layer = echo(h, fluid, porosity)
    wall = echo(h, None, porosity)
    return np.asarray((kernel @ layer) / (kernel @ wall))


def rms(difference: Real | Complex) -> float:
    """Return the root of the mean square modulus of an array."""
    return float(np.sqrt(np.mean(np.abs(difference) ** 2)))


@dataclass(eq=False)
class BedLayer(Refinement):
    """Error of the grid in the reflection of 40 mm of grains in a tube."""

    title = "reflection of a bed below 3 kHz, error of the scheme"
    derived = "dispersion (k h)²/24 on the way through the bed and back, rms over the band"
    sizes = (8e-3, 5e-3, 4e-3, 2e-3, 1e-3)
    quick_sizes = (8e-3, 5e-3, 4e-3)
    grains: str
    least_order = 1.0  #: the change of the differences at the end of the grains costs an order

    def error(self, h: float) -> float:
        """Return the rms error of the complex reflection."""
        packing = BEDS[self.grains]
        omega = 2 * np.pi * BANDS_HZ
        fluid = fit_fluid(packing, AIR)
        exact = reflection(*fluid.response(omega), omega)
        return rms(measured(h, fluid, packing.porosity) - exact)

    def cap(self, h: float) -> float:
        """Return the largest error that passes; `derived` gives its derivation."""
        omega = 2 * np.pi * BANDS_HZ
        k, _ = wave(*fit_fluid(BEDS[self.grains], AIR).response(omega), omega)
        return rms(2 * k * LAYER_M * (k * h) ** 2 / 24)
