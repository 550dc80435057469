"""Models of live sorting: trained on some grasps of each object, with a temperature."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.special import log_softmax
from threadpoolctl import threadpool_limits

from ajgdata.evaluate.calibration import TINIEST, temperature, with_temperature
from ajgdata.evaluate.splits import grouped_folds
from ajgdata.evaluate.task_data import TaskData
from ajgdata.models import make_model
from ajgdata.types import NotPossibleError


class Trained(NamedTuple):
    """A model in use, and what it says of its recordings (n, n_classes) while they are held out.

    `grasps` is how many of each class it was trained on at least, `label` (n,) the class numbers.
    """

    grasps: int
    classes: np.ndarray
    fitted: Any
    temperature: float
    held_out: np.ndarray
    label: np.ndarray

    def probabilities(self, feature: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return probabilities (n, n_classes) of features (n, bins): as they are, and scaled."""
        plain = self.fitted.predict_proba(feature)
        return plain, with_temperature(plain, self.temperature)


def trained(
    data: TaskData, model: str, folds: int, seed: int, grasps: int | None = None
) -> Trained:
    """Return `model` trained on `grasps` grasps of each class, drawn with `seed`, or on all.

    The temperature is that of the probabilities of all its recordings, each by a model that was
    trained without their grasp. Raises NotPossibleError for a model without probabilities, and for
    a class that has fewer than two grasps, or than are wanted.
    """
    rows = _drawn(data, grasps, seed)
    x, y, group = data.feature[rows], data.value[rows], data.group[rows]
    classes, label = np.unique(y, return_inverse=True)
    fewest = min(len(np.unique(group[y == one])) for one in classes)
    held_out = np.empty((len(y), len(classes)))
    with threadpool_limits(limits=1):
        for train, test in grouped_folds(y, group, "classification", min(folds, fewest), seed):
            held_out[test] = _fitted(model, seed, x[train], y[train]).predict_proba(x[test])
        fitted = _fitted(model, seed, x, y)
    log_p = log_softmax(np.log(np.maximum(held_out, TINIEST)), axis=1)
    return Trained(fewest, classes, fitted, temperature(log_p, label), held_out, label)


def _fitted(model: str, seed: int, x: np.ndarray, y: np.ndarray) -> Any:
    made = make_model(model, "classification", seed)
    if not hasattr(made, "predict_proba"):
        raise NotPossibleError(f"model {model!r} has no probabilities: choose another")
    return made.fit(x, y)


def _drawn(data: TaskData, grasps: int | None, seed: int) -> np.ndarray:
    """Return the rows of the first `grasps` grasps of each class in an order drawn with `seed`: a
    larger number holds the smaller."""
    if grasps is None:
        return np.arange(len(data.value))
    generator = np.random.default_rng(seed)
    chosen = []
    for one in np.unique(data.value):
        members = np.unique(data.group[data.value == one])
        if len(members) < grasps:
            raise NotPossibleError(f"{one} has {len(members)} grasps, not {grasps}: lower grasps")
        chosen.append(generator.permutation(members)[:grasps])
    return np.flatnonzero(np.isin(data.group, np.concatenate(chosen)))
