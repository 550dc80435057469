"""Check of a sound card with its gripper: level, noise, latency and lost frames."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.acquire.excitation import excitation_samples
from ajgdata.acquire.sound_card import SoundCard
from ajgdata.types import LogSweep

SWEEP = LogSweep(length_s=1.0, low_hz=20.0, high_hz=20_000.0, amplitude=0.9)
TAKES, SILENCE_S, TAIL_S = 3, 2.0, 0.1
#: Band of the features (Hz), in which the noise is measured.
LOW_HZ, HIGH_HZ = 200.0, 12_000.0
#: Limits of the peak of a good take, and its least signal-to-noise ratio.
LOUD_DBFS, QUIET_DBFS, GOOD_SNR_DB = -3.0, -30.0, 20.0


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
    sweep = excitation_samples(SWEEP, rate).astype(np.float32)
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
