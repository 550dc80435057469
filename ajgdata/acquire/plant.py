"""What lies between speaker and microphone in the virtual gripper, as a stream of blocks."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import NDArray
from scipy.signal import fftconvolve, sosfilt

from ajgdata.gripper import SAMPLE_RATE_HZ, ImpulseResponse, SignalChain
from ajgdata.gripper.external_noise import REFERENCE_PA, TAPS, outside_taps
from ajgdata.gripper.signal_chain import (
    PCM24_STEPS,
    gain_from_outside,
    transducers,
    volume_velocity,
)

#: A decimation filter is symmetric: its response begins so many samples before the sound (at most).
#: A card can only be late, so both its inputs are.
LEAD = 64
#: Part of the largest sample below which the end of a response is left out: under half a step of
#: the converter, even summed over a second.
NEGLIGIBLE = 1e-12
#: Below this many samples they are multiplied one by one, which rounds as `np.convolve` does.
SHORT = 64


def scene_response(ir: ImpulseResponse, chain: SignalChain) -> NDArray[np.float64]:
    """Return what a converter hears, (m,) of full scale, when it plays a single sample of 1.

    The same linear system as `gripper.record`, of speaker, scene, microphone and gain, begun `LEAD`
    samples early. Raises ValueError for a silent speaker.
    """
    if chain.level_db_spl is None:
        raise ValueError("the speaker of this signal chain is silent: nothing can be played")
    length = len(ir.samples) + SAMPLE_RATE_HZ // 4  # 100 Hz coupling is gone long before
    driven = sosfilt(transducers(chain), np.eye(1, length)[0])
    pressure = np.zeros(LEAD + length)
    heard = fftconvolve(driven, ir.samples)[: ir.latency_samples + length]
    pressure[LEAD - ir.latency_samples :] = heard
    pressure[LEAD:] += ir.static * np.cumsum(driven)
    response = pressure * volume_velocity(chain) * _gain(chain)
    kept = np.flatnonzero(np.abs(response) > NEGLIGIBLE * np.abs(response).max())
    return np.asarray(response[: kept[-1] + 1])


def scene_noise(ir: ImpulseResponse, chain: SignalChain) -> NDArray[np.float64] | None:
    """Return the filter (m,) that makes of unit white noise what a converter hears of the sound
    outside, full scale 1; None where there is none."""
    if chain.external_noise_dba is None:
        return None
    gain = gain_from_outside(ir, chain, TAPS)
    taps = outside_taps(gain, chain.external_noise_dba, chain.coupling_hz) * _gain(chain)
    return np.asarray(taps, np.float64)


def noise_floor(chain: SignalChain) -> float:
    """Return the rms of the chain's own noise, of full scale 1; 0 for none."""
    if chain.noise_db_spl is None:
        return 0.0
    return float(REFERENCE_PA * 10 ** (chain.noise_db_spl / 20) * _gain(chain))


def _gain(chain: SignalChain) -> float:
    """Full scale per pascal."""
    full_scale = np.sqrt(2) * REFERENCE_PA * 10 ** (chain.full_scale_db_spl / 20)
    return float(10 ** (chain.gain_db / 20) / full_scale)


class Plant:
    """Blocks in, blocks out: convolution with a response that may be changed between two blocks.

    `noise` is its rms at the microphone. Blocks are converted to 24 bits, as a card does.
    """

    def __init__(self, response: NDArray[Any], noise: float = 0.0, seed: int = 0) -> None:
        self._noise, self._random = noise, np.random.default_rng(seed)
        self._tail: NDArray[np.float64] = np.zeros(0)
        self._late = np.zeros(LEAD, dtype=np.float32)
        self._white: NDArray[np.float64] = np.zeros(0)
        self.set_response(response)

    def set_response(
        self, response: NDArray[Any], outside: NDArray[np.float64] | None = None
    ) -> None:
        """Use `response` (m,), full scale 1, from the next block on, and with it sound from
        `outside`: a filter (k,) of unit white noise, see `scene_noise`."""
        if response.ndim != 1 or not response.size or not np.all(np.isfinite(response)):
            raise ValueError("a response is (m,) and finite")
        self._system: tuple[NDArray[Any], dict[int, NDArray[Any]]] = (response, {})
        self._outside = outside

    def process(self, played: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (2, n) microphone and loop-back while the next block (n,) is played."""
        n = len(played)
        late = np.concatenate([self._late, played])
        self._late = late[n:]
        sound = self._convolved(played.astype(np.float64))
        total = np.zeros(max(len(sound), len(self._tail)))
        total[: len(sound)] += sound
        total[: len(self._tail)] += self._tail
        self._tail = total[n:]
        heard = total[:n]
        if self._noise:
            heard = heard + self._noise * self._random.standard_normal(n)
        if self._outside is not None:
            heard = heard + self._from_outside(n, self._outside)
        return np.stack([_converted(heard), late[:n]])

    def _from_outside(self, n: int, taps: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the next n samples of sound from outside, (n,): white noise that goes on from
        block to block, filtered."""
        before = len(taps) - 1
        if len(self._white) != before:
            self._white = self._random.standard_normal(before)
        white = np.concatenate([self._white, self._random.standard_normal(n)])
        self._white = white[n:]
        return fftconvolve(white, taps, mode="valid")

    def _convolved(self, block: NDArray[np.float64]) -> NDArray[np.float64]:
        response, spectra = self._system
        if len(response) <= SHORT:
            return np.convolve(block, response)
        whole = len(block) + len(response) - 1
        length = scipy.fft.next_fast_len(whole, real=True)
        if len(block) not in spectra:
            spectra[len(block)] = scipy.fft.rfft(response, length)
        spectrum = scipy.fft.rfft(block, length) * spectra[len(block)]
        return np.asarray(scipy.fft.irfft(spectrum, length)[:whole])


def _converted(signal: NDArray[np.float64]) -> NDArray[np.float32]:
    codes = np.clip(np.round(signal * PCM24_STEPS), -PCM24_STEPS, PCM24_STEPS - 1)
    return (codes / PCM24_STEPS).astype(np.float32)
