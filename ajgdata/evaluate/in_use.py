"""How far a model in use may be believed: found on grasps held out of inner folds, kept with it.

The model itself is then trained on all recordings. Those of the inner folds had fewer and err
rather more: temperatures, intervals and alarms are rather too wide than too narrow.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.special import log_softmax
from threadpoolctl import threadpool_limits

from ajgdata.evaluate.calibration import (
    TINIEST,
    grasp_weights,
    temperature,
    weighted_quantile,
    with_temperature,
)
from ajgdata.evaluate.metrics import wrapped
from ajgdata.evaluate.novelty import Alarm, NovelScores, alarm, novel_scores
from ajgdata.evaluate.splits import grouped_folds
from ajgdata.models import fit_named_model, make_model
from ajgdata.types import Kind, NotPossibleError

#: The inner folds of the model, each of which trains it once more.
CALIBRATION_FOLDS = 5
COVERAGE = 0.9
#: Share of new grasps of known objects that may be flagged as novel.
FALSE_ALARM = 0.05
#: Least detection rate of novel objects at which a guard that flags nothing means *known*.
RELIABLE = 0.5


@dataclass(frozen=True)
class Calibration:
    """Calibration of a model; None: not possible, for the reason in `problems` (by name).

    Probabilities in use are softmax(log p / `temperature`). The true value is within `half_width`
    (in the target's unit) of a predicted number for a share `coverage` of new groups. A recording
    is novel if its distance to the nearest grasp exceeds `novelty_threshold`, or its relative
    distance exceeds `relative_threshold` (see `novelty`): up to a share `false_alarm` of new grasps
    of known objects (requested: `false_alarm_stated`), and a share `detection_rate` of grasps of
    held-out objects.
    """

    folds: int
    groups: int
    false_alarm_stated: float
    problems: dict[str, str]
    temperature: float | None = None
    coverage: float | None = None
    half_width: float | None = None
    novelty_threshold: float | None = None
    relative_threshold: float | None = None
    false_alarm: float | None = None
    detection_rate: float | None = None

    @property
    def detects_novel_objects(self) -> bool:
        """Return whether the guard detects so many novel objects that others can be called known.

        A rate that was not measured is no evidence.
        """
        return self.detection_rate is not None and self.detection_rate >= RELIABLE

    def plain(self) -> dict[str, Any]:
        """Return it as JSON can hold it."""
        return asdict(self)


def calibration(
    features: np.ndarray,
    target: np.ndarray,
    groups: np.ndarray,
    grasp: np.ndarray,
    *,
    model: str,
    kind: Kind,
    objects: np.ndarray | None = None,
    seed: int = 0,
    period: float | None = None,
    coverage: float = COVERAGE,
    false_alarm: float = FALSE_ALARM,
) -> Calibration:
    """Return the calibration of `model`, trained on features (n, f) and `target` (n,).

    `groups` (n,) are held out whole; `grasp` (n,) and `objects` (n,) name the grasp and the object
    of each recording. What cannot be computed (impossible folds, a model without probabilities,
    too few groups) is None, with the reason in `problems`; nothing is raised.
    """
    problems: dict[str, str] = {}
    options: dict[str, Any] = {"model": model, "seed": seed}
    with threadpool_limits(limits=1):
        if kind == "classification":
            find = partial(scaling_temperature, features, target, groups, **options)
            believed = {"temperature": _possible(problems, "temperature", find)}
        else:
            find = partial(
                interval_half_width, features, target, groups, coverage, period=period, **options
            )
            half = _possible(problems, "half_width", find)
            believed = {"half_width": half, "coverage": None if half is None else coverage}
        believed |= _novelty(problems, features, grasp, groups, objects, false_alarm, seed)
    return Calibration(
        folds=_folds(groups), groups=len(np.unique(groups)), false_alarm_stated=false_alarm,
        problems=problems, **believed,
    )  # fmt: skip


def _possible(problems: dict[str, str], name: str, find: Callable[[], Any]) -> Any:
    """Return the result of `find`; None if it is not possible, with the reason in `problems`."""
    try:
        return find()
    except NotPossibleError as error:
        problems[name] = str(error)
        return None


def _novelty(
    problems: dict[str, str],
    features: np.ndarray,
    grasp: np.ndarray,
    groups: np.ndarray,
    objects: np.ndarray | None,
    false_alarm: float,
    seed: int,
) -> dict[str, float | None]:
    """Return thresholds, false alarms and detection rate of novel objects."""
    options: dict[str, Any] = {"objects": objects, "false_alarm": false_alarm, "seed": seed}
    find = partial(alarm, features, grasp, groups, **options)
    far: Alarm | None = _possible(problems, "novelty_threshold", find)
    if far is None:
        return {}
    rate = None
    if objects is not None:
        hold_out = partial(novel_scores, features, grasp, groups, objects, seed=seed)
        scores: NovelScores | None = _possible(problems, "detection_rate", hold_out)
        rate = None if scores is None else scores.detection_rate(false_alarm)
    return {
        "novelty_threshold": far.threshold,
        "relative_threshold": far.relative_threshold,
        "false_alarm": far.false_alarm,
        "detection_rate": rate,
    }


def _folds(groups: np.ndarray) -> int:
    return min(CALIBRATION_FOLDS, len(np.unique(groups)))


def _held_out(
    features: np.ndarray,
    y: np.ndarray,
    groups: np.ndarray,
    kind: Kind,
    *,
    model: str,
    folds: int,
    seed: int,
    period: float | None = None,
) -> Iterator[tuple[Any, np.ndarray, np.ndarray]]:
    """Yield a model for each fold of `groups`, the rows that it was trained on, and the others.

    Raises NotPossibleError for a classifier without probabilities.
    """
    if kind == "classification" and not hasattr(make_model(model, kind, seed), "predict_proba"):
        raise NotPossibleError(f"model {model!r} has no probabilities: choose another")
    for train, test in grouped_folds(y, groups, kind, folds, seed):
        fitted = fit_named_model(
            model, kind, features[train], y[train], groups[train], seed=seed, period=period
        )
        yield fitted, train, test


def scaling_temperature(
    features: np.ndarray, y: np.ndarray, groups: np.ndarray, **options: Any
) -> float:
    """Return the temperature of `model`, on held-out probabilities of all folds together.

    One more group, of which nothing is known, counts as any class: otherwise, if all held-out
    grasps are classified correctly, the best temperature is 0 (after Platt 1999).
    """
    classes, label = np.unique(y, return_inverse=True)
    held_out = np.empty((len(y), len(classes)))
    parts = _held_out(features, y, groups, "classification", folds=_folds(groups), **options)
    for fitted, _, test in parts:
        held_out[test] = fitted.predict_proba(features[test])
    log_p = log_softmax(np.log(np.maximum(held_out, TINIEST)), axis=1)
    return temperature(log_p, label, doubt=1 / (len(np.unique(groups)) + 1))


def held_out_residuals(
    features: np.ndarray,
    y: np.ndarray,
    groups: np.ndarray,
    *,
    period: float | None = None,
    **options: Any,
) -> np.ndarray:
    """Return |y - prediction| (n,), each by a `model` that was trained on the other folds."""
    residual = np.empty(len(y))
    options |= {"folds": _folds(groups), "period": period}
    for fitted, _, test in _held_out(features, y, groups, "regression", **options):
        residual[test] = np.abs(wrapped(y[test] - fitted.predict(features[test]), period))
    return residual


def half_width(
    residual: np.ndarray, groups: np.ndarray, coverage: float, period: float | None = None
) -> float:
    """Return the quantile of held-out residuals (n,), each group counting once.

    Infinity if there are too few groups for so large a share; with a `period`, half of it.
    """
    half = float(weighted_quantile(residual[:, None], grasp_weights(groups), coverage)[0])
    return half if period is None else min(half, period / 2)


def interval_half_width(
    features: np.ndarray,
    y: np.ndarray,
    groups: np.ndarray,
    coverage: float,
    *,
    period: float | None,
    **options: Any,
) -> float:
    """Return `half_width` of `held_out_residuals`. Raises NotPossibleError for too few groups."""
    if coverage > 1 - 1 / (count := len(np.unique(groups)) + 1):
        raise NotPossibleError(
            f"{count - 1} groups cannot show where {100 * coverage:g} % of new ones lie: "
            f"record at least {int(np.ceil(coverage / (1 - coverage) - 1e-9))}"
        )
    residual = held_out_residuals(features, y, groups, period=period, **options)
    return half_width(residual, groups, coverage, period)


@dataclass(frozen=True, eq=False)
class Calibrated:
    """Out-of-fold probabilities (n, n_classes) in the order of the rows, plain and scaled."""

    classes: np.ndarray
    plain: np.ndarray
    scaled: np.ndarray


def calibrated(
    features: np.ndarray,
    target: np.ndarray,
    groups: np.ndarray,
    *,
    model: str,
    folds: int = 5,
    seed: int = 0,
) -> Calibrated:
    """Return out-of-fold probabilities of a classifier, plain and scaled by a temperature.

    `features` (n, n_features), `target` (n,) class labels, `groups` (n,). The temperature of a fold
    is computed on its training part exactly as `calibration` computes that of a model in use; the
    test part is not used. Raises NotPossibleError for a model without probabilities.
    """
    classes = np.unique(target)
    options: dict[str, Any] = {"model": model, "seed": seed}
    plain, scaled = (np.empty((len(target), len(classes))) for _ in range(2))
    with threadpool_limits(limits=1):
        parts = _held_out(features, target, groups, "classification", folds=folds, **options)
        for fitted, train, test in parts:
            t = scaling_temperature(features[train], target[train], groups[train], **options)
            plain[test] = fitted.predict_proba(features[test])
            scaled[test] = with_temperature(plain[test], t)
    return Calibrated(classes, plain, scaled)
