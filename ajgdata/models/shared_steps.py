"""What candidates have in common, done once: steps before the model, and neighbours of k-NN.

Candidates are pipelines that differ in their last step alone, or in its k. A scaling is then fitted
to a training part once, and neighbours are looked for once, for the largest k that was asked for.
Steps are shared where plain settings (numbers, texts and lists of these) say all that they are, and
neighbours where nothing but k and the metric is set. All else is fitted alone.
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any, NamedTuple

import numpy as np
from sklearn.base import BaseEstimator
from sklearn.neighbors import KNeighborsClassifier, KNeighborsRegressor, NearestNeighbors
from sklearn.pipeline import Pipeline

from ajgdata.models.circular import Circular
from ajgdata.models.scaling import AtLeast

#: Neighbours that are looked for at once: no candidate asks for more.
MOST_NEIGHBOURS = 5


class _Rows(NamedTuple):
    train: np.ndarray
    test: np.ndarray


class SharedPart:
    """A training part and the rows that are predicted from it, by one candidate after another.

    `train` (n, n_features), `target` (n,), `test` (m, n_features). A prediction is that of the
    candidate fitted alone; of training rows exactly as far, k-NN may take another.
    """

    def __init__(self, train: np.ndarray, target: np.ndarray, test: np.ndarray) -> None:
        self._given, self._target = _Rows(train, test), target
        self._made: dict[Hashable, _Rows] = {}
        self._near: dict[Hashable, np.ndarray] = {}

    def predicted(self, candidate: BaseEstimator) -> np.ndarray:
        """Return what an unfitted candidate predicts (m,), which may be fitted by it.

        Raises ValueError where it cannot be trained on the part.
        """
        if isinstance(candidate, Circular):
            points = self._predicted(candidate.estimator, candidate.coordinates(self._target))
            return candidate.targets(points)
        return self._predicted(candidate, self._target)

    def _predicted(self, candidate: Any, target: np.ndarray) -> np.ndarray:
        if not isinstance(candidate, Pipeline):
            return candidate.fit(self._given.train, target).predict(self._given.test)
        steps = [step for _, step in candidate.steps[:-1] if step not in (None, "passthrough")]
        if not all(map(_is_plain, steps)):
            return candidate.fit(self._given.train, target).predict(self._given.test)
        key, rows = self._after_steps(steps, target)
        model: Any = candidate.steps[-1][1]
        if _counts_neighbours(model):
            return _of_neighbours(model, target, self._neighbours(key, rows, model))
        return model.fit(rows.train, target).predict(rows.test)

    def _after_steps(self, steps: list[Any], target: np.ndarray) -> tuple[Hashable, _Rows]:
        """Return rows as they leave some steps, and what names these."""
        key: tuple[Hashable, ...] = ()
        rows = self._given
        for step in steps:
            settings = step.get_params(deep=False)
            if isinstance(step, AtLeast):  # whose result is the same whatever it asks for
                step.fit(rows.train)
                settings = {}
            key = (*key, (type(step), repr(sorted(settings.items()))))
            if key not in self._made:
                fitted = step.fit(rows.train, target)
                made = _Rows(fitted.transform(rows.train), fitted.transform(rows.test))
                self._made[key] = made
            rows = self._made[key]
        return key, rows

    def _neighbours(self, key: Hashable, rows: _Rows, model: Any) -> np.ndarray:
        """Return row numbers (m, k) of the nearest in the training part, the nearest first."""
        k = model.n_neighbors
        named = (key, model.metric)
        if named not in self._near or self._near[named].shape[1] < k:
            most = max(k, min(MOST_NEIGHBOURS, len(rows.train)))
            search = NearestNeighbors(n_neighbors=most, metric=model.metric).fit(rows.train)
            self._near[named] = search.kneighbors(rows.test, return_distance=False)
        return self._near[named][:, :k]


def _is_plain(step: BaseEstimator) -> bool:
    """Return whether the settings of a step name it: no array, estimator or function is one."""
    return all(map(_is_plain_value, step.get_params(deep=False).values()))


def _is_plain_value(value: Any) -> bool:
    if isinstance(value, (tuple, list)):
        return all(map(_is_plain_value, value))
    return value is None or isinstance(value, (bool, int, float, str))


def _counts_neighbours(model: Any) -> bool:
    """Return whether a model is a k-NN of which only k and the name of the metric are set."""
    if type(model) not in (KNeighborsClassifier, KNeighborsRegressor):
        return False
    plain = type(model)(n_neighbors=model.n_neighbors, metric=model.metric)
    return isinstance(model.metric, str) and model.get_params() == plain.get_params()


def _of_neighbours(model: Any, target: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Return what k-NN predicts (m,) or (m, t) of row numbers (m, k) in `target` (n,) or (n, t),
    each counting once; of classes that are as common the first, as scikit-learn does."""
    if isinstance(model, KNeighborsRegressor):
        return target[near].mean(axis=1)
    classes, number = np.unique(target, return_inverse=True)
    votes = (number[near][:, :, np.newaxis] == np.arange(len(classes))).sum(axis=1)
    return classes[votes.argmax(axis=1)]
