"""Sweep tracking: which frames count, and what that does to noise, tones and sweeps."""

import numpy as np
import pytest

from ajgdata.acquire.excitation import excitation_samples
from ajgdata.features.axes import differing_axes
from ajgdata.features.maker import feature_maker
from ajgdata.features.spectrum import frequencies_hz, spectrum
from ajgdata.features.sweep_tracking import SweepTracking
from ajgdata.types import (
    ChirpTrain,
    FeatureSettings,
    LinearSweep,
    LogSweep,
    MaximumLengthSequence,
    Multitone,
    NotPossibleError,
)

RATE, WINDOW, HOP = 44_100, 2048, 512
FRAMES = 1 + (RATE - WINDOW) // HOP
ALL = FeatureSettings(normalisation="none")
TRACKED = FeatureSettings(kind="sweep_tracking", normalisation="none")
LINEAR = LinearSweep(low_hz=20, high_hz=20_000)
QUANTITIES = ("magnitude", "power", "root_power")


def counted(declared, **changes) -> np.ndarray:
    settings = TRACKED.model_copy(update=changes)
    return SweepTracking(excitation_samples(declared, RATE), RATE, settings).counted(RATE)


@pytest.mark.parametrize(("kind", "at_s"), [
    (LINEAR, lambda f: (f - 20) / 19_980),
    (LogSweep(), lambda f: np.log(f / 20) / np.log(1000)),
])  # fmt: skip
def test_the_frames_that_count_are_those_that_hold_the_moment_of_the_frequency(kind, at_s):
    """Without a decay, a frame counts if its window overlaps the moment, to the 0.07 of the window
    at whose ends the Hann function's square is below -40 dB, and the time it takes to pass two bins
    (the half width of the main lobe)."""
    frequency = frequencies_hz(RATE, ALL)
    found = counted(kind, decay_s=0)
    for k in range(20, 900, 40):
        start = np.flatnonzero(found[:, k]) * HOP / RATE
        moment, passing = at_s(frequency[k]), at_s(frequency[k]) - at_s(frequency[k - 2])
        assert start[-1] <= moment + passing and start[0] + WINDOW / RATE >= moment - passing
        inside = (np.arange(FRAMES) * HOP + 0.07 * WINDOW) / RATE, 0.86 * WINDOW / RATE
        must = (inside[0] < moment) & (moment < inside[0] + inside[1])
        assert found[must, k].all() and must.any()


def test_the_decay_adds_the_frames_that_begin_within_it():
    at_once, later = (counted(LINEAR, decay_s=decay) for decay in (0.0, 0.05))
    hops = int(np.ceil(0.05 * RATE / HOP))
    for k in (50, 300, 700):
        last = np.flatnonzero(at_once[:, k])[-1]
        assert np.flatnonzero(later[:, k])[-1] == last + hops
        assert later[:, k].sum() == at_once[:, k].sum() + hops


def test_what_is_not_played_counts_no_frame():
    found = counted(LinearSweep(low_hz=1_000, high_hz=8_000))
    frequency = frequencies_hz(RATE, ALL)
    assert not found[:, (frequency < 700) | (frequency > 8_300)].any()
    assert found[:, (frequency > 1_100) & (frequency < 7_900)].any(axis=0).all()


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_white_noise_makes_the_pedestal_of_the_frames_that_count(quantity):
    """|X|² of a frame is exponential of mean σ²W, W = Σw²; |X| is Rayleigh of mean √(πσ²W)/2. The
    mean over 900 bins of 83 frames (a third independent) has a deviation of 0.4 and 0.7 %; of nine
    frames (three independent) 1 and 2 %; the bound is four of these."""
    noise = 0.01 * np.random.default_rng(3).standard_normal(RATE)
    energy = 1e-4 * np.sum(np.sin(np.pi * np.arange(WINDOW) / WINDOW) ** 4)
    one = {"magnitude": np.sqrt(np.pi * energy) / 2, "power": energy, "root_power": energy}[
        quantity
    ]
    number = counted(LINEAR).sum(axis=0)
    bins = slice(60, 920)
    for base, frames, bound in ((ALL, FRAMES, 0.03), (TRACKED, number[bins], 0.08)):
        settings = base.model_copy(update={"quantity": quantity})
        make = feature_maker(settings, RATE, excitation_samples(LINEAR, RATE))
        got = make(noise)[bins] ** (2 if quantity == "root_power" else 1)
        assert np.mean(got / (one * frames)) == pytest.approx(1, rel=bound)
    assert number[bins].max() < FRAMES / 6


@pytest.mark.parametrize("declared", [LINEAR, LogSweep()])
def test_the_sweep_itself_is_kept(declared):
    """Frames that do not count hold less than 1e-4 of the energy of the loudest each, hence less
    than 83e-4 of the sum of powers; of that of magnitudes it is what a Hann window's side lobes,
    -31 dB and 18 dB an octave less, leave. The last 0.1 s rings on when the recording ends."""
    played = excitation_samples(declared, RATE)
    late = np.concatenate([np.zeros(400), played])  # 9 ms: within the decay time
    for quantity, lost in (("power", FRAMES * 1e-4), ("magnitude", 0.02)):
        whole = spectrum(late, RATE, ALL.model_copy(update={"quantity": quantity}))
        settings = TRACKED.model_copy(update={"quantity": quantity})
        found = feature_maker(settings, RATE, played)(late)
        inside = slice(3, 800)
        assert (found <= whole * (1 + 1e-6)).all()
        assert (found[inside] > (1 - lost) * whole[inside]).all()


def test_recordings_may_be_shorter_or_longer_than_the_sweep():
    played = excitation_samples(LINEAR, RATE)
    tracking = SweepTracking(played, RATE, TRACKED)
    whole = tracking.feature(played)
    longer = tracking.feature(np.concatenate([played, np.zeros(RATE // 2)]))
    shorter = tracking.feature(played[: RATE // 2])  # 20 Hz to 10 kHz
    np.testing.assert_allclose(longer[:800], whole[:800], rtol=1e-5)  # the last 0.1 s is cut
    np.testing.assert_allclose(shorter[3:390], whole[3:390], rtol=1e-5)
    assert (shorter[560:] == 0).all()
    with pytest.raises(ValueError, match="fewer than one window"):
        tracking.feature(played[:2000])
    with pytest.raises(ValueError, match=r"shape \(n,\)"):
        tracking.feature(played[:, np.newaxis])


@pytest.mark.parametrize(
    "kind", [MaximumLengthSequence(), Multitone(), ChirpTrain(), LogSweep(length_s=0.06)]
)
def test_what_is_no_sweep_is_refused(kind):
    with pytest.raises(NotPossibleError, match="no sweep that can be tracked: a frequency"):
        feature_maker(TRACKED, RATE, excitation_samples(kind, RATE))
    feature_maker(ALL, RATE, excitation_samples(kind, RATE))


def test_an_unknown_or_silent_sound_is_refused():
    with pytest.raises(NotPossibleError, match="sweep_tracking needs the played sound"):
        feature_maker(TRACKED, RATE, None)
    with pytest.raises(NotPossibleError, match="finite and not silent"):
        feature_maker(TRACKED, RATE, np.zeros(RATE))
    with pytest.raises(ValueError, match="no spectrum"):
        spectrum(np.ones(4096), RATE, TRACKED)


def test_stores_of_other_decay_times_do_not_compare():
    def described(**changes):
        features = FeatureSettings(**changes).model_dump(mode="json")
        return {"audio": {"sample_rate_hz": RATE}, "features": features}

    kind = {"kind": "sweep_tracking"}
    one, other = described(**kind), described(**kind, decay_s=0.1)
    assert differing_axes(one, other) == [("features.decay_s", 0.05, 0.1)]
    assert differing_axes(described(), described(decay_s=0.1)) == []
