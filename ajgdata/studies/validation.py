"""Validation: measured resonances of a sphere and of tubes, and attenuation in a tube.

The solver of the gripper simulates the resonators on the default grid and on a finer grid.
The difference between the grids is the uncertainty of a simulated value. Sound speeds differ
between measurement and simulation, so relative deviations from theory are transferred.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.special import eval_legendre, spherical_jn

from ajgdata.gripper.grid import Cells, cut_cells
from ajgdata.gripper.medium import Air, air_fluid
from ajgdata.gripper.objects import MM
from ajgdata.gripper.pressure_frames import ricker_wavelet
from ajgdata.gripper.scene import Numerics, Scene
from ajgdata.gripper.solver import Patches, Probe, at_rest, march
from ajgdata.gripper.solver_plan import wide_weight
from ajgdata.gripper.system import System, assemble
from ajgdata.gripper.walls import WallList
from ajgdata.studies.extreme_cases import AIR, time_step
from ajgdata.studies.resonators import (
    HIGHEST_DEGREE,
    ImpedanceTube,
    Resonators,
    SphereMeasurement,
    TubeMeasurement,
    TubeSeries,
    measured_resonators,
    sphere_resonances_hz,
    sphere_root,
    thermoviscous_attenuation,
    tube_fundamental_hz,
)
from ajgdata.studies.rigid_domains import ball, box, closed, resonances, upright_tube
from ajgdata.types.table import Table, table_of

Real = NDArray[np.floating]
#: Spacing (mm) of the second grid.
FINER_MM = 3.0
#: Spacing (mm) of the second grid in a quick run.
COARSER_MM = 6.0
#: A sphere has 58 resonances up to the sixth measured one, which is 13-fold; two are spare.
SPHERE_MODES = 60
#: Radius (m) of the simulated tubes. The source does not state it; the resonances along a rigid
#: tube do not depend on it below 8 kHz.
TUBE_RADIUS_M = 0.0125
#: Simulated length of the impedance tube (m), and heights of the two receivers.
LENGTH_M = 2.0
RECEIVERS_M = (0.3, 1.3)
#: End of the simulation (s). The echo of the far end reaches the upper receiver after 7.8 ms.
END_S = 7.5e-3
#: Frequency at which the spectrum of the pulse is largest.
PEAK_HZ = np.sqrt(2) * 700.0
#: `wall_admittance` of the gripper.
DEFAULT_ADMITTANCE = Scene().gripper.wall_admittance
#: Decibels per neper.
DECIBELS = 20 / np.log(10)
#: Frequency (Hz) at which `wall_admittance` is compared with the boundary layer of a diffuse field.
REFERENCE_HZ = 3_000.0


@dataclass(frozen=True)
class Simulated:
    """Values on the default grid and their uncertainties.

    Cut cells converge at first order. The uncertainty is therefore the difference from another
    grid, extrapolated at first order to a spacing of zero.
    """

    value: Real
    uncertainty: Real

    @classmethod
    def on_grids(cls, simulate: Callable[[float], Real], other_mm: float) -> Simulated:
        """Run `simulate(h)`, h in m, on the default grid and on a grid of `other_mm` (mm)."""
        default_mm = Numerics().dx_mm
        value = simulate(default_mm * MM)
        change = np.abs(value - simulate(other_mm * MM))
        return cls(value, change * default_mm / abs(default_mm - other_mm))


def tables(quick: bool = False) -> tuple[Table, ...]:
    """Return resonances, attenuation, admittances of the wall and fitted parameters.

    Takes half a minute on one core; `quick` compares the default grid with a coarser one.
    """
    measured = measured_resonators()
    other_mm = COARSER_MM if quick else FINER_MM
    bands = band_values(measured.impedance_tube, other_mm)
    return (
        _resonance_table(measured, other_mm),
        _attenuation_table(bands),
        _admittance_table(bands),
        _parameter_table(measured),
    )


# Resonances


def _resonance_table(measured: Resonators, other_mm: float) -> Table:
    note = (
        "Radius of the sphere and lag of the sweep are fitted to the same peaks, so only the ratios"
        " of the sphere's resonances are a test. Tubes: fundamental of several modes, theory c/2L."
        " The source states no end correction and none is applied. The measured tubes are lower"
        " than theory; the data do not separate ends, walls, lengths and the scale of the sweep."
        f" Simulated on the default grid of {Numerics().dx_mm:g} mm. The uncertainty is the"
        f" difference from a grid of {other_mm:g} mm, extrapolated at first order."
    )
    rows = (*_sphere_rows(measured.sphere, other_mm), *_tube_rows(measured.tubes, other_mm))
    return table_of(
        "resonances",
        "Resonances of a sphere and of tubes",
        rows,
        note,
        resonance="Resonance",
        theory_hz="Theory, Hz",
        measured_hz="Measured, Hz",
        measured_sd_hz="Measured ±, Hz",
        simulated_hz="Simulated, Hz",
        simulated_sd_hz="Simulated ±, Hz",
    )


def _sphere_rows(sphere: SphereMeasurement, other_mm: float) -> Iterator[dict[str, object]]:
    """Yield one row per degree."""
    radius = sphere.radius_mm.value * MM
    theory = sphere_resonances_hz(radius, Air(sphere.temperature_c))
    theory_simulated = sphere_resonances_hz(radius, AIR)
    ratio = Simulated.on_grids(lambda h: sphere_frequencies(radius, h) / theory_simulated, other_mm)
    for n, peak in enumerate(sphere.resonances_hz):
        yield {
            "resonance": f"sphere, degree {n + 1}",
            "theory_hz": theory[n],
            "measured_hz": peak.value,
            "measured_sd_hz": peak.uncertainty,
            "simulated_hz": theory[n] * ratio.value[n],
            "simulated_sd_hz": theory[n] * ratio.uncertainty[n],
        }


def sphere_frequencies(radius: float, h: float) -> Real:
    """Return the resonances (Hz), (HIGHEST_DEGREE,), of a sphere on a grid of spacing `h` (m).

    The grid splits a resonance of degree n, which is (2n + 1)-fold. Each value is the mean of the
    computed resonances, weighted by their share of the shape j_n(k r) P_n(cos θ).
    """
    cells, system = closed(ball(radius), h, radius + h, -radius - h, radius)
    hertz, shapes = resonances(system, SPHERE_MODES)
    values = []
    for degree in range(1, HIGHEST_DEGREE + 1):
        shape = _zonal(cells, system, degree, sphere_root(degree) / radius)
        weight = (shape @ shapes) ** 2
        values.append(weight @ hertz / weight.sum())
    return np.array(values)


def _zonal(cells: Cells, system: System, degree: int, wavenumber: float) -> Real:
    """Return the rotationally symmetric shape of a resonance, (open cells,), of unit norm."""
    z, y, x = np.meshgrid(cells.z, cells.y, cells.x, indexing="ij")
    distance = np.maximum(np.sqrt(x**2 + y**2 + z**2), 1e-9)
    pressure = spherical_jn(degree, wavenumber * distance) * eval_legendre(degree, z / distance)
    live = np.flatnonzero(system.mass)
    shape = pressure.ravel()[live] * np.sqrt(system.mass.ravel()[live])
    return shape / np.linalg.norm(shape)


def _tube_rows(series: TubeSeries, other_mm: float) -> Iterator[dict[str, object]]:
    """Yield one row per tube."""
    for tube in series.tubes:
        theory = tube_fundamental_hz(tube.length_mm * MM, Air(tube.temperature_c))
        ratio = Simulated.on_grids(partial(fundamental_ratio, tube), other_mm)
        yield {
            "resonance": f"tube of {tube.length_mm:g} mm",
            "theory_hz": theory,
            "measured_hz": tube.fundamental_hz.value,
            "measured_sd_hz": tube.fundamental_hz.uncertainty,
            "simulated_hz": theory * float(ratio.value),
            "simulated_sd_hz": theory * float(ratio.uncertainty),
        }


def fundamental_ratio(tube: TubeMeasurement, h: float) -> Real:
    """Return the simulated fundamental over c/2L, from the measured modes."""
    length = tube.length_mm * MM
    orders = np.array(tube.modes)
    hertz = tube_frequencies(length, max(tube.modes), h)[orders - 1]
    # Least-squares slope of frequency over order, through the origin, as in the measurement.
    fundamental = orders @ hertz / (orders @ orders)
    return np.asarray(fundamental / tube_fundamental_hz(length, AIR))


def tube_frequencies(length: float, count: int, h: float) -> Real:
    """Return the lowest resonances (Hz), (count,), of a tube with closed ends, below 8 kHz."""
    _, system = closed(upright_tube(TUBE_RADIUS_M, length), h, TUBE_RADIUS_M + h, 0.0, length)
    hertz, _ = resonances(system, count)
    return hertz


# Attenuation


@dataclass(frozen=True)
class BandValues:
    """Attenuation (Np/m) and admittance of the walls in each band, (bands,).

    `theory` is the thermoviscous attenuation. `required` and `smooth` are the `wall_admittance`
    that give the measured and the thermoviscous attenuation in the simulated tube.
    """

    frequency_hz: Real
    theory: Real
    measured: Real
    measured_sd: Real
    simulated: Simulated

    @property
    def required(self) -> Real:
        """Return the required admittance; attenuation is proportional to a small admittance."""
        return DEFAULT_ADMITTANCE * self.measured / self.simulated.value

    @property
    def required_sd(self) -> Real:
        """Return the standard uncertainty from measurement and grid."""
        relative = np.hypot(
            self.measured_sd / self.measured, self.simulated.uncertainty / self.simulated.value
        )
        return self.required * relative

    @property
    def smooth(self) -> Real:
        """Return the admittance of smooth walls for a wave along the tube."""
        return DEFAULT_ADMITTANCE * self.theory / self.simulated.value


def band_values(tube: ImpedanceTube, other_mm: float) -> BandValues:
    """Simulate the tube with the default `wall_admittance`, and collect all values per band."""
    frequency_hz = np.array([band.frequency_hz for band in tube.bands])
    width = tube.width_mm * MM
    simulated = Simulated.on_grids(
        lambda h: simulated_attenuation(frequency_hz, width, DEFAULT_ADMITTANCE, h), other_mm
    )
    return BandValues(
        frequency_hz,
        thermoviscous_attenuation(frequency_hz, width, Air(tube.temperature_c)),
        np.array([band.attenuation_np_m.value for band in tube.bands]),
        np.array([band.attenuation_np_m.uncertainty for band in tube.bands]),
        simulated,
    )


def simulated_attenuation(frequency_hz: Real, width: float, admittance: float, h: float) -> Real:
    """Return the attenuation (Np/m), (n,), of a plane wave in a square tube of `width` (m).

    The walls are those of the housing, which only have a resistance, with ρc/z = `admittance`. A
    pulse starts at the lower end; the attenuation follows from its spectra at two heights.
    """
    cells = cut_cells(box(width, width, LENGTH_M), h, width / 2 + h, 0.0, LENGTH_M)
    resistance = AIR.density * AIR.sound_speed / admittance
    # The ends are rigid, so that the pulse starts as a plane wave.
    sides = cells.housing.copy()
    layers = np.flatnonzero(cells.volume.any(axis=(1, 2)))
    sides[layers[[0, -1]]] = 0.0
    walls = WallList.uniform(sides, 0.0, resistance, 0.0)
    weight = wide_weight(h)
    system = assemble(cells, air_fluid(AIR), time_step(h, weight), walls=walls, wide=weight)
    slabs = [layers[0], *(int(np.argmin(np.abs(cells.z - z))) for z in RECEIVERS_M)]
    source, lower, upper = (_slab_probe(cells, system, slab) for slab in slabs)
    steps = int(END_S / system.dt)
    patches = Patches(lower.cell, np.zeros(len(lower.cell), np.int64), lower.weight)
    felt = np.zeros((1, steps))
    # The pulse has no net volume, which would leak slowly through lossy walls.
    drive = ricker_wavelet(system.dt, PEAK_HZ)
    out = march(system, at_rest(system), source, upper, drive, steps, patches, felt)
    omega = 2 / system.dt * np.arcsin(np.pi * frequency_hz * system.dt)
    kernel = np.exp(-1j * omega[:, None] * np.arange(steps) * system.dt)
    distance = cells.z[slabs[2]] - cells.z[slabs[1]]
    return np.log(np.abs(kernel @ felt[0]) / np.abs(kernel @ out)) / distance


def _slab_probe(cells: Cells, system: System, slab: int) -> Probe:
    """Return a probe of the mean over the open cells of one layer, weighted by volume."""
    volume = (cells.volume * (system.mass > 0))[slab].ravel()
    inside = np.flatnonzero(volume)
    first = slab * volume.size
    return Probe((first + inside).astype(np.uint64), volume[inside] / volume.sum())


def lossy_tube_attenuation(frequency_hz: Real, width: float, admittance: float, air: Air) -> Real:
    """Return the analytic attenuation (Np/m), (n,), in a square tube with locally reacting walls.

    p = cos(q x) cos(q y) exp(-i κ z) with κ² = k² - 2 q² and, at the walls x = ± d/2,
    q tan(q d/2) = i k β (Morse & Ingard, Theoretical Acoustics, section 9.2). Solved by iteration
    for the small square (q d/2)².
    """
    wavenumber = 2 * np.pi * frequency_hz / air.sound_speed
    half = width / 2
    load = 1j * wavenumber * half * admittance
    square = load
    for _ in range(20):
        root = np.sqrt(square)
        square = load * root / np.tan(root)
    along = np.sqrt(wavenumber**2 - 2 * square / half**2)
    return np.abs(along.imag)


def diffuse_admittance(frequency_hz: float, air: Air) -> float:
    """Return the admittance of the thermoviscous boundary layer on a wall in a diffuse field.

    √(ων/2)/c (sin²θ + (γ - 1)/√Pr), with the mean 2/3 of sin²θ (Pierce, Acoustics, section 10-4).
    """
    kinematic = air.viscosity / air.density
    boundary = np.sqrt(2 * np.pi * frequency_hz * kinematic / 2) / air.sound_speed
    return float(boundary * (2 / 3 + (air.gamma - 1) / np.sqrt(air.prandtl)))


def _attenuation_table(bands: BandValues) -> Table:
    note = (
        "Plane waves in an empty square tube of 100 mm. Theory: thermoviscous boundary layer"
        f" (Kirchhoff). Simulated: walls with the default wall_admittance, {DEFAULT_ADMITTANCE:g}"
        " at all frequencies. Neighbouring measured bands scatter by more than some of their"
        " uncertainties."
    )
    keys = ("theory", "measured", "measured_sd")
    levels = {f"{key}_db_m": DECIBELS * getattr(bands, key) for key in keys}
    levels["simulated_db_m"] = DECIBELS * bands.simulated.value
    levels["simulated_sd_db_m"] = DECIBELS * bands.simulated.uncertainty
    return table_of(
        "attenuation",
        "Attenuation in a tube",
        _rows({"frequency_hz": bands.frequency_hz, **levels}),
        note,
        frequency_hz="Frequency, Hz",
        theory_db_m="Theory, dB/m",
        measured_db_m="Measured, dB/m",
        measured_sd_db_m="Measured ±, dB/m",
        simulated_db_m="Simulated, dB/m",
        simulated_sd_db_m="Simulated ±, dB/m",
    )


def _admittance_table(bands: BandValues) -> Table:
    boundary_layer = diffuse_admittance(REFERENCE_HZ, AIR)
    note = (
        "Required: wall_admittance that gives the measured attenuation in the simulated tube."
        f" The default is {DEFAULT_ADMITTANCE:g}, which is"
        f" {DEFAULT_ADMITTANCE / boundary_layer:.2g} times the boundary layer at 3 kHz in a diffuse"
        f" field ({boundary_layer:.2g}). Its range is 1 to 10 times that value."
    )
    values = {
        "frequency_hz": bands.frequency_hz,
        "smooth": bands.smooth,
        "required": bands.required,
        "required_sd": bands.required_sd,
        "ratio": bands.measured / bands.theory,
        "default_ratio": DEFAULT_ADMITTANCE / bands.required,
    }
    return table_of(
        "admittance",
        "Admittance of the wall",
        _rows(values),
        note,
        frequency_hz="Frequency, Hz",
        smooth="Thermoviscous",
        required="Required",
        required_sd="Required ±",
        ratio="Measured over thermoviscous",
        default_ratio="Default over required",
    )


def _rows(values: dict[str, Real]) -> list[dict[str, object]]:
    """Return one row per band from columns (bands,)."""
    return [dict(zip(values, row, strict=True)) for row in zip(*values.values(), strict=True)]


def _parameter_table(measured: Resonators) -> Table:
    tube = measured.impedance_tube
    fitted = {
        "radius of the sphere, mm": measured.sphere.radius_mm,
        "lag of the sweep, sphere, Hz": measured.sphere.lag_hz,
        "lag of the sweep, tubes, Hz": measured.tubes.lag_hz,
        "sound speed in the impedance tube, m/s": tube.sound_speed_m_s,
        "attenuation over thermoviscous, 150 to 1650 Hz": tube.ratio,
    }
    rows = [
        {"parameter": name, "value": quantity.value, "sd": quantity.uncertainty}
        for name, quantity in fitted.items()
    ]
    sources = (measured.sphere.source, tube.source)
    origins = " and ".join(f"{source.repository} ({source.licence})" for source in sources)
    note = (
        f"Recordings: {origins}. An undamped resonance peaks 130 Hz late at the speed of the sweep;"
        " the detector adds a delay."
    )
    return table_of(
        "parameters", "Fitted parameters", rows, note, parameter="Parameter", value="Value", sd="±"
    )
