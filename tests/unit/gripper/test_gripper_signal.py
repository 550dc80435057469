import numpy as np
import pytest
from scipy.signal import sosfreqz

from ajgdata.gripper.signal import (
    FLOW_AT_100_DB_M3_S,
    SignalChain,
    excitation_sweep,
    record,
    transducers,
)
from ajgdata.gripper.simulation import ImpulseResponse, lowpass

QUIET = SignalChain(noise_db_spl=None)
FULL_SCALE_PA = np.sqrt(2) * 20e-6 * 10 ** (130 / 20)


def _response(samples, static=0.0, latency=0):
    return ImpulseResponse(np.asarray(samples, float), static, 44_100, latency, {})


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


def test_transducers_have_the_declared_features():
    _, h = sosfreqz(transducers(QUIET), worN=np.array([20, 100, 1_000, 3_000, 9_000]), fs=44_100)
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
    direct = record(_response([3e6]), pulse, QUIET).samples
    late = record(_response([0, 0, 3e6], latency=2), pulse, QUIET).samples
    assert np.max(np.abs(direct - late)) <= 2**-23
    _, h = sosfreqz(transducers(QUIET), worN=np.array([1_000.0]), fs=44_100)
    at_1k = np.abs(np.sum(direct * np.exp(-2j * np.pi * 1_000 / 44_100 * np.arange(1_000))))
    expected = 0.5 * 3e6 * FLOW_AT_100_DB_M3_S / FULL_SCALE_PA * np.abs(h[0])
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
    assert level == pytest.approx(42, abs=0.1)
    assert np.array_equal(one, same)
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.03


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
