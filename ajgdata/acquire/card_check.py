"""A check of a sound card with its gripper: sweeps, a silence, a minute of pulses, a verdict."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.acquire.card import Capture, Heard
from ajgdata.acquire.card_measures import (
    Distortion,
    Hum,
    Pulses,
    clock_drift,
    clock_ppm,
    dbfs,
    harmonic_distortion,
    hum,
    pulse_delays,
    sweep_powers,
)
from ajgdata.acquire.excitation import excitation_samples
from ajgdata.acquire.markers import framed
from ajgdata.acquire.sound_card import SoundCard
from ajgdata.features.bands import third_octaves
from ajgdata.types import LogSweep

SWEEP = LogSweep(length_s=1.0, low_hz=20.0, high_hz=20_000.0, amplitude=0.9)
TAKES, SILENCE_S, DRIFT_S, PULSE_S = 3, 2.0, 60.0, 1.0
TAIL_S = 0.1
MAINS_HZ = (50, 60)
#: Where a gripper's features are: what the verdict on noise and distortion looks at.
LOW_HZ, HIGH_HZ = 200.0, 12_000.0
#: Peak of a good take, and the limits between which it may stay as it is.
GOOD_DBFS, LOUD_DBFS, QUIET_DBFS = -9.0, -3.0, -30.0
#: Signal to noise that a band should have, and below which it says nothing.
GOOD_SNR_DB, NO_SNR_DB = 30.0, 10.0
#: Noise of a good room, relative to the signal: a hum above it is heard in the features.
HUM_PROMINENCE_DB, HUM_BELOW_DB = 10.0, 60.0
DISTORTED = 0.03
#: Distortion that stands out of the noise: more than twice what noise alone would be taken for.
OUT_OF_NOISE = 2.0
#: Two clocks: one has no drift at all, but for what pulses in noise vary by, in standard errors.
TWO_CLOCKS_PPM, DRIFT_ERRORS = 1.0, 5.0

Level = Literal["good", "change", "bad"]


class Advice(NamedTuple):
    """Part of a verdict: *bad* cannot be used, *change* should be, *good* is. `fix` says how."""

    level: Level
    topic: str
    said: str
    fix: str = ""


class Band(NamedTuple):
    """A third octave: levels of sweep and noise, and harmonics relative to the sweep; None where
    they are not measured or not above the noise."""

    centre_hz: float
    level_dbfs: float
    noise_dbfs: float
    distortion: float | None

    @property
    def snr_db(self) -> float:
        """Signal to noise while the sweep is in the band."""
        return self.level_dbfs - self.noise_dbfs


@dataclass(frozen=True)
class CardCheck:
    """What was measured. `drift_ppm` compares the card's two clocks, `clock_ppm` the card with this
    computer; they and `lost_frames` are None where they were not measured, be it that too many of
    the pulses are `unheard` in the noise."""

    device: dict[str, Any]
    sample_rate_hz: int
    latency_samples: tuple[int, ...]
    peak_dbfs: float
    clipped: int
    xruns: int
    repeated: int
    lost_frames: int | None
    bands: tuple[Band, ...]
    hum: tuple[Hum, ...]
    drift_ppm: float | None
    drift_error_ppm: float | None
    clock_ppm: float | None
    drift_s: float
    unheard: int

    @property
    def latency_spread(self) -> int:
        """Samples between the shortest and the longest latency."""
        return max(self.latency_samples) - min(self.latency_samples)

    @property
    def verdict(self) -> tuple[Advice, ...]:
        """What to change, the worst first; a single *good* line if there is nothing."""
        found = [*_levels(self), *_noise(self), *_timing(self)]
        order = {"bad": 0, "change": 1}
        said = sorted(found, key=lambda one: order[one.level])
        return tuple(said) or (Advice("good", "all", "the card is ready: record"),)

    def facts(self) -> dict[str, str]:
        """Return the figures in words, by topic."""
        median = float(np.median([band.snr_db for band in self.bands]))
        worst = 100 * max(band.distortion or 0.0 for band in self.bands)
        mains = max(self.hum, key=lambda one: one.prominence_db)
        lost = "frames not counted" if self.lost_frames is None else f"{self.lost_frames} frames"
        clocks = [
            f"{said} {ppm:+.1f} ppm"
            for said, ppm in (("in/out", self.drift_ppm), ("computer", self.clock_ppm))
            if ppm is not None
        ]
        return {
            "latency": f"{self.latency_samples[-1]} samples, spread {self.latency_spread}",
            "level": f"peak {self.peak_dbfs:.1f} dBFS, headroom {-self.peak_dbfs:.1f} dB, "
            f"{self.clipped} samples clipped",
            "noise": f"sweep {median:.0f} dB above it (median of third octaves)",
            "hum": mains.said(),
            "harmonics": f"{worst:.2g} % at most",
            "dropouts": f"{lost} in {self.drift_s:.0f} s, {self.xruns} xruns, "
            f"{self.repeated} takes repeated",
            "clocks": ", ".join(clocks) or "not measured",
        }

    def summary(self) -> dict[str, Any]:
        """Return it as plain values for JSON or session.yaml."""
        kept = asdict(self)
        kept["bands"] = [{**band._asdict(), "snr_db": band.snr_db} for band in self.bands]
        kept["hum"] = [one._asdict() for one in self.hum]
        kept["latency_samples"] = list(self.latency_samples)
        return {**kept, "verdict": [one._asdict() for one in self.verdict]}


class Sounds(NamedTuple):
    """What was heard for a check, for its picture: one take (n,) and the pulses' delays (m,)."""

    take: NDArray[np.float32]
    delays: NDArray[np.float64]


def check_card(
    card: SoundCard, drift_s: float = DRIFT_S, progress: Callable[[str], object] = lambda _: None
) -> tuple[CardCheck, Sounds]:
    """Measure `card`, of a gripper that lies still in a quiet room. Raises CardError.

    `drift_s` 0 leaves the clocks out. `progress` is told what is done next.
    """
    rate = card.settings.sample_rate_hz
    sweep = excitation_samples(SWEEP, rate)
    takes: list[Capture] = []
    for number in range(TAKES):
        progress(f"sweep {number + 1} of {TAKES}")
        takes.append(card.take(sweep.astype(np.float32), round(TAIL_S * rate)))
    progress("silence: keep quiet")
    frames = round(SILENCE_S * rate)
    quiet = card.play(np.zeros(1, dtype=np.float32), frames)
    silence = quiet.samples[:, card.settings.input_channel - 1].astype(float)
    found, pulses = Pulses(np.zeros(0), np.zeros(0)), Heard(quiet.samples[:0])
    if drift_s >= 2 * PULSE_S:
        progress(f"pulses for {drift_s:.0f} s")
        found, pulses = _pulses(card, sweep, drift_s, _latency(card, takes[-1]))
    drift = clock_drift(found, round(PULSE_S * rate))
    check = CardCheck(
        device=dict(card.describe()),
        sample_rate_hz=rate,
        latency_samples=tuple(_latency(card, take) for take in takes),
        peak_dbfs=max(take.peak_dbfs for take in takes),
        clipped=sum(take.clipped for take in takes),
        # Not those of the time when the stream was opened.
        xruns=sum(take.xruns for take in takes[1:]) + len(pulses.flags),
        repeated=sum(len(take.doubts) for take in takes),
        lost_frames=drift and drift.lost_frames,
        bands=_bands(takes[-1].samples, sweep, silence, rate),
        hum=tuple(hum(silence, rate, mains_hz) for mains_hz in MAINS_HZ),
        drift_ppm=drift and drift.ppm,
        drift_error_ppm=drift and drift.error_ppm,
        clock_ppm=None if pulses.flags else clock_ppm(pulses.rate_hz, rate),
        drift_s=drift_s if found.delays.size else 0.0,
        unheard=int(np.count_nonzero(~found.heard)),
    )
    return check, Sounds(takes[-1].samples, np.where(found.heard, found.delays, np.nan))


def _latency(card: SoundCard, take: Capture) -> int:
    """Return what was measured in a take, by the loop-back if there is one."""
    delay = take.latency_samples if card.settings.loopback_channel else take.arrival_samples
    return delay or 0


def _pulses(
    card: SoundCard, sweep: NDArray[Any], drift_s: float, latency: int
) -> tuple[Pulses, Heard]:
    """Return the delays of one marker a second, and all that was heard."""
    rate, settings = card.settings.sample_rate_hz, card.settings
    pulse = framed(sweep, rate).marker
    every, count = round(PULSE_S * rate), int(drift_s / PULSE_S)
    one = np.zeros(every, dtype=np.float32)
    one[: len(pulse)] = pulse
    heard = card.play(np.tile(one, count), count * every + latency + every // 4)
    channel = settings.loopback_channel or settings.input_channel
    sound = heard.samples[latency:, channel - 1].astype(float)
    return pulse_delays(sound, pulse, every, count, reach=every // 8), heard


def _bands(
    heard: NDArray[Any], sweep: NDArray[Any], silence: NDArray[Any], rate_hz: int
) -> tuple[Band, ...]:
    high_hz = min(16_000.0, 0.4 * rate_hz)
    centres = third_octaves(high_hz=high_hz)
    octaves = float(np.log2(SWEEP.high_hz / SWEEP.low_hz))
    sound = heard.astype(float)
    powers = sweep_powers(sound, silence, rate_hz, centres, SWEEP.length_s, octaves)
    levels, noise = map(dbfs, powers)
    found = harmonic_distortion(sound, sweep, silence, rate_hz, SWEEP.low_hz, SWEEP.high_hz)
    return tuple(
        Band(float(hz), float(level), float(floor), _distortion(found, float(hz)))
        for hz, level, floor in zip(centres, levels, noise, strict=True)
    )


def _distortion(found: Distortion, centre_hz: float) -> float | None:
    at = np.flatnonzero(np.isclose(found.centres_hz, centre_hz))
    if not at.size or found.ratio[at[0]] < OUT_OF_NOISE * found.noise[at[0]]:
        return None
    return float(found.ratio[at[0]])


def _levels(check: CardCheck) -> list[Advice]:
    peak = check.peak_dbfs
    if check.clipped:
        said = f"{check.clipped} samples are clipped"
        return [Advice("bad", "level", said, "lower the output, or the input gain, by 12 dB")]
    if peak > LOUD_DBFS:
        said = f"peak {peak:.1f} dBFS: {peak - GOOD_DBFS:.0f} dB too loud"
        fix = f"lower the output, or the input gain, until the peak is {GOOD_DBFS:.0f} dBFS"
        return [Advice("change", "level", said, fix)]
    if peak < QUIET_DBFS:
        said = f"peak {peak:.1f} dBFS: {GOOD_DBFS - peak:.0f} dB too quiet"
        fix = f"raise the input gain, or the output, until the peak is {GOOD_DBFS:.0f} dBFS"
        return [Advice("change", "level", said, fix)]
    return []


def _noise(check: CardCheck) -> list[Advice]:
    bands = [band for band in check.bands if LOW_HZ <= band.centre_hz <= HIGH_HZ]
    found = []
    snr = float(np.median([band.snr_db for band in bands]))
    if snr < GOOD_SNR_DB:
        said = f"the sweep is {snr:.0f} dB above the noise (median of third octaves)"
        level: Level = "bad" if snr < NO_SNR_DB else "change"
        found.append(Advice(level, "noise", said, "play louder, or find what makes the noise"))
    mains = max(check.hum, key=lambda one: one.prominence_db)
    strongest = max(band.level_dbfs for band in bands)
    if mains.prominence_db > HUM_PROMINENCE_DB and mains.level_dbfs > strongest - HUM_BELOW_DB:
        said = f"hum of {mains.mains_hz} Hz, {mains.level_dbfs:.0f} dBFS"
        fix = "use another power supply, a shorter or a shielded cable"
        found.append(Advice("change", "hum", said, fix))
    worst = max(bands, key=lambda band: band.distortion or 0.0)
    if (worst.distortion or 0.0) > DISTORTED:
        said = f"{100 * (worst.distortion or 0):.0f} % harmonics at {worst.centre_hz:.0f} Hz"
        fix = "lower the output and raise the input gain; see that nothing rattles"
        found.append(Advice("change", "distortion", said, fix))
    return found


def _timing(check: CardCheck) -> list[Advice]:
    found = []
    if check.latency_spread:
        said = f"latency differs by {check.latency_spread} samples between takes"
        fix = "connect a spare output to a spare input and give --loopback-channel"
        found.append(Advice("change", "latency", said, fix))
    if lost := check.lost_frames:
        said = f"{lost} frames were lost within {check.drift_s:.0f} s"
        found.append(Advice("bad", "dropouts", said, "close other programs; use another port"))
    elif check.xruns or check.repeated:
        said = f"the driver reported {check.xruns} xruns, {check.repeated} takes were repeated"
        found.append(Advice("change", "dropouts", said, "close other programs; use another port"))
    if check.unheard:
        said = f"{check.unheard} pulses of {check.drift_s / PULSE_S:.0f} drown in the noise"
        if check.drift_ppm is None:
            said = f"clocks and dropouts not measured: too noisy ({said})"
        fix = "play louder, or find what makes the noise"
        found.append(Advice("change", "clocks", said, fix))
    least = max(TWO_CLOCKS_PPM, DRIFT_ERRORS * (check.drift_error_ppm or 0.0))
    if check.drift_ppm is not None and abs(check.drift_ppm) > least:
        said = f"input and output drift apart by {check.drift_ppm:.0f} millionths: two clocks"
        found.append(Advice("bad", "clocks", said, "play and record with one device"))
    return found
