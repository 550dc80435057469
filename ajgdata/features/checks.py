"""Checks of the samples of a recording: each defect has one message and one remedy.

error (unusable): `too_short`, `not_finite`, `silent`, `constant`, `too_quiet`, `float_bytes`.
warning (used, but look): `clipped`, `quiet`, `offset`, `hum`, `gap`, `repeated_block`.
note (unusual and fine): `beyond_full_scale`. The last five are in modules of their own.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.features.band import ALL_HZ, reaching_hz
from ajgdata.features.encoding import check_encoding
from ajgdata.features.gaps import check_gaps
from ajgdata.features.hum import check_hum
from ajgdata.features.offset import check_offset
from ajgdata.features.repeats import check_repeats
from ajgdata.features.segments import segments
from ajgdata.store.audio import Audio, Remark

TOO_QUIET = 1e-30  # no microphone: below this float32 loses digits (1.2e-38), then everything
_QUIET = 1e-4  # -80 dB of full scale: three bits of a 16-bit recording
_RUN = 3  # samples at the extreme, one after another, before it is called clipping
#: A smooth peak that quantisation flattens over three samples has curvature c <= q per sample
#: squared (q the quantum), hence leaves it by 4 c + q <= 5 q at the most; clipping leaves a cliff.
_CLIFF_QUANTA = 8
_BITS = {"PCM_U8": 8, "PCM_S8": 8, "PCM_16": 16, "PCM_24": 24, "PCM_32": 32}
#: Bits of full scale that count in files of floats and in compressed files: less is rounding noise.
_FLOAT_BITS = 16
#: Code of the note about float samples above full scale.
BEYOND_FULL_SCALE = "beyond_full_scale"
_GAIN = "lower the gain and record again, or set quality to reject"


def check_audio(
    audio: Audio, window: int, band_hz: tuple[float, float] | None = None
) -> list[Remark]:
    """Return every remark on a recording that could be read.

    `window` and `band_hz` are those of the feature. Conversion hides clipping, so the samples are
    judged as recorded; but those as converted must still make a feature (opposite channels average
    to silence).
    """
    is_converted = audio.samples.size != audio.recorded.size  # resampled, or averaged
    remarks = check_samples(
        audio.recorded,
        audio.info.subtype,
        0 if is_converted else window,
        sample_rate_hz=audio.info.sample_rate_hz,
        lines_hz=_lines_hz(audio, window, band_hz),
    )
    if is_converted:
        of_converted = _check_level(_columns(audio.samples), audio.info.subtype, window)
        wrong = [issue for issue in (*remarks, *of_converted) if issue.level == "error"]
        if errors := {issue.code: issue for issue in reversed(wrong)}:  # the first of each code
            remarks = list(reversed(errors.values()))
        elif not any(remark.code == "quiet" for remark in remarks):
            remarks += [remark for remark in of_converted if remark.code == "quiet"]
    return [*audio.remarks, *remarks]


def _lines_hz(
    audio: Audio, window: int, band_hz: tuple[float, float] | None
) -> tuple[float, float]:
    """Return the frequencies that reach the feature of the converted samples."""
    if band_hz is None:  # also without samples
        return ALL_HZ
    rate_hz = audio.info.sample_rate_hz * len(audio.samples) / len(audio.recorded)
    return reaching_hz(band_hz, window, rate_hz)


def check_samples(
    samples: NDArray[Any],
    subtype: str,
    window: int,
    *,
    sample_rate_hz: float = 44_100,
    lines_hz: tuple[float, float] = ALL_HZ,
) -> list[Remark]:
    """Return remarks on samples (n,) or (n, channels) as recorded, full scale +-1.

    `subtype` is libsndfile's name of the encoding (`AudioInfo.subtype`): integers clip at full
    scale, float samples may exceed it and clip wherever a flat top shows. `window` is the number of
    samples that the feature needs; `lines_hz` are the frequencies that reach it. With an error
    nothing else is looked for: of samples without sound, the first reason is reported in addition
    to their length.
    """
    columns = _columns(samples)
    remarks = _check_level(columns, subtype, window)
    if any(remark.level == "error" for remark in remarks):
        return remarks
    defects: list[Remark] = []
    with np.errstate(over="ignore", invalid="ignore"):  # a sum that overflows exceeds no limit
        for column in columns.T:
            defects += _check_signal(column, subtype, sample_rate_hz, lines_hz)
    first = {defect.code: defect for defect in reversed(defects)}  # the first of each code
    if errors := [defect for defect in first.values() if defect.level == "error"]:
        return errors
    return [*remarks, *reversed(first.values())]


def _columns(samples: NDArray[Any]) -> NDArray[Any]:
    """Return samples (n,) or (n, channels) as (n, channels)."""
    return samples[:, np.newaxis] if samples.ndim == 1 else samples


def _check_signal(
    samples: NDArray[Any],
    subtype: str,
    sample_rate_hz: float,
    lines_hz: tuple[float, float],
) -> list[Remark]:
    """Return the defects of the signal of one channel (n,), which has sound."""
    samples = np.ascontiguousarray(samples, np.float32)
    parts = segments(samples, sample_rate_hz)
    is_integer = subtype in _BITS
    loudest = float(parts.rms.max(initial=0))
    wrong = check_encoding(samples, loudest) if is_integer else None
    if wrong:
        return [wrong]
    quantum = 2.0 ** (1 - _BITS[subtype]) if is_integer else _float_quantum(samples)
    defects = [
        check_offset(samples, parts, sample_rate_hz) if lines_hz[0] <= 0 else None,
        check_hum(samples, parts, sample_rate_hz, lines_hz),
        check_gaps(samples, quantum),
        check_repeats(samples, quantum),
    ]
    return [defect for defect in defects if defect]


def _float_quantum(samples: NDArray[Any]) -> float:
    """Return the step below which samples (n,) of a file without integers are rounding noise."""
    return float(max(samples.max(), -samples.min())) * 2.0 ** (1 - _FLOAT_BITS)


def _check_level(columns: NDArray[Any], subtype: str, window: int) -> list[Remark]:
    """Return remarks on the length and on the amplitudes of samples (n, channels)."""
    if errors := _unusable(columns, window):
        return errors
    remarks = []
    lowest, highest = _extremes(columns)
    clipped = sum(
        _clipped(column, subtype, low, high)
        for column, low, high in zip(columns.T, lowest, highest, strict=True)
    )
    if clipped:
        share = 100 * clipped / columns.size
        problem = f"{clipped} samples ({share:.2g} %) lie flat at the extreme: clipped"
        remarks.append(Remark("warning", "clipped", problem, _GAIN))
    swing = float((highest - lowest).max()) / 2  # the peak without any offset
    if swing < _QUIET:
        problem = f"very quiet: peak {swing:.2g} of full scale 1"
        remarks.append(
            Remark("warning", "quiet", problem, "check microphone and gain, or record again")
        )
    peak = float(np.maximum(highest, -lowest).max())
    if peak > 1 and subtype not in _BITS:
        problem = f"samples beyond full scale: peak {peak:.4g} (float samples may)"
        fix = "nothing to do, unless the file was meant to be within +-1"
        remarks.append(Remark("note", BEYOND_FULL_SCALE, problem, fix))
    return remarks


def _extremes(columns: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the lowest and highest sample of each channel, NaN if there is NaN."""
    rows = columns.T  # one channel is contiguous along its row
    return rows.min(axis=1), rows.max(axis=1)


def _unusable(columns: NDArray[Any], window: int) -> list[Remark]:
    """Return the reasons why samples (n, channels) have no feature."""
    count = len(columns)
    soundless = _soundless(columns) if count > 1 else None
    if count >= max(window, 1):
        return [soundless] if soundless else []
    problem = f"{count} samples are fewer than one window of {window}"
    fix = "record longer, set features.window, or remove its row"
    too_short = Remark("error", "too_short", problem, fix)
    return [too_short, soundless] if soundless else [too_short]


def _soundless(columns: NDArray[Any]) -> Remark | None:
    """Return the first reason why samples (n, channels), n > 0, hold no sound."""
    lowest, highest = _extremes(columns)
    peak = float(np.maximum(highest, -lowest).max())
    if not np.isfinite(peak):
        finite = np.isfinite(columns).all(axis=1)
        bad = len(columns) - int(np.count_nonzero(finite))
        problem = f"{bad} samples are NaN or infinite, the first at index {int(np.argmin(finite))}"
        return Remark("error", "not_finite", problem, "find what wrote them and record again")
    if peak == 0:
        fix = "check that the microphone is connected and selected, then record again"
        return Remark("error", "silent", "every sample is zero", fix)
    if peak < TOO_QUIET:
        problem = f"peak {peak:.2g} is below anything that a microphone gives"
        return Remark("error", "too_quiet", problem, "find what scaled it down and record again")
    if np.array_equal(lowest, highest):
        problem = f"every sample is {columns[0].max():.4g}: no sound, only an offset"
        return Remark("error", "constant", problem, "check microphone and cable, then record again")
    return None


def _clipped(samples: NDArray[Any], subtype: str, lowest: float, highest: float) -> int:
    """Return the number of samples (n,) that lie in flat runs at the highest or lowest value."""
    if subtype in _BITS:
        full_scale = np.float32(1 - 2.0 ** (1 - _BITS[subtype]))
        # float32 holds 24 bits: the highest 32-bit codes read as 1
        upper = _in_runs(samples >= full_scale) if highest >= full_scale else 0
        lower = _in_runs(samples <= -1) if lowest <= -1 else 0
        return upper + lower
    peak = max(highest, -lowest)
    tops = [extreme for extreme in (highest, lowest) if abs(extreme) > peak / 2]
    return sum(_flat_top(samples, extreme) for extreme in tops)


def _flat_top(samples: NDArray[Any], extreme: float) -> int:
    """Return samples in runs at `extreme`, if the signal leaves it by more than quantisation
    explains."""
    at = samples == extreme
    if not (count := _in_runs(at)):
        return 0
    steps = np.abs(np.diff(samples))
    leaving = steps[at[1:] != at[:-1]]
    return count if np.median(leaving) >= _CLIFF_QUANTA * steps[steps > 0].min() else 0


def _in_runs(hit: NDArray[np.bool_]) -> int:
    """Return the number of True in runs of at least _RUN."""
    if np.count_nonzero(hit) < _RUN:
        return 0
    edges = np.flatnonzero(np.diff(hit, prepend=False, append=False))
    lengths = edges[1::2] - edges[::2]
    return int(lengths[lengths >= _RUN].sum())
