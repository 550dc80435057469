"""A take through a sound card: played between markers, checked, cut, repeated when in doubt."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.acquire.card import Capture, CardError, CardSettings, Heard, TakeError
from ajgdata.acquire.markers import MARKER_S, Arrival, Framed, arrival, framed

if TYPE_CHECKING:
    from ajgdata.acquire.line import PortAudioLine

#: Longest way through a card that is looked for; afterwards it is known, and takes are short.
MOST_LATENCY_S = 2.0
#: A session's latency may seem to move by this much when another object is held: over all fillings
#: and objects of the virtual gripper by 44 samples (1 ms). By more, the driver has moved it: the
#: smallest period in use, 64 samples at 44.1 kHz, is more.
WANDER_S = 0.0014
#: Full scale of a 16-bit converter, the smallest of those in use.
FULL_SCALE = 1 - 2.0**-15
#: Peak below which an input is called silent: 80 dB below full scale.
SILENT = 1e-4


class _Doubt(NamedTuple):
    problem: str
    fix: str
    for_good: bool = False


class SoundCard:
    """Takes through a line (see Card). The first one measures the latency of the session, unless it
    resumes one."""

    def __init__(self, line: PortAudioLine, settings: CardSettings) -> None:
        self.settings = settings
        self._line = line
        self._latency: int | None = None
        self._measured = False

    def resume(self, latency_samples: int | None) -> None:
        """Go on with a session whose latency is known: takes are cut alike before and after."""
        self._latency = latency_samples

    def take(self, played: NDArray[np.float32], tail: int = 0) -> Capture:
        """Play `played` float32 (n,) in [-1, 1] and return n + `tail` samples from when it arrived.

        Raises CardError when the card is gone, silent or wrongly connected, TakeError when each
        attempt left a doubt, ValueError for a sound that cannot be played.
        """
        if played.ndim != 1 or not played.size or not np.all(np.abs(played) <= 1):
            raise ValueError("a sound to play is (n,) within [-1, 1]")
        sound = framed(played, self.settings.sample_rate_hz, tail)
        doubts: list[_Doubt] = []
        xruns = 0
        while len(doubts) < self.settings.attempts:
            time = datetime.now(UTC).isoformat(timespec="milliseconds")
            heard = self._line.play(sound.sound, len(sound.sound) + self._margin())
            xruns += len(heard.flags)
            found, reference = self._arrivals(heard.samples, sound)
            if doubt := self._doubt(heard, found, reference):
                doubts.append(doubt)
                continue
            if self._latency is None or self.settings.loopback_channel:
                self._latency = reference.latency_samples
            self._measured = True
            begin = self._latency + sound.start
            channel = self.settings.input_channel - 1
            samples = heard.samples[begin : begin + len(played) + tail, channel]
            delays = self._latency, found.latency_samples
            return _capture(samples, delays, xruns, time, [one.problem for one in doubts])
        last = doubts[-1]
        if last.for_good:
            raise CardError(self.settings.device, last.problem, last.fix)
        problem = f"{len(doubts)} takes of {len(doubts)} in doubt: {last.problem}"
        raise TakeError(self.settings.device, problem, last.fix)

    def listen(self, frames: int) -> Capture:
        """Play nothing and return `frames` samples: what the microphone hears by itself.

        There is nothing to measure a delay by. Raises CardError when the card is gone, TakeError
        when the driver reports faults in each attempt.
        """
        nothing = np.zeros(frames, dtype=np.float32)
        time = datetime.now(UTC).isoformat(timespec="milliseconds")
        reported: list[str] = []
        for _ in range(self.settings.attempts):
            heard = self._line.play(nothing, frames)
            samples = heard.samples[:, self.settings.input_channel - 1]
            if not heard.flags and np.all(np.isfinite(samples)):
                return _capture(samples, (None, None), len(reported), time, reported)
            reported.append(", ".join(heard.flags) or "samples that are no numbers")
        problem = f"the driver reported {reported[-1]} in each of {len(reported)} takes"
        raise TakeError(self.settings.device, problem, "close other programs")

    def describe(self) -> Mapping[str, Any]:
        """Return device, driver, channels and latency, as session.yaml keeps them."""
        settings = self.settings.model_dump(mode="json")
        return {**settings, **self._line.describe(), "latency_samples": self._latency}

    def close(self) -> None:
        """Let the card go. May be called twice."""
        self._line.close()

    def _margin(self) -> int:
        """Frames to record beyond the sound."""
        rate = self.settings.sample_rate_hz
        known = (self._latency or 0) + (0.1 if self._measured else MOST_LATENCY_S) * rate
        return round(known + MARKER_S * rate)

    def _arrivals(self, samples: NDArray[np.float32], sound: Framed) -> tuple[Arrival, Arrival]:
        """Return the arrival at the microphone, and that which latency is measured by."""
        microphone, loopback = self.settings.input_channel, self.settings.loopback_channel
        if not np.all(np.isfinite(samples)):
            return Arrival(0, 0, 0.0), Arrival(0, 0, 0.0)
        heard = arrival(samples[:, microphone - 1], sound)
        return heard, arrival(samples[:, loopback - 1], sound) if loopback else heard

    def _doubt(self, heard: Heard, found: Arrival, reference: Arrival) -> _Doubt | None:
        """Return what speaks against a take, the worst first; None if nothing does."""
        samples, settings = heard.samples, self.settings
        if bad := int(np.count_nonzero(~np.isfinite(samples))):
            return _Doubt(f"the driver gave {bad} samples that are no numbers", "use another API")
        if not found.found:
            return self._unheard(samples)
        if not reference.found:
            number = settings.loopback_channel
            return _Doubt(
                f"input {number}, the loop-back, does not hear the output",
                "connect it with a cable, or leave the loop-back channel out",
                for_good=True,
            )
        if heard.flags:
            said = ", ".join(sorted(set(heard.flags)))
            return _Doubt(f"the driver reported {said}", "close other programs")
        return self._moved(found, reference)

    def _moved(self, found: Arrival, reference: Arrival) -> _Doubt | None:
        """Return a doubt if frames were lost in this take, or before it."""
        if lost := reference.lost or found.lost:
            what = f"{lost} frames lost" if lost > 0 else f"{-lost} frames too many"
            return _Doubt(f"{what} between the markers", "close other programs")
        if self._latency is not None and self.settings.loopback_channel is None:
            moved = reference.latency_samples - self._latency
            if abs(moved) > WANDER_S * self.settings.sample_rate_hz:
                problem = f"latency moved by {moved} samples since the session began"
                fix = "record into another --session; with a loop-back cable it may move"
                return _Doubt(problem, fix, for_good=True)
        return None

    def _unheard(self, samples: NDArray[np.float32]) -> _Doubt:
        """Say where the sound is instead of on the microphone's channel."""
        number = self.settings.input_channel
        peaks = np.abs(samples).max(axis=0)
        peak = 20 * np.log10(max(float(peaks[number - 1]), 1e-10))
        skip = {number, self.settings.loopback_channel}
        louder = [n + 1 for n, p in enumerate(peaks) if n + 1 not in skip and p > SILENT]
        if peaks[number - 1] <= SILENT and louder:
            problem = f"input {number} is silent, input {louder[0]} is not: wrong channel"
            return _Doubt(problem, f"use input channel {louder[0]}", for_good=True)
        if peaks[number - 1] <= SILENT:
            problem = f"input {number} is silent (peak {peak:.0f} dBFS)"
            return _Doubt(problem, "check plug, mute and gain of the microphone", for_good=True)
        problem = f"input {number} does not hear the output (peak {peak:.0f} dBFS)"
        return _Doubt(problem, "check plug, level and channel of the speaker", for_good=True)


def _capture(
    samples: NDArray[np.float32],
    delays: tuple[int | None, int | None],
    xruns: int,
    time: str,
    doubts: Sequence[str],
) -> Capture:
    """Return what is kept of samples (n,) beyond doubt; `delays` are latency and arrival."""
    peak = float(np.abs(samples).max())
    return Capture(
        np.clip(samples, -1.0, 1.0),
        *delays,
        peak_dbfs=20 * float(np.log10(max(peak, 1e-10))),
        clipped=int(np.count_nonzero(np.abs(samples) >= FULL_SCALE)),
        xruns=xruns,
        time=time,
        doubts=tuple(doubts),
    )
