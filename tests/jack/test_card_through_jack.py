"""Takes through PortAudio and JACK, against a plant that is known to the last bit."""

import os
import signal
import threading
import time
from contextlib import contextmanager

import numpy as np
import pytest
from simulated_card import PERIOD

from ajgdata.acquire.card import CardError, TakeError
from ajgdata.acquire.sound_card import open_card
from ajgdata.gripper import excitation_sweep
from ajgdata.types import PassiveRecording

#: Of 15 bits, and a response of few: each product and sum is exact in float64, and none is lost in
#: float32 or 24 bits.
SWEEP = (np.round(excitation_sweep(amplitude=0.5) * 2**14) / 2**14).astype(np.float32)
RESPONSE = np.array([0, 0.5, 0.25, 0, -0.125])
PATIENCE_S = 60


@contextmanager
def freewheeling():
    """Time runs as fast as all clients can follow, so a busy machine misses nothing: only for
    clients that exist already."""
    with clock() as (control, _):
        control.set_freewheel(True)
        yield


def client(name):
    """Open a JACK client; a busy server refuses some attempts."""
    import jack

    end = time.monotonic() + PATIENCE_S
    while True:
        try:
            return jack.Client(name, no_start_server=True)
        except jack.JackOpenError:
            if time.monotonic() > end:
                raise
            time.sleep(0.2)


@contextmanager
def clock():
    """Yield a JACK client that controls the time, and an event: the server missed a cycle."""
    control = client("ajgdata-test")
    missed = threading.Event()
    control.set_xrun_callback(lambda _: missed.set())
    try:
        control.activate()
        yield control, missed
    finally:
        control.set_freewheel(False)
        control.close()


def test_every_take_is_the_convolution_bit_for_bit(rig):
    """In freewheel each take needs a fraction of its second."""
    started = rig(RESPONSE)
    expected = np.convolve(SWEEP.astype(float), RESPONSE)[: len(SWEEP)].astype(np.float32)
    with open_card(started.settings) as card, freewheeling():
        card.resume(PERIOD)
        takes = [card.take(SWEEP) for _ in range(100)]
    exact = sum(np.array_equal(take.samples, expected) for take in takes)
    latencies = {take.latency_samples for take in takes}
    assert (exact, latencies) == (100, {PERIOD})


def paused(pid: int, seconds: float = 0.4) -> None:
    os.kill(pid, signal.SIGSTOP)
    time.sleep(seconds)
    os.kill(pid, signal.SIGCONT)


@pytest.mark.parametrize("who", ["recorder", "server"])
def test_whoever_stalls_in_real_time_the_take_that_is_kept_is_exact(rig, who):
    """Repeated until nothing was missed; what is kept equals the convolution as ever. Attempts
    after the stall are in freewheel, because a busy machine may miss something in each."""
    started = rig(RESPONSE, attempts=10)
    expected = np.convolve(SWEEP.astype(float), RESPONSE)[: len(SWEEP)].astype(np.float32)
    with open_card(started.settings) as card, clock() as (control, missed):
        card.resume(PERIOD)
        pid = card._line._process.pid if who == "recorder" else started.jackd

        def stall() -> None:
            missed.clear()
            paused(pid)
            missed.wait(PATIENCE_S)
            control.set_freewheel(True)

        with started.at_next_sound(stall):
            take = card.take(SWEEP)
    assert take.doubts
    np.testing.assert_array_equal(take.samples, expected)


@pytest.mark.parametrize("who", ["server", "recorder"])
def test_whoever_is_killed_is_missed_without_another_attempt(rig, who):
    started = rig(RESPONSE, attempts=6)
    with open_card(started.settings) as card:
        with freewheeling():
            card.take(SWEEP)
        pid = card._line._process.pid if who == "recorder" else started.jackd
        kill = started.at_next_sound(lambda: os.kill(pid, signal.SIGKILL))
        with pytest.raises(CardError) as raised, kill:
            card.take(SWEEP)
    assert type(raised.value) is CardError  # a TakeError follows the last attempt
    # The server of a killed card ends with it.
    said = "its process has ended" if who == "recorder" else "was disconnected while it played"
    assert said in str(raised.value)


def test_each_passive_recording_is_a_part_of_the_known_noise(rig):
    """The noise has a seed: a lost frame would make a recording differ from each part of it."""
    level = 3.9e-2  # 3.9 standard deviations, which the noise reaches every 0.2 s
    settings = PassiveRecording(
        length_s=0.3, trigger_dbfs=20 * np.log10(level), pre_trigger_s=0.1, time_limit_s=60
    )
    frames = 13_230
    before = 4_410
    started = rig(noise=1e-2, attempts=1)
    with open_card(started.settings) as card, freewheeling():
        takes = [card.take(settings) for _ in range(5)]
    noise = 1e-2 * np.random.default_rng(0).standard_normal(40_000_000)
    noise = (np.round(noise * 2**23) / 2**23).astype(np.float32)
    for take in takes:
        first = take.samples[before]
        assert abs(first) >= level
        starts = np.flatnonzero(noise == first) - before
        parts = [noise[start : start + frames] for start in starts if start >= 0]
        assert any(np.array_equal(part, take.samples) for part in parts)
        assert (take.latency_samples, take.attempts) == (None, 1)


def test_no_trigger_is_reported_and_the_card_records_again(rig):
    started = rig(noise=1e-3)
    quiet = PassiveRecording(length_s=0.2, trigger_dbfs=-20, time_limit_s=1)
    with open_card(started.settings) as card, freewheeling():
        with pytest.raises(TakeError, match="no sound reached -20 dBFS in 1 s"):
            card.take(quiet)
        samples = card.take(PassiveRecording(length_s=0.2)).samples
    assert len(samples) == 8_820
    assert samples.std() == pytest.approx(1e-3, rel=0.05)  # six times 1/sqrt(2 n)
