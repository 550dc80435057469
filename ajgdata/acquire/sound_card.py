"""Recording through a sound card. Takes are checked by markers, and repeated after a fault.

`check_card` measures level, noise, latency and lost frames of a card with its gripper.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import periodogram

from ajgdata.acquire.card import (
    FULL_SCALE,
    Capture,
    CardError,
    CardSettings,
    Sound,
    TakeError,
)
from ajgdata.acquire.excitation import excitation_samples
from ajgdata.acquire.line import PortAudioLine
from ajgdata.acquire.markers import ALIKE, MARKER_S, Arrival, arrival, framed
from ajgdata.acquire.trigger import Trigger
from ajgdata.types import LogSweep, PassiveRecording

#: Longest latency of a card that is detected (s). Takes are shorter after the first measurement.
MAX_LATENCY_S = 2.0
#: Largest apparent change of the latency in a session (s). Objects and fillings of the virtual
#: gripper change it by up to 44 samples (1 ms). A driver changes it by a period; the smallest
#: period in use is 64 samples at 44.1 kHz.
WANDER_S = 0.0014
#: Peak below which an input is silent: 80 dB below full scale.
SILENT_PEAK = 1e-4
#: Sound that `check_card` plays.
TEST_SWEEP = LogSweep(length_s=1.0, low_hz=20.0, high_hz=20_000.0, amplitude=0.9)
#: Number of takes of `check_card`.
TAKES = 3
#: Length of the recording of the noise, and of the silence after the sound of a take.
SILENCE_S = 2.0
TAIL_S = 0.1
#: Band in which the noise is measured.
LOW_HZ = 200.0
HIGH_HZ = 12_000.0
#: Highest and lowest peak of a good take, and its lowest signal-to-noise ratio.
LOUD_DBFS = -3.0
QUIET_DBFS = -30.0
GOOD_SNR_DB = 20.0


class _Fault(NamedTuple):
    """A fault of a take. A further take has a `permanent` fault as well."""

    problem: str
    fix: str
    permanent: bool = False


class SoundCard:
    """A sound card that records through a line.

    The first take measures the latency of the session, unless the session is resumed.
    """

    def __init__(self, line: PortAudioLine, settings: CardSettings) -> None:
        self.settings = settings
        self._line = line
        self._latency: int | None = None
        self._measured = False

    def resume(self, latency_samples: int | None) -> None:
        """Use the known latency of a session that is resumed."""
        self._latency = latency_samples

    def take(self, played: Sound, tail: int = 0) -> Capture:
        """Play `played` float32 (n,) in [-1, 1] and return n + `tail` samples from its arrival on.

        Without a played sound, return the samples of the passive recording. Raises CardError if the
        card is unplugged, silent or wrongly connected, TakeError if each attempt has a fault, and
        ValueError for a sound that cannot be played.
        """
        if isinstance(played, PassiveRecording):
            return self._take_passively(played)
        if played.ndim != 1 or not played.size or not np.all(np.abs(played) <= 1):
            raise ValueError("a sound to play is (n,) within [-1, 1]")
        sound = framed(played, self.settings.sample_rate_hz, tail)
        faults: list[_Fault] = []
        xruns = 0
        for _ in range(self.settings.attempts):
            time = datetime.now(UTC).isoformat(timespec="milliseconds")
            samples, flags = self._line.play(sound.sound, len(sound.sound) + self._margin())
            xruns += len(flags)
            arrived = arrival(np.nan_to_num(samples), sound)
            fault = self._fault(samples, flags, arrived)
            if fault:
                faults.append(fault)
                continue
            if self._latency is None:
                self._latency = arrived.latency_samples
            self._measured = True
            begin = self._latency + sound.start
            return Capture.measured(
                samples[begin : begin + len(played) + tail],
                FULL_SCALE,
                latency_samples=self._latency,
                arrival_samples=arrived.latency_samples,
                xruns=xruns,
                time=time,
                doubts=tuple(fault.problem for fault in faults),
            )
        last = faults[-1]
        if last.permanent:
            raise CardError(self.settings.device, last.problem, last.fix)
        raise self._in_doubt(faults)

    def _take_passively(self, settings: PassiveRecording) -> Capture:
        """Return a passive recording. Raises CardError and TakeError as `take` does.

        There are no markers: only the driver reports lost frames. A recording with a trigger is not
        repeated, because its sound is over.
        """
        trigger = Trigger.from_settings(settings, self.settings.sample_rate_hz)
        level = settings.trigger_dbfs
        attempts = self.settings.attempts if level is None else 1
        faults: list[_Fault] = []
        xruns = 0
        for _ in range(attempts):
            time = datetime.now(UTC).isoformat(timespec="milliseconds")
            samples, flags = self._line.listen(trigger)
            xruns += len(flags)
            if not samples.size:
                problem = f"no sound reached {level:g} dBFS in {settings.time_limit_s:g} s"
                fix = "make the sound again, or change excitation.trigger_dbfs or time_limit_s"
                raise TakeError(self.settings.device, problem, fix)
            if not samples.any():
                silence = self._no_sound(samples)
                raise CardError(self.settings.device, silence.problem, silence.fix)
            fault = _not_numbers(samples)
            if flags and not fault:
                fault = _reported(flags)
            if fault:
                faults.append(fault)
                continue
            return Capture.measured(
                samples,
                FULL_SCALE,
                latency_samples=None,
                arrival_samples=None,
                xruns=xruns,
                time=time,
                doubts=tuple(fault.problem for fault in faults),
            )
        raise self._in_doubt(faults)

    def _in_doubt(self, faults: Sequence[_Fault]) -> TakeError:
        """Return the error of a take in which each attempt had one of `faults`."""
        problem = f"{len(faults)} takes of {len(faults)} in doubt: {faults[-1].problem}"
        return TakeError(self.settings.device, problem, faults[-1].fix)

    def listen(self, frames: int) -> NDArray[np.float32]:
        """Play nothing and return what the microphone records, (frames,). Raises CardError."""
        return self._line.play(np.zeros(frames, dtype=np.float32), frames)[0]

    def describe(self) -> Mapping[str, Any]:
        """Return device, driver, channels and latency, for session.yaml."""
        settings = self.settings.model_dump(mode="json")
        return {**settings, **self._line.describe(), "latency_samples": self._latency}

    def close(self) -> None:
        """Close the card. May be called twice."""
        self._line.close()

    def _margin(self) -> int:
        """Return the number of frames to record after the sound."""
        rate = self.settings.sample_rate_hz
        reserve_s = 0.1 if self._measured else MAX_LATENCY_S
        latest = (self._latency or 0) + reserve_s * rate
        return round(latest + MARKER_S * rate)

    def _fault(
        self, samples: NDArray[np.float32], flags: tuple[str, ...], arrived: Arrival
    ) -> _Fault | None:
        """Return the worst fault of a take (frames,); None if it is good."""
        not_numbers = _not_numbers(samples)
        if not_numbers:
            return not_numbers
        if arrived.likeness <= ALIKE:  # a marker was not recorded
            return self._no_sound(samples)
        if flags:
            return _reported(flags)
        if arrived.lost:
            lost = arrived.lost
            problem = f"{lost} frames lost" if lost > 0 else f"{-lost} frames too many"
            return _Fault(f"{problem} between the markers", "close other programs")
        moved = 0 if self._latency is None else arrived.latency_samples - self._latency
        if abs(moved) > WANDER_S * self.settings.sample_rate_hz:
            problem = f"latency moved by {moved} samples since the session began"
            return _Fault(problem, "record into another --session", permanent=True)
        return None

    def _no_sound(self, samples: NDArray[np.float32]) -> _Fault:
        """Return the fault of a take (frames,) in which the microphone did not record the sound."""
        number = self.settings.microphone
        if np.abs(samples).max() > SILENT_PEAK:
            problem = f"microphone {number} does not record the output"
            return _Fault(problem, "check plug, level and channel of the speaker", permanent=True)
        fix = "check plug, mute, gain and number of the microphone"
        return _Fault(f"microphone {number} is silent", fix, permanent=True)


def _not_numbers(samples: NDArray[np.float32]) -> _Fault | None:
    """Return the fault of samples (frames,) with NaN or infinity; None without them."""
    count = int(np.count_nonzero(~np.isfinite(samples)))
    if not count:
        return None
    return _Fault(f"the driver gave {count} samples that are not numbers", "use another API")


def _reported(flags: Sequence[str]) -> _Fault:
    """Return the fault of a take during which the driver reported `flags`."""
    reports = ", ".join(sorted(set(flags)))
    return _Fault(f"the driver reported {reports}", "close other programs")


@contextmanager
def open_card(settings: CardSettings) -> Iterator[SoundCard]:
    """Yield the sound card of `settings`, with one stream until the end. Raises CardError."""
    card = SoundCard(PortAudioLine(settings), settings)
    try:
        yield card
    finally:
        card.close()


class CardCheck(NamedTuple):
    """Measurements of a sound card.

    `latency_samples` are the latencies of the takes. `clipped` is the number of clipped samples,
    and `repeated` the number of takes that were repeated after a fault.
    """

    latency_samples: tuple[int, ...]
    peak_dbfs: float
    clipped: int
    repeated: int
    snr_db: float

    @property
    def issues(self) -> list[tuple[str, str]]:
        """Return pairs (problem, fix). A clipped recording cannot be used."""
        change_level = "change output or input gain until it is -9 dBFS"
        issues = []
        if self.clipped:
            issues.append((f"{self.clipped} samples are clipped", "lower output or input gain"))
        elif self.peak_dbfs > LOUD_DBFS:
            issues.append(("peak is too loud", change_level))
        if self.peak_dbfs < QUIET_DBFS:
            issues.append(("peak is too quiet", change_level))
        if self.snr_db < GOOD_SNR_DB:
            issues.append(("too much noise", "play louder, or remove its source"))
        spread = max(self.latency_samples) - min(self.latency_samples)
        if spread:
            issues.append((f"latency differs by {spread} samples between takes", "use another API"))
        if self.repeated:
            issues.append(
                (f"{self.repeated} takes repeated", "close other programs; use another port")
            )
        return issues


def check_card(card: SoundCard) -> CardCheck:
    """Measure `card` while its gripper is at rest in a quiet room. Raises CardError."""
    rate = card.settings.sample_rate_hz
    sweep = excitation_samples(TEST_SWEEP, rate).astype(np.float32)
    takes = [card.take(sweep, round(TAIL_S * rate)) for _ in range(TAKES)]
    noise = _power(card.listen(round(SILENCE_S * rate)), rate) + 1e-30
    signal = _power(takes[-1].samples, rate)
    return CardCheck(
        tuple(take.arrival_samples for take in takes if take.arrival_samples is not None),
        peak_dbfs=max(take.peak_dbfs for take in takes),
        clipped=sum(take.clipped for take in takes),
        repeated=sum(take.attempts - 1 for take in takes),
        snr_db=float(10 * np.log10(max(signal / noise - 1, 1e-3))),
    )


def _power(samples: NDArray[Any], rate_hz: int) -> float:
    """Return the mean square of samples (n,) between LOW_HZ and HIGH_HZ, by Parseval's theorem."""
    frequency, power = periodogram(samples, rate_hz, detrend=False, scaling="spectrum")
    return float(power[(frequency >= LOW_HZ) & (frequency < HIGH_HZ)].sum())
