"""Check of a sound card with its gripper: level, noise, latency and dropouts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.acquire.excitation import excitation_samples
from ajgdata.acquire.sound_card import SoundCard
from ajgdata.features.spectrum import third_octaves
from ajgdata.types import LogSweep

SWEEP = LogSweep(length_s=1.0, low_hz=20.0, high_hz=20_000.0, amplitude=0.9)
TAKES, SILENCE_S, TAIL_S = 3, 2.0, 0.1
#: Frequencies of a gripper's features, in which noise is measured.
LOW_HZ, HIGH_HZ = 200.0, 12_000.0
#: Peak of a good take, and the limits between which it may stay as it is.
GOOD_DBFS, LOUD_DBFS, QUIET_DBFS = -9.0, -3.0, -30.0
#: Signal-to-noise ratio of a good take, and of one that cannot be used.
GOOD_SNR_DB, NO_SNR_DB = 30.0, 10.0
_TINY = 1e-30

Level = Literal["good", "change", "bad"]


class Advice(NamedTuple):
    """Part of a verdict: *bad* cannot be used, *change* should be, *good* is. `fix` says how."""

    level: Level
    topic: str
    problem: str
    fix: str = ""


@dataclass(frozen=True)
class CardCheck:
    """Measures of a card."""

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
    def verdict(self) -> tuple[Advice, ...]:
        """What to change, the worst first; a single *good* line if there is nothing."""
        order = {"bad": 0, "change": 1}
        advice = sorted([*_levels(self), *_timing(self)], key=lambda one: order[one.level])
        return tuple(advice) or (Advice("good", "all", "the card is ready: record"),)

    def facts(self) -> dict[str, str]:
        """Return the measures as text, by topic."""
        return {
            "latency": f"{self.latency_samples[-1]} samples, spread {self.latency_spread}",
            "level": f"peak {self.peak_dbfs:.1f} dBFS, {self.clipped} samples clipped",
            "noise": f"sweep {self.snr_db:.0f} dB above it (median of third octaves)",
            "dropouts": f"{self.xruns} xruns, {self.repeated} takes repeated",
        }


def check_card(card: SoundCard, progress: Callable[[str], object] = lambda _: None) -> CardCheck:
    """Measure `card`, of a gripper that lies still in a quiet room. Raises CardError.

    `progress` receives the name of the next step.
    """
    rate = card.settings.sample_rate_hz
    sweep = excitation_samples(SWEEP, rate).astype(np.float32)
    takes = []
    for number in range(TAKES):
        progress(f"sweep {number + 1} of {TAKES}")
        takes.append(card.take(sweep, round(TAIL_S * rate)))
    progress("silence: keep quiet")
    silence = card.listen(round(SILENCE_S * rate)).samples
    delays = [
        take.latency_samples if card.settings.loopback_channel else take.arrival_samples
        for take in takes
    ]
    return CardCheck(
        latency_samples=tuple(delay or 0 for delay in delays),
        peak_dbfs=max(take.peak_dbfs for take in takes),
        clipped=sum(take.clipped for take in takes),
        # Opening the stream causes xruns before the first take.
        xruns=sum(take.xruns for take in takes[1:]),
        repeated=sum(take.attempts - 1 for take in takes),
        snr_db=_snr_db(takes[-1].samples, silence, rate),
    )


def _snr_db(heard: NDArray[Any], silence: NDArray[Any], rate_hz: int) -> float:
    """Return the median signal-to-noise ratio of third octaves while the sweep is in the band.

    The sweep is in each third octave for length_s/(3 octaves); its energy is that of `heard` (n,)
    without the power of `silence` (m,).
    """
    centres = third_octaves(LOW_HZ, min(HIGH_HZ, 0.4 * rate_hz))
    noise = _band_powers(silence, rate_hz, centres)
    octaves = np.log2(SWEEP.high_hz / SWEEP.low_hz)
    share = SWEEP.length_s * (np.log2(10) / 10) / octaves * rate_hz / len(heard)
    power = (_band_powers(heard, rate_hz, centres) - noise) / share
    ratio = np.maximum(power, noise + _TINY) / (noise + _TINY)
    return float(np.median(10 * np.log10(ratio)))


def _band_powers(samples: NDArray[Any], rate_hz: int, centres_hz: NDArray[Any]) -> NDArray[Any]:
    """Return the mean square of samples (n,) in each third octave (bands,), by Parseval."""
    from scipy.signal import periodogram  # half a second

    frequency, power = periodogram(samples, rate_hz, detrend=False, scaling="spectrum")
    edges = centres_hz[:, None] * 10 ** np.array([-0.05, 0.05])
    inside = (frequency >= edges[:, :1]) & (frequency < edges[:, 1:])
    return np.asarray((inside * power).sum(axis=1))


def _levels(check: CardCheck) -> list[Advice]:
    """Return advice about loudness and noise."""
    peak, target = check.peak_dbfs, f"until the peak is {GOOD_DBFS:.0f} dBFS"
    advice = []
    if check.clipped:
        problem = f"{check.clipped} samples are clipped"
        advice.append(Advice("bad", "level", problem, f"lower output or input gain {target}"))
    elif peak > LOUD_DBFS:
        problem = f"peak {peak:.1f} dBFS is too loud"
        advice.append(Advice("change", "level", problem, f"lower output or input gain {target}"))
    elif peak < QUIET_DBFS:
        problem = f"peak {peak:.1f} dBFS is too quiet"
        advice.append(Advice("change", "level", problem, f"raise input gain or output {target}"))
    if check.snr_db < GOOD_SNR_DB:
        level: Level = "bad" if check.snr_db < NO_SNR_DB else "change"
        problem = f"the sweep is {check.snr_db:.0f} dB above the noise"
        advice.append(Advice(level, "noise", problem, "play louder, or remove the noise source"))
    return advice


def _timing(check: CardCheck) -> list[Advice]:
    """Return advice about latency and lost frames."""
    advice = []
    if check.latency_spread:
        problem = f"latency differs by {check.latency_spread} samples between takes"
        cable = "connect a spare output to a spare input and give --loopback-channel"
        advice.append(Advice("change", "latency", problem, cable))
    if check.xruns or check.repeated:
        problem = f"the driver reported {check.xruns} xruns, {check.repeated} takes were repeated"
        fix = "close other programs; use another port"
        advice.append(Advice("change", "dropouts", problem, fix))
    return advice
