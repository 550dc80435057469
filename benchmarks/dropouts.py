"""Dropouts injected into takes, found in the sound alone, and false alarms, by noise.

No flag of a driver is used. Takes are those of the virtual gripper on a cube; frames are lost
(deleted), played twice (inserted) or replaced by silence (zeroed) at random places of the sweep.
"""

from __future__ import annotations

import argparse

import numpy as np
from scipy.signal import fftconvolve

from ajgdata.acquire.markers import Framed, arrival, framed, hole_samples
from ajgdata.acquire.plant import scene_response
from ajgdata.acquire.simulated_card import PERIOD
from ajgdata.gripper import Scene, SignalChain, excitation_sweep, simulate

FRAMES = (1, 4, 16, 64, 256, 1_024)
SNR_DB = (60, 40, 20, 10, 0, -10, -20)
KINDS = ("deleted", "inserted", "zeroed")
#: Marks what a driver silences: noise is not added there.
HOLE_VALUE = 9.0


def damaged(clean: np.ndarray, kind: str, frames: int, at: int) -> np.ndarray:
    if kind == "deleted":
        return np.r_[clean[:at], clean[at + frames :], np.zeros(frames)]
    if kind == "inserted":
        return np.r_[clean[:at], clean[at - frames : -frames]]
    return np.r_[clean[:at], np.full(frames, HOLE_VALUE), clean[at + frames :]]


def doubted(heard: np.ndarray, sound: Framed, length: int) -> bool:
    """As acquire.sound_card decides, without flags."""
    found = arrival(heard, sound)
    begin = found.latency_samples + sound.start
    return not found.found or found.lost != 0 or hole_samples(heard[begin : begin + length]) > 0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=25, help="per kind, size and noise")
    parser.add_argument("--clean", type=int, default=200, help="takes without fault per noise")
    given = parser.parse_args()
    rng = np.random.default_rng(0)
    sweep = excitation_sweep()
    sound = framed(sweep, 44_100)
    response = scene_response(
        simulate(Scene.model_validate({"object": "cube_20p7"})), SignalChain()
    )
    heard = np.r_[np.zeros(PERIOD), fftconvolve(sound.sound, response), np.zeros(4_096)]
    begin = PERIOD + sound.start
    rms = np.sqrt(np.mean(heard[begin : begin + len(sweep)] ** 2))
    print("SNR dB  false alarms  " + "  ".join(f"{kind} {FRAMES}" for kind in KINDS))
    for snr in SNR_DB:
        noise = rms * 10 ** (-snr / 20)

        def doubt(clean: np.ndarray, noise: float = noise) -> bool:
            noisy = clean + noise * rng.standard_normal(len(clean))
            noisy[clean == HOLE_VALUE] = 0.0
            return doubted(noisy.astype(np.float32), sound, len(sweep))

        alarms = sum(doubt(heard) for _ in range(given.clean))
        cells = []
        for kind in KINDS:
            found = []
            for frames in FRAMES:
                places = rng.integers(begin + frames, begin + len(sweep) - frames, given.times)
                found.append(sum(doubt(damaged(heard, kind, frames, int(at))) for at in places))
            cells.append(" ".join(f"{one:3d}" for one in found))
        print(f"{snr:6d}  {alarms:5d}/{given.clean:<5d}  " + "  |  ".join(cells), flush=True)
    print(f"found of {given.times} each")


if __name__ == "__main__":
    main()
