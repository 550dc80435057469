"""Recordings of a new session brought nearer to those of known ones, without its labels.

A gripper that was moved, warmed or filled anew shifts and scales the bins of all its spectra. What
recordings without labels, or of nothing, tell of that is taken out: here of spectra that are
compressed by asinh, where a change of gain is a shift, and then put back.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.evaluate.reference_correction import Remedy, change

Float64 = NDArray[np.float64]
Float32 = NDArray[np.float32]
#: Compression starts at this share of the mean of what is known, as in the linear models.
RELATIVE = 0.1
#: A bin whose deviation is smaller does not vary: float32 rounds it away.
STILL = 1e-6


class Brought(NamedTuple):
    """Features (n, f) to learn from and (m, f) to test, brought together."""

    known: Float32
    new: Float32


def standardised(
    known: np.ndarray, sessions: np.ndarray, unlabelled: np.ndarray, new: np.ndarray
) -> Brought:
    """Give each bin the same mean and deviation in every session: those of the known ones' middle.

    `known` (n, f) of `sessions` (n,); `unlabelled` (u, f) are recordings of the new session whose
    labels nobody needs, from which its own mean and deviation are taken; `new` (m, f) is tested.
    It supposes that classes are as frequent in one session as in another.
    """
    scale = _scale(known)
    z, own = _whitened(known, sessions, scale)
    centre, spread = _moments(_compressed(unlabelled, scale))
    there = (_compressed(new, scale) - centre) / spread
    return Brought(_expanded(z, own, scale), _expanded(there, own, scale))


def coral(
    known: np.ndarray, sessions: np.ndarray, unlabelled: np.ndarray, new: np.ndarray
) -> Brought:
    """Standardise as above, then give the known the correlations of the new session (CORAL: Sun,
    Feng & Saenko 2016, AAAI 30; arXiv 1511.05547).

    Known z, each bin standardised, become z C_known^(-1/2) C_new^(1/2). Of fewer recordings than
    bins a covariance is singular: both are shrunk towards a multiple of the identity by the share
    that Ledoit & Wolf (2004, J. Multivar. Anal. 88, 365) estimate, where the original adds the
    identity itself.
    """
    scale = _scale(known)
    z, own = _whitened(known, sessions, scale)
    centre, spread = _moments(compressed := _compressed(unlabelled, scale))
    target = (compressed - centre) / spread
    coloured = _power(_power(z, z, -0.5), target, 0.5)
    there = (_compressed(new, scale) - centre) / spread
    return Brought(_expanded(coloured, own, scale), _expanded(there, own, scale))


def referenced(
    known: np.ndarray,
    sessions: np.ndarray,
    references: Mapping[str, np.ndarray],
    new: np.ndarray,
    new_references: np.ndarray,
    *,
    hz: np.ndarray,
    remedy: Remedy,
    normalisation: str = "l1",
) -> Brought:
    """Undo in every session what recordings of nothing tell of its change from all known ones.

    `references` (r, f) by session; for the corrections see `reference_correction`. A known session
    without references stays as it is. Raises NotPossibleError for fewer than two of known sessions,
    and for none of the new one.
    """
    before = np.concatenate([*references.values(), np.empty((0, known.shape[1]))])
    told = change(before, new_references, hz).undone(new, remedy, normalisation)
    mended = np.array(known, np.float32)
    for session in np.unique(sessions):
        if len(own := references.get(str(session), ())):
            rows = sessions == session
            mended[rows] = change(before, own, hz).undone(known[rows], remedy, normalisation)
    return Brought(mended, told)


class _Moments(NamedTuple):
    mean: Float64
    sd: Float64


def _scale(known: np.ndarray) -> float:
    return float(np.abs(known).mean() * RELATIVE) or 1.0


def _compressed(features: np.ndarray, scale: float) -> Float64:
    return np.arcsinh(np.asarray(features, np.float64) / scale)


def _expanded(z: Float64, own: _Moments, scale: float) -> Float32:
    """Return features of standardised bins; no magnitude is below 0."""
    return (scale * np.sinh(np.maximum(z * own.sd + own.mean, 0.0))).astype(np.float32)


def _moments(values: Float64) -> _Moments:
    """Return mean and deviation (f,); a bin that does not vary, or of one recording, counts 1."""
    sd = values.std(axis=0, ddof=1) if len(values) > 1 else np.ones(values.shape[1])
    return _Moments(values.mean(axis=0), np.where(sd > STILL, sd, 1.0))


def _whitened(known: np.ndarray, sessions: np.ndarray, scale: float) -> tuple[Float64, _Moments]:
    """Return bins standardised session by session (n, f), and the middle of the sessions' mean and
    deviation."""
    values = _compressed(known, scale)
    z, each = np.empty_like(values), []
    for session in np.unique(sessions):
        rows = sessions == session
        each.append(own := _moments(values[rows]))
        z[rows] = (values[rows] - own.mean) / own.sd
    means, deviations = zip(*each, strict=True)
    return z, _Moments(np.mean(means, axis=0), np.mean(deviations, axis=0))


def _power(rows: Float64, of: Float64, power: float) -> Float64:
    """Return `rows` (n, f) times a power of the shrunk covariance of `of` (m, f).

    The covariance is s I + (1 - d) V l Vᵀ with shrinkage d, s = d trace / f, and the m non-zero
    eigenvalues l of the rows alone: no matrix (f, f) is needed.
    """
    from sklearn.covariance import ledoit_wolf_shrinkage

    centred = of - of.mean(axis=0)
    share = max(float(ledoit_wolf_shrinkage(centred, assume_centered=True)), STILL)
    _, singular, basis = np.linalg.svd(centred / np.sqrt(len(of)), full_matrices=False)
    eigen = np.square(singular)
    floor = share * max(float(eigen.sum()) / of.shape[1], STILL)
    gain = (floor + (1 - share) * eigen) ** power - floor**power
    return floor**power * rows + ((rows @ basis.T) * gain) @ basis
