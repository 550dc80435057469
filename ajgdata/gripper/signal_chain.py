"""From impulse response to recording: excitation, transducers, noise, converter."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

from ajgdata.gripper.noise import REFERENCE_PA, external_noise_pa, motor_sound
from ajgdata.gripper.scene import SAMPLE_RATE_HZ, derive_seed
from ajgdata.gripper.signal_settings import SignalChain

Real = NDArray[np.floating]
#: Coefficients of s², s and 1.
Polynomial = tuple[float, float, float]
#: Numerator and denominator.
FilterSection = tuple[Polynomial, Polynomial]
#: PCM24: the largest and the smallest value of a sample are 1 - 2^-23 and -1.
PCM24_STEPS = 2.0**23
#: Amplitude (m³/s) at 1 kHz of 100 dB, measured once on the default scene with a 20 mm cube; a
#: test holds it to half a decibel.
FLOW_AT_100_DB_M3_S = 1.51e-6

DEFAULT_CHAIN = SignalChain()


@dataclass(frozen=True)
class ImpulseResponse:
    """Pressure (Pa) at the microphone per volume velocity (m³/s) at the speaker, `samples` (n,).

    p[n] = Σ samples[m] q[n - m + latency_samples]; the latency is that of the linear-phase
    decimation filter. `static` is what the response settles at, for ever on this time scale,
    because the balloon holds the volume that the speaker pushed in; `samples` decays to zero
    without it. Convolve the input with `samples`, then add `static` times its running sum.
    `provenance` says how it was computed; it is as deterministic as `samples`. `outside` (m,) is
    what comes through the membrane: rms pressure at the microphone per rms pressure in the room, at
    frequencies evenly from 0 to half the rate (see `ajgdata.gripper.outside`).
    """

    samples: Real
    static: float
    sample_rate_hz: int
    latency_samples: int
    provenance: dict[str, Any]
    outside: Real | None = None


@dataclass(frozen=True)
class SimulatedRecording:
    """One recording: samples (n,) in [-1, 1), exact multiples of 2^-23, and how many clipped."""

    samples: Real
    clipped_count: int


def excitation_sweep(
    duration_s: float = 1.0,
    low_hz: float = 20.0,
    high_hz: float = 20_000.0,
    amplitude: float = 0.9,
    fade_s: float = 0.005,
) -> Real:
    """Return a logarithmic sweep (Farina 2000) with raised-cosine fades, (n,) in [-1, 1].

    Raises ValueError for limits out of order or beyond the band, and for fades that meet.

    >>> sweep = excitation_sweep(duration_s=0.5, amplitude=0.9)
    >>> sweep.shape, bool(abs(sweep).max() <= 0.9)
    ((22050,), True)
    """
    if not (0 < low_hz < high_hz < SAMPLE_RATE_HZ / 2 and 0 < 2 * fade_s <= duration_s):
        raise ValueError("a sweep needs 0 < low_hz < high_hz < 22050 and 0 < 2 fade_s <= duration")
    time = np.arange(round(duration_s * SAMPLE_RATE_HZ)) / SAMPLE_RATE_HZ
    octaves = np.log(high_hz / low_hz)
    sweep = np.sin(
        2 * np.pi * low_hz * duration_s / octaves * np.expm1(time / duration_s * octaves)
    )
    edge = np.clip(np.minimum(time, time[::-1]) / fade_s, 0, 1)
    return amplitude * sweep * np.sin(np.pi / 2 * edge) ** 2


@lru_cache(maxsize=8)
def transducers(chain: SignalChain) -> Real:
    """Second-order sections (N, 6) from excitation to the speaker's volume velocity, with the AC
    coupling of speaker and microphone; unit gain at 1 kHz, mapped by the bilinear rule.

    A balanced armature gives the same pressure in a 2 cm³ coupler at all frequencies below its
    first resonance, and the pressure there is γP/V times the volume displaced: the displacement is
    flat, and the volume velocity, its derivative, rises with frequency. Above, each resonance takes
    12 dB an octave off: q = s Π ω²/(s² + ω s/Q + ω²) (two-port model of Kim & Allen 2013, Hearing
    Research 301, with the mass and stiffness of the armature and of the air in front of it).
    """
    coupling = _warp(chain.coupling_hz)
    analogue: list[FilterSection] = [((1, 0, 0), (1, 2 * coupling, coupling**2))]
    for number, (frequency, q) in enumerate(
        zip(chain.resonances_hz, chain.resonances_q, strict=True)
    ):
        omega = _warp(frequency)
        # The derivative comes with the first resonance.
        over = (0, 0, 1) if number else (0, 1, 0)
        analogue.append((over, (1 / omega**2, 1 / (q * omega), 1)))
    sections = np.array([_bilinear(*section) for section in analogue])
    z = np.exp(-2j * np.pi * 1_000 / SAMPLE_RATE_HZ)
    at_1k = np.prod(sections[:, :3] @ [1, z, z * z] / (sections[:, 3:] @ [1, z, z * z]))
    sections[0, :3] /= abs(at_1k)
    return sections


def _bilinear(over: Polynomial, under: Polynomial) -> list[float]:
    """Digital section b0, b1, b2, 1, a1, a2 of an analogue one: s = 2 rate (1 - z⁻¹)/(1 + z⁻¹)."""
    k = 2 * SAMPLE_RATE_HZ
    both = [
        (a * k**2 + b * k + c, 2 * (c - a * k**2), a * k**2 - b * k + c)
        for a, b, c in (over, under)
    ]
    return [value / both[1][0] for polynomial in both for value in polynomial]


def _warp(frequency_hz: float) -> float:
    """Analogue frequency that the bilinear rule maps to `frequency_hz`."""
    return float(2 * SAMPLE_RATE_HZ * np.tan(np.pi * frequency_hz / SAMPLE_RATE_HZ))


def record(
    ir: ImpulseResponse,
    excitation: Real,
    chain: SignalChain = DEFAULT_CHAIN,
    seed: int = 0,
    angle_deg: float = 0.0,
) -> SimulatedRecording:
    """Play `excitation` (n,), full scale 1, in the scene of `ir` and record it, (n,).

    Recording = (excitation ∗ speaker ∗ h ∗ microphone + noise) gain, clipped and quantised to 24
    bits; playing and recording start together. Noise is the chain's floor, through the membrane the
    sound outside, and the motor that holds the gripper at `angle_deg`. `seed` draws all of it for
    this one take. Of a silent speaker only the length of `excitation` counts. Raises ValueError for
    an excitation that is not (n,) or not finite, and for a response that does not say what comes
    through the membrane, if that is asked for.

    >>> click = ImpulseResponse(np.ones(1), 0.0, SAMPLE_RATE_HZ, 0, {})
    >>> quiet = SignalChain(noise_db_spl=None)
    >>> take = record(click, excitation_sweep(), quiet)
    >>> take.samples.shape, bool(np.all(take.samples * 2**23 % 1 == 0))
    ((44100,), True)
    """
    from scipy.signal import sosfilt  # half a second

    excitation = np.asarray(excitation, dtype=np.float64)
    if excitation.ndim != 1 or not np.all(np.isfinite(excitation)):
        raise ValueError("excitation must be one-dimensional and finite")
    pressure: Real = np.zeros(len(excitation))
    if chain.level_db_spl is not None:
        pressure = _played(ir, sosfilt(transducers(chain), excitation)) * volume_velocity(chain)
    for noise in _noises(ir, chain, len(excitation), seed, angle_deg):
        pressure += noise
    full_scale = np.sqrt(2) * REFERENCE_PA * 10 ** (chain.full_scale_db_spl / 20)
    return _convert(pressure * 10 ** (chain.gain_db / 20) / full_scale)


def _played(ir: ImpulseResponse, flow: Real) -> Real:
    """Return the pressure (n,) at the microphone for the volume velocity `flow` (n,)."""
    full = len(flow) + len(ir.samples) - 1
    size = next_fast_len(full, real=True)
    pressure = irfft(rfft(flow, size) * rfft(ir.samples, size), size)[:full]
    pressure = pressure[ir.latency_samples : ir.latency_samples + len(flow)]
    return np.asarray(pressure + ir.static * np.cumsum(flow))


def _noises(
    ir: ImpulseResponse, chain: SignalChain, count: int, seed: int, angle_deg: float
) -> Iterator[Real]:
    """Yield the pressure (Pa) of each noise of a take at the microphone, (count,)."""
    if chain.noise_db_spl is not None:
        floor = REFERENCE_PA * 10 ** (chain.noise_db_spl / 20)
        yield floor * np.random.default_rng(seed).standard_normal(count)
    if chain.external_noise_dba is not None:
        own = derive_seed(seed, "outside")  # the floor stays as it is without
        if ir.outside is None:
            raise ValueError("the response has no gain for sound from outside: simulate the scene")
        level = chain.external_noise_dba
        yield external_noise_pa(count, ir.outside, level, chain.coupling_hz, own)
    if chain.motor is not None:
        own = derive_seed(seed, "motor")
        yield motor_sound(count, chain.motor, angle_deg, own)


def volume_velocity(chain: SignalChain) -> float:
    """Return the amplitude (m³/s) of the speaker at 1 kHz for a full-scale excitation, 0 if silent.

    For the level: 105 dB in a coupler of V = 2 cm³ need √2 · 3.56 Pa · V/γP = 7.1e-11 m³, which at
    1 kHz are 4.5e-7 m³/s, 10.6 dB less than 100 dB in the cavity need.
    """
    if chain.level_db_spl is None:
        return 0.0
    return FLOW_AT_100_DB_M3_S * float(10 ** ((chain.level_db_spl - 100) / 20))


def _convert(signal: Real) -> SimulatedRecording:
    codes = np.round(signal * PCM24_STEPS)
    clipped = int(np.count_nonzero((codes > PCM24_STEPS - 1) | (codes < -PCM24_STEPS)))
    return SimulatedRecording(np.clip(codes, -PCM24_STEPS, PCM24_STEPS - 1) / PCM24_STEPS, clipped)
