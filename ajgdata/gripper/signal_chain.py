"""From impulse response to recording: excitation, transducers, noise and converter."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft
from scipy.signal import sosfilt

from ajgdata.gripper.noise import REFERENCE_PA, external_noise_pa, motor_sound
from ajgdata.gripper.scene import SAMPLE_RATE_HZ, derive_seed
from ajgdata.gripper.signal_settings import SignalChain

Real = NDArray[np.floating]
#: Coefficients of s², s and 1.
Polynomial = tuple[float, float, float]
#: Numerator and denominator of an analogue second-order filter.
FilterSection = tuple[Polynomial, Polynomial]
#: Steps of PCM24 per full scale: samples are from -1 to 1 - 2^-23.
PCM24_STEPS = 2.0**23
#: Amplitude (m³/s) at 1 kHz that gives 100 dB in the default scene with a 20 mm cube. We measured
#: it once, and a test checks it to half a decibel.
FLOW_AT_100_DB_M3_S = 1.51e-6

DEFAULT_CHAIN = SignalChain()


@dataclass(frozen=True)
class ImpulseResponse:
    """Pressure (Pa) at the microphone per volume velocity (m³/s) at the speaker: `samples` (n,).

    For a volume velocity q, the pressure is p[n] = Σ samples[m] q[n - m + latency_samples], plus
    `static` times the running sum of q. The latency is that of the linear-phase decimation filter.
    `static` is the final value of the response: the balloon contains the volume that the speaker
    pushed in, and on this time scale nothing flows out. `samples` are without it, and decay to 0.
    `provenance` has the digest of the scene and the numerics. `outside` (m,) is the gain of sound
    through the membrane: rms pressure at the microphone per rms pressure in the room, at equally
    spaced frequencies from 0 to half the rate (see `ajgdata.gripper.outside`).
    """

    samples: Real
    static: float
    sample_rate_hz: int
    latency_samples: int
    provenance: dict[str, Any]
    outside: Real | None = None


@dataclass(frozen=True)
class SimulatedRecording:
    """One recording: samples (n,) in [-1, 1), exact multiples of 2^-23; number of clipped ones."""

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

    Raises ValueError for limits out of order or beyond the band, and for fades that overlap.

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
    """Return the second-order sections (N, 6) from excitation to the speaker's volume velocity.

    They include the AC coupling of speaker and microphone, have a gain of 1 at 1 kHz, and are
    digital by the bilinear transform. Below its first resonance, a balanced armature gives the same
    pressure in a 2 cm³ coupler at all frequencies. This pressure is γP/V times the displaced
    volume, so the displacement is flat, and the volume velocity, its derivative, rises with
    frequency. Each resonance reduces it by 12 dB per octave at higher frequencies:
    q = s Π ω²/(s² + ω s/Q + ω²). This is the two-port model of Kim & Allen 2013, Hearing Research
    301, with the mass and stiffness of the armature and of the air in front of it.
    """
    coupling = _prewarped(chain.coupling_hz)
    first, second = chain.resonances_hz
    first_q, second_q = chain.resonances_q
    analogue: list[FilterSection] = [
        ((1, 0, 0), (1, 2 * coupling, coupling**2)),
        ((0, 1, 0), _resonance(first, first_q)),  # s: the derivative
        ((0, 0, 1), _resonance(second, second_q)),
    ]
    sections = np.array([_bilinear(*section) for section in analogue])
    z = np.exp(-2j * np.pi * 1_000 / SAMPLE_RATE_HZ)
    at_1k = np.prod(sections[:, :3] @ [1, z, z * z] / (sections[:, 3:] @ [1, z, z * z]))
    sections[0, :3] /= abs(at_1k)
    return sections


def _resonance(frequency_hz: float, q: float) -> Polynomial:
    """Return the denominator s²/ω² + s/(Qω) + 1 of a resonance."""
    omega = _prewarped(frequency_hz)
    return 1 / omega**2, 1 / (q * omega), 1


def _bilinear(numerator: Polynomial, denominator: Polynomial) -> list[float]:
    """Return the digital section b0, b1, b2, 1, a1, a2 of an analogue one.

    The bilinear transform replaces s by 2 rate (1 - z⁻¹)/(1 + z⁻¹).
    """
    k = 2 * SAMPLE_RATE_HZ
    over, under = (
        (a * k**2 + b * k + c, 2 * (c - a * k**2), a * k**2 - b * k + c)
        for a, b, c in (numerator, denominator)
    )
    return [value / under[0] for value in (*over, *under)]


def _prewarped(frequency_hz: float) -> float:
    """Return the analogue frequency (rad/s) that the bilinear transform maps to `frequency_hz`."""
    return float(2 * SAMPLE_RATE_HZ * np.tan(np.pi * frequency_hz / SAMPLE_RATE_HZ))


def record(
    ir: ImpulseResponse,
    excitation: Real,
    chain: SignalChain = DEFAULT_CHAIN,
    seed: int = 0,
    angle_deg: float = 0.0,
) -> SimulatedRecording:
    """Return the recording (n,) of `excitation` (n,), full scale 1, in the scene of `ir`.

    Recording = (excitation ∗ speaker ∗ h ∗ microphone + noise) gain, clipped and quantised to 24
    bits. Playing and recording start together. The noise consists of the noise of the microphone,
    the outside sound through the membrane, and the sound of the motor that holds the gripper at
    `angle_deg`; `seed` determines all of it. If the speaker is silent, only the length of
    `excitation` has an effect.

    Raises ValueError for an excitation that is not (n,) or not finite, and if the chain has outside
    sound and `ir` has no gain for it.

    >>> click = ImpulseResponse(np.ones(1), 0.0, SAMPLE_RATE_HZ, 0, {})
    >>> quiet = SignalChain(noise_db_spl=None)
    >>> recording = record(click, excitation_sweep(), quiet)
    >>> recording.samples.shape, bool(np.all(recording.samples * 2**23 % 1 == 0))
    ((44100,), True)
    """
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
    count = len(flow) + len(ir.samples) - 1
    size = next_fast_len(count, real=True)
    pressure = irfft(rfft(flow, size) * rfft(ir.samples, size), size)[:count]
    pressure = pressure[ir.latency_samples : ir.latency_samples + len(flow)]
    return np.asarray(pressure + ir.static * np.cumsum(flow))


def _noises(
    ir: ImpulseResponse, chain: SignalChain, count: int, seed: int, angle_deg: float
) -> Iterator[Real]:
    """Yield the pressure (Pa) of each noise of a recording at the microphone, (count,)."""
    if chain.noise_db_spl is not None:
        floor = REFERENCE_PA * 10 ** (chain.noise_db_spl / 20)
        yield floor * np.random.default_rng(seed).standard_normal(count)
    if chain.external_noise_dba is not None:
        if ir.outside is None:
            raise ValueError("the response has no gain for sound from outside: simulate the scene")
        level = chain.external_noise_dba
        outside_seed = derive_seed(seed, "outside")
        yield external_noise_pa(count, ir.outside, level, chain.coupling_hz, outside_seed)
    if chain.motor is not None:
        yield motor_sound(count, chain.motor, angle_deg, derive_seed(seed, "motor"))


def volume_velocity(chain: SignalChain) -> float:
    """Return the amplitude (m³/s) of the speaker at 1 kHz for a full-scale excitation, 0 if silent.

    A receiver of 105 dB displaces √2 · 3.56 Pa · V/γP = 7.1e-11 m³ in a coupler of V = 2 cm³. This
    is 4.5e-7 m³/s at 1 kHz, 10.6 dB less than the 1.51e-6 m³/s for 100 dB in the cavity.
    """
    if chain.level_db_spl is None:
        return 0.0
    return FLOW_AT_100_DB_M3_S * float(10 ** ((chain.level_db_spl - 100) / 20))


def _convert(signal: Real) -> SimulatedRecording:
    """Return a signal (n,), full scale 1, clipped and quantised to 24 bits."""
    codes = np.round(signal * PCM24_STEPS)
    clipped = int(np.count_nonzero((codes > PCM24_STEPS - 1) | (codes < -PCM24_STEPS)))
    return SimulatedRecording(np.clip(codes, -PCM24_STEPS, PCM24_STEPS - 1) / PCM24_STEPS, clipped)
