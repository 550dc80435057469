"""Further splits of a task: repeats of the grouped one, within sessions and across them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ajgdata.experiments.base import Inputs
from ajgdata.experiments.cross_validation.results import GROUPED, REPEATED
from ajgdata.types import NotPossibleError

if TYPE_CHECKING:
    from ajgdata.evaluate.crossval import CrossValidation, Predictions, Tested
    from ajgdata.evaluate.splits import Folds
    from ajgdata.evaluate.task_data import TaskData
    from ajgdata.experiments.cross_validation import Evaluation, Settings

ScoreRow = tuple[str, str, str, str, float]
#: Models that are always tried across sessions: they train in an instant, or (k-NN) are chosen in
#: one. Folds of sessions cost up to four times as much as those of a task.
CHEAP = ("knn", "linear_plain", "knn_plain", "ridge_plain")
#: Up to so many recordings all models are.
FEW_RECORDINGS = 200


class Further(NamedTuple):
    """Results by the name of their part; `no_sessions` says why there are none of sessions ("" if
    there are, or if nobody asked)."""

    repeated: dict[str, Tested]
    sessions: dict[str, CrossValidation]
    no_sessions: str


def further_splits(inputs: Inputs, settings: Settings, model: str, found: Evaluation) -> Further:
    """Return repeats of the grouped split of `found`, and splits by sessions, as settings ask."""
    sessions, reason = {}, ""
    if _asked(settings, model, len(found.data[GROUPED].value)):
        try:
            sessions = _by_session(inputs, model, found)
        except NotPossibleError as error:
            reason = str(error)
    return Further(_repeats(inputs, settings, model, found), sessions, reason)


def _asked(settings: Settings, model: str, recordings: int) -> bool:
    if settings.compare_sessions == "auto":
        return model in CHEAP or recordings <= FEW_RECORDINGS
    return settings.compare_sessions == "all"


def _by_session(inputs: Inputs, model: str, found: Evaluation) -> dict[str, CrossValidation]:
    from ajgdata.evaluate.crossval import cross_validate
    from ajgdata.evaluate.sessions import WITHIN, choice_groups, session_of, session_splits

    data, session = found.data[GROUPED], session_of(found.data[GROUPED].name)
    splits = session_splits(data.value, data.group, session, inputs.kind, inputs.folds, inputs.seed)

    def inner(parts: Folds) -> list[np.ndarray]:
        return [choice_groups(data.group, session, train) for train, _ in parts]

    return {
        split: cross_validate(
            data.feature, data.value, data.group, model=model, parts=parts, split=split,
            inner_groups=None if split == WITHIN else inner(parts), **inputs.split,
        )
        for split, parts in splits.items()
    }  # fmt: skip


def _repeats(
    inputs: Inputs, settings: Settings, model: str, found: Evaluation
) -> dict[str, Tested]:
    from ajgdata.evaluate.crossval import cross_validate
    from ajgdata.evaluate.resampling import repeated, repeats_of

    data, first = found.data[GROUPED], found.splits[GROUPED]
    folds, groups = first.scores.folds, len(np.unique(data.group))
    repeats = repeats_of(settings.repeats, len(data.value), groups, folds)
    if repeats < 2:
        return {}

    def once(seed: int) -> CrossValidation:
        named = inputs.split | {"folds": folds, "seed": seed}
        return cross_validate(data.feature, data.value, data.group, model=model, **named)

    period = inputs.period_deg
    return {REPEATED: repeated(once, first, repeats, seed=inputs.seed, period=period)}


def grasp_interval_scores(
    model: str, part: str, tests: Sequence[tuple[Predictions, TaskData]], inputs: Inputs
) -> Iterator[ScoreRow]:
    """Yield the ends of the interval over grasps of the metric that is read first.

    `tests` are predictions, and the recordings that their rows count in: of known and withheld
    values together there are two.
    """
    from ajgdata.evaluate.agreement import GRASP_INTERVAL
    from ajgdata.evaluate.intervals import metric_interval
    from ajgdata.evaluate.metrics import METRICS

    y_true, y_pred, fold = (
        np.concatenate([getattr(one, key) for one, _ in tests])
        for key in ("y_true", "y_pred", "fold")
    )
    group = np.concatenate([data.group[one.row] for one, data in tests])
    parts = np.repeat(np.arange(len(tests)), [len(one.row) for one, _ in tests])
    interval = metric_interval(
        y_true, y_pred, fold, group, part=parts, kind=inputs.kind, period=inputs.period_deg,
        seed=inputs.seed,
    )  # fmt: skip
    for end, value in zip(GRASP_INTERVAL, interval, strict=True):
        yield model, part, METRICS[inputs.kind][0], end, value


def interval_scores(model: str, found: Mapping[str, Tested], folds: int) -> Iterator[ScoreRow]:
    """Yield the ends of the corrected intervals of repeats as rows of scores."""
    from ajgdata.evaluate.resampling import corrected_interval

    for part, one in found.items():
        for metric, values in one.scores.per_fold.items():
            interval = corrected_interval(values, folds, metric)
            yield model, part, metric, "low", interval.low
            yield model, part, metric, "high", interval.high
