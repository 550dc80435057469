"""Takes through a sound card: what comes back is what was played, or it is not kept."""

import numpy as np
import pytest
from fake_card import RATE_HZ, FakeLine, Fault, fake_card
from scipy.signal import fftconvolve

from ajgdata.acquire.card import CardError, TakeError
from ajgdata.acquire.markers import ALIKE, MAX_LOST_FRAMES, arrival, framed
from ajgdata.gripper import excitation_sweep

SWEEP = excitation_sweep().astype(np.float32)
#: Peaks at its sixth sample, rings for a while, and dies away within the gap.
RINGING = np.r_[0, 0, 0, 0.01, 0.03, 0.05 * 0.96 ** np.arange(200) * np.cos(np.arange(200))]


@pytest.mark.parametrize("latency", [0, 80_787])
def test_latency_is_measured_and_taken_out(latency):
    card = fake_card(FakeLine(np.array([0.5]), latency=latency))
    take = card.take(SWEEP, tail=100)
    assert take.latency_samples == latency and take.attempts == 1
    np.testing.assert_allclose(take.samples, np.r_[0.5 * SWEEP, np.zeros(100)], atol=1e-7)
    assert card.take(SWEEP).latency_samples == latency


@pytest.mark.parametrize(
    "fault, doubt",
    [
        (Fault(delete=1), "1 frames lost between the markers"),
        (Fault(insert=64), "64 frames too many between the markers"),
        (Fault(flags=("input overflow",)), "the driver reported input overflow"),
    ],
)
def test_a_take_in_doubt_is_repeated(fault, doubt):
    line = FakeLine(RINGING, noise=1e-3, faults=[fault])
    take = fake_card(line).take(SWEEP)
    assert (take.doubts, take.xruns, line.takes) == ((doubt,), len(fault.flags), 2)


def test_resonances_louder_than_the_markers_change_nothing():
    """A sharp resonance, which the sweep excites fully and the markers do not: what is alike is
    told by shape, and where it begins by its first part."""
    rng = np.random.default_rng(3)
    for hz in (2_500, 11_000):
        time = np.arange(6_000) / RATE_HZ
        ring = np.sin(2 * np.pi * hz * time) * np.exp(-time / 0.02)
        response = 0.01 * (np.eye(1, 6_000, 20)[0] + 0.3 * np.r_[np.zeros(20), ring[:-20]])
        sound = framed(SWEEP, RATE_HZ)
        recording = np.r_[np.zeros(1_000), fftconvolve(sound.sound, response)]
        result = arrival(recording + 1e-5 * rng.standard_normal(len(recording)), sound)
        assert result.lost == 0 and result.likeness > 0.99
        assert abs(result.latency_samples - 1_020) < 40


def test_clipping_is_counted_and_cut_at_full_scale():
    take = fake_card(FakeLine(np.array([2.0]))).take(SWEEP)
    assert take.clipped == np.count_nonzero(2 * np.abs(SWEEP) >= 1 - 2**-15)
    assert take.samples.max() == 1 and take.samples.min() == -1
    assert take.peak_dbfs == pytest.approx(20 * np.log10(2 * np.abs(SWEEP).max()), abs=0.01)


@pytest.mark.parametrize(
    "line, said",
    [
        (FakeLine(faults=[Fault(silent=True)] * 3), "microphone 1 is silent. Check plug"),
        (
            FakeLine(noise=1e-2, faults=[Fault(silent=True)] * 3),
            r"microphone 1 does not record the output. Check plug",
        ),
        (FakeLine(faults=[Fault(unplugged=True)]), "went away while it played"),
    ],
)
def test_what_is_wrong_with_the_card_is_said_after_the_first_take(line, said):
    with pytest.raises(CardError, match=said) as raised:
        fake_card(line).take(SWEEP)
    assert not isinstance(raised.value, TakeError)


def test_latency_that_moves_within_a_session_is_refused_and_a_little_is_not():
    """A little is another object: what is taken out stays, what was measured is noted."""
    line = FakeLine(RINGING, faults=[Fault(), Fault(shift=50), *[Fault(shift=64)] * 3])
    card = fake_card(line)
    first, second = (card.take(SWEEP) for _ in range(2))
    assert first.latency_samples == second.latency_samples == first.arrival_samples
    assert second.arrival_samples == first.arrival_samples + 50
    np.testing.assert_allclose(second.samples[50:], first.samples[:-50], atol=1e-6)
    with pytest.raises(CardError, match="latency moved by 64 samples"):
        card.take(SWEEP)


def test_a_session_that_goes_on_is_cut_as_before():
    card = fake_card(FakeLine(latency=1_050))
    card.resume(1_024)
    take = card.take(SWEEP)
    assert (take.latency_samples, take.arrival_samples) == (1_024, 1_050)
    assert card.describe()["latency_samples"] == 1_024
    other = fake_card(FakeLine(np.array([0.5]), latency=61_024))
    other.resume(1_024)  # measured anew, however far it is
    with pytest.raises(CardError, match="latency moved by 60000 samples"):
        other.take(SWEEP)


def test_noise_alone_is_not_taken_for_markers():
    """The largest of 16,384 correlations, each with a deviation of about 1/sqrt(400)."""
    sound = framed(SWEEP[:4_410], RATE_HZ)  # the windows of a short sound meet
    rng = np.random.default_rng(0)
    results = [
        arrival(rng.standard_normal(len(sound.sound) + MAX_LOST_FRAMES), sound) for _ in range(40)
    ]
    assert max(result.likeness for result in results) < 0.45 < ALIKE
