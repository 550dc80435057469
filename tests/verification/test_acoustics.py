"""Decay times and levels of the study of acoustics, against what they must be."""

import numpy as np
import pytest

from ajgdata.gripper.external_noise import transmission
from ajgdata.studies.acoustics.choices import QUIET, _distance, all_choices, choices
from ajgdata.studies.acoustics.decay import decay_time, decays
from ajgdata.studies.acoustics.from_outside import from_outside

RATE = 44_100


@pytest.mark.parametrize(
    ("octave", "seconds"), [(500.0, 0.2), (2_000.0, 0.05), (2_000.0, 0.2), (8_000.0, 0.05)]
)
def test_the_decay_time_of_tones_is_that_of_their_envelope(octave, seconds):
    """Tones in the middle of the octave that fall by 60 dB in a known time, and one that is louder
    and longer two octaves above, which the filter takes 40 dB off."""
    time = np.arange(round(1.5 * seconds * RATE)) / RATE
    tones = sum(np.sin(2 * np.pi * octave * ratio * time) for ratio in (0.93, 1.0, 1.11))
    heard = tones * 10 ** (-3 * time / seconds) + np.sin(8 * np.pi * octave * time) / 100
    # Beats of the tones ripple about the line.
    assert decay_time(heard, octave) == pytest.approx(seconds, rel=0.05)


def test_a_decay_that_is_the_filters_own_is_not_told():
    pulse = np.eye(1, 4_000, 400)[0]
    assert decay_time(pulse, 1_000.0) is None
    assert decay_time(pulse, 8_000.0) is None


def test_losses_and_grains_shorten_the_decay():
    table = decays(quick=True)
    for rows in table.parted("medium").values():
        times = rows.numbers("hz_4000")
        assert np.all(np.diff(times) < 0)
    assert list(table.column("losses")[:3]) == ["least", "default", "most"]
    least, filled = (table.where(medium=m).numbers("hz_4000")[0] for m in ("air", "plastic"))
    assert filled < least / 2


def test_levels_by_band_are_means_of_power():
    table = from_outside(quick=True)
    limp = table.where(band="1000–2000").rows[0]["mass_law"]
    ends = 10 * np.log10(transmission(np.array([1_000.0, 2_000.0]), 0.3))
    assert ends[1] < limp < ends[0]
    solved, mass_law = table.numbers("solved"), table.numbers("mass_law")
    np.testing.assert_allclose(table.numbers("difference"), solved - mass_law, atol=1e-9)
    assert np.all(np.diff(table.numbers("hz")) > 0)


def test_each_choice_is_measured_and_the_default_is_no_change():
    table = choices(quick=True)
    assert [row["choice"] for row in table.rows] == [one.name for one in all_choices()]
    changes = table.numbers("change")
    assert np.all((changes > 1e-4) & (changes < 2)) and np.all(table.numbers("time_ratio") > 0)
    # Neither more nor less losses are the default, nor is either noise.
    assert all(one.gripper or one.signal != one.beside for one in all_choices())
    assert QUIET == {"noise_db_spl": None}
    assert _distance(np.array([3.0, 4.0]), np.array([6.0, 8.0])) == pytest.approx(0, abs=1e-15)
    assert _distance(np.array([1.0, 0.0]), np.array([0.0, 2.0])) == pytest.approx(np.sqrt(2))
