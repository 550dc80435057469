"""Measures of the study of error against run time."""

import numpy as np
import pytest

from ajgdata.studies.accuracy import BANDS_KHZ, SCENES, decibels, in_bands, scene_of
from ajgdata.studies.noise_free import relative_error


def test_errors_are_relative_and_levels_are_decibels():
    reference = np.linspace(1.0, 2.0, 1025)
    assert relative_error(1.1 * reference, reference) == pytest.approx(0.1)
    levels = list(decibels(2 * reference, reference).values())
    assert levels == pytest.approx([20 * np.log10(2)] * len(BANDS_KHZ))


def test_bands_are_parts_of_the_spectrum():
    """A bin of 44.1 kHz over 2,048 samples is 21.5 Hz wide. The bands have no gap."""
    assert [low for low, _ in BANDS_KHZ[1:]] == [high for _, high in BANDS_KHZ[:-1]]
    bands = list(in_bands(np.arange(1025.0)).values())
    for (low, high), band in zip(BANDS_KHZ, bands, strict=True):
        hertz = band * 44_100 / 2048
        assert low * 1e3 <= hertz[0] < low * 1e3 + 21.6
        assert high * 1e3 - 21.6 <= hertz[-1] < high * 1e3


@pytest.mark.parametrize("scene_class", SCENES)
def test_the_two_objects_of_a_class_differ_in_nothing_else(scene_class):
    first, second = (scene_of(settings) for settings in SCENES[scene_class])
    assert first.object != second.object
    assert first.model_copy(update={"object": second.object}) == second
