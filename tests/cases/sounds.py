"""Synthetic recordings for the cases: decaying resonances, written as 16-bit WAV files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import soundfile

RATE_HZ = 44_100
#: A quarter of a second is enough for a spectrum.
FRAMES = 11_025


def resonances(number: int, repeat: int, seed: int = 0, frames: int = FRAMES) -> np.ndarray:
    """Return the sound (frames,) of object `number`; repeats differ slightly, as grasps do."""
    random = np.random.default_rng([seed, number, repeat])
    time_s = np.arange(frames) / RATE_HZ
    sound = np.zeros(frames)
    for harmonic in (1, 2, 3):
        frequency_hz = (900 + 350 * number) * harmonic * (1 + 0.01 * random.normal())
        phase = random.uniform(0, 2 * np.pi)
        sound += np.exp(-12 * time_s) * np.sin(2 * np.pi * frequency_hz * time_s + phase)
    return 0.2 * sound + 0.002 * random.normal(size=frames)


def write_wav(path: Path, samples: np.ndarray, rate_hz: int = RATE_HZ) -> Path:
    """Write samples (frames,) or (frames, channels) of full scale ±1 as a 16-bit WAV."""
    path.parent.mkdir(parents=True, exist_ok=True)
    soundfile.write(path, samples, rate_hz, subtype="PCM_16")
    return path
