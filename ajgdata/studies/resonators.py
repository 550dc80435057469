"""Measured resonators: a rigid sphere, eight tubes and an impedance tube, and their theory.

`resonators.yaml` holds the few numbers that `tools/resonator_measurements.py` derives from
recordings of other groups. The recordings are not part of this package.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files

import numpy as np
import yaml
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import spherical_jn

from ajgdata.gripper.medium import Air
from ajgdata.types.base import Strict

Real = NDArray[np.floating]
TABLE = "resonators.yaml"
#: Resonances of the sphere are measured for the smallest root of the degrees 1 to HIGHEST_DEGREE.
HIGHEST_DEGREE = 6


class MeasuredValue(Strict):
    """A measured or fitted value and its standard uncertainty, in the unit of its key."""

    value: float
    uncertainty: float


class MeasurementSource(Strict):
    """Origin of the recordings: repository, commit, licence, and the files that were used."""

    repository: str
    commit: str
    licence: str
    files: str


class SphereMeasurement(Strict):
    """Resonances of a rigid sphere.

    `resonances_hz` are those of degree 1 to HIGHEST_DEGREE, minus the fitted lag of the sweep. The
    radius is fitted to the same resonances, so only their ratios are a test.
    """

    source: MeasurementSource
    temperature_c: float
    radius_mm: MeasuredValue
    lag_hz: MeasuredValue
    resonances_hz: tuple[MeasuredValue, ...]


class TubeMeasurement(Strict):
    """Fundamental frequency of a closed tube, from the peaks of several of its modes."""

    length_mm: float
    temperature_c: float
    modes: tuple[int, ...]
    fundamental_hz: MeasuredValue


class TubeSeries(Strict):
    """Tubes of several lengths, with one fitted lag of the sweep for all of them."""

    source: MeasurementSource
    lag_hz: MeasuredValue
    tubes: tuple[TubeMeasurement, ...]


class Attenuation(Strict):
    """Attenuation of a plane wave in a band around `frequency_hz`."""

    frequency_hz: float
    attenuation_np_m: MeasuredValue


class ImpedanceTube(Strict):
    """Attenuation in an empty square tube.

    The sound speed is fitted, and with it the temperature of dry air. `ratio` is the attenuation
    over the thermoviscous attenuation, one value for the complete band.
    """

    source: MeasurementSource
    width_mm: float
    sound_speed_m_s: MeasuredValue
    temperature_c: float
    ratio: MeasuredValue
    bands: tuple[Attenuation, ...]


class Resonators(Strict):
    """Measurements of all resonators."""

    sphere: SphereMeasurement
    tubes: TubeSeries
    impedance_tube: ImpedanceTube


@cache
def measured_resonators() -> Resonators:
    """Return the measurements of the package."""
    text = files("ajgdata.studies").joinpath(TABLE).read_text(encoding="utf-8")
    return Resonators.model_validate(yaml.safe_load(text))


def sphere_root(degree: int) -> float:
    """Return the smallest positive root x = k a of j_n'(x) = 0 for n = `degree` (at least 1).

    These are the resonances of a rigid sphere (Rayleigh, Theory of Sound, section 331).

    >>> [round(sphere_root(n), 3) for n in (1, 2, 3)]
    [2.082, 3.342, 4.514]
    """

    def slope(x: float) -> float:
        return float(spherical_jn(degree, x, derivative=True))

    # The slope is positive from 0 to the root, which is below degree + 2.
    return float(brentq(slope, 0.5 * degree, degree + 2.0))


def sphere_resonances_hz(radius_m: float, air: Air) -> Real:
    """Return the resonances (Hz), (HIGHEST_DEGREE,), of a rigid sphere: f = x c / (2π a)."""
    roots = np.array([sphere_root(degree) for degree in range(1, HIGHEST_DEGREE + 1)])
    return roots * air.sound_speed / (2 * np.pi * radius_m)


def tube_fundamental_hz(length_m: float, air: Air) -> float:
    """Return c / 2L (Hz) of a rigid tube with closed ends; closed ends have no end correction."""
    return air.sound_speed / (2 * length_m)


def thermoviscous_attenuation(frequency_hz: Real, width_m: float, air: Air) -> Real:
    """Return the attenuation (Np/m), (n,), of a plane wave in a smooth square tube.

    Kirchhoff's solution for tubes that are wide compared with the boundary layer:
    α = P/(2S) √(ων/2)/c (1 + (γ - 1)/√Pr), with perimeter P = 4 d and cross-section S = d²
    (Pierce, Acoustics, section 10-5).
    """
    kinematic = air.viscosity / air.density
    boundary = np.sqrt(2 * np.pi * frequency_hz * kinematic / 2) / air.sound_speed
    heat = 1 + (air.gamma - 1) / np.sqrt(air.prandtl)
    return np.asarray(2 / width_m * boundary * heat)
