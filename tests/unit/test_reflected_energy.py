"""Energies against those of a reference: made-up ones, and of a sound that is a sum of sines."""

import numpy as np
import pytest

from ajgdata.evaluate.energy import band_energy, relative_energies
from ajgdata.features.spectrum import spectrum
from ajgdata.types import FeatureSettings

POWER = FeatureSettings(quantity="power", normalisation="none")


def test_the_reference_is_one_and_others_follow_object_by_object():
    """Two objects, one 100 times as loud: what they differ by is no spread of the media."""
    label = np.repeat(["air", "coffee"], 8)
    matched = np.tile(np.repeat(["a", "b"], 4), 2)
    group = np.array([f"g{n // 2}" for n in range(16)])  # two samples a grasp
    loud = np.where(matched == "a", 1.0, 100.0)
    sample = np.tile([0.9, 1.1], 8)  # whose mean is that of the grasp
    energy = loud * sample * np.where(label == "air", 1.0, 0.1)
    air, coffee = relative_energies(energy, label, group, matched, "air")
    assert (air.label, air.groups, coffee.groups) == ("air", 4, 4)
    assert air.mean == pytest.approx(1) and air.sd == pytest.approx(0, abs=1e-12)
    assert coffee.mean == pytest.approx(0.1)
    assert coffee.by_object == {"a": pytest.approx(0.1), "b": pytest.approx(0.1)}
    doubled = np.where(np.isin(group, ["g4", "g6"]), 2 * energy, energy)
    _, coffee = relative_energies(doubled, label, group, matched, "air")
    assert coffee.mean == pytest.approx(0.15)
    assert coffee.sd == pytest.approx(np.std([0.2, 0.1, 0.2, 0.1], ddof=1))


def test_the_interval_is_that_of_a_ratio_of_means_over_groups():
    """Of 60 groups each with deviations of 20 and 40 %: the ratio has one of the root of
    (0.2² + 0.4²) / 60 = 5.8 %, and 1.96 of these on both sides."""
    generator = np.random.default_rng(0)
    means = np.r_[
        1 + 0.2 * generator.standard_normal(60), 0.1 + 0.04 * generator.standard_normal(60)
    ]
    label = np.repeat(["air", "coffee"], 60)
    group = np.arange(120)
    air, coffee = relative_energies(means, label, group, np.full(120, "a"), "air")
    low, high = coffee.interval
    assert low < coffee.mean < high
    assert (high - low) / coffee.mean == pytest.approx(2 * 1.96 * 0.058, rel=0.2)
    assert not air.interval.is_defined  # the reference is 1 in every resample
    doubled = relative_energies(
        *(np.repeat(x, 2) for x in (means, label, group)), np.full(240, "a"), "air"
    )
    assert doubled[1].interval == pytest.approx(coffee.interval)  # recordings do not count
    few = relative_energies(means[51:69], label[51:69], group[51:69], np.full(18, "a"), "air")[1]
    assert not few.interval.is_defined  # of nine groups


def test_half_the_amplitude_is_a_quarter_of_the_energy_and_the_band_selects():
    """Sines within and outside the band; Hann leaks below 1e-9 of its power 20 bins away."""
    time = np.arange(44_100) / 44_100
    low = np.sin(2 * np.pi * 1_000 * time)
    high = np.sin(2 * np.pi * 9_000 * time)
    spectra = [spectrum(s, 44_100, POWER) for s in (low + high, 0.5 * low + high, low)]
    power = np.stack(spectra)
    frequency = np.fft.rfftfreq(2048, 1 / 44_100)
    loud, half, alone = band_energy(power, frequency, (500, 2_000))
    assert half / loud == pytest.approx(0.25, rel=1e-6)
    assert alone / loud == pytest.approx(1, rel=1e-6)
    with pytest.raises(ValueError, match="no frequency lies within 1 to 2 Hz"):
        band_energy(power, frequency, (1, 2))


def test_a_missing_reference_is_said():
    energy = np.array([4.0, 1.0])
    label = np.array(["air", "coffee"])
    with pytest.raises(ValueError, match="no energy of 'air' to compare with on 'b'"):
        relative_energies(energy, label, np.array(["g0", "g1"]), np.array(["a", "b"]), "air")
