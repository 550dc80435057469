"""Diagnosis from scores: a model recognises the object, or the placement and the session."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

from ajgdata.evaluate.agreement import Estimate, Interval, placebo_test
from ajgdata.evaluate.fold_tests import corrected_interval

#: `object`: a new session keeps most of the skill. `placement`: it keeps less than half of it.
#: `nothing`: not better than chance or the placebo. `unmeasured`: there is only one session.
DiagnosisVerdict = Literal["object", "placement", "nothing", "inconclusive", "unmeasured"]
#: Share of the skill in known sessions that a new session must keep. `experiments.cross_gripper`
#: uses the same share for a new gripper.
KEPT_SKILL = 0.5
#: Number of held-out sessions from which their variation is part of the interval. The intervals of
#: fewer sessions would be too wide for any verdict, so their verdicts are preliminary.
ENOUGH_SESSIONS = 5


def kept_skill(known: Estimate, new: Estimate) -> tuple[float, float, float]:
    """Return the share of the skill that is kept in new sessions, with the ends of its interval.

    The skill is (value - chance) / (perfect - chance). The interval is that of the score in new
    sessions; the score in known sessions counts as exact.

    >>> from ajgdata.evaluate.agreement import Estimate, Interval
    >>> known = Estimate(0.9, Interval(0.8, 1.0), chance=0.5, perfect=1.0)
    >>> new = Estimate(0.7, Interval(0.6, 0.8), chance=0.5, perfect=1.0)
    >>> share, low, high = kept_skill(known, new)
    >>> f"{share:.2f} {low:.2f} {high:.2f}"
    '0.50 0.25 0.75'
    """
    whole = (known.value - known.chance) / (known.perfect - known.chance)
    shares = [
        (value - new.chance) / (new.perfect - new.chance) / whole
        for value in (new.value, *new.interval)
    ]
    return shares[0], min(shares[1:]), max(shares[1:])


def over_sessions(new: Estimate, folds: Sequence[float], metric: str) -> Estimate:
    """Return the score in new sessions with an interval that also has the variation of sessions.

    `new` has the interval over grasps, and `folds` are the scores of the held-out sessions. With
    fewer than `ENOUGH_SESSIONS` folds, `new` is returned.
    """
    if len(folds) < ENOUGH_SESSIONS:
        return new
    between = corrected_interval(folds, len(folds), metric)
    if not between.is_defined:
        return new
    low = min(new.interval.low, between.low)
    high = max(new.interval.high, between.high)
    return new._replace(interval=Interval(low, high))


def diagnose(
    known: Estimate, new: Estimate | None, placebo: Estimate | None = None
) -> DiagnosisVerdict:
    """Return whether a model recognises the object, or the placement and the session.

    Args:
        known: Score on held-out grasps of known sessions.
        new: Score in held-out sessions; None if there is only one session.
        placebo: Score of one object under the names of all classes, by the split of `known`.
    """
    is_better = known.is_better_than_chance
    if placebo is not None:
        is_better = placebo_test(known, placebo).is_better
    if not is_better:
        return "nothing"
    if new is None or math.isnan(new.chance):
        return "unmeasured"
    _, low, high = kept_skill(known, new)
    if math.isnan(low):
        return "inconclusive"
    if low >= KEPT_SKILL:
        return "object"
    if high < KEPT_SKILL:
        return "placement"
    return "inconclusive"
