"""Drift, measured: models of day 1 on other sessions, corrections, calibration grasps, alarms.

There is a model for each session of day 1, trained on the others, so that each is tested on a
session of day 1, too. Its probabilities are scaled by the temperature that suits the sessions of
the other models (Guo et al. 2017, see `evaluate.calibration`), as they would be in use.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ajgdata.evaluate.calibration import (
    TINIEST,
    calibration_error,
    reliability,
    temperature,
    with_temperature,
)
from ajgdata.evaluate.cross_gripper import calibration_groups
from ajgdata.evaluate.novelty import Guard, alarm
from ajgdata.evaluate.reference_correction import REMEDIES, change
from ajgdata.live.drift import DriftWatch
from ajgdata.models import fit_named_model
from ajgdata.types import NotPossibleError

if TYPE_CHECKING:
    from sklearn.base import BaseEstimator

    from ajgdata.evaluate.task_data import TaskData
    from ajgdata.experiments.base import Inputs
    from ajgdata.experiments.drift import Settings

Row = dict[str, Any]


class Sessions(NamedTuple):
    """Recordings of objects, and features (r, f) of references, by session; `hz` (f,)."""

    held: dict[str, TaskData]
    references: dict[str, np.ndarray]
    hz: np.ndarray


class Trained(NamedTuple):
    """A model of all sessions of day 1 but one, `unmet`; the temperature that suits it, the guard
    that knows its grasps, and the references (r, f) of the sessions that it has met."""

    fitted: BaseEstimator
    unmet: str
    temperature: float
    guard: Guard
    references: np.ndarray


def sessions_of(inputs: Inputs, day_1: Sequence[str], later: Sequence[str]) -> Sessions:
    """Return the recordings of sessions by name.

    Raises NotPossibleError for one that has no recording of an object, or none of nothing.
    """
    data, columns = inputs.data(), inputs.store.columns
    if "object" not in columns:
        raise NotPossibleError("there is no column 'object', empty where nothing is held")
    empty = columns["object"].values.astype(str) == ""
    of_all, of_data = _session(columns["recording"].values), _session(data.name)
    held, references = {}, {}
    for session in (*day_1, *later):
        held[session] = data.where(of_data == session)
        references[session] = inputs.store.feature[empty & (of_all == session)]
        if not len(held[session].value):
            raise NotPossibleError(f"session {session!r} has no recording of an object")
        if not len(references[session]):
            raise NotPossibleError(f"session {session!r} has no reference: record nothing, too")
    return Sessions(held, references, inputs.store.frequency_hz)


def _session(names: np.ndarray) -> np.ndarray:
    return np.array([str(name).partition("/")[0] for name in names])


def _joined(parts: Sequence[TaskData]) -> TaskData:
    return type(parts[0])(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def trained_on_day_1(
    inputs: Inputs, day_1: Sequence[str], model: str, found: Sessions
) -> list[Trained]:
    """Return the models of day 1, one for each of its sessions, which it does not meet."""
    fitted, log_p, label = [], [], []
    for unmet in day_1:
        there = found.held[unmet]
        known = _joined([found.held[one] for one in day_1 if one != unmet])
        if lacking := sorted({*there.value.tolist()} - {*known.value.tolist()}):
            raise NotPossibleError(f"only session {unmet!r} of day 1 holds {lacking[0]!r}")
        one = _fitted(inputs, model, known)
        if not hasattr(one, "predict_proba"):
            raise NotPossibleError(f"model {model!r} has no probabilities: choose another")
        fitted.append(one)
        log_p.append(np.log(np.maximum(one.predict_proba(there.feature), TINIEST)))
        label.append(np.searchsorted(one.classes_, there.value))
    models = []
    for at, (one, unmet) in enumerate(zip(fitted, day_1, strict=True)):
        others = [n for n in range(len(fitted)) if n != at]
        known = _joined([found.held[day_1[n]] for n in others])
        doubt = 1 / (len(np.unique(known.group)) + 1)  # as in evaluate.in_use
        probable, true = (np.concatenate([of[n] for n in others]) for of in (log_p, label))
        suits = temperature(probable, true, doubt)
        met = np.concatenate([found.references[day_1[n]] for n in others])
        models.append(Trained(one, unmet, suits, _guard(known, inputs.seed), met))
    return models


def _fitted(inputs: Inputs, model: str, data: TaskData) -> Any:
    """Return `model` trained on recordings of the task."""
    return fit_named_model(
        model, inputs.kind, data.feature, data.value, data.group,
        seed=inputs.seed, limits=inputs.most_recordings,
    )  # fmt: skip


def _guard(known: TaskData, seed: int) -> Guard:
    """Return a guard of its grasps, with the alarm that a model in use has."""
    far = alarm(known.feature, known.group, known.group, seed=seed).threshold
    return dataclasses.replace(Guard.of(known.feature, known.group), threshold=far)


def said(
    inputs: Inputs, settings: Settings, found: Sessions, one: Trained, fold: int
) -> Iterator[Row]:
    """Yield what a model says of its session of day 1 and of each later one, as it is and with each
    correction by each number of references."""
    for session in (one.unmet, *(name for each in settings.changes for name in each.sessions)):
        there, new = found.held[session], found.references[session]
        for count in settings.references:
            changed = change(one.references, new[:count], found.hz)
            for remedy in REMEDIES:
                if remedy == "none" and count != settings.references[0]:
                    continue  # it uses none of them
                feature = changed.undone(there.feature, remedy, inputs.features.normalisation)
                used = 0 if remedy == "none" else min(count, len(new))
                row = {"session": session, "fold": fold, "remedy": remedy, "references": used}
                row |= {"stretch": changed.stretch}
                yield row | _told(one, feature, there.value, settings.threshold)


def _told(one: Trained, feature: np.ndarray, value: np.ndarray, threshold: float) -> Row:
    """Return measures of the predictions: `wrong_share` are probable enough to be sorted, and
    wrong; `unlike_share` are unlike anything seen."""
    scaled = with_temperature(one.fitted.predict_proba(feature), one.temperature)
    confidence = scaled.max(axis=1)
    right = one.fitted.classes_[scaled.argmax(axis=1)] == value
    return {
        "accuracy": float(right.mean()),
        "confidence": float(confidence.mean()),
        "calibration_error": calibration_error(reliability(confidence, right)),
        "wrong_share": float(np.mean(~right & (confidence >= threshold))),
        "unlike_share": float(np.mean(one.guard.novelty(feature) > 1)),
    }


def mended(inputs: Inputs, settings: Settings, model: str, found: Sessions) -> Iterator[Row]:
    """Yield the accuracy on each later session of models that were trained on all of day 1 and some
    grasps of the session; what is tested is the same for every number of grasps."""
    known, most = _joined([found.held[one] for one in settings.day_1]), max(settings.grasps)
    for session in (name for each in settings.changes for name in each.sessions):
        there = found.held[session]
        for draw in range(settings.draws):
            generator = np.random.default_rng([inputs.seed, draw])
            orders = calibration_groups(there.value, there.group, most, generator)
            tested = there.where(np.isin(there.group, np.concatenate([o[most:] for o in orders])))
            if not len(tested.value):
                raise NotPossibleError(f"session {session!r}: {most} calibration grasps leave none")
            for grasps in settings.grasps:
                chosen = np.concatenate([order[:grasps] for order in orders])
                added = there.where(np.isin(there.group, chosen))
                every = _joined([known, added])
                one = _fitted(inputs, model, every)
                accuracy = float(np.mean(one.predict(tested.feature) == tested.value))
                row = {"session": session, "draw": draw, "grasps": grasps}
                yield row | {"recordings": len(added.value), "accuracy": accuracy}


def alarms(day_1: Sequence[str], later: Sequence[str], found: Sessions) -> Iterator[Row]:
    """Yield for each reference, in turn, how far it is from day 1 over the limit of an alarm, and
    the least such ratio of the last few: above 1 the alarm is raised.

    A session of day 1 is watched by the others.
    """
    for session in (*day_1, *later):
        known = [found.references[one] for one in day_1 if one != session]
        watch = DriftWatch(np.concatenate(known))
        for number, reference in enumerate(found.references[session]):
            row = {"session": session, "number": number}
            row |= {"ratio": float(watch.score(reference)) / watch.limit}
            row |= {"observed": watch.observe(reference), "in_a_row": watch.in_a_row}
            yield row | {"false_alarm": watch.false_alarm}


def change_ms(found: Sessions, day_1: Sequence[str], later: Sequence[str]) -> float:
    """Return the processor time (ms) that finding and undoing the change of one session takes."""
    known = np.concatenate([found.references[one] for one in day_1])
    begun = time.process_time()
    for session in later:
        changed = change(known, found.references[session], found.hz)
        changed.undone(found.held[session].feature, REMEDIES[-1])
    return 1e3 * (time.process_time() - begun) / len(later)
