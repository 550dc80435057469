"""Every kind of excitation has the properties that its formula promises; the default is the sweep
that all data sets so far were recorded with."""

import hashlib

import numpy as np
import pytest
import soundfile
from pydantic import TypeAdapter, ValidationError
from scipy.signal import hilbert

from ajgdata.acquire.excitation import excitation_samples, played_samples
from ajgdata.gripper import SAMPLE_RATE_HZ, excitation_sweep
from ajgdata.store.audio import file_sha256
from ajgdata.types import (
    DEFAULT_EXCITATION,
    DataError,
    ExcitationSpec,
    LinearSweep,
    LogSweep,
    MaximumLengthSequence,
    PassiveRecording,
    SoundFile,
    WhiteNoise,
)

RATE = SAMPLE_RATE_HZ
KINDS = (LogSweep, LinearSweep, MaximumLengthSequence, WhiteNoise)
LENGTHS = (0.1, 1.0)


@pytest.mark.parametrize(
    ("declared", "digest"),
    [
        (LogSweep(), "c6fc9afe5057a2f42cd7a5a821459b9460d3b258dca96b1daff6b0cdec8191fb"),
        (
            MaximumLengthSequence(),
            "9ecf918ae4aae363d7e4d009b6b9bb8423914ae01a38f8638da1afdaae853f66",
        ),
    ],
)
def test_sounds_of_existing_sessions_keep_their_bytes_and_settings(declared, digest):
    """As 24-bit codes, because the sine of a library may differ in its last digit."""
    codes = np.rint(excitation_samples(declared, RATE) * 2**23).astype("<i4")
    assert hashlib.sha256(codes.tobytes()).hexdigest() == digest
    assert "silence_before_s" not in declared.model_dump()


def test_the_default_is_the_sweep_that_the_virtual_gripper_has_always_played():
    assert excitation_samples(DEFAULT_EXCITATION, RATE).tobytes() == excitation_sweep().tobytes()


def crest_factor_db(samples: np.ndarray) -> float:
    """Peak over rms of samples (n,) in decibels."""
    return float(20 * np.log10(np.abs(samples).max() / np.sqrt(np.mean(np.square(samples)))))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("length_s", LENGTHS)
def test_length_level_and_determinism(kind, length_s):
    declared = kind(length_s=length_s, amplitude=0.25, silence_s=0.05, silence_before_s=0.15)
    samples = excitation_samples(declared, RATE)
    begin = 6615
    end = begin + round(length_s * RATE)
    assert samples.shape == (end + 2205,)
    assert not samples[:begin].any() and not samples[end:].any()
    without = excitation_samples(kind(length_s=length_s, amplitude=0.25), RATE)
    assert samples[begin:end].tobytes() == without.tobytes()
    # A sweep goes through every phase: some sample is within 0.14 rad of a crest, cos(0.14) = 0.99.
    assert 0.99 * 0.25 <= np.abs(samples).max() <= 0.25 * (1 + 1e-12)
    excitation_samples.cache_clear()
    assert excitation_samples(declared, RATE).tobytes() == samples.tobytes()
    assert f"{length_s:g} s" in declared.description and "-12.04 dBFS" in declared.description


def frequency_at(samples: np.ndarray, time_s: float) -> float:
    """Instantaneous frequency: the slope of the analytic signal's phase over 2 ms."""
    at = round(time_s * RATE)
    phase = np.unwrap(np.angle(hilbert(samples)))[at - 44 : at + 45]
    return float(np.polyfit(np.arange(-44, 45) / RATE, phase, 1)[0] / (2 * np.pi))


@pytest.mark.parametrize("share", [0.4, 0.9])
def test_instantaneous_frequency_of_the_sweep(share):
    """f = low (high/low)^(t/T). Over 2 ms it bends by (0.001 ln(1000))^2/6 of itself, 8e-6; the
    Hilbert transform of a faded sweep is good to 1e-3."""
    samples = excitation_samples(LogSweep(), RATE)
    assert frequency_at(samples, share) == pytest.approx(20 * 1000**share, rel=3e-3)


@pytest.mark.parametrize("share", [0.1, 0.4, 0.9])
def test_instantaneous_frequency_of_the_linear_sweep(share):
    """f = low + (high - low) t/T is its own mean over 2 ms."""
    samples = excitation_samples(LinearSweep(low_hz=100, high_hz=12_000, length_s=1), RATE)
    assert frequency_at(samples, share) == pytest.approx(100 + 11_900 * share, rel=3e-3)


def test_energy_of_the_linear_sweep_is_flat():
    """|X(f)|² = A² T/(4 (high - low)) by stationary phase: 6 dB below A² in each direction of
    frequency, over (high - low)/T hertz per second."""
    frequency = np.fft.rfftfreq(RATE, 1 / RATE)
    power = np.abs(np.fft.rfft(excitation_samples(LinearSweep(), RATE)) / RATE) ** 2
    for low in (400, 1600, 6400):
        inside = (frequency >= low) & (frequency < 2 * low)
        expected = 0.81 / (4 * (20_000 - 20)) * inside.sum()
        assert power[inside].sum() == pytest.approx(expected, rel=0.02)  # ripple, over octaves


def test_white_noise_is_uniform_flat_and_decided_by_its_seed():
    """Uniform samples within ±A have the variance A²/3. Half of the energy is in each half of the
    band; with n/4 independent values per half, its share scatters by 1/sqrt(n) = 0.005."""
    declared = WhiteNoise(fade_s=0, amplitude=0.5, seed=1)
    samples = excitation_samples(declared, RATE)
    assert samples.var() == pytest.approx(0.25 / 3, rel=0.02)
    assert crest_factor_db(samples) == pytest.approx(10 * np.log10(3), abs=0.1)
    power = np.abs(np.fft.rfft(samples)) ** 2
    assert power[: len(power) // 2].sum() / power.sum() == pytest.approx(0.5, abs=0.02)
    other = excitation_samples(WhiteNoise(fade_s=0, amplitude=0.5, seed=2), RATE)
    # The correlation of independent samples scatters by 1/sqrt(n).
    assert abs(np.corrcoef(samples, other)[0, 1]) < 0.02
    assert samples[:3] == pytest.approx(
        0.5 * np.random.Generator(np.random.PCG64(1)).uniform(-1, 1, 3), rel=1e-4
    )


def test_a_band_of_noise_has_no_energy_outside():
    declared = WhiteNoise(low_hz=1_000, high_hz=4_000, fade_s=0)
    power = np.abs(np.fft.rfft(excitation_samples(declared, RATE))) ** 2
    frequency = np.fft.rfftfreq(RATE, 1 / RATE)
    inside = (frequency >= 1_000) & (frequency <= 4_000)
    assert power[~inside].sum() < 1e-20 * power.sum()
    lower = inside & (frequency < 2_500)
    assert power[lower].sum() / power.sum() == pytest.approx(0.5, abs=0.05)
    with pytest.raises(ValueError, match="contains no multiple of 10 Hz"):
        excitation_samples(WhiteNoise(low_hz=1, high_hz=2, length_s=0.1), RATE)


def write_sound(folder, samples, rate_hz=RATE, subtype="PCM_24"):
    """Write `chirp.wav` into a folder, and return its declaration."""
    soundfile.write(folder / "chirp.wav", samples, rate_hz, subtype=subtype)
    return SoundFile(file="chirp.wav", silence_before_s=0.001, silence_s=0.002)


def test_an_own_file_is_played_unchanged_between_its_silences(tmp_path):
    sound = np.rint(2**23 * 0.5 * np.sin(np.arange(2_000))) / 2**23
    samples = played_samples(write_sound(tmp_path, sound), RATE, tmp_path)
    np.testing.assert_array_equal(samples, np.r_[np.zeros(44), sound, np.zeros(88)])


@pytest.mark.parametrize(
    ("samples", "options", "said"),
    [
        (0.5 * np.ones((100, 2)), {}, "has 2 channels, and the speaker plays one"),
        (0.5 * np.ones(100), {"rate_hz": 48_000}, "48000 Hz, and the data set at 44100 Hz"),
        (np.r_[0.5, np.ones(3), 0.5], {}, "is clipped, or exceeds full scale"),
        (np.r_[0.5, 1.5, 0.5], {"subtype": "FLOAT"}, r"full scale \(peak 1.5\)"),
        (np.zeros(100), {}, "is silent, or has samples that are not numbers"),
        (np.r_[0.5, np.nan], {"subtype": "FLOAT"}, "is silent, or has samples that are not"),
        (0.5 * np.ones(61 * 8_000), {"rate_hz": 8_000}, "has 61 s, and a sound has up to 60 s"),
    ],
)
def test_a_file_that_cannot_be_played_is_refused_in_one_line(tmp_path, samples, options, said):
    declared = write_sound(tmp_path, samples, **options)
    rate = 8_000 if options.get("rate_hz") == 8_000 else RATE
    with pytest.raises(DataError, match=said) as caught:
        played_samples(declared, rate, tmp_path)
    assert str(caught.value).startswith("excitation.file: ") and "\n" not in str(caught.value)


def test_a_missing_file_and_another_file_are_refused(tmp_path):
    declared = write_sound(tmp_path, 0.5 * np.sin(np.arange(500)))
    with pytest.raises(DataError, match=r"there is no .*other\.wav"):
        played_samples(SoundFile(file="other.wav"), RATE, tmp_path)
    for path in ("../chirp.wav", str(tmp_path / "chirp.wav")):
        with pytest.raises(ValidationError, match="must be a path inside the folder"):
            SoundFile(file=path)
    right = file_sha256(tmp_path / "chirp.wav")
    known = declared.model_copy(update={"sha256": right})
    assert len(played_samples(known, RATE, tmp_path)) == 500 + 44 + 88
    write_sound(tmp_path, 0.4 * np.sin(np.arange(500)))
    with pytest.raises(DataError, match=r"is not the file of excitation\.sha256"):
        played_samples(known, RATE, tmp_path)


def test_passive_recording_has_no_samples():
    with pytest.raises(ValueError, match=r"excitation\.kind none has no computed sound"):
        excitation_samples(PassiveRecording(), RATE)


def test_energy_of_the_sweep_falls_by_3_db_an_octave():
    """|X(f)|² = A² T/(4 ln(high/low) f) by stationary phase."""
    frequency = np.fft.rfftfreq(RATE, 1 / RATE)
    power = np.abs(np.fft.rfft(excitation_samples(LogSweep(), RATE)) / RATE) ** 2
    for low in (400, 1600, 6400):
        inside = (frequency >= low) & (frequency < 2 * low)
        expected = (0.81 / (4 * np.log(1000) * frequency[inside])).sum()
        assert power[inside].sum() == pytest.approx(expected, rel=0.02)  # ripple, over octaves


def test_fades_are_raised_cosines():
    plain = excitation_samples(LogSweep(fade_s=0), RATE)
    faded = excitation_samples(LogSweep(fade_s=0.01), RATE)
    time = np.arange(441) / RATE
    edge = np.sin(np.pi / 2 * time / 0.01) ** 2
    assert np.allclose(faded[:441], plain[:441] * edge, atol=1e-15)
    assert np.allclose(faded[-441:], plain[-441:] * edge[::-1], atol=1e-15)
    assert np.array_equal(faded[441:-441], plain[441:-441])


def test_autocorrelation_of_the_sequence_is_one_and_minus_one_nth():
    count = 2**12 - 1
    declared = MaximumLengthSequence(order=12, amplitude=1, length_s=count / RATE)
    samples = excitation_samples(declared, RATE)
    assert samples.shape == (count,) and set(np.unique(samples)) == {-1, 1}
    circular = np.fft.irfft(np.abs(np.fft.rfft(samples)) ** 2, count) / count
    assert circular[0] == pytest.approx(1)
    assert np.allclose(circular[1:], -1 / count, atol=1e-12)
    assert crest_factor_db(samples) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"kind": "log_sweep", "low_hz": 500, "high_hz": 400}, "low_hz 500 must be below"),
        ({"kind": "linear_sweep", "low_hz": 500, "high_hz": 500}, "low_hz 500 must be below"),
        ({"kind": "noise", "low_hz": 500, "high_hz": 400}, "low_hz 500 must be below"),
        ({"kind": "log_sweep", "length_s": 0.1, "fade_s": 0.06}, "two fades do not fit"),
        ({"kind": "none", "trigger_dbfs": -30, "pre_trigger_s": 1}, "pre_trigger_s 1 must be"),
        ({"kind": "none", "trigger_dbfs": 3}, "less than or equal to 0"),
        ({"kind": "none", "amplitude": 0.5}, "Extra inputs are not permitted"),
    ],
)
def test_what_cannot_be_played_is_refused(given, said):
    with pytest.raises(ValidationError, match=said):
        TypeAdapter(ExcitationSpec).validate_python(given)
    with pytest.raises(ValueError, match="high_hz 20000 is not below half the rate of 16000 Hz"):
        excitation_samples(LogSweep(), 16_000)
    with pytest.raises(ValueError, match="high_hz 9000 is not below half the rate of 16000 Hz"):
        excitation_samples(WhiteNoise(high_hz=9_000), 16_000)
