import numpy as np
import pytest
from pydantic import ValidationError
from scipy.signal import sosfilt, sosfreqz

from ajgdata.gripper.external_noise import (
    a_weighting,
    external_noise_pa,
    mass_law_gain,
    transmission,
)
from ajgdata.gripper.medium import Air
from ajgdata.gripper.signal_chain import (
    Player,
    excitation_sweep,
    record,
    transducers,
    volume_velocity,
)
from ajgdata.gripper.signal_settings import SignalChain
from ajgdata.gripper.simulation import ImpulseResponse, lowpass

QUIET = SignalChain(noise_db_spl=None)
FULL_SCALE_PA = np.sqrt(2) * 20e-6 * 10 ** (129 / 20)
#: As flat as the pressure in a coupler, or as the volume velocity.
BELLS = SignalChain(noise_db_spl=None, driver="velocity")


def _response(samples, static=0.0, latency=0, membrane=0.3, outside=None):
    samples = np.asarray(samples, float)
    return ImpulseResponse(samples, static, 44_100, latency, {}, membrane, outside)


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
    heard = record(_response([0.0], stiffness / 44_100), tone, chain).samples[22_050:]
    return 20 * np.log10(np.sqrt(np.mean(heard**2)) * FULL_SCALE_PA / 20e-6)


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
    # A speaker of constant volume velocity falls by 6 dB an octave there, its bell aside.
    assert _coupler(400.0, BELLS) - _coupler(800.0, BELLS) > 5


def test_the_level_is_that_of_a_receiver_of_105_db_in_a_coupler():
    # It gives 89.4 dB in the cavity, see `volume_velocity`; the level is 90, rounded.
    assert _coupler(1_000.0, QUIET) == pytest.approx(105.5, abs=0.3)
    assert volume_velocity(SignalChain(level_db_spl=None)) == 0.0


def test_an_armature_loses_its_treble_above_the_second_resonance():
    """Volume velocity: + 6 dB an octave of the derivative, - 12 of each resonance that is passed;
    the bilinear rule takes more off as the converter's limit nears."""
    _, h = sosfreqz(transducers(QUIET), worN=np.array([5_000, 6_000, 13_000, 18_000]), fs=44_100)
    level = 20 * np.log10(np.abs(h))
    assert level[0] > level[2] + 10
    assert (level[2] - level[3]) / np.log2(18 / 13) > 18


def test_bells_have_the_declared_features():
    _, h = sosfreqz(transducers(BELLS), worN=np.array([20, 100, 1_000, 3_000, 9_000]), fs=44_100)
    level = 20 * np.log10(np.abs(h))
    assert level[2] == pytest.approx(0, abs=1e-9)
    # Two first-order high passes at their corner; the 3 kHz bell lifts the reference by 0.7 dB.
    assert level[1] == pytest.approx(-6.0 - 0.7, abs=0.1)
    assert level[0] < -27
    assert 8 < level[3] < 12
    assert level[4] > 3


def test_a_delayed_unit_pulse_is_the_transducers_alone():
    pulse = np.zeros(1_000)
    pulse[0] = 0.5
    late_one = _response([0, 0, 3e6], latency=2)
    _, h = sosfreqz(transducers(QUIET), worN=np.array([1_000.0]), fs=44_100)
    loud = QUIET.model_copy(update={"level_db_spl": 100.0})
    direct, late = (record(r, pulse, loud).samples for r in (_response([3e6]), late_one))
    assert np.max(np.abs(direct - late)) <= 2**-23
    at_1k = np.abs(np.sum(direct * np.exp(-2j * np.pi * 1_000 / 44_100 * np.arange(1_000))))
    expected = 0.5 * 3e6 * volume_velocity(loud) / FULL_SCALE_PA * np.abs(h[0])
    assert at_1k == pytest.approx(expected, rel=1e-2)


def test_a_static_pressure_is_a_response_that_never_ends():
    sweep = excitation_sweep(0.1)
    short = record(_response([0.0], static=1e4), sweep, QUIET).samples
    long = record(_response(np.full(len(sweep), 1e4)), sweep, QUIET).samples
    assert np.max(np.abs(short - long)) <= 2**-22


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
    one, same, other = (record(_response([1.0]), silence, seed=s).samples for s in (1, 1, 2))
    level = 20 * np.log10(np.std(one) * FULL_SCALE_PA / 20e-6)
    assert level == pytest.approx(38.6, abs=0.1)
    # A-weighted up to 10 kHz, as the microphone's data sheet has it: 94 dB less 59 dB(A).
    f = np.fft.rfftfreq(44_100, 1 / 44_100)
    power = np.abs(np.fft.rfft(one * FULL_SCALE_PA / 20e-6)) ** 2 * a_weighting(f) ** 2
    weighted = 2 * np.sum(power[(f >= 20) & (f <= 10_000)]) / 44_100**2
    assert 10 * np.log10(weighted) == pytest.approx(94 - 59, abs=0.2)
    assert np.array_equal(one, same)
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.03


def test_a_weighting_is_that_of_the_standard():
    """Table 3 of IEC 61672-1 at its exact frequencies 1000·10^(n/10), rounded to 0.1 dB there."""
    n = np.array([-17, -10, -3, 0, 4, 10, 13])
    stated = np.array([-50.5, -19.1, -3.2, 0.0, 1.3, -2.5, -9.3])
    level = 20 * np.log10(a_weighting(1_000 * 10.0 ** (n / 10)))
    assert np.max(np.abs(level - stated)) <= 0.05 + 1e-9


def test_the_mass_law_is_the_mean_over_a_diffuse_field():
    """Quadrature of 1/(1 + (a cos θ)²) cos θ sin θ instead of the closed form."""
    theta = np.deg2rad(np.linspace(0, 78, 20_001))
    weight = np.cos(theta) * np.sin(theta)
    rho_c = 101_325 / (287.05 * 293.15) * np.sqrt(1.4 * 287.05 * 293.15)
    for f, mass in ((100.0, 0.3), (1_000.0, 0.3), (10_000.0, 0.3), (500.0, 3.0)):
        a = np.pi * f * mass / rho_c
        mean = np.trapezoid(weight / (1 + (a * np.cos(theta)) ** 2), theta)
        expected = mean / np.trapezoid(weight, theta)
        assert transmission(np.array([f]), mass)[0] == pytest.approx(expected, rel=1e-6)
    assert np.array_equal(transmission(np.array([0.0, 1_000.0]), 0.0), [1, 1])
    heavy = transmission(np.array([2_000.0, 4_000.0]), 1e3)
    # Far above the mass law's corner an octave costs 6 dB, less the slow logarithm.
    assert 5.5 < 10 * np.log10(heavy[0] / heavy[1]) < 6.1


def _outside_pa(dba, mass, seed=3, count=44_100):
    chain = SignalChain(noise_db_spl=None, external_noise_dba=dba, outside="mass_law", gain_db=10)
    taken = record(_response([0.0], membrane=mass), np.zeros(count), chain, seed)
    return taken.samples * FULL_SCALE_PA / 10 ** (10 / 20)


@pytest.mark.parametrize("mass", [0.0, 0.3, 2.0])
def test_sound_from_outside_has_the_level_of_the_mass_law(mass):
    """Mean square against the integral of A-weighted white sound times the transmitted share.

    The mean square of Gaussian noise of density S scatters by √(∫S² df / T) / ∫S df, with T = 1 s.
    """
    f = np.linspace(20, 20_000, 400_001)
    white = (20e-6) ** 2 * 10**8 / np.trapezoid(a_weighting(f) ** 2, f)
    density = white * transmission(f, mass) * f**2 / (f**2 + 100.0**2)
    expected = np.trapezoid(density, f)
    scatter = np.sqrt(np.trapezoid(density**2, f)) / expected
    squares = [np.mean(_outside_pa(80, mass, seed) ** 2) for seed in range(8)]
    assert np.mean(squares) == pytest.approx(expected, rel=4 * scatter / np.sqrt(8))
    assert 0.3 * scatter < np.std(squares, ddof=1) / expected < 2.5 * scatter


def test_the_spectrum_inside_falls_by_the_mass_law():
    """The same noise behind no membrane and behind one; bin by bin, up to the FFT's round-off."""
    open_, behind = (
        np.fft.rfft(external_noise_pa(44_100, mass_law_gain(44_100, m), 80, 100.0, 3))
        for m in (0.0, 0.3)
    )
    f = np.arange(20, 20_001)
    share = np.abs(behind[f] / open_[f]) ** 2
    np.testing.assert_allclose(share, transmission(f.astype(float), 0.3), rtol=1e-9)
    for spectrum in (open_, behind):
        beyond = np.abs(np.delete(spectrum, f))
        assert beyond.max() < 1e-12 * np.abs(spectrum).max()


def test_more_noise_outside_is_the_same_noise_scaled():
    quiet, loud = (external_noise_pa(4_410, np.ones(2), dba, 100.0, 5) for dba in (45, 80))
    np.testing.assert_allclose(loud, quiet * 10 ** (35 / 20), rtol=1e-14)
    quiet, loud = (np.std(_outside_pa(dba, 0.3)) for dba in (45, 80))
    # Rounding adds noise of 2^-23/√12 of full scale to the quieter one, and by chance what the two
    # have in common: r = added / quiet moves the ratio by r²/2 ± r/√n.
    share = FULL_SCALE_PA / 10 ** (10 / 20) * 2**-23 / np.sqrt(12) / quiet
    tolerance = share**2 / 2 + 4 * share / np.sqrt(44_100)
    assert loud / quiet == pytest.approx(10 ** (35 / 20), rel=tolerance)


def test_noise_from_outside_adds_to_all_else_and_has_its_seed():
    gain = np.linspace(1, 0.1, 7)
    sweep, response = excitation_sweep(0.1), _response([1e6, -5e5], outside=gain)
    silent = _response([0.0], outside=gain)
    with_floor = SignalChain(external_noise_dba=70)
    both, again = (record(response, sweep, with_floor, 9).samples for _ in range(2))
    assert np.array_equal(both, again)
    without = record(response, sweep, SignalChain(), 9).samples
    chain = SignalChain(noise_db_spl=None, external_noise_dba=70)
    alone = record(silent, np.zeros(len(sweep)), chain, 9).samples
    assert np.max(np.abs(both - without - alone)) <= 1.5 * 2**-23
    other = record(silent, np.zeros(len(sweep)), chain, 10).samples
    assert abs(np.corrcoef(alone, other)[0, 1]) < 0.2


def test_noise_from_outside_is_independent_of_the_microphone_noise():
    """The correlation of two independent noises of n samples has the deviation 1 / sqrt(n). With
    the same draws it is .95: only sound below 20 Hz and above 20 kHz is filtered out."""
    silence, response = np.zeros(44_100), _response([0.0], outside=np.ones(2))
    outside = SignalChain(noise_db_spl=None, external_noise_dba=70)
    for seed in (0, 9):
        floor = record(response, silence, SignalChain(), seed).samples
        external = record(response, silence, outside, seed).samples
        assert abs(np.corrcoef(floor, external)[0, 1]) < 5 / np.sqrt(44_100)


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
    with pytest.raises(ValueError, match="mass_law"):
        record(_response([0.0]), np.zeros(10), chain)


@pytest.mark.parametrize("bad", [np.zeros((2, 3)), np.array([np.nan, 0])])
def test_an_excitation_must_be_a_signal(bad):
    with pytest.raises(ValueError, match="excitation"):
        record(_response([1.0]), bad)


@pytest.mark.parametrize("factor", [2, 5, 10])
def test_decimation_is_flat_and_does_not_alias(factor):
    taps, latency = lowpass(factor)
    assert np.argmax(taps) == latency * factor and np.allclose(taps, taps[::-1], atol=1e-15)
    gain = np.abs(np.fft.rfft(taps / factor, 1 << 16))
    f = np.fft.rfftfreq(1 << 16, 1 / (44_100 * factor))
    assert np.max(np.abs(gain[f <= 20_000] - 1)) < 2e-4
    assert np.max(gain[f >= 24_100]) < 2e-4


@pytest.mark.parametrize(
    ("chain", "said"),
    [
        ({"peaks_hz": (3_000.0,)}, "have 1, 2 and 2 values"),
        ({"peaks_hz": (3_000.0, 30_000.0)}, "less than 22050"),
        ({"rolloff_hz": 22_050.0}, "less than 22050"),
        ({"coupling_hz": 0.0}, "greater than 0"),
    ],
)
def test_a_chain_that_cannot_be_is_refused(chain, said):
    with pytest.raises(ValidationError, match=said):
        SignalChain.model_validate(chain)


def test_sounds_played_together_are_recorded_as_each_alone():
    generator = np.random.default_rng(4)
    decay = np.exp(-np.arange(300) / 40)
    irs = [_response(decay * generator.normal(size=300), static=0.1, latency=7) for _ in "ab"]
    chain = SignalChain(external_noise_dba=60.0, outside="mass_law")
    sounds = [0.3 * generator.uniform(-1, 1, n) for n in (900, 1200, 900)]
    player = Player(sounds, chain)
    for seed, ir in enumerate(irs):
        for sound, take in zip(sounds, player.record(ir, seed), strict=True):
            alone = record(ir, sound, chain, seed)
            np.testing.assert_array_equal(take.samples, alone.samples)
            driven = sosfilt(transducers(chain), sound)
            heard = np.convolve(driven, ir.samples)[7 : 7 + len(sound)] + 0.1 * np.cumsum(driven)
            floor = record(ir, sound, chain.model_copy(update={"level_db_spl": None}), seed)
            gain = 10 ** (chain.gain_db / 20) / 10 ** (chain.full_scale_db_spl / 20)
            scaled = heard * volume_velocity(chain) * gain / (np.sqrt(2) * 20e-6)
            # each of the two recordings is rounded to 24 bits
            np.testing.assert_allclose(take.samples - floor.samples, scaled, atol=1.01 / 2**23)
