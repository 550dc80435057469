"""Checks of the samples of a recording: each defect has one message and one remedy.

- error (unusable): `too_short`, `not_finite`, `silent`, `constant`, `too_quiet`, `float_bytes`
- warning (used; a person should check it): `clipped`, `quiet`, `dead_channel`, `offset`, `hum`,
  `gap`, `repeated_block`
- note (unusual and correct): `beyond_full_scale`

`float_bytes`, `offset`, `hum`, `gap` and `repeated_block` have modules of their own.

Each of several microphones is checked as a recording of its own. A recording cannot be used if one
of its microphones cannot be used. For the mean of all channels, one channel without sound is a
warning.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.features.encoding import check_encoding
from ajgdata.features.gaps import check_gaps
from ajgdata.features.hum import check_hum
from ajgdata.features.offset import check_offset
from ajgdata.features.repeats import check_repeats
from ajgdata.features.segments import segments
from ajgdata.store.audio import Audio, Remark
from ajgdata.types.features import ALL_HZ, Band
from ajgdata.types.settings import microphone_text

#: Least peak of a microphone, relative to full scale. Far below it (1.2e-38), float32 loses digits.
TOO_QUIET = 1e-30
#: Peak of a quiet recording: -80 dB of full scale, three bits of a 16-bit recording.
_QUIET = 1e-4
#: Least number of successive samples at the extreme that are called clipping.
_RUN = 3
#: Least step (in quanta) from a clipped top to the next sample. A smooth peak that quantisation
#: flattens over three samples has a curvature c <= q per sample squared, where q is the quantum.
#: The next sample differs from it by up to 4 c + q <= 5 q.
_CLIFF_QUANTA = 8
#: Bits of the encodings with integers, by libsndfile's names.
_BITS = {"PCM_U8": 8, "PCM_S8": 8, "PCM_16": 16, "PCM_24": 24, "PCM_32": 32}
#: Bits of full scale in files of floats and in compressed files; smaller steps are rounding noise.
_FLOAT_BITS = 16
#: Code of the note about float samples above full scale.
BEYOND_FULL_SCALE = "beyond_full_scale"
_GAIN = "lower the gain and record again, or set quality to reject"


def check_audio(
    audio: Audio,
    least_samples: int,
    lines_hz: Band = ALL_HZ,
    microphones: Sequence[int] = (),
) -> list[Remark]:
    """Return all remarks on a recording that could be read.

    The feature requires `least_samples`, and lines of the frequencies `lines_hz` reach it.
    `microphones` are the numbers of the used channels, if each one has a feature.
    Conversion hides clipping, so the recorded samples are checked. The converted samples are also
    checked, because they must have a feature (the mean of opposite channels is silence).
    """
    is_converted = audio.samples.size != audio.recorded.size  # resampled, or averaged
    remarks = check_samples(
        audio.recorded,
        audio.info.subtype,
        0 if is_converted else least_samples,
        sample_rate_hz=audio.info.sample_rate_hz,
        lines_hz=lines_hz,
        microphones=microphones,
    )
    if is_converted:
        of_converted = _of_microphones(
            audio.columns,
            microphones,
            lambda columns: _check_level(columns, audio.info.subtype, least_samples),
        )
        errors = [remark for remark in (*remarks, *of_converted) if remark.level == "error"]
        if errors:
            remarks = _first_of_each_code(errors)
        elif not any(remark.code == "quiet" for remark in remarks):
            remarks += [remark for remark in of_converted if remark.code == "quiet"]
    return [*audio.remarks, *remarks]


def _first_of_each_code(remarks: Sequence[Remark]) -> list[Remark]:
    """Return the first remark of each code, in the order of the last remarks of each code."""
    first = {remark.code: remark for remark in reversed(remarks)}
    return list(reversed(first.values()))


def check_samples(
    samples: NDArray[Any],
    subtype: str,
    least_samples: int,
    *,
    sample_rate_hz: float = 44_100,
    lines_hz: Band = ALL_HZ,
    microphones: Sequence[int] = (),
) -> list[Remark]:
    """Return remarks on recorded samples (n,) or (n, channels), full scale +-1.

    `subtype` is libsndfile's name of the encoding (`AudioInfo.subtype`). Integers clip at full
    scale. Float samples can exceed full scale, and clip at any flat top. The feature requires
    `least_samples`, and lines of the frequencies `lines_hz` reach it. `microphones` are the numbers
    of the channels, if each one has a feature; without numbers, the feature is that of their mean.
    If there is an error, the result has only errors: the length, and the first reason for missing
    sound.
    """
    return _of_microphones(
        _columns(samples),
        microphones,
        lambda columns: _check_sound(columns, subtype, least_samples, sample_rate_hz, lines_hz),
    )


def _of_microphones(
    columns: NDArray[Any],
    microphones: Sequence[int],
    check: Callable[[NDArray[Any]], list[Remark]],
) -> list[Remark]:
    """Return the remarks of `check` on samples (n, channels), or on each of several microphones.

    A remark of several microphones is one remark, which names them if they are not all.
    """
    if len(microphones) < 2:
        return check(columns)
    remarks = [
        (number, remark)
        for number, column in zip(microphones, columns.T, strict=True)
        for remark in check(column[:, np.newaxis])
    ]
    has_error = any(remark.level == "error" for _, remark in remarks)
    numbers: dict[str, list[int]] = {}
    first: dict[str, Remark] = {}
    for number, remark in remarks:
        if not has_error or remark.level == "error":
            first.setdefault(remark.code, remark)
            numbers.setdefault(remark.code, []).append(number)
    return [
        remark._replace(problem=f"{microphone_text(tuple(numbers[code]))}: {remark.problem}")
        if len(numbers[code]) < len(microphones)
        else remark
        for code, remark in first.items()
    ]


def _check_sound(
    columns: NDArray[Any],
    subtype: str,
    least_samples: int,
    sample_rate_hz: float,
    lines_hz: Band,
) -> list[Remark]:
    """Return remarks on samples (n, channels) with one feature, see `check_samples`."""
    remarks = _check_level(columns, subtype, least_samples)
    if any(remark.level == "error" for remark in remarks):
        return remarks
    defects: list[Remark] = []
    with np.errstate(over="ignore", invalid="ignore"):  # a sum that overflows exceeds no limit
        for column in columns.T:
            defects += _check_signal(column, subtype, sample_rate_hz, lines_hz)
    defects = _first_of_each_code(defects)
    errors = [defect for defect in defects if defect.level == "error"]
    return errors or [*remarks, *defects]


def _columns(samples: NDArray[Any]) -> NDArray[Any]:
    """Return samples (n,) or (n, channels) as (n, channels)."""
    return samples[:, np.newaxis] if samples.ndim == 1 else samples


def _check_signal(
    samples: NDArray[Any],
    subtype: str,
    sample_rate_hz: float,
    lines_hz: Band,
) -> list[Remark]:
    """Return the defects of the signal of one channel (n,), which has sound."""
    samples = np.ascontiguousarray(samples, np.float32)
    parts = segments(samples, sample_rate_hz)
    is_integer = subtype in _BITS
    loudest = float(parts.rms.max(initial=0))
    if is_integer:
        error = check_encoding(samples, loudest)
        if error:
            return [error]
        quantum = 2.0 ** (1 - _BITS[subtype])
    else:
        quantum = _float_quantum(samples)
    defects = [
        check_hum(samples, parts, sample_rate_hz, lines_hz),
        check_gaps(samples, quantum),
        check_repeats(samples, quantum),
    ]
    if lines_hz[0] <= 0:
        defects.insert(0, check_offset(samples, parts, sample_rate_hz))
    return [defect for defect in defects if defect]


def _float_quantum(samples: NDArray[Any]) -> float:
    """Return the step of samples (n,) of a file without integers; less is rounding noise."""
    return float(max(samples.max(), -samples.min())) * 2.0 ** (1 - _FLOAT_BITS)


def _check_level(columns: NDArray[Any], subtype: str, least_samples: int) -> list[Remark]:
    """Return remarks on the length and on the amplitudes of samples (n, channels)."""
    errors = _unusable(columns, least_samples)
    if errors:
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
    dead = [number for number, swing in enumerate(highest - lowest, 1) if swing == 0]
    if dead:
        problem = f"channel {dead[0]} has no sound, and is a part of the mean of all channels"
        fix = "check microphone and cable, or set audio.microphone to the number of another channel"
        remarks.append(Remark("warning", "dead_channel", problem, fix))
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
    """Return the lowest and highest sample of each channel (channels,), NaN if there is NaN."""
    rows = columns.T  # one channel is contiguous along its row
    return rows.min(axis=1), rows.max(axis=1)


def _unusable(columns: NDArray[Any], least_samples: int) -> list[Remark]:
    """Return the reasons why samples (n, channels) have no feature."""
    errors = []
    count = len(columns)
    if count < max(least_samples, 1):
        problem = f"{count} samples are fewer than the {least_samples} of a feature"
        fix = "record longer, change features in dataset.yaml, or remove its row"
        errors.append(Remark("error", "too_short", problem, fix))
    soundless = _soundless(columns) if count > 1 else None
    if soundless:
        errors.append(soundless)
    return errors


def _soundless(columns: NDArray[Any]) -> Remark | None:
    """Return the first reason why samples (n, channels), n > 0, have no sound; None for sound."""
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
    """Return the number of samples in runs at `extreme`.

    It is 0 if quantisation explains the steps between these runs and their neighbours.
    """
    is_extreme = samples == extreme
    count = _in_runs(is_extreme)
    if not count:
        return 0
    steps = np.abs(np.diff(samples))
    edge_steps = steps[is_extreme[1:] != is_extreme[:-1]]
    return count if np.median(edge_steps) >= _CLIFF_QUANTA * steps[steps > 0].min() else 0


def _in_runs(mask: NDArray[np.bool_]) -> int:
    """Return the number of True in runs of at least _RUN."""
    if np.count_nonzero(mask) < _RUN:
        return 0
    edges = np.flatnonzero(np.diff(mask, prepend=False, append=False))
    lengths = edges[1::2] - edges[::2]
    return int(lengths[lengths >= _RUN].sum())
