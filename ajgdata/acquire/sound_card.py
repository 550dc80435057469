"""Recording through a sound card: between markers, checked, cut, repeated after a fault.

`check_card` measures level, noise, latency and lost frames of a card with its gripper.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.acquire.card import Capture, CardError, CardSettings, TakeError
from ajgdata.acquire.excitation import excitation_samples
from ajgdata.acquire.line import PortAudioLine
from ajgdata.acquire.markers import ALIKE, MARKER_S, Arrival, arrival, framed
from ajgdata.types import LogSweep

#: Longest latency of a card that is detected. Once it is known, takes are shorter.
MAX_LATENCY_S = 2.0
#: Largest apparent change of the latency in a session. Objects and fillings of the virtual gripper
#: change it by up to 44 samples (1 ms); a driver that moves it does so by a period, of which the
#: smallest in use is 64 samples at 44.1 kHz.
WANDER_S = 0.0014
#: Full scale of a 16-bit converter, the smallest in use.
FULL_SCALE = 1 - 2.0**-15
#: Peak below which an input is silent: 80 dB below full scale.
SILENT_PEAK = 1e-4
#: Takes of `check_card`, and the sound that it plays.
TEST_SWEEP = LogSweep(length_s=1.0, low_hz=20.0, high_hz=20_000.0, amplitude=0.9)
TAKES, SILENCE_S, TAIL_S = 3, 2.0, 0.1
#: Band of the features (Hz), in which the noise is measured.
LOW_HZ, HIGH_HZ = 200.0, 12_000.0
#: Limits of the peak of a good take, and its least signal-to-noise ratio.
LOUD_DBFS, QUIET_DBFS, GOOD_SNR_DB = -3.0, -30.0, 20.0


class _Fault(NamedTuple):
    problem: str
    fix: str
    permanent: bool = False


class SoundCard:
    """Records through a line. The first take measures the latency of the session, unless
    the session is resumed."""

    def __init__(self, line: PortAudioLine, settings: CardSettings) -> None:
        self.settings = settings
        self._line = line
        self._latency: int | None = None
        self._measured = False

    def resume(self, latency_samples: int | None) -> None:
        """Use the known latency of a session that is resumed."""
        self._latency = latency_samples

    def take(self, played: NDArray[np.float32], tail: int = 0) -> Capture:
        """Play `played` float32 (n,) in [-1, 1] and return n + `tail` samples from when it arrived.

        Raises CardError when the card is gone, silent or wrongly connected, TakeError when each
        attempt has a fault, ValueError for a sound that cannot be played.
        """
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
            if fault := self._fault(samples, flags, arrived):
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
        problem = f"{len(faults)} takes of {len(faults)} in doubt: {last.problem}"
        raise TakeError(self.settings.device, problem, last.fix)

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
        known = (self._latency or 0) + (0.1 if self._measured else MAX_LATENCY_S) * rate
        return round(known + MARKER_S * rate)

    def _fault(
        self, samples: NDArray[np.float32], flags: tuple[str, ...], arrived: Arrival
    ) -> _Fault | None:
        """Return the worst fault of a take (frames,); None if it is good."""
        if bad := int(np.count_nonzero(~np.isfinite(samples))):
            return _Fault(f"the driver gave {bad} samples that are not numbers", "use another API")
        if arrived.likeness <= ALIKE:  # a marker was not recorded
            return self._no_sound(samples)
        if flags:
            reports = ", ".join(sorted(set(flags)))
            return _Fault(f"the driver reported {reports}", "close other programs")
        if lost := arrived.lost:
            problem = f"{lost} frames lost" if lost > 0 else f"{-lost} frames too many"
            return _Fault(f"{problem} between the markers", "close other programs")
        moved = 0 if self._latency is None else arrived.latency_samples - self._latency
        if abs(moved) > WANDER_S * self.settings.sample_rate_hz:
            problem = f"latency moved by {moved} samples since the session began"
            return _Fault(problem, "record into another --session", permanent=True)
        return None

    def _no_sound(self, samples: NDArray[np.float32]) -> _Fault:
        """Return the reason for a take (frames,) without the sound at the microphone."""
        number = self.settings.microphone
        if np.abs(samples).max() > SILENT_PEAK:
            problem = f"microphone {number} does not record the output"
            return _Fault(problem, "check plug, level and channel of the speaker", permanent=True)
        fix = "check plug, mute, gain and number of the microphone"
        return _Fault(f"microphone {number} is silent", fix, permanent=True)


@contextmanager
def open_card(settings: CardSettings) -> Iterator[SoundCard]:
    """Yield the sound card of `settings`, with one stream until the end. Raises CardError."""
    card = SoundCard(PortAudioLine(settings), settings)
    try:
        yield card
    finally:
        card.close()


class CardCheck(NamedTuple):
    """Measurements of a card: latencies of its takes (samples), loudest peak (dBFS), clipped
    samples, takes that were repeated after a fault, and signal-to-noise ratio (dB)."""

    latency_samples: tuple[int, ...]
    peak_dbfs: float
    clipped: int
    repeated: int
    snr_db: float

    @property
    def issues(self) -> list[str]:
        """Return problems with their fixes. A clipped recording cannot be used."""
        spread = max(self.latency_samples) - min(self.latency_samples)
        level = "change output or input gain until it is -9 dBFS"
        limits = {
            f"{self.clipped} samples are clipped; lower output or input gain": self.clipped,
            f"peak is too loud; {level}": self.peak_dbfs > LOUD_DBFS and not self.clipped,
            f"peak is too quiet; {level}": self.peak_dbfs < QUIET_DBFS,
            "too much noise; play louder, or remove its source": self.snr_db < GOOD_SNR_DB,
            f"latency differs by {spread} samples between takes; use another API": spread,
            f"{self.repeated} takes repeated; close other programs; use another port": (
                self.repeated
            ),
        }
        return [issue for issue, present in limits.items() if present]


def check_card(card: SoundCard) -> CardCheck:
    """Measure `card`, with its gripper at rest in a quiet room. Raises CardError."""
    rate = card.settings.sample_rate_hz
    sweep = excitation_samples(TEST_SWEEP, rate).astype(np.float32)
    takes = [card.take(sweep, round(TAIL_S * rate)) for _ in range(TAKES)]
    noise = _power(card.listen(round(SILENCE_S * rate)), rate) + 1e-30
    signal = _power(takes[-1].samples, rate)
    return CardCheck(
        tuple(take.arrival_samples for take in takes),
        peak_dbfs=max(take.peak_dbfs for take in takes),
        clipped=sum(take.clipped for take in takes),
        repeated=sum(take.attempts - 1 for take in takes),
        snr_db=float(10 * np.log10(max(signal / noise - 1, 1e-3))),
    )


def _power(samples: NDArray[Any], rate_hz: int) -> float:
    """Return the mean square of samples (n,) between LOW_HZ and HIGH_HZ, by Parseval."""
    from scipy.signal import periodogram  # half a second

    frequency, power = periodogram(samples, rate_hz, detrend=False, scaling="spectrum")
    return float(power[(frequency >= LOW_HZ) & (frequency < HIGH_HZ)].sum())
