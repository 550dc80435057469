"""Derive `ajgdata/studies/resonators.yaml` from recordings of resonators.

Run `python tools/resonator_measurements.py FOLDER`. FOLDER contains `tube_sphere_resonator` (files
of github.com/Parkerwise/QuantumAnalog) and `impedance_tube` (of github.com/tjueterb/impedancetube).

Sphere and tubes: a linear sweep excites the resonator, and the oscilloscope shows the detected
amplitude. A peak appears later than its resonance, because the sweep is fast: an undamped resonance
peaks 1.217 / √(2 · rate) seconds late (the first maximum of a Fresnel integral), here 130 Hz, and
the detector adds a delay. The lag is therefore fitted.

Impedance tube: noise propagates along six microphones. At each frequency, a wave in each direction
is fitted to the six complex amplitudes. Gains of the microphones are smooth functions of frequency;
five recordings with exchanged microphones separate them from the attenuation.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np
import yaml
from numpy.typing import NDArray
from scipy.optimize import least_squares

import ajgdata.studies
from ajgdata.gripper.medium import Air
from ajgdata.store.files import write_bytes
from ajgdata.studies.resonators import (
    TABLE,
    Attenuation,
    ImpedanceTube,
    MeasuredValue,
    MeasurementSource,
    Resonators,
    SphereMeasurement,
    TubeMeasurement,
    TubeSeries,
    sphere_resonances_hz,
    thermoviscous_attenuation,
    tube_fundamental_hz,
)

Real = NDArray[np.floating]
Complex = NDArray[np.complexfloating]

# Sweeps

#: From 800 Hz to 10 kHz in 400 ms (journal.md of the source).
START_HZ = 800.0
RATE_HZ_S = 9_200.0 / 0.4
#: Lag of an undamped resonance: see the docstring of this file.
UNDAMPED_LAG_HZ = 1.217 / np.sqrt(2 * RATE_HZ_S) * RATE_HZ_S
#: A peak is searched this far from where theory and the undamped lag place it.
SEARCH_HZ = 80.0
#: A parabola through this range around the highest sample gives the peak.
PARABOLA_HZ = 40.0
#: The sweep starts with a transient, and above the second limit the peaks of neighbouring modes of
#: the longest tubes are not distinct.
TUBE_BAND_HZ = (1_400.0, 5_000.0)
#: Radius (m) that the search starts with; the fitted radius replaces it.
SPHERE_GUESS_M = 0.050
#: Recordings in which speaker and microphone are nearly opposite, at 160°, 170° and 180°: there all
#: six peaks are high. Temperatures in °F (journal.md).
SPHERE_FILES = {25: 71.8, 26: 72.0, 27: 72.0}
#: Recording, length (mm) and temperature (°F) of each tube (journal.md).
TUBE_FILES = {
    1: (600.0, 74.5),
    2: (525.0, 75.0),
    3: (450.0, 75.0),
    4: (375.0, 75.0),
    5: (300.0, 75.0),
    6: (225.0, 75.2),
    7: (150.0, 75.2),
    8: (75.0, 75.4),
}
SWEEP_SOURCE = {
    "repository": "https://github.com/Parkerwise/QuantumAnalog",
    "commit": "755f0d6a519cc5e48a6c4a3a6ee85e9e9871158b",
    "licence": "none stated",
}


class Sweep(NamedTuple):
    """Detected amplitude (n,) over the frequency of the sweep (n,), Hz, with its lag."""

    frequency_hz: Real
    amplitude: Real


def celsius(fahrenheit: float) -> float:
    """Return a temperature in °C."""
    return (fahrenheit - 32) / 1.8


def read_sweep(folder: Path, index: int) -> Sweep:
    """Read the file with this number; its fourth and fifth columns are time (s) and amplitude."""
    lines = (folder / f"TEK{index:04d}.CSV").read_text(encoding="latin-1").splitlines()
    cells = [line.split(",") for line in lines]
    time_s = np.array([float(row[3]) for row in cells])
    amplitude = np.array([float(row[4]) for row in cells])
    return Sweep(START_HZ + RATE_HZ_S * time_s, amplitude)


def peak_hz(sweep: Sweep, expected_hz: float) -> float:
    """Return the frequency of the peak near `expected_hz`, with its lag; NaN without a peak."""
    smooth = np.convolve(sweep.amplitude, np.full(5, 0.2), "same")
    window = np.flatnonzero(np.abs(sweep.frequency_hz - expected_hz) < SEARCH_HZ)
    top = window[smooth[window].argmax()]
    if top in (window[0], window[-1]):
        return float("nan")
    offset = sweep.frequency_hz - sweep.frequency_hz[top]
    near = np.abs(offset) < PARABOLA_HZ
    curvature, slope, _ = np.polyfit(offset[near], sweep.amplitude[near], 2)
    return float(sweep.frequency_hz[top] - slope / (2 * curvature))


def fitted(matrix: Real, values: Real) -> tuple[Real, Real, float]:
    """Return least-squares parameters, their standard uncertainties and the rms residual.

    `matrix` (n, parameters), `values` (n,); the residual allows for the number of parameters.
    """
    params, *_ = np.linalg.lstsq(matrix, values, rcond=None)
    residual = values - matrix @ params
    rms = float(np.sqrt(residual @ residual / (len(values) - len(params))))
    sd = rms * np.sqrt(np.diag(np.linalg.inv(matrix.T @ matrix)))
    return params, sd, rms


def quantity(value: float, uncertainty: float, decimals: int) -> MeasuredValue:
    """Return a rounded quantity."""
    return MeasuredValue(
        value=round(float(value), decimals), uncertainty=round(float(uncertainty), decimals)
    )


def sphere(folder: Path) -> SphereMeasurement:
    """Fit radius and lag to the six peaks, averaged over the recordings."""
    temperature_c = float(np.mean([celsius(value) for value in SPHERE_FILES.values()]))
    air = Air(temperature_c)
    expected = sphere_resonances_hz(SPHERE_GUESS_M, air)
    sweeps = [read_sweep(folder, index) for index in SPHERE_FILES]
    peaks = np.array([[peak_hz(sweep, f + UNDAMPED_LAG_HZ) for f in expected] for sweep in sweeps])
    mean = peaks.mean(axis=0)
    per_radius = sphere_resonances_hz(1.0, air)
    matrix = np.stack([per_radius, np.ones(len(mean))], axis=1)
    (inverse_radius, lag), (inverse_sd, lag_sd), rms = fitted(matrix, mean)
    radius_mm = 1e3 / inverse_radius
    return SphereMeasurement(
        source=MeasurementSource(**SWEEP_SOURCE, files="TEK0025.CSV to TEK0027.CSV"),
        temperature_c=round(temperature_c, 2),
        radius_mm=quantity(radius_mm, radius_mm * inverse_sd / inverse_radius, 2),
        lag_hz=quantity(lag, lag_sd, 1),
        resonances_hz=tuple(quantity(value - lag, rms, 1) for value in mean),
    )


def tubes(folder: Path) -> TubeSeries:
    """Fit one lag for all tubes, and a fundamental per tube, to the peaks n f + lag."""
    airs = [Air(celsius(fahrenheit)) for _, fahrenheit in TUBE_FILES.values()]
    peaks = []
    for tube, ((index, (length_mm, _)), air) in enumerate(
        zip(TUBE_FILES.items(), airs, strict=True)
    ):
        sweep = read_sweep(folder, index)
        fundamental = tube_fundamental_hz(length_mm / 1e3, air)
        for mode in range(1, int(TUBE_BAND_HZ[1] / fundamental) + 1):
            expected = mode * fundamental + UNDAMPED_LAG_HZ
            if TUBE_BAND_HZ[0] < expected < TUBE_BAND_HZ[1]:
                peaks.append((tube, mode, peak_hz(sweep, expected)))
    peaks = [peak for peak in peaks if np.isfinite(peak[2])]
    matrix = np.zeros((len(peaks), len(TUBE_FILES) + 1))
    for row, (tube, mode, _) in enumerate(peaks):
        matrix[row, tube] = mode
    matrix[:, -1] = 1.0
    params, sd, _ = fitted(matrix, np.array([peak[2] for peak in peaks]))
    measurements = tuple(
        TubeMeasurement(
            length_mm=length_mm,
            temperature_c=round(celsius(fahrenheit), 2),
            modes=tuple(mode for own, mode, _ in peaks if own == tube),
            fundamental_hz=quantity(params[tube], sd[tube], 2),
        )
        for tube, (length_mm, fahrenheit) in enumerate(TUBE_FILES.values())
    )
    return TubeSeries(
        source=MeasurementSource(**SWEEP_SOURCE, files="TEK0001.CSV to TEK0008.CSV"),
        lag_hz=quantity(params[-1], sd[-1], 1),
        tubes=measurements,
    )


# Impedance tube

#: Distances (m) of the microphones from the beginning of the test section (examples of the source).
MICROPHONES_M = np.array([-0.8, -0.385, -0.3, 0.8, 0.885, 1.3])
WIDTH_M = 0.1
BAND_HZ = (150.0, 1_650.0)
BANDS = 10
#: Order of the polynomials of frequency that are logarithm and phase of a microphone's gain.
GAIN_ORDER = 6
#: The first recording is the direct one; in the n-th of the others, microphones 0 and n are
#: exchanged.
TUBE_RECORDINGS = (
    "empty_00_11_22_33_44_55.h5",
    "empty_01_10_22_33_44_55.h5",
    "empty_02_11_20_33_44_55.h5",
    "empty_03_11_22_30_44_55.h5",
    "empty_04_11_22_33_40_55.h5",
    "empty_05_11_22_33_44_50.h5",
)
TUBE_SOURCE = {
    "repository": "https://github.com/tjueterb/impedancetube",
    "commit": "959934c37c57098f6567051376832213b5104e5f",
    "licence": "BSD-3-Clause, Copyright 2022 Tobias Jüterbock",
}


class Spectra(NamedTuple):
    """Complex amplitudes (recordings, frequencies, channels), unit norm over the channels."""

    frequency_hz: Real
    amplitude: Complex


class TubeFit(NamedTuple):
    """Ratio to the thermoviscous attenuation per band (bands,) and sound speed (m/s), with standard
    uncertainties."""

    ratio: Real
    ratio_sd: Real
    sound_speed: float
    sound_speed_sd: float


def read_tube(folder: Path) -> Spectra:
    """Return the spectra of complete recordings of 1 s.

    Shorter windows would bias the attenuation, because a window does not travel with the sound.
    """
    amplitudes = []
    for name in TUBE_RECORDINGS:
        with h5py.File(folder / "Resources" / name) as file:
            data = file["time_data"]
            rate_hz = float(data.attrs["sample_freq"])
            samples = np.asarray(data, float)
        window = np.hanning(len(samples))
        amplitudes.append(np.fft.rfft(samples * window[:, None], axis=0))
    frequency_hz = np.fft.rfftfreq(len(samples), 1 / rate_hz)
    in_band = (frequency_hz >= BAND_HZ[0]) & (frequency_hz < BAND_HZ[1])
    amplitude = np.array(amplitudes)[:, in_band]
    amplitude /= np.linalg.norm(amplitude, axis=2, keepdims=True)
    return Spectra(frequency_hz[in_band], amplitude)


def fit_tube(spectra: Spectra, bands: int, *, fit_positions: bool = False) -> TubeFit:
    """Fit ratio per band, sound speed and gains; with `fit_positions` also four positions.

    Minimised is the part of the amplitudes (channels,) outside the two-dimensional space of a wave
    in each direction. The boundary layer slows a wave by as much as it damps it:
    k = ω/c + (1 - i) α.
    """
    frequency_hz, amplitude = spectra
    low, high = BAND_HZ
    band = np.minimum((bands * (frequency_hz - low) / (high - low)).astype(int), bands - 1)
    basis = np.polynomial.chebyshev.chebvander(
        2 * (frequency_hz - low) / (high - low) - 1, GAIN_ORDER
    )
    gains = 2 * (len(MICROPHONES_M) - 1) * basis.shape[1]

    def residual(params: Real) -> Real:
        ratio = params[:bands]
        air = air_of_speed(100 * params[bands])
        alpha = ratio[band] * thermoviscous_attenuation(frequency_hz, WIDTH_M, air)
        wavenumber = 2 * np.pi * frequency_hz / air.sound_speed + (1 - 1j) * alpha
        series = params[bands + 1 : bands + 1 + gains].reshape(2, -1, basis.shape[1]) @ basis.T
        gain = np.exp(np.vstack([np.zeros(len(band)), series[0] + 1j * series[1]])).T
        position = MICROPHONES_M.copy()
        if fit_positions:
            position[1:5] += params[-4:]
        return outside(amplitude, gain, wavenumber, position - MICROPHONES_M.mean())

    shifts = 4 if fit_positions else 0
    start = np.concatenate([np.ones(bands), [3.45], np.zeros(gains + shifts)])
    result = least_squares(residual, start, method="lm")
    variance = 2 * result.cost / (len(result.fun) / 2)
    sd = np.sqrt(variance * np.diag(np.linalg.inv(result.jac.T @ result.jac)))
    speed = 100 * result.x[bands]
    speed_sd = 100 * sd[bands]
    return TubeFit(result.x[:bands], sd[:bands], float(speed), float(speed_sd))


def outside(amplitude: Complex, gain: Complex, wavenumber: Complex, position: Real) -> Real:
    """Return real and imaginary part of the amplitudes that two waves do not explain."""
    remainders = []
    for recording, values in enumerate(amplitude):
        place = position.copy()
        place[[0, recording]] = place[[recording, 0]]
        phase = wavenumber[:, None] * place
        waves = gain[:, :, None] * np.stack([np.exp(-1j * phase), np.exp(1j * phase)], axis=-1)
        basis, _ = np.linalg.qr(waves)
        parts = np.einsum("fck,fc->fk", basis.conj(), values)
        remainders.append(values - np.einsum("fck,fk->fc", basis, parts))
    flat = np.array(remainders).ravel()
    return np.concatenate([flat.real, flat.imag])


def air_of_speed(sound_speed: float) -> Air:
    """Return dry air with this sound speed (m/s)."""
    cold = Air(0.0)
    kelvin = 273.15 * (sound_speed / cold.sound_speed) ** 2
    return Air(kelvin - 273.15)


def combined(fit: TubeFit, variants: Sequence[TubeFit]) -> Real:
    """Return the uncertainty of the ratios (bands,): that of the fit, and the changes by variants
    of the analysis, as the root of the sum of squares."""
    changes = [variant.ratio - fit.ratio for variant in variants]
    return np.sqrt(fit.ratio_sd**2 + sum(change**2 for change in changes))


def impedance_tube(folder: Path) -> ImpedanceTube:
    """Fit the attenuation per band, and one ratio for the complete band."""
    spectra = read_tube(folder)
    per_band = fit_tube(spectra, BANDS)
    complete = fit_tube(spectra, 1)
    band_sd = combined(per_band, [fit_tube(spectra, BANDS, fit_positions=True)])
    moved = fit_tube(spectra, 1, fit_positions=True)
    (fit_sd,) = combined(complete, [moved])
    speed_sd = np.hypot(complete.sound_speed_sd, moved.sound_speed - complete.sound_speed)
    # The bands scatter more than the fit expects: one ratio does not describe all of them.
    scatter = per_band.ratio.std(ddof=1) / np.sqrt(BANDS)
    ratio_sd = np.hypot(fit_sd, scatter)
    air = air_of_speed(complete.sound_speed)
    edges = np.linspace(*BAND_HZ, BANDS + 1)
    centres = (edges[:-1] + edges[1:]) / 2
    smooth = thermoviscous_attenuation(centres, WIDTH_M, air)
    values = zip(centres, per_band.ratio * smooth, band_sd * smooth, strict=True)
    return ImpedanceTube(
        source=MeasurementSource(**TUBE_SOURCE, files="Resources/empty_*.h5"),
        width_mm=1e3 * WIDTH_M,
        sound_speed_m_s=quantity(complete.sound_speed, speed_sd, 1),
        temperature_c=round(air.temperature_c, 1),
        ratio=quantity(complete.ratio[0], ratio_sd, 2),
        bands=tuple(
            Attenuation(frequency_hz=float(hz), attenuation_np_m=quantity(value, sd, 5))
            for hz, value, sd in values
        ),
    )


def measurements(folder: Path) -> Resonators:
    """Derive all numbers from the recordings in `folder`."""
    sweeps = folder / "tube_sphere_resonator"
    return Resonators(
        sphere=sphere(sweeps),
        tubes=tubes(sweeps),
        impedance_tube=impedance_tube(folder / "impedance_tube"),
    )


def main() -> None:
    """Write the table into the package."""
    if len(sys.argv) != 2:
        raise SystemExit("usage: python tools/resonator_measurements.py FOLDER")
    table = measurements(Path(sys.argv[1])).model_dump(mode="json")
    text = yaml.safe_dump(table, sort_keys=False, allow_unicode=True, default_flow_style=None)
    head = "# Written by tools/resonator_measurements.py, which describes the derivation.\n"
    (package,) = ajgdata.studies.__path__
    write_bytes(Path(package) / TABLE, (head + text).encode())


if __name__ == "__main__":
    main()
