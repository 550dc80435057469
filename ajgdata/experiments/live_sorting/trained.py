"""Models of live sorting: trained on some grasps of each object, with a temperature."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from ajgdata.evaluate.calibration import with_temperature
from ajgdata.evaluate.in_use import FOLDS, held_out_probability, temperature_in_use
from ajgdata.evaluate.task_data import TaskData
from ajgdata.models import fit_named_model
from ajgdata.types import NotPossibleError


class Trained(NamedTuple):
    """A model in use with its temperature; `grasps`: the fewest training grasps of a class."""

    grasps: int
    classes: np.ndarray
    fitted: Any
    temperature: float

    def probabilities(self, feature: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return probabilities (n, n_classes) of features (n, bins): as they are, and scaled."""
        plain = self.fitted.predict_proba(feature)
        return plain, with_temperature(plain, self.temperature)


def trained(
    data: TaskData,
    model: str,
    seed: int,
    grasps: int | None = None,
    limits: Mapping[str, int] | None = None,
) -> Trained:
    """Return `model` trained on `grasps` grasps of each class, drawn with `seed`, or on all.

    Model and temperature are what training for use gives (pipeline.train). Raises NotPossibleError
    for a model without probabilities, and for a class that has fewer than two grasps, or than are
    wanted.
    """
    rows = _drawn(data, grasps, seed)
    x, y, group = data.feature[rows], data.value[rows], data.group[rows]
    classes, label = np.unique(y, return_inverse=True)
    fewest = min(len(np.unique(group[y == one])) for one in classes)
    if fewest < 2:
        raise NotPossibleError("a class has a single grasp, which nothing is held out of")
    folds = min(FOLDS, len(np.unique(group)))
    with threadpool_limits(limits=1):
        held_out = held_out_probability(
            x, y, group, model=model, folds=folds, seed=seed, limits=limits
        )
        fitted = fit_named_model(model, "classification", x, y, group, seed=seed, limits=limits)
    found = temperature_in_use(held_out, label, group)
    return Trained(fewest, classes, fitted, found)


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
