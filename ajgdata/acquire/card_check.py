"""Check of a sound card with its gripper: level, noise, latency and dropouts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.acquire.excitation import excitation_samples
from ajgdata.acquire.sound_card import SoundCard
from ajgdata.types import LogSweep

SWEEP = LogSweep(length_s=1.0, low_hz=20.0, high_hz=20_000.0, amplitude=0.9)
TAKES, SILENCE_S, TAIL_S = 3, 2.0, 0.1
#: Band of the features, in which the noise is measured.
LOW_HZ, HIGH_HZ = 200.0, 12_000.0
#: Peak of a good take, and its limits.
GOOD_DBFS, LOUD_DBFS, QUIET_DBFS = -9.0, -3.0, -30.0
#: Signal-to-noise ratio of a good take, and of an unusable one.
GOOD_SNR_DB, NO_SNR_DB = 20.0, 0.0
_TINY = 1e-30


class Issue(NamedTuple):
    """One result of a check, with its fix. A card with a `fatal` issue cannot be used."""

    problem: str
    fix: str
    fatal: bool = False


class CardCheck(NamedTuple):
    """Measurements of a card; `repeated` counts takes that had a fault."""

    latency_samples: tuple[int, ...]
    peak_dbfs: float
    clipped: int
    xruns: int
    repeated: int
    snr_db: float

    @property
    def latency_spread(self) -> int:
        """Samples between the shortest and the longest latency."""
        return max(self.latency_samples) - min(self.latency_samples)

    @property
    def issues(self) -> list[Issue]:
        """What to change, fatal issues first."""
        lower = f"lower output or input gain until the peak is {GOOD_DBFS:.0f} dBFS"
        higher = f"raise input gain or output until the peak is {GOOD_DBFS:.0f} dBFS"
        snr = f"the sweep is {self.snr_db:.0f} dB above the noise"
        latency = f"latency differs by {self.latency_spread} samples between takes"
        cable = "connect a spare output to a spare input and give --loopback-channel"
        dropouts = f"{self.xruns} xruns reported by the driver, {self.repeated} takes repeated"
        clipped = Issue(f"{self.clipped} samples are clipped", lower, fatal=True)
        loud = Issue(f"peak {self.peak_dbfs:.1f} dBFS is too loud", lower)
        quiet = Issue(f"peak {self.peak_dbfs:.1f} dBFS is too quiet", higher)
        noise = Issue(snr, "play louder, or remove the noise source", self.snr_db < NO_SNR_DB)
        dropout = Issue(dropouts, "close other programs; use another port")
        found = [
            (self.clipped > 0, clipped),
            (not self.clipped and self.peak_dbfs > LOUD_DBFS, loud),
            (self.peak_dbfs < QUIET_DBFS, quiet),
            (self.snr_db < GOOD_SNR_DB, noise),
            (self.latency_spread > 0, Issue(latency, cable)),
            (bool(self.xruns or self.repeated), dropout),
        ]
        issues = [issue for present, issue in found if present]
        return sorted(issues, key=lambda issue: not issue.fatal)

    def facts(self) -> dict[str, str]:
        """Return the measurements as text, by topic."""
        return {
            "latency": f"{self.latency_samples[-1]} samples, spread {self.latency_spread}",
            "level": f"peak {self.peak_dbfs:.1f} dBFS, {self.clipped} samples clipped",
            "noise": f"sweep {self.snr_db:.0f} dB above it ({LOW_HZ:.0f} to {HIGH_HZ:.0f} Hz)",
            "dropouts": f"{self.xruns} xruns, {self.repeated} takes repeated",
        }


def check_card(card: SoundCard, progress: Callable[[str], object] = lambda _: None) -> CardCheck:
    """Measure `card`, with its gripper at rest in a quiet room. Raises CardError.

    `progress` receives the name of the next step.
    """
    rate = card.settings.sample_rate_hz
    sweep = excitation_samples(SWEEP, rate).astype(np.float32)
    takes = []
    for number in range(TAKES):
        progress(f"sweep {number + 1} of {TAKES}")
        takes.append(card.take(sweep, round(TAIL_S * rate)))
    progress("silence: keep quiet")
    silence = card.listen(round(SILENCE_S * rate))
    loopback = card.settings.loopback_channel
    return CardCheck(
        tuple(take.latency_samples if loopback else take.arrival_samples for take in takes),
        peak_dbfs=max(take.peak_dbfs for take in takes),
        clipped=sum(take.clipped for take in takes),
        # Opening the stream causes xruns before the first take.
        xruns=sum(take.xruns for take in takes[1:]),
        repeated=sum(take.attempts - 1 for take in takes),
        snr_db=_snr_db(takes[-1].samples, silence, rate),
    )


def _snr_db(samples: NDArray[Any], silence: NDArray[Any], rate_hz: int) -> float:
    """Return the ratio of the power of a sweep (n,) to that of silence (m,), LOW_HZ to HIGH_HZ."""
    noise = _power(silence, rate_hz) + _TINY
    return float(10 * np.log10(max(_power(samples, rate_hz) / noise - 1, 1e-3)))


def _power(samples: NDArray[Any], rate_hz: int) -> float:
    """Return the mean square of samples (n,) between LOW_HZ and HIGH_HZ, by Parseval."""
    from scipy.signal import periodogram  # half a second

    frequency, power = periodogram(samples, rate_hz, detrend=False, scaling="spectrum")
    return float(power[(frequency >= LOW_HZ) & (frequency < HIGH_HZ)].sum())
