"""The grain bed against the analytic Johnson-Champoux-Allard fluid."""

import numpy as np
import pytest

from ajgdata.gripper.medium import Packing, fit_fluid
from ajgdata.studies.extreme_cases import AIR, PLASTIC
from ajgdata.studies.known_cases.tube import reflection


@pytest.mark.parametrize(
    ("packing", "errors"),
    [
        (Packing(6e-3, 0.40), (0.13, 0.035, 0.025)),
        (Packing(0.7e-3, 0.50), (0.13, 0.055, 0.030)),
    ],
)
def test_two_poles_fit_the_reflection_and_fewer_do_worse(packing, errors):
    omega = 2 * np.pi * np.geomspace(80, 15_000, 300)
    exact = reflection(*packing.jca(omega, AIR), omega)
    residuals = []
    for poles in range(3):
        fluid = fit_fluid(packing, AIR, poles)
        fitted = reflection(*fluid.response(omega), omega)
        residuals.append(float(np.sqrt(np.mean(np.abs(fitted - exact) ** 2))))
        assert fluid.density > 0 and fluid.drag > 0 and min(fluid.strengths, default=1) > 0
    assert residuals[0] > 2 * residuals[1] > 2 * residuals[2]
    assert all(f < cap for f, cap in zip(residuals, errors, strict=True))


def test_jca_has_its_two_limits():
    slow = np.array([2 * np.pi * 1e-3])
    fast = np.array([2 * np.pi * 1e9])
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
