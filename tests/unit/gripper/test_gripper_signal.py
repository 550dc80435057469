import numpy as np
import pytest
from scipy.signal import sosfilt

from ajgdata.gripper.medium import Air
from ajgdata.gripper.noise import (
    a_weighting,
    external_noise_pa,
)
from ajgdata.gripper.signal_chain import (
    excitation_sweep,
    record,
    transducers,
    volume_velocity,
)
from ajgdata.gripper.signal_settings import SignalChain
from ajgdata.gripper.simulation import ImpulseResponse, lowpass

QUIET = SignalChain(noise_db_spl=None)
FULL_SCALE_PA = np.sqrt(2) * 20e-6 * 10 ** (129 / 20)


def _response(samples, static=0.0, latency=0, outside=None):
    return ImpulseResponse(np.asarray(samples, float), static, 44_100, latency, {}, outside)


def test_the_sweep_runs_from_20_hz_to_20_khz():
    sweep = excitation_sweep()
    assert len(sweep) == 44_100
    assert 0.85 < np.abs(sweep).max() <= 0.9
    for second, expected in ((0.25, 20 * 1000**0.25), (0.5, 20 * 1000**0.5), (0.9, 20 * 1000**0.9)):
        n = int(second * 44_100)
        cut = sweep[n - 512 : n + 512] * np.hanning(1024)
        peak = np.argmax(np.abs(np.fft.rfft(cut, 1 << 16))) * 44_100 / (1 << 16)
        assert peak == pytest.approx(expected, rel=0.05, abs=25)
    with pytest.raises(ValueError, match="low_hz"):
        excitation_sweep(low_hz=0)


def _coupler(frequency_hz: float, chain: SignalChain) -> float:
    """Level (dB SPL) of a full-scale tone in a small rigid volume of 2 cm³: p = γP/V ∫q dt."""
    stiffness = Air().gamma * Air().pressure_pa / 2e-6
    time = np.arange(44_100) / 44_100
    tone = np.sin(2 * np.pi * frequency_hz * time) * np.minimum(1, time / 0.1)
    samples = record(_response([0.0], stiffness / 44_100), tone, chain).samples[22_050:]
    return 20 * np.log10(np.sqrt(np.mean(samples**2)) * FULL_SCALE_PA / 20e-6)


def test_an_armature_gives_a_coupler_the_same_pressure_below_its_resonance():
    """Two-pole resonances lift it by 1/|Π 1 - (f/f0)² + i f/(f0 Q)|, and two first-order high
    passes at 100 Hz lower it. The running sum stands for the integral up to (ω/rate)²/24, and the
    bilinear rule for iω up to (ω/rate)²/12: 0.09 dB at 2 kHz, where they add."""
    resonances = list(zip(QUIET.resonances_hz, QUIET.resonances_q, strict=True))
    for f in (200.0, 400.0, 800.0, 1_500.0, 2_000.0):
        lift = np.prod([1 / abs(1 - (f / f0) ** 2 + 1j * f / (f0 * q)) for f0, q in resonances])
        expected = 20 * np.log10(lift / (1 + (100 / f) ** 2))
        at_1k = np.prod([1 / abs(1 - (1e3 / f0) ** 2 + 1e3j / (f0 * q)) for f0, q in resonances])
        expected -= 20 * np.log10(at_1k / (1 + (100 / 1e3) ** 2))
        assert _coupler(f, QUIET) - _coupler(1e3, QUIET) == pytest.approx(expected, abs=0.1)


def test_the_level_is_that_of_a_receiver_of_105_db_in_a_coupler():
    # It gives 89.4 dB in the cavity, see `volume_velocity`; the level is 90, rounded.
    assert _coupler(1_000.0, QUIET) == pytest.approx(105.5, abs=0.3)
    assert volume_velocity(SignalChain(level_db_spl=None)) == 0.0


def test_clipping_is_counted_and_codes_are_24_bit():
    sweep = excitation_sweep()
    take = record(_response([1e9]), sweep, QUIET)
    assert take.samples.min() == -1 and take.samples.max() == 1 - 2**-23
    limits = (take.samples == -1) | (take.samples == 1 - 2**-23)
    assert 0 < take.clipped_count <= np.count_nonzero(limits)
    codes = take.samples * 2**23
    assert np.array_equal(codes, np.round(codes))
    quieter = record(_response([1e9]), sweep, SignalChain(gain_db=-80, noise_db_spl=None))
    assert quieter.clipped_count == 0


def test_the_noise_has_its_level_and_its_seed():
    silence = np.zeros(44_100)
    noise, same, other = (record(_response([1.0]), silence, seed=s).samples for s in (1, 1, 2))
    level = 20 * np.log10(np.std(noise) * FULL_SCALE_PA / 20e-6)
    assert level == pytest.approx(38.6, abs=0.1)
    # A-weighted up to 10 kHz, as the microphone's data sheet has it: 94 dB less 59 dB(A).
    f = np.fft.rfftfreq(44_100, 1 / 44_100)
    power = np.abs(np.fft.rfft(noise * FULL_SCALE_PA / 20e-6)) ** 2 * a_weighting(f) ** 2
    weighted = 2 * np.sum(power[(f >= 20) & (f <= 10_000)]) / 44_100**2
    assert 10 * np.log10(weighted) == pytest.approx(94 - 59, abs=0.2)
    assert np.array_equal(noise, same)
    assert abs(np.corrcoef(noise, other)[0, 1]) < 0.03


def test_a_weighting_is_that_of_the_standard():
    """Table 3 of IEC 61672-1 at its exact frequencies 1000·10^(n/10), rounded to 0.1 dB there."""
    n = np.array([-17, -10, -3, 0, 4, 10, 13])
    stated = np.array([-50.5, -19.1, -3.2, 0.0, 1.3, -2.5, -9.3])
    level = 20 * np.log10(a_weighting(1_000 * 10.0 ** (n / 10)))
    assert np.max(np.abs(level - stated)) <= 0.05 + 1e-9


def test_sound_from_outside_comes_through_the_membrane_as_it_is_solved():
    """Bin by bin against a gain of 1; powers are drawn straight between the given frequencies."""
    chain = SignalChain(noise_db_spl=None, external_noise_dba=90.0)
    through, open_ = (
        np.fft.rfft(record(_response([0.0], outside=gain), np.zeros(44_100), chain).samples)
        for gain in (np.array([0.0, 2.0, 1.0]), np.ones(2))
    )
    # 11,025 Hz is the middle of three.
    for f, power in ((5_000, 4 * 5_000 / 11_025), (11_025, 4.0), (16_537, 4 - 3 * 5_512 / 11_025)):
        assert np.abs(through[f] / open_[f]) ** 2 == pytest.approx(power, rel=1e-3)
    with pytest.raises(ValueError, match="no gain for sound from outside"):
        record(_response([0.0]), np.zeros(10), chain)


def test_sound_from_outside_has_its_level_in_the_room():
    """Mean square against the integral of A-weighted white sound behind the AC coupling.

    The mean square of Gaussian noise of density S scatters by √(∫S² df / T) / ∫S df, with T = 1 s.
    """
    f = np.linspace(20, 20_000, 400_001)
    white = (20e-6) ** 2 * 10**8 / np.trapezoid(a_weighting(f) ** 2, f)
    density = white * f**2 / (f**2 + 100.0**2)
    expected = np.trapezoid(density, f)
    scatter = np.sqrt(np.trapezoid(density**2, f)) / expected
    sounds = [external_noise_pa(44_100, np.ones(2), 80, 100.0, seed) for seed in range(8)]
    assert np.mean(np.square(sounds)) == pytest.approx(expected, rel=4 * scatter / np.sqrt(8))
    louder = external_noise_pa(44_100, np.ones(2), 100, 100.0, 0)
    np.testing.assert_allclose(louder, 10 * sounds[0], rtol=1e-12)


def test_a_recording_is_the_convolution_of_sound_speaker_and_scene():
    generator = np.random.default_rng(4)
    decay = np.exp(-np.arange(300) / 40)
    ir = _response(decay * generator.normal(size=300), static=0.1, latency=7)
    sound = 0.3 * generator.uniform(-1, 1, 900)
    driven = sosfilt(transducers(QUIET), sound)
    pressure = np.convolve(driven, ir.samples)[7:907] + 0.1 * np.cumsum(driven)
    expected = pressure * volume_velocity(QUIET) / FULL_SCALE_PA
    # A recording is rounded to 24 bits.
    np.testing.assert_allclose(record(ir, sound, QUIET).samples, expected, atol=0.51 / 2**23)


@pytest.mark.parametrize("factor", [2, 5])
def test_decimation_is_flat_and_does_not_alias(factor):
    taps, latency = lowpass(factor)
    assert np.argmax(taps) == latency * factor and np.allclose(taps, taps[::-1], atol=1e-15)
    gain = np.abs(np.fft.rfft(taps / factor, 1 << 16))
    f = np.fft.rfftfreq(1 << 16, 1 / (44_100 * factor))
    assert np.max(np.abs(gain[f <= 20_000] - 1)) < 2e-4
    assert np.max(gain[f >= 24_100]) < 2e-4
