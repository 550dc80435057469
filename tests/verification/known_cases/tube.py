"""An impedance tube: a bed layer on a rigid end against the analytic porous layer."""

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
from ajgdata.studies.rigid_domains import box
from known_cases.case import Refinement

Real = NDArray[np.floating]
Complex = NDArray[np.complexfloating]
LAYER_M, AIR_M, PROBE_M = 0.040, 2.0, 0.5
#: The echo returns after 2.9 ms; that of the far end after 8.7 ms.
GATE_S, END_S = 2.3e-3, 8.4e-3
PULSE_S = 1 / (2 * np.pi * 3_000)
BANDS_HZ = np.geomspace(200, 3_000, 40)
#: Of ground coffee the drag rules.
BEDS = {"plastic": PLASTIC, "coffee": Packing(0.7e-3, 0.50)}


def reflection(rho: Complex, compressibility: Complex, omega: Real) -> Complex:
    """Reflection (ω,) of a layer on a rigid ground, seen from air, at normal incidence.

    Z = -i z cot(k L), R = (Z - ρc)/(Z + ρc) (Allard & Atalla 2009, section 2.3).
    """
    k, z = wave(rho, compressibility, omega)
    z, z0 = -1j * z / np.tan(k * LAYER_M), AIR.density * AIR.sound_speed
    return np.asarray((z - z0) / (z + z0))


def echo(h: float, fluid: Fluid | None, porosity: float) -> Real:
    """Echo (n,) of the layer, or of a rigid wall in its place, half a metre above it."""
    layer, width = LAYER_M if fluid else 0.0, 2 * h
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
    """Gaussian: at 15 kHz, where a coarse grid all but stops a wave, 108 dB down."""
    half = int(np.ceil(6 * PULSE_S / dt))
    return np.exp(-((np.arange(-half, half + 1) * dt / PULSE_S) ** 2) / 2)


def measured(h: float, fluid: Fluid, porosity: float) -> Complex:
    """Reflection (ω,) of the layer over that of the rigid wall at BANDS_HZ.

    They are heard at the frequencies that the time steps make of them.
    """
    dt = time_step(h, wide_weight(h))
    omega = 2 / dt * np.arcsin(2 * np.pi * BANDS_HZ * dt / 2)
    kernel = np.exp(-1j * omega[:, None] * np.arange(int(END_S / dt)) * dt)
    layer, wall = (echo(h, what, porosity) for what in (fluid, None))
    return np.asarray((kernel @ layer) / (kernel @ wall))


def rms(difference: Real | Complex) -> float:
    """Root of the mean square modulus of an array."""
    return float(np.sqrt(np.mean(np.abs(difference) ** 2)))


@dataclass(eq=False)
class BedLayer(Refinement):
    """40 mm of grains in a tube: what the grid adds to the fluid that is marched."""

    title = "reflection of a bed below 3 kHz, error of the scheme"
    derived = "dispersion (k h)²/24 on the way through the bed and back, rms over the band"
    sizes = (8e-3, 5e-3, 4e-3, 2e-3, 1e-3)
    quick_sizes = (8e-3, 5e-3, 4e-3)
    grains: str
    least_order = 1.0  #: the change of the differences where the grains end costs an order

    def error(self, h: float) -> float:
        """Return the rms error of the complex reflection."""
        packing, omega = BEDS[self.grains], 2 * np.pi * BANDS_HZ
        fluid = fit_fluid(packing, AIR)
        exact = reflection(*fluid.response(omega), omega)
        return rms(measured(h, fluid, packing.porosity) - exact)

    def cap(self, h: float) -> float:
        """See `derived`."""
        omega = 2 * np.pi * BANDS_HZ
        k, _ = wave(*fit_fluid(BEDS[self.grains], AIR).response(omega), omega)
        return rms(2 * k * LAYER_M * (k * h) ** 2 / 24)
