"""Calibration of a trained model on held-out grasps.

The model itself is trained on all recordings. Calibration trains a model on each inner fold and
uses its predictions for the held-out groups. These models have fewer recordings and larger errors,
so temperatures, intervals and thresholds are conservative.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
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
from ajgdata.evaluate.metrics import length, wrapped
from ajgdata.evaluate.novelty import Alarm, alarm, novel_scores
from ajgdata.evaluate.splits import grouped_folds
from ajgdata.evaluate.task_data import TaskData, TrainingCopies, training_part
from ajgdata.models import fit_named_model, make_model
from ajgdata.types import Kind, NotPossibleError
from ajgdata.types.input_layout import InputLayout

#: Number of inner folds. Each trains the model again.
CALIBRATION_FOLDS = 5
COVERAGE = 0.9
#: Share of new grasps of known objects that can be flagged as novel.
FALSE_ALARM = 0.05
#: Smallest detection rate of novel objects at which a recording without a flag counts as known.
MIN_DETECTION_RATE = 0.5


@dataclass(frozen=True)
class Calibration:
    """Calibration of a model. A value that could not be computed is None; `problems` has reasons.

    Probabilities in use are softmax(log p / `temperature`). The true value is within `half_width`
    (in the unit of the target; of a vector in Euclidean distance) of a predicted value for a share
    `coverage` of new groups. A
    recording is novel if its distance to the nearest grasp exceeds `novelty_threshold`, or if its
    relative distance exceeds `relative_threshold` (see `novelty`). This flags up to a share
    `false_alarm` of new grasps of known objects (`false_alarm_stated` is the requested share), and
    a share `detection_rate` of grasps of held-out objects.
    """

    folds: int
    groups: int
    false_alarm_stated: float
    problems: dict[str, str]  #: reason by the name of the value
    temperature: float | None = None
    coverage: float | None = None
    half_width: float | None = None
    novelty_threshold: float | None = None
    relative_threshold: float | None = None
    false_alarm: float | None = None
    detection_rate: float | None = None

    @property
    def detects_novel_objects(self) -> bool:
        """Return whether a recording that the guard does not flag counts as a known object.

        This is false if the detection rate was not measured.
        """
        return self.detection_rate is not None and self.detection_rate >= MIN_DETECTION_RATE

    def plain(self) -> dict[str, Any]:
        """Return the fields as a dict for JSON."""
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
    copies: TrainingCopies | None = None,
    layout: InputLayout | None = None,
) -> Calibration:
    """Return the calibration of `model` for features (n, f) and `target` (n,).

    `layout` states the dimensions and covariates in the features; novelty ignores the covariates.

    Folds never divide `groups` (n,). `grasp` (n,) and `objects` (n,) name the grasp and the object
    of each recording. Models of folds also train on the `copies` of their training recordings; the
    calibration uses no predictions for copies. Values that cannot be computed (impossible folds, a
    model without probabilities, too few groups) are None, with the reason in `problems`; nothing is
    raised.
    """
    problems: dict[str, str] = {}
    scaling: float | None = None
    half: float | None = None
    thresholds: Alarm | None = None
    detection_rate: float | None = None
    with threadpool_limits(limits=1):
        if kind == "classification":
            with _recorded(problems, "temperature"):
                scaling = scaling_temperature(
                    features,
                    target,
                    groups,
                    model=model,
                    seed=seed,
                    copies=copies,
                    layout=layout,
                )
        else:
            with _recorded(problems, "half_width"):
                half = interval_half_width(
                    features,
                    target,
                    groups,
                    coverage,
                    model=model,
                    seed=seed,
                    period=period,
                    copies=copies,
                    layout=layout,
                )
        sounds = features if layout is None else layout.feature(features)
        with _recorded(problems, "novelty_threshold"):
            thresholds = alarm(
                sounds, grasp, groups, objects=objects, false_alarm=false_alarm, seed=seed
            )
        if thresholds is not None and objects is not None:
            with _recorded(problems, "detection_rate"):
                scores = novel_scores(sounds, grasp, groups, objects, seed=seed)
                detection_rate = scores.detection_rate(false_alarm)
    result = Calibration(
        folds=_folds(groups),
        groups=len(np.unique(groups)),
        false_alarm_stated=false_alarm,
        problems=problems,
        temperature=scaling,
        coverage=None if half is None else coverage,
        half_width=half,
        detection_rate=detection_rate,
    )
    if thresholds is None:
        return result
    return replace(
        result,
        novelty_threshold=thresholds.threshold,
        relative_threshold=thresholds.relative_threshold,
        false_alarm=thresholds.false_alarm,
    )


@contextmanager
def _recorded(problems: dict[str, str], name: str) -> Iterator[None]:
    """Add the reason to `problems`, by `name`, if the block raises NotPossibleError."""
    try:
        yield
    except NotPossibleError as error:
        problems[name] = str(error)


def scaling_temperature(
    features: np.ndarray,
    y: np.ndarray,
    groups: np.ndarray,
    *,
    model: str,
    seed: int,
    copies: TrainingCopies | None = None,
    layout: InputLayout | None = None,
) -> float:
    """Return the temperature of `model` from held-out probabilities of all folds together.

    If all held-out grasps are classified correctly, the best temperature would be 0. The labels are
    therefore smoothed by the weight of one further group, which can be of any class (after Platt
    1999).
    """
    classes, label = np.unique(y, return_inverse=True)
    held_out = np.empty((len(y), len(classes)))
    for fitted, _, test in _held_out(
        features,
        y,
        groups,
        "classification",
        model=model,
        folds=_folds(groups),
        seed=seed,
        copies=copies,
        layout=layout,
    ):
        held_out[test] = fitted.predict_proba(features[test])
    log_p = log_softmax(np.log(np.maximum(held_out, TINIEST)), axis=1)
    return temperature(log_p, label, smoothing=1 / (len(np.unique(groups)) + 1))


def _folds(groups: np.ndarray) -> int:
    """Return the number of inner folds for the groups (n,)."""
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
    copies: TrainingCopies | None = None,
    layout: InputLayout | None = None,
) -> Iterator[tuple[Any, np.ndarray, np.ndarray]]:
    """Yield for each fold: a fitted model, the rows that it was trained on, and the held-out rows.

    Raises NotPossibleError for a classifier without probabilities.
    """
    if kind == "classification":
        unfitted = make_model(model, kind, seed, layout=layout)
        if not hasattr(unfitted, "predict_proba"):
            raise NotPossibleError(f"model {model!r} has no probabilities: choose another")
    data = TaskData(features, y, groups, name=groups)
    for train, test in grouped_folds(y, groups, kind, folds, seed):
        part = training_part(data, train, copies)
        fitted = fit_named_model(
            model,
            kind,
            part.feature,
            part.value,
            part.group,
            seed=seed,
            period=period,
            layout=layout,
        )
        yield fitted, train, test


def interval_half_width(
    features: np.ndarray,
    y: np.ndarray,
    groups: np.ndarray,
    coverage: float,
    *,
    model: str,
    seed: int,
    period: float | None,
    copies: TrainingCopies | None = None,
    layout: InputLayout | None = None,
) -> float:
    """Return the `half_width` of `held_out_residuals`.

    Raises NotPossibleError if there are too few groups for the coverage.
    """
    count = len(np.unique(groups))
    if coverage > 1 - 1 / (count + 1):
        raise NotPossibleError(
            f"{count} groups cannot show where {100 * coverage:g} % of new ones lie: "
            f"record at least {int(np.ceil(coverage / (1 - coverage) - 1e-9))}"
        )
    residual = held_out_residuals(
        features, y, groups, model=model, seed=seed, period=period, copies=copies, layout=layout
    )
    return half_width(residual, groups, coverage, period)


def held_out_residuals(
    features: np.ndarray,
    y: np.ndarray,
    groups: np.ndarray,
    *,
    model: str,
    seed: int,
    period: float | None = None,
    copies: TrainingCopies | None = None,
    layout: InputLayout | None = None,
) -> np.ndarray:
    """Return |y - prediction| (n,), each by a `model` that was trained on the other folds.

    For vectors y (n, k), it is the Euclidean distance.
    """
    residual = np.empty(len(y))
    for fitted, _, test in _held_out(
        features,
        y,
        groups,
        "regression",
        model=model,
        folds=_folds(groups),
        seed=seed,
        period=period,
        copies=copies,
        layout=layout,
    ):
        residual[test] = length(wrapped(y[test] - fitted.predict(features[test]), period))
    return residual


def half_width(
    residual: np.ndarray, groups: np.ndarray, coverage: float, period: float | None = None
) -> float:
    """Return the `coverage` quantile of held-out residuals (n,), with equal weights of groups (n,).

    Infinity if there are too few groups for the coverage. With a `period`, at most half of it.
    """
    half = float(weighted_quantile(residual[:, None], grasp_weights(groups), coverage)[0])
    return half if period is None else min(half, period / 2)


@dataclass(frozen=True, eq=False)
class CalibratedProbabilities:
    """Out-of-fold probabilities (n, n_classes) in the order of the rows, plain and scaled."""

    classes: np.ndarray
    plain: np.ndarray
    scaled: np.ndarray


def calibrated_probabilities(
    features: np.ndarray,
    target: np.ndarray,
    groups: np.ndarray,
    *,
    model: str,
    folds: int = 5,
    seed: int = 0,
) -> CalibratedProbabilities:
    """Return out-of-fold probabilities of a classifier, plain and scaled by a temperature.

    `features` (n, n_features), `target` (n,) class labels, `groups` (n,). The temperature of a fold
    is computed from its training part in the same way as in `calibration`; the test part is not
    used. Raises NotPossibleError for a model without probabilities.
    """
    classes = np.unique(target)
    plain = np.empty((len(target), len(classes)))
    scaled = np.empty((len(target), len(classes)))
    with threadpool_limits(limits=1):
        for fitted, train, test in _held_out(
            features, target, groups, "classification", model=model, folds=folds, seed=seed
        ):
            t = scaling_temperature(
                features[train], target[train], groups[train], model=model, seed=seed
            )
            plain[test] = fitted.predict_proba(features[test])
            scaled[test] = with_temperature(plain[test], t)
    return CalibratedProbabilities(classes, plain, scaled)
