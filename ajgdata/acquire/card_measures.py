"""What a sweep and a silence say about a sound card: levels, noise, hum, distortion, clocks.

Pure functions of samples with full scale 1. Levels in dBFS are those of mean squares against a sine
of full scale, so that such a sine has 0 dBFS.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy.fft
from numpy.typing import ArrayLike, NDArray

from ajgdata.features.bands import third_octaves

Real = NDArray[np.float64]

#: Harmonics that are looked for; each needs its place before the response.
HARMONICS = (2, 3, 4, 5)
#: Response that belongs to one harmonic, and what comes before it, in seconds.
WINDOW_S, BEFORE_S = 0.028, 0.002
#: Lowest fundamental whose harmonics are told from the sweep's own beginning.
LOWEST_HZ = 100.0
#: Lines of a mains frequency that are added up.
MAINS_LINES = 10
#: Lines that stand out by less than noise does by itself (3 dB) are none.
HEARD_DB = 3.0
#: Deviations of the noise's power that a band's has to exceed: noise alone does so once in 100.
DEVIATIONS = 3.0
#: Samples of a compressed pulse that are compared with those of another.
COMPARED = 1_024
#: Likeness of two pulses above which delays scatter by less than .15 samples (noise 0 dB below the
#: sweep). Noise alone reaches .25: the largest of 11,000 correlations of some 460 values each.
ALIKE = 0.5
_TINY = 1e-30


def dbfs(mean_square: ArrayLike) -> Real:
    """Return mean squares as levels; a sine of full scale, 1/2, has 0 dBFS."""
    return np.asarray(10 * np.log10(2 * np.maximum(np.asarray(mean_square, float), _TINY)))


def band_powers(samples: NDArray[Any], rate_hz: int, centres_hz: Real) -> Real:
    """Return the mean square of samples (n,) in each third octave (bands,): by Parseval's theorem
    they add up to that of all frequencies between the outer edges."""
    from scipy.signal import periodogram  # half a second

    frequency, power = periodogram(samples, rate_hz, detrend=False, scaling="spectrum")
    edges = np.asarray(centres_hz)[:, None] * 10 ** (np.array([-0.05, 0.05]))
    inside = (frequency >= edges[:, :1]) & (frequency < edges[:, 1:])
    return np.asarray((inside * power).sum(axis=1))


def sweep_powers(
    heard: NDArray[Any],
    silence: NDArray[Any],
    rate_hz: int,
    centres_hz: Real,
    length_s: float,
    octaves: float,
) -> tuple[Real, Real]:
    """Return the mean square (bands,) of the sound of a logarithmic sweep while it is in a band,
    and that of the noise.

    `heard` (n,) holds the sweep, `silence` (m,) nothing. The sweep's energy in a third octave is
    all heard within length_s/(3 octaves), the noise's all the time, and is subtracted. What is left
    of a band must exceed what noise varies by; else the sweep counts as loud as the noise. The
    power of a band of width B varies by 1/sqrt(B T) of itself within T seconds.
    """
    noise = band_powers(silence, rate_hz, centres_hz)
    heard_s, silence_s = len(heard) / rate_hz, len(silence) / rate_hz
    width = centres_hz * (10**0.05 - 10**-0.05)
    varies = noise * np.sqrt(1 / (width * heard_s) + 1 / (width * silence_s))
    left = band_powers(heard, rate_hz, centres_hz) - noise
    power = left * heard_s / (length_s * (np.log2(10) / 10) / octaves)
    return np.where(left > DEVIATIONS * varies, np.maximum(power, noise), noise), noise


class Hum(NamedTuple):
    """Sound of the mains: all its lines together, and how far they stand out of their
    neighbourhood."""

    mains_hz: int
    level_dbfs: float
    prominence_db: float

    def said(self) -> str:
        """Return it in words."""
        if self.prominence_db < HEARD_DB:
            return f"none of {self.mains_hz} Hz"
        above = f"{self.prominence_db:.0f} dB above its neighbourhood"
        return f"{self.mains_hz} Hz: {self.level_dbfs:.0f} dBFS, {above}"


def hum(silence: NDArray[Any], rate_hz: int, mains_hz: int) -> Hum:
    """Return the mains' lines in a recording (n,) of nothing, of a second or more.

    A line is what lies within 1.5 Hz of a multiple of `mains_hz`; its neighbourhood, of the same
    width in sum, is the median of what lies within 10 Hz.
    """
    from scipy.signal import periodogram

    if len(silence) < rate_hz:
        raise ValueError("hum needs a second of silence")
    frequency, power = periodogram(silence, rate_hz, "hann", detrend="constant", scaling="spectrum")
    power = power / 1.5  # a Hann window spreads a line over three bins: 1/4, 1, 1/4 of amplitude
    lines = floor = 0.0
    for line_hz in mains_hz * np.arange(1, MAINS_LINES + 1):
        away = np.abs(frequency - line_hz)
        on = away <= 1.5
        lines += power[on].sum()
        floor += on.sum() * float(np.median(power[~on & (away <= 10)])) / np.log(2)
    prominence = 10 * np.log10((lines + _TINY) / (floor + _TINY))
    return Hum(mains_hz, float(dbfs(max(lines - floor, 0.0))), float(prominence))


class Distortion(NamedTuple):
    """Harmonics relative to the fundamental (bands,), and what noise alone would be taken for."""

    centres_hz: Real
    ratio: Real
    noise: Real


def harmonic_distortion(
    heard: NDArray[Any],
    played: NDArray[Any],
    silence: NDArray[Any],
    rate_hz: int,
    low_hz: float,
    high_hz: float,
) -> Distortion:
    """Return total harmonic distortion by third octave of the fundamental, from one sweep.

    `heard` (n,) has no latency, `played` (m,) is a logarithmic sweep from `low_hz` to `high_hz`,
    `silence` (at least m + 30 ms) what is heard of nothing. Divided by the sweep, the k-th
    harmonic's response stands T ln(k)/ln(high/low) before the linear one (A. Farina, 108th AES
    Convention, 2000), and its spectrum at k f is that of the harmonic of a fundamental f. Both pass
    through the gripper, whose own resonances are no distortion: it is
    sqrt(Σ |H_k(k f)/H_1(k f)|²), averaged over the band, the speaker's harmonics as it makes them.
    The noise is that of `silence`, divided alike, and what the ends of the sweep leave by
    themselves. Raises ValueError for a silence that is too short.
    """
    growth_s = len(played) / rate_hz / np.log(high_hz / low_hz)

    def divided(sound: NDArray[Any]) -> Real:
        return _divided(sound, played, rate_hz, low_hz, high_hz)

    def powers(response: Real) -> list[Real]:
        at_s = [-growth_s * np.log(k) for k in (1, *HARMONICS)]
        return [_windowed_power(response, one, rate_hz) for one in at_s]

    # All frequencies of the silence are in the windows up to here, as the sweep passes over it.
    places = np.arange(0.0, (len(silence) - len(played)) / rate_hz - WINDOW_S, WINDOW_S)
    if not places.size:
        raise ValueError("distortion needs a silence that is longer than the sweep")
    quiet = divided(silence)
    nothing = np.mean([_windowed_power(quiet, at_s, rate_hz) for at_s in places], axis=0)
    linear, *others = powers(divided(heard))
    own, *ends = powers(divided(played))
    centres = third_octaves(LOWEST_HZ, high_hz / HARMONICS[0])
    fine = (centres[:, None] * 10 ** np.linspace(-0.05, 0.05, 9)).ravel()
    grid = np.linspace(0, rate_hz / 2, len(linear))

    def ratio(parts: Sequence[Real], through: Real) -> Real:
        total = np.zeros(len(fine))
        for k, part in zip(HARMONICS, parts, strict=True):
            hz = k * fine
            reached = (hz < high_hz) / (np.interp(hz, grid, through) + _TINY)
            total += reached * np.interp(hz, grid, part)
        return np.asarray(total.reshape(len(centres), -1).mean(axis=1))

    noise = ratio([nothing] * len(HARMONICS), linear) + ratio(ends, own)
    return Distortion(centres, np.sqrt(ratio(others, linear)), np.sqrt(noise))


def _divided(
    sound: NDArray[Any], played: NDArray[Any], rate_hz: int, low_hz: float, high_hz: float
) -> Real:
    """Return `sound` divided by `played` between two frequencies; what comes before is at the
    end."""
    size = scipy.fft.next_fast_len(len(sound) + len(played), real=True)
    spectrum = scipy.fft.rfft(played, size)
    power = np.abs(spectrum) ** 2
    frequency = scipy.fft.rfftfreq(size, 1 / rate_hz)
    inside = (frequency > low_hz) & (frequency < high_hz)
    inverse = np.where(inside, spectrum.conj() / (power + 1e-6 * power[inside].max()), 0)
    return np.asarray(scipy.fft.irfft(scipy.fft.rfft(sound, size) * inverse, size))


def _windowed_power(response: Real, at_s: float, rate_hz: int) -> Real:
    """Return the power spectrum of the response around a time, faded in and out."""
    begin = round((at_s - BEFORE_S) * rate_hz)
    n, edge = round((BEFORE_S + WINDOW_S) * rate_hz), round(BEFORE_S / 2 * rate_hz)
    fade = np.sin(np.pi / 2 * np.clip(np.arange(n) / edge, 0, 1)) ** 2
    part = response[np.arange(begin, begin + n) % len(response)] * fade * fade[::-1]
    return np.asarray(np.abs(scipy.fft.rfft(part, 6 * n)) ** 2)  # padded for a fine spectrum


class Pulses(NamedTuple):
    """Delays (n,) of pulses in samples, each against the first, and how much alike they are, 0 to
    1: below ALIKE it is noise that is compared."""

    delays: Real
    likeness: Real

    @property
    def heard(self) -> NDArray[np.bool_]:
        """Tell which of them were heard (n,)."""
        return np.asarray(self.likeness > ALIKE)


def pulse_delays(
    heard: NDArray[Any], pulse: NDArray[Any], every: int, count: int, reach: int
) -> Pulses:
    """Return the delays of pulses (m,) that were played `every` samples, `count` times, up to
    `reach` samples more or less, to parts of a sample."""
    from scipy.signal import correlate

    pad = np.r_[np.zeros(reach), heard, np.zeros(reach + len(pulse))]
    length = 2 * reach + len(pulse)
    whole = correlate(pad[:length], pulse, "valid", "fft")
    start = max(int(np.argmax(np.abs(whole))) - COMPARED // 4, 0)
    first = whole[start : start + COMPARED]  # the rest is noise, and dies away
    found = []
    for k in range(count):
        one = correlate(pad[k * every : k * every + length], pulse, "valid", "fft")
        match = correlate(one, first, "full", "fft")
        best = int(np.clip(np.argmax(match), 1, len(match) - 2))
        before, peak, after = match[best - 1 : best + 2]
        curved = before - 2 * peak + after
        part = 0.5 * (before - after) / curved if curved else 0.0
        there = one[max(best - len(first) + 1, 0) : best + 1]
        norm = np.sqrt(np.sum(there**2) * np.sum(first**2))
        found.append((best - (len(first) - 1) - start + part, peak / norm if norm else 0.0))
    return Pulses(*np.array(found).reshape(-1, 2).T)


class Drift(NamedTuple):
    """Millionths by which the recording clock runs ahead of the playing one, the standard error of
    that, and frames that were lost, or too many, on the way."""

    ppm: float
    error_ppm: float
    lost_frames: int


def clock_drift(pulses: Pulses, every: int) -> Drift | None:
    """Return the slope of the delays of pulses that were played `every` samples, without the whole
    samples by which they leave it at once: frames lost. None where fewer than four, or not half of
    them, were heard."""
    at = np.flatnonzero(pulses.heard)
    if len(at) < max(4, len(pulses.delays) / 2):
        return None
    delays, steps = pulses.delays[at], np.diff(pulses.delays[at])
    jumps = np.round(steps - np.median(steps / np.diff(at)) * np.diff(at))
    smooth, time = delays - np.r_[0, np.cumsum(jumps)], at * every
    centred = time - time.mean()
    slope = float(centred @ smooth / (centred @ centred))
    left = smooth - smooth.mean() - slope * centred
    error = np.sqrt(left @ left / (len(at) - 2) / (centred @ centred))
    return Drift(1e6 * slope, 1e6 * float(error), int(np.abs(jumps).sum()))


def clock_ppm(measured_hz: float | None, rate_hz: int) -> float | None:
    """Return by how many millionths a card is faster than this computer's clock, of its measured
    rate; None where time does not run as usual."""
    ppm = 1e6 * ((measured_hz or 0.0) / rate_hz - 1)
    return ppm if abs(ppm) < 1e4 else None
