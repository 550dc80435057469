"""Simulated resonators against theory, and the numbers derived from recordings of others."""

from pathlib import Path

import numpy as np
import pytest

from ajgdata.gripper.scene import Numerics
from ajgdata.gripper.solver_plan import wide_weight
from ajgdata.studies.extreme_cases import AIR
from ajgdata.studies.resonators import (
    HIGHEST_DEGREE,
    measured_resonators,
    sphere_resonances_hz,
    sphere_root,
    thermoviscous_attenuation,
    tube_fundamental_hz,
)
from ajgdata.studies.validation import (
    diffuse_admittance,
    fundamental_ratio,
    lossy_tube_attenuation,
    simulated_attenuation,
    sphere_frequencies,
    tables,
    tube_frequencies,
)
from tools.resonator_measurements import (
    Spectra,
    air_of_speed,
    fit_tube,
    impedance_tube,
    sphere,
    tubes,
)

H = Numerics().dx_mm * 1e-3
#: Recordings of other groups, next to the project; they are not part of it.
FOLDER = Path(__file__).resolve().parents[3] / "shared/recordings/resonators"
needs_recordings = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"needs {FOLDER}")


def dispersion(frequency_hz, h):
    """Relative error of a wave along an axis of the grid."""
    phase = 2 * np.pi * frequency_hz / AIR.sound_speed * h
    weight = wide_weight(h)
    difference = 2 * (1 + 3 * weight) * np.sin(phase / 2) - 2 * weight * np.sin(3 * phase / 2)
    return abs(difference / phase - 1)


def test_roots_of_the_sphere_are_those_of_tables():
    roots = [sphere_root(degree) for degree in range(1, HIGHEST_DEGREE + 1)]
    expected = [2.0816, 3.3421, 4.5141, 5.6467, 6.7565, 7.8511]  # Ferris (1952)
    assert roots == pytest.approx(expected, abs=1e-4)


def test_resonances_of_the_simulated_sphere():
    exact = sphere_resonances_hz(0.050, AIR)
    # The bound of a box whose walls cut cells, see `BoxOffGrid`.
    assert sphere_frequencies(0.050, H) == pytest.approx(exact, rel=6e-3)


@pytest.mark.parametrize("length", [0.075, 0.6])
def test_resonances_of_a_simulated_tube(length):
    count = int(5_000 / tube_fundamental_hz(length, AIR))
    exact = tube_fundamental_hz(length, AIR) * np.arange(1, count + 1)
    assert tube_frequencies(length, count, H) == pytest.approx(exact, rel=dispersion(5_000, H))


@pytest.mark.parametrize("h", [6e-3, H])
def test_attenuation_in_a_simulated_tube(h):
    frequency_hz = np.array([200.0, 800.0, 1_600.0])
    width = 0.1
    exact = lossy_tube_attenuation(frequency_hz, width, 4e-3, AIR)
    # In each corner cell, two walls h long act as their vector sum; the width is sampled at h/4.
    corners = (2 - np.sqrt(2)) * h / width
    sampling = 2 * (h / 8) / width
    simulated = simulated_attenuation(frequency_hz, width, 4e-3, h)
    assert simulated == pytest.approx(exact, rel=corners + sampling)
    weak = simulated_attenuation(frequency_hz, width, 4e-4, h)
    assert simulated == pytest.approx(10 * weak, rel=5e-3)  # proportional to small admittances


def test_attenuation_of_locally_reacting_walls_at_low_frequencies():
    # One-dimensional limit: perimeter over twice the cross-section, times the admittance.
    (value,) = lossy_tube_attenuation(np.array([100.0]), 0.1, 1e-3, AIR)
    assert value == pytest.approx(4 * 0.1 / (2 * 0.1**2) * 1e-3, rel=1e-3)


def test_thermoviscous_attenuation_and_admittance_of_textbooks():
    # 3e-5 √f / a per metre in a wide circular tube of radius a; the hydraulic radius is the same.
    (value,) = thermoviscous_attenuation(np.array([1_000.0]), 0.1, AIR)
    assert value == pytest.approx(3e-5 * np.sqrt(1_000) / 0.05, rel=0.03)
    # The lower end of the range of `wall_admittance`.
    assert diffuse_admittance(3_000.0, AIR) == pytest.approx(1.2e-3, rel=0.06)


def test_tables_of_the_study():
    resonances, attenuation, admittance, parameters = tables(quick=True)
    assert len(resonances.rows) == HIGHEST_DEGREE + 8
    assert len(attenuation.rows) == len(admittance.rows) == 10
    assert len(parameters.rows) == 5
    simulated = resonances.numbers("simulated_hz") / resonances.numbers("theory_hz")
    assert simulated == pytest.approx(1, abs=2e-3)
    ratio = admittance.numbers("required") / admittance.numbers("smooth")
    assert ratio == pytest.approx(admittance.numbers("ratio"))


def test_fundamental_is_that_of_all_measured_modes():
    (tube,) = (t for t in measured_resonators().tubes.tubes if t.length_mm == 300)
    hertz = tube_frequencies(0.3, max(tube.modes), H)
    low = min(hertz / np.arange(1, 9))
    high = max(hertz / np.arange(1, 9))
    ratio = float(fundamental_ratio(tube, H)) * tube_fundamental_hz(0.3, AIR)
    assert low <= ratio <= high


# Derivation of the measured numbers


def test_fit_finds_the_attenuation_of_made_up_recordings():
    positions = np.array([-0.8, -0.385, -0.3, 0.8, 0.885, 1.3])
    draw = np.random.default_rng(0)
    air = air_of_speed(346.0)
    frequency_hz = np.linspace(150, 1_649, 300)
    alpha = 1.7 * thermoviscous_attenuation(frequency_hz, 0.1, air)
    wavenumber = 2 * np.pi * frequency_hz / air.sound_speed + (1 - 1j) * alpha
    gain = np.array([1.0, 1.1, 0.9, 1.05, 0.95 + 0.05j, 1.0 - 0.03j])
    amplitude = np.zeros((6, 300, 6), complex)
    for recording in range(6):
        place = positions.copy()
        place[[0, recording]] = place[[recording, 0]]
        waves = draw.standard_normal((2, 300, 2)) @ np.array([1, 1j])
        phase = wavenumber[:, None] * place
        sound = waves[0][:, None] * np.exp(-1j * phase)
        sound += 0.3 * waves[1][:, None] * np.exp(1j * phase)
        noise = 0.01 * draw.standard_normal((300, 6, 2)) @ np.array([1, 1j])
        amplitude[recording] = gain * sound + noise
    amplitude /= np.linalg.norm(amplitude, axis=2, keepdims=True)
    fit = fit_tube(Spectra(frequency_hz, amplitude), 1)
    assert fit.ratio[0] == pytest.approx(1.7, abs=4 * fit.ratio_sd[0])
    assert fit.ratio_sd[0] < 0.1
    assert fit.sound_speed == pytest.approx(346.0, abs=0.1)


@needs_recordings
def test_sphere_and_tubes_are_derived_from_the_recordings():
    stored = measured_resonators()
    assert sphere(FOLDER / "tube_sphere_resonator") == stored.sphere
    assert tubes(FOLDER / "tube_sphere_resonator") == stored.tubes


@needs_recordings
@pytest.mark.slow
def test_attenuation_is_derived_from_the_recordings():
    derived = impedance_tube(FOLDER / "impedance_tube")
    stored = measured_resonators()
    assert derived.ratio.value == pytest.approx(stored.impedance_tube.ratio.value, abs=0.01)
    for new, old in zip(derived.bands, stored.impedance_tube.bands, strict=True):
        assert new.attenuation_np_m.value == pytest.approx(old.attenuation_np_m.value, rel=0.01)
