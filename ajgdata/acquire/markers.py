"""Marker chirps before and after a sound: where it arrived, and if frames were lost on the way.

Drivers do not report every frame they lose. Whatever is lost, or played twice, between two equal
chirps changes the distance between them, and both pass through the same gripper, so that its
response does not matter.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

MARKER_S = 0.02
#: Silence on both sides of the sound: the gripper has died away before what comes next.
GAP_S = 0.05
#: Most frames that may be lost and still be counted; more leave the second marker unfound.
MAX_LOST_FRAMES = 8_192
#: Samples of a marker's compressed response that are compared; they fit into the gap.
RESPONSE = 2_048
#: Likeness of the two markers below which they are not the same sound. Noise alone reaches 0.4: the
#: largest of 2 MAX_LOST_FRAMES correlations of some 400 independent values each.
ALIKE = 0.5
#: Part of its peak at which a compressed marker begins, well between two samples of a marker's own.
ONSET = 0.35
#: Part of the largest energy below which there is nothing to be alike.
QUIET_SHARE = 1e-9


@dataclass(frozen=True)
class Framed:
    """A sound between markers: `sound` (m,) is marker, gap, played, gap and tail, marker.

    `start` is where the played sound begins, `second` where the second marker does.
    """

    sound: NDArray[np.float32]
    marker: NDArray[np.float64]
    start: int
    second: int


class Arrival(NamedTuple):
    """Where a framed sound arrived: `latency_samples` after it was played, `lost` frames fewer
    between its markers than were played (negative: more), and how much alike they are, 0 to 1."""

    latency_samples: int
    lost: int
    likeness: float


def framed(played: NDArray[Any], sample_rate_hz: int, tail: int = 0) -> Framed:
    """Return `played` (n,), and `tail` samples of silence after it, between two markers.

    The markers are as loud as `played`: what does not clip in it does not clip in them.
    """
    level = float(np.abs(played).max(initial=0.0))
    marker = _marker(sample_rate_hz) * level
    gap = round(GAP_S * sample_rate_hz)
    parts = [marker, np.zeros(gap), played, np.zeros(gap + tail), marker]
    ends = np.cumsum([len(part) for part in parts])
    sound = np.concatenate(parts).astype(np.float32)
    return Framed(sound, marker, start=int(ends[1]), second=int(ends[3]))


def arrival(recorded: NDArray[Any], sound: Framed) -> Arrival:
    """Return where `sound` arrived in `recorded` (n,), which began with it; silence: nowhere."""
    from scipy.signal import correlate  # half a second

    if len(recorded) < len(sound.sound) or not np.any(recorded) or not np.any(sound.marker):
        return Arrival(0, 0, 0.0)
    # A compressed marker begins before it arrives: there is room for that, whatever the latency.
    recorded = np.concatenate([np.zeros(RESPONSE), recorded])
    coarse = int(np.argmax(np.abs(correlate(recorded, sound.sound, "valid", "fft"))))
    # What is found of one marker must not be found again for the other, however short the sound.
    reach = min(MAX_LOST_FRAMES, (sound.second - RESPONSE - len(sound.marker)) // 2)
    begin, first = _compressed(recorded, sound.marker, coarse, reach)
    onset = _onset(first[: coarse - begin + reach])
    itself = correlate(sound.marker, sound.marker, "full", "fft")
    latency = begin + onset + len(sound.marker) - 1 - _onset(itself) - RESPONSE
    low = max(onset - RESPONSE // 32, 0)
    template = first[low : low + RESPONSE]
    after, second = _compressed(recorded, sound.marker, coarse + sound.second, reach)
    if len(second) < len(template):
        return Arrival(latency, 0, 0.0)
    match = correlate(second, template, "valid", "fft")
    energy = correlate(second**2, np.ones(len(template)), "valid", "fft")
    # Alike is what has the same shape: the sweep itself, in a resonance, may well be louder.
    norm = np.sqrt(np.maximum(energy, QUIET_SHARE * energy.max()) * np.sum(template**2))
    alike = match / norm if norm.all() else np.zeros(len(match))
    best = int(np.argmax(alike))
    moved = (after + best) - (begin + low) - sound.second
    return Arrival(latency, -moved, float(np.clip(alike[best], 0, 1)))


def _onset(compressed: NDArray[np.float64]) -> int:
    """Return where a compressed marker begins: objects change its peak, by milliseconds, and hardly
    the way that sound arrives by first."""
    strength = np.abs(compressed)
    peak = int(np.argmax(strength))
    before = max(peak - RESPONSE // 2, 0)
    return before + int(np.argmax(strength[before : peak + 1] > ONSET * strength[peak]))


def _compressed(
    recorded: NDArray[np.float64], marker: NDArray[np.float64], at: int, reach: int
) -> tuple[int, NDArray[np.float64]]:
    """Return the correlation of `recorded` with the marker around `at`, and where it begins."""
    from scipy.signal import correlate

    begin = max(at - reach, 0)
    part = recorded[begin : at + reach + RESPONSE + len(marker)]
    return begin, np.asarray(correlate(part, marker, "valid", "fft"))


def _marker(sample_rate_hz: int) -> NDArray[np.float64]:
    """Return 20 ms of a linear chirp, 2 to 12 kHz, faded in and out over its whole length."""
    from scipy.signal import chirp

    n = round(MARKER_S * sample_rate_hz)
    high = min(12_000.0, 0.4 * sample_rate_hz)
    time = np.arange(n) / sample_rate_hz
    return np.asarray(chirp(time, 2_000.0, n / sample_rate_hz, high) * np.hanning(n))
