"""Air, and the grain bed as an equivalent fluid that a time-domain solver can march.

Time convention e^{+iωt}. The Johnson-Champoux-Allard (JCA) fluid is not local in time; the solver
marches its fit ρ(ω) = ρ∞ + σ'/(iω), C(ω) = C∞ (1 + Σ cj / (1 + iωτj)).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

FIT_BAND_HZ = (80.0, 15_000.0)
#: Twice the depth of the deepest bed that fits the gripper.
FIT_PATH_M = 0.1
#: Weight of the relative error of the attenuation: the smallest of .1, .2, .3, … with which it is
#: within 10 % from 300 Hz to 1 kHz in each medium. No accuracy of a model was looked at.
FIT_ATTENUATION = 0.4
#: An attenuation far below this (1/m, 0.1 dB on the way through a bed and back) counts by its
#: absolute error, so that grains whose porosity goes to 1 become air.
FAINT_ATTENUATION = 0.2
Complex = NDArray[np.complexfloating]
Real = NDArray[np.floating]


@dataclass(frozen=True)
class Air:
    """Dry air as an ideal gas, viscosity by Sutherland's law.

    SI units: density kg/m3, sound_speed m/s, viscosity Pa s, compressibility 1/Pa.
    """

    temperature_c: float = 20.0
    pressure_pa: float = 101_325.0
    gamma: float = 1.4
    prandtl: float = 0.71

    @property
    def density(self) -> float:
        """ρ = P / (R T)."""
        return self.pressure_pa / (287.05 * (self.temperature_c + 273.15))

    @property
    def sound_speed(self) -> float:
        """c = √(γ R T)."""
        return float(np.sqrt(self.gamma * 287.05 * (self.temperature_c + 273.15)))

    @property
    def viscosity(self) -> float:
        """η by Sutherland's law."""
        kelvin = self.temperature_c + 273.15
        return 1.716e-5 * (kelvin / 273.15) ** 1.5 * (273.15 + 110.4) / (kelvin + 110.4)

    @property
    def compressibility(self) -> float:
        """Adiabatic, 1/(γ P)."""
        return 1.0 / (self.gamma * self.pressure_pa)


@dataclass(frozen=True)
class Packing:
    """Random packing of spheres: diameter in m, porosity."""

    diameter: float
    porosity: float

    def jca(self, omega: Real, air: Air) -> tuple[Complex, Complex]:
        """Equivalent density (kg/m³) and compressibility (1/Pa) seen by the mean flow, of the shape
        of `omega` (rad/s).

        Johnson et al. (1987) and Champoux & Allard (1991) as in Allard & Atalla (2009);
        the packing's parameters by Kozeny-Carman and Bruggeman (tortuosity φ^-1/2).
        """
        phi, eta, rho0 = self.porosity, air.viscosity, air.density
        k0 = phi**3 * self.diameter**2 / (180 * (1 - phi) ** 2)
        tortuosity = phi**-0.5
        thermal_length = phi * self.diameter / (3 * (1 - phi))
        viscous_length = np.sqrt(8 * k0 * tortuosity / phi)
        sigma, iw = eta / k0, 1j * omega
        viscous = np.sqrt(
            1 + 4 * iw * tortuosity**2 * eta * rho0 / (sigma * viscous_length * phi) ** 2
        )
        rho = tortuosity * rho0 / phi * (1 + sigma * phi / (iw * rho0 * tortuosity) * viscous)
        heat = iw * rho0 * air.prandtl * thermal_length**2
        thermal = 1 + 8 * eta / heat * np.sqrt(1 + heat / (16 * eta))
        stiffness = air.gamma - (air.gamma - 1) / thermal
        return rho, np.asarray(phi / (air.gamma * air.pressure_pa) * stiffness)


@dataclass(frozen=True)
class Fluid:
    """The fluid that the solver marches: density ρ∞, drag σ', compressibility C∞ and relaxation
    poles."""

    density: float
    drag: float
    compressibility: float
    strengths: tuple[float, ...] = ()
    times: tuple[float, ...] = ()

    def response(self, omega: Real) -> tuple[Complex, Complex]:
        """Density (kg/m³) and compressibility (1/Pa), of the shape of `omega` (rad/s)."""
        iw = 1j * omega
        relaxed = 1 + sum(
            (c / (1 + iw * t) for c, t in zip(self.strengths, self.times, strict=True)),
            start=np.zeros_like(iw),
        )
        return self.density + self.drag / iw, np.asarray(self.compressibility * relaxed)

    def sensitivities(self, omega: Real) -> tuple[Complex, Complex]:
        """Relative change of density per log ρ∞ and log σ', (2, ω), and of compressibility per log
        C∞, each log cj and each log τj, (1 + 2 poles, ω)."""
        rho, compressibility = self.response(omega)
        delay = 1j * omega * np.array(self.times)[:, None]
        part = np.array(self.strengths)[:, None] / (1 + delay)
        share = self.compressibility / compressibility
        density = np.stack([self.density / rho, self.drag / (1j * omega * rho)])
        unity = np.ones((1, len(omega)))
        return density, np.concatenate([unity, part * share, -part * delay / (1 + delay) * share])


def air_fluid(air: Air) -> Fluid:
    """Free air has neither drag nor relaxation at this scale."""
    return Fluid(air.density, 0.0, air.compressibility)


def wave(rho: Complex, compressibility: Complex, omega: Real) -> tuple[Complex, Complex]:
    """Wavenumber (1/m) and characteristic impedance (Pa s/m) of an equivalent fluid, of the shape
    of `omega` (rad/s)."""
    return np.asarray(omega * np.sqrt(rho * compressibility)), np.sqrt(rho / compressibility)


def fit_fluid(packing: Packing, air: Air, poles: int = 2) -> Fluid:
    """Fit ρ∞, σ', C∞ and `poles` relaxations to the JCA wavenumber and impedance.

    Least squares over 80 Hz-15 kHz, equally weighted per octave: the impedance relative, the
    wavenumber as phase and attenuation over FIT_PATH_M, because waves that cross the bed and come
    back see its absolute error. Below 1 kHz this error is small even if the attenuation is a third
    too low, so its relative error is fitted, too, with the weight FIT_ATTENUATION. All parameters
    are positive by their logarithms, so that the fitted fluid is passive; the relaxation times stay
    within the band, so that no pole turns into a second drag. It begins at the fit in air of 20 °C,
    which is near.
    """
    near = () if air == Air() else _fitted(packing, Air(), poles)[1]
    return _fitted(packing, air, poles, near)[0]


@lru_cache(maxsize=64)
def _fitted(
    packing: Packing, air: Air, poles: int, near: tuple[float, ...] = ()
) -> tuple[Fluid, tuple[float, ...]]:
    """Return the fluid and the logarithms of its parameters, from those of a fit that is `near`."""
    omega = 2 * np.pi * np.geomspace(*FIT_BAND_HZ, 80)
    rho, compressibility = packing.jca(omega, air)
    k, z = wave(rho, compressibility, omega)
    notable = k.imag - FAINT_ATTENUATION  # the imaginary part of k is negative
    scale = np.array([rho.real[-1], -(omega * rho.imag)[0], compressibility.real[-1]])

    def fluid(logs: Real) -> Fluid:
        values = np.exp(logs)
        density, drag, compressibility = (values[:3] * scale).tolist()
        strengths, times = values[3 : 3 + poles].tolist(), values[3 + poles :].tolist()
        return Fluid(density, drag, compressibility, tuple(strengths), tuple(times))

    def misfit(logs: Real) -> Real:
        k_fit, z_fit = wave(*fluid(logs).response(omega), omega)
        error = np.concatenate([(k_fit - k) * FIT_PATH_M, z_fit / z - 1])
        attenuation = FIT_ATTENUATION * (k_fit.imag - k.imag) / notable
        return np.concatenate([error.real, error.imag, attenuation])

    def slopes(logs: Real) -> Real:
        trial = fluid(logs)
        of_rho, of_c = trial.sensitivities(omega)
        k_fit, z_fit = wave(*trial.response(omega), omega)
        # k = ω√(ρC), z = √(ρ/C): half the relative change of ρ, plus or minus that of C.
        bend = [np.concatenate([of_rho, sign * of_c]) / 2 for sign in (1, -1)]
        change = np.concatenate([bend[0] * k_fit * FIT_PATH_M, bend[1] * z_fit / z], axis=1).T
        attenuation = FIT_ATTENUATION * ((bend[0] * k_fit).imag / notable).T
        return np.concatenate([change.real, change.imag, attenuation])

    fastest, slowest = np.log(0.2 / omega[-1]), np.log(1 / omega[0])
    times = np.linspace(np.log(1 / omega[-1]), slowest, poles + 2)[1:-1]
    start = np.concatenate([np.zeros(3), np.full(poles, np.log(0.1)), times])
    low = np.concatenate([start[: 3 + poles] - 5, np.full(poles, fastest)])
    high = np.concatenate([start[: 3 + poles] + 5, np.full(poles, slowest)])
    begin = np.clip(near, low, high) if near else start
    fitted = least_squares(misfit, begin, slopes, (low, high), xtol=1e-10, ftol=1e-10)
    return fluid(fitted.x), tuple(fitted.x.tolist())
