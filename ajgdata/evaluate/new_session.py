"""Models of known sessions on a new one, with corrections that may help and what these need of it.

A gripper that was moved, warmed or refilled shifts and scales the bins of all its spectra.
Corrections use recordings without labels, or of the empty gripper, to undo that on spectra that are
compressed by asinh, where a change of gain is a shift.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from ajgdata.evaluate import metrics
from ajgdata.evaluate.cross_gripper import calibration_groups
from ajgdata.evaluate.reference_correction import Remedy, change
from ajgdata.models import fit_named_model
from ajgdata.types import Kind, NotPossibleError

#: What is tried beside calibration grasps, by name, in the order of what it needs.
NONE, STANDARDISED = "as it is", "standardised"
BY_REFERENCES: dict[str, Remedy] = {
    "references, difference": "difference",
    "references, ratio": "ratio",
    "references, stretch and ratio": "stretch and ratio",
}


@dataclass(frozen=True, eq=False)
class SessionData:
    """Features (n, f), targets, groups and sessions (n,); `references` (r, f) are recordings of
    nothing by session, `hz` (f,) frequencies, `normalisation` how features were divided."""

    feature: np.ndarray
    value: np.ndarray
    group: np.ndarray
    session: np.ndarray
    hz: np.ndarray
    references: Mapping[str, np.ndarray] = field(default_factory=dict)
    normalisation: str = "l1"

    def where(self, chosen: np.ndarray) -> SessionData:
        """Return the recordings that are `chosen`, a boolean (n,) or rows."""
        kept = ("feature", "value", "group", "session")
        return replace(self, **{name: getattr(self, name)[chosen] for name in kept})


@dataclass(frozen=True)
class Point:
    """One model on one session: the remedy, and how many of the new session's recordings it used
    (`labelled`, `unlabelled`, `references`); `cpu_s` is correcting and training."""

    session: str
    draw: int
    remedy: str
    grasps: int  #: of each class (value) that were labelled
    labelled: int
    unlabelled: int
    references: int
    tested: int
    scores: dict[str, float]
    chance: dict[str, float]
    cpu_s: float


def on_new_sessions(
    data: SessionData,
    *,
    tested: Sequence[str],
    train_on: Sequence[str],
    sizes: Sequence[int],
    draws: int,
    model: str,
    kind: Kind,
    seed: int,
    period: float | None = None,
    limits: Mapping[str, int] | None = None,
) -> Iterator[Point]:
    """Yield for each session of `tested` what models of `train_on` (none: all others) say of it.

    Each draw sets `max(sizes)` groups of each class (each value, of a number) aside: these are what
    the new session gives, labelled or not, and all else is tested. Sizes for which some class has
    too few groups are left out; where no size is left, half of the groups stand aside, unlabelled.
    Groups that are tested are trained on in no session.
    """
    fit = partial(fit_named_model, model, kind, seed=seed, period=period, limits=limits)
    with threadpool_limits(limits=1):
        for session in tested:
            there = data.where(data.session == session)
            others = np.isin(data.session, train_on) if train_on else data.session != session
            known = data.where(others & (data.session != session))
            for draw in range(draws):
                given, chosen = _given(there, sizes, np.random.default_rng([seed, draw]))
                yield from _points(known, there, given, chosen, draw, fit, kind, period)


def _given(
    there: SessionData, sizes: Sequence[int], generator: np.random.Generator
) -> tuple[np.ndarray, dict[int, np.ndarray]]:
    """Return which recordings (n,) are set aside, and which of these each size labels."""
    label = there.value.astype(str)
    orders = calibration_groups(label, there.group, 0, generator)
    possible = [size for size in sizes if size < min(map(len, orders))]
    if not possible:
        every = generator.permutation(np.unique(there.group))
        return np.isin(there.group, every[: len(every) // 2]), {}

    def first(count: int) -> np.ndarray:
        return np.isin(there.group, np.concatenate([order[:count] for order in orders]))

    return first(max(possible)), {size: first(size) for size in possible}


def _points(
    known: SessionData,
    there: SessionData,
    given: np.ndarray,
    chosen: Mapping[int, np.ndarray],
    draw: int,
    fit: Callable[..., Any],
    kind: Kind,
    period: float | None,
) -> Iterator[Point]:
    """Yield every remedy in one session."""
    session = str(there.session[0])
    tests, pool = there.where(~given), there.where(given)
    known = known.where(~np.isin(known.group, tests.group))
    if len(np.unique(known.value)) < 2 or not len(tests.value) or not len(pool.value):
        raise NotPossibleError(f"session {session!r}: too little is left to train on or to test")
    count = len(there.references.get(session, ()))
    plain = Brought(known.feature, tests.feature)

    def point(remedy: str, bring: Callable[[], Brought], **used: int) -> Point:
        begun = time.process_time()
        brought, y, group = bring(), known.value, known.group
        if grasps := used.get("grasps", 0):
            added = there.where(chosen[grasps])
            brought = Brought(np.concatenate([brought.known, added.feature]), brought.new)
            y, group = np.append(y, added.value), np.append(group, added.group)
        fitted = fit(brought.known, y, group)
        cpu_s = time.process_time() - begun
        needs = dict.fromkeys(("grasps", "labelled", "unlabelled", "references"), 0) | used
        return Point(
            session=session, draw=draw, remedy=remedy, **needs, tested=len(tests.value),
            scores=metrics.score(tests.value, fitted.predict(brought.new), kind, period),
            chance=metrics.chance(y, tests.value, kind, period), cpu_s=cpu_s,
        )  # fmt: skip

    yield point(NONE, lambda: plain)
    own = {name: one for name, one in there.references.items() if name in set(known.session)}
    if count and sum(map(len, own.values())) >= 2:
        mended = partial(
            referenced, known.feature, known.session, own, tests.feature,
            there.references[session], hz=there.hz, normalisation=there.normalisation,
        )  # fmt: skip
        for name, remedy in BY_REFERENCES.items():
            yield point(name, partial(mended, remedy=remedy), references=count)
    aligned = known.feature, known.session, pool.feature, tests.feature
    yield point(STANDARDISED, partial(standardised, *aligned), unlabelled=len(pool.value))
    for grasps, rows in chosen.items():
        labelled = int(rows.sum())
        yield point(grasps_name(grasps), lambda: plain, grasps=grasps, labelled=labelled)


def grasps_name(grasps: int) -> str:
    """Return the name of training on labelled grasps as well: `2 grasps of each`."""
    return f"{grasps} grasp{'s' * (grasps > 1)} of each"


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
