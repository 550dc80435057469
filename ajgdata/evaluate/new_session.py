"""Models of known sessions on a new one, with what may help there and what that needs of it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from ajgdata.evaluate import metrics
from ajgdata.evaluate.cross_gripper import calibration_groups
from ajgdata.evaluate.reference_correction import Remedy
from ajgdata.evaluate.session_shift import Brought, coral, referenced, standardised
from ajgdata.models import fit_named_model
from ajgdata.types import Kind, NotPossibleError

#: What is tried beside calibration grasps, by name, in the order of what it needs.
NONE, STANDARDISED, CORAL = "as it is", "standardised", "CORAL"
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
    yield point(CORAL, partial(coral, *aligned), unlabelled=len(pool.value))
    for grasps, rows in chosen.items():
        labelled = int(rows.sum())
        yield point(grasps_name(grasps), lambda: plain, grasps=grasps, labelled=labelled)


def grasps_name(grasps: int) -> str:
    """Return the name of training on labelled grasps as well: `2 grasps of each`."""
    return f"{grasps} grasp{'s' * (grasps > 1)} of each"
