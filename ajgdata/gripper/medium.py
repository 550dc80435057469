"""Air, and the bed of grains as an equivalent fluid for a solver in the time domain.

The time convention is e^{+iωt}. The Johnson-Champoux-Allard (JCA) fluid is not local in time, so
the solver uses a fit of it: ρ(ω) = ρ∞ + σ'/(iω), C(ω) = C∞ (1 + Σ cj / (1 + iωτj)).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

#: Band of the fit.
FIT_BAND_HZ = (80.0, 15_000.0)
#: Path of the phase and attenuation in the fit: twice the depth of the deepest possible bed.
FIT_PATH_M = 0.1
#: Weight of the relative error of the attenuation: the smallest of .1, .2, .3, … with an error of
#: up to 10 % from 300 Hz to 1 kHz in each medium. No accuracy of a model influenced this choice.
FIT_ATTENUATION = 0.4
#: Attenuation (1/m) that is 0.1 dB on the way through a bed and back. The absolute error of smaller
#: attenuations is fitted, so that grains whose porosity approaches 1 become air.
FAINT_ATTENUATION = 0.2
Complex = NDArray[np.complexfloating]
Real = NDArray[np.floating]


@dataclass(frozen=True)
class Air:
    """Dry air as an ideal gas."""

    temperature_c: float = 20.0
    pressure_pa: float = 101_325.0
    gamma: float = 1.4
    prandtl: float = 0.71

    @property
    def density(self) -> float:
        """ρ = P / (R T), kg/m³."""
        return self.pressure_pa / (287.05 * (self.temperature_c + 273.15))

    @property
    def sound_speed(self) -> float:
        """c = √(γ R T), m/s."""
        return float(np.sqrt(self.gamma * 287.05 * (self.temperature_c + 273.15)))

    @property
    def viscosity(self) -> float:
        """η by Sutherland's law, Pa s."""
        kelvin = self.temperature_c + 273.15
        return 1.716e-5 * (kelvin / 273.15) ** 1.5 * (273.15 + 110.4) / (kelvin + 110.4)

    @property
    def compressibility(self) -> float:
        """Adiabatic compressibility 1/(γ P), 1/Pa."""
        return 1.0 / (self.gamma * self.pressure_pa)


@dataclass(frozen=True)
class Packing:
    """A random packing of spheres: diameter (m) and porosity."""

    diameter: float
    porosity: float

    def jca(self, omega: Real, air: Air) -> tuple[Complex, Complex]:
        """Return equivalent density (kg/m³) and compressibility (1/Pa) for the mean flow.

        Both have the shape of `omega` (rad/s). The equations are those of Johnson et al. (1987) and
        Champoux & Allard (1991) in the form of Allard & Atalla (2009). The parameters of the
        packing are those of Kozeny-Carman and Bruggeman (tortuosity φ^-1/2).
        """
        phi = self.porosity
        eta = air.viscosity
        rho0 = air.density
        permeability = phi**3 * self.diameter**2 / (180 * (1 - phi) ** 2)
        tortuosity = phi**-0.5
        thermal_length = phi * self.diameter / (3 * (1 - phi))
        viscous_length = np.sqrt(8 * permeability * tortuosity / phi)
        sigma = eta / permeability
        iw = 1j * omega
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
    """The fluid of the solver: ρ(ω) = ρ∞ + σ'/(iω), C(ω) = C∞ (1 + Σ cj / (1 + iωτj)).

    `density` ρ∞ is in kg/m³, `drag` σ' in Pa s/m², `compressibility` C∞ in 1/Pa. The relaxation
    poles have the strengths cj and the times τj (s).
    """

    density: float
    drag: float
    compressibility: float
    strengths: tuple[float, ...] = ()
    times: tuple[float, ...] = ()

    def response(self, omega: Real) -> tuple[Complex, Complex]:
        """Return density (kg/m³) and compressibility (1/Pa), of the shape of `omega` (rad/s)."""
        iw = 1j * omega
        relaxed = 1 + sum(
            (c / (1 + iw * t) for c, t in zip(self.strengths, self.times, strict=True)),
            start=np.zeros_like(iw),
        )
        return self.density + self.drag / iw, np.asarray(self.compressibility * relaxed)

    def sensitivities(self, omega: Real) -> tuple[Complex, Complex]:
        """Return the relative changes of density and compressibility per logarithm of a parameter.

        That of the density is (2, n), per log ρ∞ and log σ'. That of the compressibility is
        (1 + 2 poles, n), per log C∞, each log cj and each log τj. `omega` (n,) is in rad/s.
        """
        rho, compressibility = self.response(omega)
        delay = 1j * omega * np.array(self.times)[:, None]
        part = np.array(self.strengths)[:, None] / (1 + delay)
        share = self.compressibility / compressibility
        density = np.stack([self.density / rho, self.drag / (1j * omega * rho)])
        unity = np.ones((1, len(omega)))
        return density, np.concatenate([unity, part * share, -part * delay / (1 + delay) * share])


def air_fluid(air: Air) -> Fluid:
    """Return free air as a fluid of the solver: drag and relaxation are negligible."""
    return Fluid(air.density, 0.0, air.compressibility)


def wave(rho: Complex, compressibility: Complex, omega: Real) -> tuple[Complex, Complex]:
    """Return wavenumber (1/m) and characteristic impedance (Pa s/m) of an equivalent fluid.

    Density `rho` (kg/m³), `compressibility` (1/Pa) and `omega` (rad/s) have the shape of the
    results.
    """
    return np.asarray(omega * np.sqrt(rho * compressibility)), np.sqrt(rho / compressibility)


def fit_fluid(packing: Packing, air: Air, poles: int = 2) -> Fluid:
    """Return a fluid with `poles` relaxations, fitted to the JCA wavenumber and impedance.

    The fit minimises squared errors over 80 Hz-15 kHz, with equal weights per octave. The error of
    the impedance is relative. The error of the wavenumber is a phase and an attenuation on a path
    of FIT_PATH_M, because waves that cross the bed and return have this absolute error. Below
    1 kHz, the absolute error is small even if the attenuation is too low by a third. Therefore the
    relative error of the attenuation is also fitted, with the weight FIT_ATTENUATION.

    The fit finds logarithms, so all parameters are positive and the fluid is passive. The
    relaxation times are limited to the band, so that no pole becomes a second drag. The fit starts
    from the fit in air of 20 °C.
    """
    start = () if air == Air() else _fitted(packing, Air(), poles)[1]
    return _fitted(packing, air, poles, start)[0]


@lru_cache(maxsize=64)
def _fitted(
    packing: Packing, air: Air, poles: int, start: tuple[float, ...] = ()
) -> tuple[Fluid, tuple[float, ...]]:
    """Return the fluid and the logarithms of its parameters.

    The fit starts from the logarithms `start`, or from a guess if there are none.
    """
    omega = 2 * np.pi * np.geomspace(*FIT_BAND_HZ, 80)
    rho, compressibility = packing.jca(omega, air)
    k, z = wave(rho, compressibility, omega)
    notable = k.imag - FAINT_ATTENUATION  # the imaginary part of k is negative
    scale = np.array([rho.real[-1], -(omega * rho.imag)[0], compressibility.real[-1]])

    def fluid(logs: Real) -> Fluid:
        """Return the fluid whose parameters have these logarithms (3 + 2 poles,)."""
        values = np.exp(logs)
        density, drag, compressibility = (values[:3] * scale).tolist()
        strengths = tuple(values[3 : 3 + poles].tolist())
        times = tuple(values[3 + poles :].tolist())
        return Fluid(density, drag, compressibility, strengths, times)

    def misfit(logs: Real) -> Real:
        """Return the weighted errors of wavenumber, impedance and attenuation."""
        k_fit, z_fit = wave(*fluid(logs).response(omega), omega)
        error = np.concatenate([(k_fit - k) * FIT_PATH_M, z_fit / z - 1])
        attenuation = FIT_ATTENUATION * (k_fit.imag - k.imag) / notable
        return np.concatenate([error.real, error.imag, attenuation])

    def slopes(logs: Real) -> Real:
        """Return the derivatives of the errors by the logarithms."""
        trial = fluid(logs)
        of_rho, of_c = trial.sensitivities(omega)
        k_fit, z_fit = wave(*trial.response(omega), omega)
        # k = ω√(ρC) and z = √(ρ/C): half the relative change of ρ, plus or minus that of C.
        of_k = np.concatenate([of_rho, of_c]) / 2
        of_z = np.concatenate([of_rho, -of_c]) / 2
        change = np.concatenate([of_k * k_fit * FIT_PATH_M, of_z * z_fit / z], axis=1).T
        attenuation = FIT_ATTENUATION * ((of_k * k_fit).imag / notable).T
        return np.concatenate([change.real, change.imag, attenuation])

    fastest = np.log(0.2 / omega[-1])
    slowest = np.log(1 / omega[0])
    times = np.linspace(np.log(1 / omega[-1]), slowest, poles + 2)[1:-1]
    guess = np.concatenate([np.zeros(3), np.full(poles, np.log(0.1)), times])
    low = np.concatenate([guess[: 3 + poles] - 5, np.full(poles, fastest)])
    high = np.concatenate([guess[: 3 + poles] + 5, np.full(poles, slowest)])
    first = np.clip(start, low, high) if start else guess
    fitted = least_squares(misfit, first, slopes, (low, high), xtol=1e-10, ftol=1e-10)
    return fluid(fitted.x), tuple(fitted.x.tolist())
