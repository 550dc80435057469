"""Checks of the samples of a recording: each defect has one message and one remedy.

error (unusable): `too_short`, `not_finite`, `silent`, `constant`, `too_quiet`.
warning (used, but look): `clipped`, `quiet`. note (unusual and fine): `beyond_full_scale`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.store.audio import Audio, Remark

TOO_QUIET = 1e-30  # no microphone: below this float32 loses digits (1.2e-38), then everything
_QUIET = 1e-4  # -80 dB of full scale: three bits of a 16-bit recording
_RUN = 3  # samples at the extreme, one after another, before it is called clipping
#: A smooth peak that quantisation flattens over three samples has curvature c <= q per sample
#: squared (q the quantum), hence leaves it by 4 c + q <= 5 q at the most; clipping leaves a cliff.
_CLIFF_QUANTA = 8
_BITS = {"PCM_U8": 8, "PCM_S8": 8, "PCM_16": 16, "PCM_24": 24, "PCM_32": 32}
#: Code of the note about float samples above full scale.
BEYOND = "beyond_full_scale"
_GAIN = "lower the gain and record again, or set quality to reject"


def check_audio(audio: Audio, window: int) -> list[Remark]:
    """Return every remark on a recording that could be read.

    Conversion hides clipping, so the samples are judged as recorded; but those as converted must
    still make a feature (opposite channels average to silence).
    """
    converted = audio.samples.size != audio.recorded.size  # resampled, or averaged over channels
    remarks = check_samples(audio.recorded, audio.info.subtype, 0 if converted else window)
    if converted:
        of_converted = check_samples(audio.samples, audio.info.subtype, window)
        wrong = [issue for issue in (*remarks, *of_converted) if issue.level == "error"]
        if errors := {issue.code: issue for issue in reversed(wrong)}:  # the first of each code
            remarks = list(reversed(errors.values()))
        elif not any(remark.code == "quiet" for remark in remarks):
            remarks += [remark for remark in of_converted if remark.code == "quiet"]
    return [*audio.remarks, *remarks]


def check_samples(samples: NDArray[Any], subtype: str, window: int) -> list[Remark]:
    """Return remarks on samples (n,) or (n, channels) as recorded, full scale +-1.

    `subtype` is libsndfile's name of the encoding (`AudioInfo.subtype`): integers clip at full
    scale, float samples may exceed it and clip wherever a flat top shows. `window` is the number of
    samples that the feature needs. With an error nothing else is looked for: of samples without
    sound, the first reason is reported in addition to their length.
    """
    columns = samples[:, np.newaxis] if samples.ndim == 1 else samples
    if errors := _unusable(columns, window):
        return errors
    remarks = []
    if clipped := sum(_clipped(column, subtype) for column in columns.T):
        share = 100 * clipped / columns.size
        problem = f"{clipped} samples ({share:.2g} %) lie flat at the extreme: clipped"
        remarks.append(Remark("warning", "clipped", problem, _GAIN))
    peak = float(np.abs(columns).max())
    if _swing(columns) < _QUIET:
        problem = f"very quiet: peak {_swing(columns):.2g} of full scale 1"
        remarks.append(
            Remark("warning", "quiet", problem, "check microphone and gain, or record again")
        )
    if peak > 1 and subtype not in _BITS:
        problem = f"samples beyond full scale: peak {peak:.4g} (float samples may)"
        fix = "nothing to do, unless the file was meant to be within +-1"
        remarks.append(Remark("note", BEYOND, problem, fix))
    return remarks


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
    count = len(columns)
    finite = np.isfinite(columns).all(axis=1)
    if not finite.all():
        bad = int(count - np.count_nonzero(finite))
        problem = f"{bad} samples are NaN or infinite, the first at index {int(np.argmin(finite))}"
        return Remark("error", "not_finite", problem, "find what wrote them and record again")
    peak = float(np.abs(columns).max())
    if peak == 0:
        fix = "check that the microphone is connected and selected, then record again"
        return Remark("error", "silent", "every sample is zero", fix)
    if peak < TOO_QUIET:
        problem = f"peak {peak:.2g} is below anything that a microphone gives"
        return Remark("error", "too_quiet", problem, "find what scaled it down and record again")
    if not np.any(columns != columns[0]):
        problem = f"every sample is {columns[0].max():.4g}: no sound, only an offset"
        return Remark("error", "constant", problem, "check microphone and cable, then record again")
    return None


def _swing(columns: NDArray[Any]) -> float:
    """Return half the largest peak-to-peak amplitude: the peak without any offset."""
    return float(np.ptp(columns, axis=0).max()) / 2


def _clipped(samples: NDArray[Any], subtype: str) -> int:
    """Return the number of samples (n,) that lie in flat runs at the highest or lowest value."""
    if subtype in _BITS:
        highest = 1 - 2.0 ** (1 - _BITS[subtype])
        # float32 holds 24 bits: the highest 32-bit codes read as 1
        return _in_runs(samples >= np.float32(highest)) + _in_runs(samples <= -1)
    peak = max(samples.max(), -samples.min())
    tops = [extreme for extreme in (samples.max(), samples.min()) if abs(extreme) > peak / 2]
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
