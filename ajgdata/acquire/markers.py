"""Marker chirps before and after a sound measure its latency and the number of lost frames.

Drivers do not report every lost frame. A frame that is lost, or played twice, between two equal
chirps changes the distance between them. Both chirps pass through the same gripper, so its response
does not change this distance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import chirp, correlate

MARKER_S = 0.02
#: Silence on both sides of the sound, in which the response of the gripper dies away.
GAP_S = 0.05
#: Largest number of lost frames that can be counted: beyond it, the second marker is not found.
MAX_LOST_FRAMES = 8_192
#: Samples of a marker's compressed response that are compared; they fit into the gap.
RESPONSE = 2_048
#: Two markers are the same sound if their likeness is above this value. Noise alone reaches 0.4,
#: the largest of 2 MAX_LOST_FRAMES correlations of about 400 independent values each.
ALIKE = 0.5
#: A compressed marker begins at this part of its peak.
ONSET = 0.35
#: Parts of a recording with less than this share of the largest energy have no likeness.
QUIET_SHARE = 1e-9


@dataclass(frozen=True)
class Framed:
    """A sound between markers: `sound` (m,) is marker, gap, played sound, gap and tail, marker.

    `start` is the index of the played sound, and `second` the index of the second marker.
    """

    sound: NDArray[np.float32]
    marker: NDArray[np.float64]
    start: int
    second: int


class Arrival(NamedTuple):
    """Arrival of a framed sound in a recording.

    `latency_samples` is the delay of the first marker. `lost` is the number of frames that are
    missing between the markers (negative: additional frames). `likeness` of the markers is between
    0 and 1.
    """

    latency_samples: int
    lost: int
    likeness: float


def framed(played: NDArray[Any], sample_rate_hz: int, tail: int = 0) -> Framed:
    """Return `played` (n,), followed by `tail` samples of silence, between two markers.

    The markers have the peak of `played`, so they do not clip if `played` does not clip.
    """
    level = float(np.abs(played).max(initial=0.0))
    marker = _marker(sample_rate_hz) * level
    gap = round(GAP_S * sample_rate_hz)
    parts = [marker, np.zeros(gap), played, np.zeros(gap + tail), marker]
    ends = np.cumsum([len(part) for part in parts])
    sound = np.concatenate(parts).astype(np.float32)
    return Framed(sound, marker, start=int(ends[1]), second=int(ends[3]))


def arrival(recorded: NDArray[Any], sound: Framed) -> Arrival:
    """Return the arrival of `sound` in `recorded` (n,), which began when the sound was played.

    The likeness is 0 if there is no sound.
    """
    if len(recorded) < len(sound.sound) or not np.any(recorded) or not np.any(sound.marker):
        return Arrival(0, 0, 0.0)
    # A compressed marker begins before its arrival: the zeros make room for a latency of 0.
    recorded = np.concatenate([np.zeros(RESPONSE), recorded])
    coarse = int(np.argmax(np.abs(correlate(recorded, sound.sound, "valid", "fft"))))
    # The ranges in which the two markers are searched must not overlap for a short sound.
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
    # Likeness compares shapes, because the sweep can be louder than a marker at a resonance.
    norm = np.sqrt(np.maximum(energy, QUIET_SHARE * energy.max()) * np.sum(template**2))
    alike = match / norm if norm.all() else np.zeros(len(match))
    best = int(np.argmax(alike))
    moved = (after + best) - (begin + low) - sound.second
    return Arrival(latency, -moved, float(np.clip(alike[best], 0, 1)))


def _onset(compressed: NDArray[np.float64]) -> int:
    """Return the index at which a compressed marker begins.

    An object moves the peak by milliseconds, but hardly changes the beginning, which is the sound
    on the fastest path.
    """
    strength = np.abs(compressed)
    peak = int(np.argmax(strength))
    before = max(peak - RESPONSE // 2, 0)
    return before + int(np.argmax(strength[before : peak + 1] > ONSET * strength[peak]))


def _compressed(
    recorded: NDArray[np.float64], marker: NDArray[np.float64], at: int, reach: int
) -> tuple[int, NDArray[np.float64]]:
    """Return the first index of a part around `at`, and its correlation with the marker."""
    begin = max(at - reach, 0)
    part = recorded[begin : at + reach + RESPONSE + len(marker)]
    return begin, np.asarray(correlate(part, marker, "valid", "fft"))


def _marker(sample_rate_hz: int) -> NDArray[np.float64]:
    """Return 20 ms of a linear chirp, 2 to 12 kHz, faded in and out over its whole length."""
    n = round(MARKER_S * sample_rate_hz)
    high = min(12_000.0, 0.4 * sample_rate_hz)
    time = np.arange(n) / sample_rate_hz
    return np.asarray(chirp(time, 2_000.0, n / sample_rate_hz, high) * np.hanning(n))
