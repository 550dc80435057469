"""Models of known sessions in a new session, as they are and with corrections.

A gripper that was moved, warmed or refilled shifts and scales the bins of all its spectra.
Corrections use recordings of the session, without or with labels, to undo that change.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from ajgdata.evaluate import metrics
from ajgdata.evaluate.cross_gripper import calibration_groups
from ajgdata.models import fit_named_model
from ajgdata.types import Kind, NotPossibleError

NONE, STANDARDISED = "as it is", "standardised"
#: Spectra are compressed by asinh from this share of their mean on, as in the linear models.
RELATIVE = 0.1
#: A bin whose deviation is smaller does not vary: float32 rounds it away.
STILL = 1e-6
Row = dict[str, Any]
#: Features (n, f) to train on and (m, f) to test.
Corrected = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True, eq=False)
class SessionData:
    """Features (n, f), targets, groups and sessions (n,)."""

    feature: np.ndarray
    value: np.ndarray
    group: np.ndarray
    session: np.ndarray

    def where(self, chosen: np.ndarray) -> SessionData:
        """Return the recordings that are `chosen`, a boolean (n,) or rows."""
        columns = (self.feature, self.value, self.group, self.session)
        return SessionData(*(column[chosen] for column in columns))


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
) -> Iterator[Row]:
    """Yield one row per session of `tested`, draw, correction and metric.

    Models are trained on the sessions `train_on` (none: all others). Each draw sets `max(sizes)`
    groups of each class (each value, of a number) aside for corrections, labelled or not; the rest
    is tested. Sizes for which a class has too few groups are skipped; if none is possible, half of
    the groups are set aside, unlabelled. Groups that are tested are trained on in no session.
    `labelled` and `unlabelled` are counts of recordings of the new session.
    """
    fit = partial(fit_named_model, model, kind, seed=seed, period=period, limits=limits)
    with threadpool_limits(limits=1):
        for session in tested:
            there = data.where(data.session == session)
            others = np.isin(data.session, train_on) if train_on else data.session != session
            known = data.where(others & (data.session != session))
            for draw in range(draws):
                aside, labelled = _set_aside(there, sizes, np.random.default_rng([seed, draw]))
                for row in _corrections(known, there, aside, labelled, fit, kind, period):
                    yield {"session": str(session), "draw": draw, **row}


def _set_aside(
    there: SessionData, sizes: Sequence[int], generator: np.random.Generator
) -> tuple[np.ndarray, dict[int, np.ndarray]]:
    """Return which recordings (n,) are set aside, and which of these each size labels."""
    orders = calibration_groups(there.value.astype(str), there.group, 0, generator)
    possible = [size for size in sizes if size < min(map(len, orders))]
    if not possible:
        every = generator.permutation(np.unique(there.group))
        return np.isin(there.group, every[: len(every) // 2]), {}

    def first(count: int) -> np.ndarray:
        return np.isin(there.group, np.concatenate([order[:count] for order in orders]))

    return first(max(possible)), {size: first(size) for size in possible}


def _corrections(
    known: SessionData,
    there: SessionData,
    aside: np.ndarray,
    labelled: Mapping[int, np.ndarray],
    fit: Callable[..., Any],
    kind: Kind,
    period: float | None,
) -> Iterator[Row]:
    """Yield the metrics of each correction in one session."""
    session = str(there.session[0])
    tests, pool = there.where(~aside), there.where(aside)
    known = known.where(~np.isin(known.group, tests.group))
    if len(np.unique(known.value)) < 2 or not len(tests.value) or not len(pool.value):
        raise NotPossibleError(f"session {session!r}: too little is left to train on or to test")

    def rows(name: str, corrected: Corrected, added: SessionData | None = None, **used: int):
        x, y, group = corrected[0], known.value, known.group
        if added is not None:
            x = np.concatenate([x, added.feature])
            y, group = np.append(y, added.value), np.append(group, added.group)
        scores = metrics.score(tests.value, fit(x, y, group).predict(corrected[1]), kind, period)
        chance = metrics.chance(y, tests.value, kind, period)
        counts = dict.fromkeys(("labelled", "unlabelled"), 0) | used
        for metric, value in scores.items():
            row = {"remedy": name, **counts, "metric": metric}
            yield row | {"value": value, "chance": chance[metric]}

    plain = known.feature, tests.feature
    yield from rows(NONE, plain)
    corrected = standardised(known.feature, known.session, pool.feature, tests.feature)
    yield from rows(STANDARDISED, corrected, unlabelled=len(pool.value))
    for grasps, chosen in labelled.items():
        name = f"{grasps} grasp{'s' * (grasps > 1)} of each"
        yield from rows(name, plain, there.where(chosen), labelled=int(chosen.sum()))


def standardised(
    known: np.ndarray, sessions: np.ndarray, unlabelled: np.ndarray, new: np.ndarray
) -> Corrected:
    """Give each bin the same mean and deviation in every session: the mean of those of known ones.

    `known` (n, f) of `sessions` (n,); `unlabelled` (u, f) are recordings of the new session, from
    which its own mean and deviation are computed; `new` (m, f) is tested. Spectra are compressed by
    asinh, so a gain is a shift. This assumes that classes are equally frequent in all sessions.
    """
    scale = float(np.abs(known).mean() * RELATIVE) or 1.0

    def compressed(features: np.ndarray) -> np.ndarray:
        return np.arcsinh(np.asarray(features, np.float64) / scale)

    values = compressed(known)
    moments = {name: _moments(values[sessions == name]) for name in np.unique(sessions)}
    mean, sd = np.mean(list(moments.values()), axis=0)

    def restored(points: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Return features of standardised bins; no magnitude is below 0."""
        z = (points - own[0]) / own[1]
        return (scale * np.sinh(np.maximum(z * sd + mean, 0.0))).astype(np.float32)

    corrected = np.empty(values.shape, np.float32)
    for name, own in moments.items():
        corrected[sessions == name] = restored(values[sessions == name], own)
    return corrected, restored(compressed(new), _moments(compressed(unlabelled)))


def _moments(values: np.ndarray) -> np.ndarray:
    """Return mean and deviation (2, f); a bin that does not vary, or of one recording, counts 1."""
    sd = values.std(axis=0, ddof=1) if len(values) > 1 else np.ones(values.shape[1])
    return np.array([values.mean(axis=0), np.where(sd > STILL, sd, 1.0)])
