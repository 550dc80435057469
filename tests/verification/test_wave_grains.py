"""The grain bed against the analytic Johnson-Champoux-Allard fluid."""

import numpy as np
import pytest
from wave_cases import AIR, PLASTIC, box, check_convergence, time_step

from ajgdata.gripper.grid import cut_cells
from ajgdata.gripper.medium import Fluid, Packing, air_fluid, fit_fluid, wave
from ajgdata.gripper.plan import steps_per_sample
from ajgdata.gripper.simulation import lowpass
from ajgdata.gripper.solver import Probe, at_rest, march
from ajgdata.gripper.system import Packed, assemble

LAYER = 0.040
BANDS = np.geomspace(200, 3_000, 40)


def _reflection(rho, compressibility, omega):
    """Of a layer on a rigid ground, seen from air (plane waves)."""
    k, z = wave(rho, compressibility, omega)
    z, z0 = -1j * z / np.tan(k * LAYER), AIR.density * AIR.sound_speed
    return (z - z0) / (z + z0)


def _tube(h: float, fluid: Fluid | None) -> np.ndarray:
    """Echo of the layer, or of a rigid wall in its place, at a probe half a metre above it."""
    air_length, width = 2.0, 2 * h
    layer = LAYER if fluid else 0.0
    top = layer + np.round(air_length / h) * h
    cells = cut_cells(box(width, width, top, layer), h, width, 0.0, top)
    grains = Packed(fluid, PLASTIC.porosity, np.ones(cells.shape)) if fluid else None
    system = assemble(cells, air_fluid(AIR), time_step(h), grains)
    slab = np.argmin(np.abs(cells.z - (layer + 0.5)))
    inside = np.flatnonzero((cells.volume > 0).ravel() & (system.mass.ravel() > 0))
    here = inside[inside // system.span.slab == slab]
    probe = Probe(here.astype(np.uint64), np.full(len(here), 1 / len(here)))
    pulse, _ = lowpass(steps_per_sample(h, 0.99))
    echo = march(system, at_rest(system), probe, probe, pulse, int(8.4e-3 / system.dt))
    echo[: int(2.3e-3 / system.dt)] = 0.0
    return echo


def _measured(h: float, fluid: Fluid) -> np.ndarray:
    time = np.arange(int(8.4e-3 / time_step(h))) * time_step(h)
    kernel = np.exp(-2j * np.pi * BANDS[:, None] * time)
    return (kernel @ _tube(h, fluid)) / (kernel @ _tube(h, None))


def test_a_layer_in_a_tube_reflects_like_its_fluid():
    fluid, omega = fit_fluid(PLASTIC, AIR), 2 * np.pi * BANDS
    exact = _reflection(*fluid.response(omega), omega)
    sizes = (8e-3, 5e-3, 4e-3)
    measured = [_measured(h, fluid) for h in sizes]
    errors = [float(np.sqrt(np.mean(np.abs(m - exact) ** 2))) for m in measured]
    check_convergence(sizes, errors, order=1.0, cap=1.5e-2)
    jca = _reflection(*PLASTIC.jca(omega, AIR), omega)
    assert np.sqrt(np.mean(np.abs(measured[-1] - jca) ** 2)) < 4e-2


@pytest.mark.parametrize(
    ("packing", "errors"),
    [
        (Packing(6e-3, 0.40), (0.13, 0.035, 0.025)),
        (Packing(4.5e-3, 0.40), (0.15, 0.045, 0.025)),
        (Packing(0.7e-3, 0.50), (0.13, 0.055, 0.030)),
    ],
)
def test_two_poles_fit_the_reflection_and_fewer_do_worse(packing, errors):
    omega = 2 * np.pi * np.geomspace(80, 15_000, 300)
    exact = _reflection(*packing.jca(omega, AIR), omega)
    found = []
    for poles in range(3):
        fluid = fit_fluid(packing, AIR, poles)
        fitted = _reflection(*fluid.response(omega), omega)
        found.append(float(np.sqrt(np.mean(np.abs(fitted - exact) ** 2))))
        assert fluid.density > 0 and fluid.drag > 0 and min(fluid.strengths, default=1) > 0
    assert found[0] > 2 * found[1] > 2 * found[2]
    assert all(f < cap for f, cap in zip(found, errors, strict=True))


def test_jca_has_its_two_limits():
    slow, fast = np.array([2 * np.pi * 1e-3]), np.array([2 * np.pi * 1e9])
    k0 = 0.4**3 * 0.006**2 / (180 * 0.6**2)
    rho, c = PLASTIC.jca(slow, AIR)
    assert rho.imag[0] * slow[0] == pytest.approx(-AIR.viscosity / k0, rel=1e-4)
    assert c.real[0] == pytest.approx(0.4 / AIR.pressure_pa, rel=1e-4)  # isothermal
    rho, c = PLASTIC.jca(fast, AIR)
    assert rho.real[0] == pytest.approx(0.4**-0.5 * AIR.density / 0.4, rel=1e-2)
    assert c.real[0] == pytest.approx(0.4 * AIR.compressibility, rel=1e-2)  # adiabatic


def test_air_is_air():
    assert AIR.sound_speed == pytest.approx(344.4, abs=0.2)  # 22 °C, dry air
    assert AIR.viscosity == pytest.approx(1.82e-5, rel=0.01)
    assert AIR.density == pytest.approx(1.196, rel=0.002)
