"""A model chosen among candidates by inner folds of its own training part.

What is chosen is trained again on the whole part; `best_estimator_` is then an ordinary estimator,
and the one that is kept.
"""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Self

import numpy as np
from sklearn.base import BaseEstimator, MetaEstimatorMixin, clone
from sklearn.model_selection import GroupKFold, StratifiedGroupKFold
from sklearn.utils import get_tags
from sklearn.utils.metaestimators import _BaseComposition, available_if
from sklearn.utils.validation import check_is_fitted

from ajgdata.models.limits import check_cost, learned_rows, most_to_choose, thinned
from ajgdata.models.shared_steps import SharedPart

Folds = list[tuple[np.ndarray, np.ndarray]]
#: Inner folds, and how many where more than LARGE recordings are trained on: candidates then differ
#: by more than their scatter, and each costs more. Not where groups are few, as sessions are:
#: halves of them would be too little to learn from.
INNER_FOLDS, LARGE, LARGE_FOLDS, FEW_GROUPS = 3, 200, 2, 20
NO_GROUPS = "no groups were given to divide the training recordings by"
ONE_GROUP = "the training recordings are of one group: two are needed"
ONE_ROW = "candidates would be trained on one recording: two are needed"
NO_SCORE = "no candidate can be trained on the inner folds"


def _first_has(name: str) -> Callable[[Any], bool]:
    return lambda self: hasattr(self.candidates[0][1], name)


class Tuned(MetaEstimatorMixin, _BaseComposition):
    """The candidate that errs least on inner grouped folds; of equals the first.

    `candidates` are pairs of a name and an unfitted estimator, all of one kind. Classes count by
    accuracy, numbers by their mean square error, with a `period` the shortest way round. Without
    groups, or with one alone, nothing can be chosen without flattering, nor by training on one
    recording: the first is taken, and `reason_` says why. Of more than `most_to_choose` recordings
    some of each group choose. `while_choosing` are settings of all candidates on the inner folds
    alone, which make them cheaper. After `fit`: `choice_` (a name), `best_estimator_`,
    `inner_folds_`, `inner_scores_` (by name, higher is better, none without a choice),
    `chosen_on_`, how many recordings chose where not all did (else 0), and
    `failed_`, the names of those that could not be trained on all inner folds.
    """

    best_estimator_: Any
    choice_: str
    reason_: str
    inner_folds_: int
    inner_scores_: dict[str, float]
    chosen_on_: int
    failed_: tuple[str, ...]

    def __init__(
        self,
        candidates: Sequence[tuple[str, BaseEstimator]],
        period: float | None = None,
        random_state: int = 0,
        while_choosing: Mapping[str, Any] | None = None,
    ) -> None:
        self.candidates = candidates
        self.period = period
        self.while_choosing = while_choosing
        self.random_state = random_state

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Return the settings, and with `deep` those of the candidates: `name__setting`."""
        return self._get_params("candidates", deep=deep)

    def set_params(self, **params: Any) -> Self:
        """Set what `get_params` returns."""
        return self._set_params("candidates", **params)

    def __sklearn_tags__(self) -> Any:
        return get_tags(self.candidates[0][1])

    def each(
        self, wrap: Callable[[BaseEstimator], BaseEstimator], period: float | None = None
    ) -> Tuned:
        """Return the same choice among wrapped candidates."""
        wrapped = [(name, wrap(estimator)) for name, estimator in self.candidates]
        cheaper = self.while_choosing
        if cheaper and wrapped:
            place = _place(wrapped[0][1], self.candidates[0][1])
            cheaper = {f"{place}{name}": value for name, value in cheaper.items()}
        return Tuned(wrapped, period, self.random_state, cheaper)

    def fit(self, X: Any, y: Any, groups: Any = None) -> Self:
        """Choose and train on features (n, n_features), targets (n,) and groups (n,)."""
        self.reason_, self.inner_scores_, self.inner_folds_, self.failed_ = "", {}, 0, ()
        self.chosen_on_ = 0
        X, y = np.asarray(X), np.asarray(y)
        best = self._chosen(X, y, groups)
        self.choice_, estimator = self.candidates[best]
        rows = learned_rows(estimator, groups, y)
        self.best_estimator_ = clone(estimator)
        if rows is None:
            self.best_estimator_.fit(X, y)
        else:
            self.best_estimator_.fit(X[rows], y[rows])
        return self

    def _chosen(self, X: np.ndarray, y: np.ndarray, groups: Any) -> int:
        """Return the number of the best candidate."""
        if groups is None:
            self.reason_ = NO_GROUPS
            return 0
        count = len(y)
        most = most_to_choose(self.candidates[0][1])
        if count > most:
            some = thinned(np.asarray(groups), most, y)
            X, y, groups = X[some], y[some], np.asarray(groups)[some]
        classes = get_tags(self).estimator_type == "classifier"
        folds = inner_folds(y, np.asarray(groups), classes, self.random_state)
        if not folds:
            self.reason_ = ONE_GROUP
            return 0
        if min(len(train) for train, _ in folds) < 2:
            self.reason_ = ONE_ROW
            return 0
        fits = len(self.candidates) * len(folds)
        check_cost(self.candidates[0][1], len(folds[0][0]), fits)
        score = self._scored(X, y, folds)
        names = [name for name, _ in self.candidates]
        self.failed_ = tuple(np.array(names)[~np.isfinite(score)].tolist())
        if not np.isfinite(score).any():
            self.reason_ = NO_SCORE
            return 0
        self.inner_folds_, self.chosen_on_ = len(folds), len(y) if len(y) < count else 0
        self.inner_scores_ = dict(zip(names, map(float, score), strict=True))
        return int(np.nanargmax(score))

    def _scored(self, X: np.ndarray, y: np.ndarray, folds: Folds) -> np.ndarray:
        """Return the mean score of each candidate over folds, NaN for one that cannot be trained
        on all of them."""
        cheaper = self.while_choosing or {}
        score = np.full((len(self.candidates), len(folds)), np.nan)
        for fold, (train, test) in enumerate(folds):
            part = SharedPart(X[train], y[train], X[test])
            for number, (_, candidate) in enumerate(self.candidates):
                tried = clone(candidate).set_params(**cheaper)
                # not one to train on these rows: as of too few, or of one class
                with contextlib.suppress(ValueError):
                    predicted = part.predicted(tried)
                    score[number, fold] = self._score(predicted, y[test])
        return score.mean(axis=1)

    def _score(self, predicted: np.ndarray, y: np.ndarray) -> float:
        """Return accuracy, or minus the mean square error."""
        if get_tags(self).estimator_type == "classifier":
            return float(np.mean(predicted == y))
        away = predicted - y
        if self.period is not None:
            away = (away + self.period / 2) % self.period - self.period / 2
        return -float(np.mean(away**2))

    @property
    def classes_(self) -> np.ndarray:
        """Return the classes (k,) of the chosen estimator."""
        return self.best_estimator_.classes_

    @property
    def n_features_in_(self) -> int:
        """Return the number of features that it was trained on."""
        return self.best_estimator_.n_features_in_

    def predict(self, X: Any) -> np.ndarray:
        """Return what the chosen estimator predicts (n,)."""
        check_is_fitted(self, "best_estimator_")
        return self.best_estimator_.predict(X)

    @available_if(_first_has("predict_proba"))
    def predict_proba(self, X: Any) -> np.ndarray:
        """Return probabilities (n, k) of `classes_` by the chosen estimator."""
        check_is_fitted(self, "best_estimator_")
        return self.best_estimator_.predict_proba(X)


def _place(outer: BaseEstimator, inner: BaseEstimator) -> str:
    """Return what the settings of `inner` begin with among those of `outer`, which wraps it."""
    if outer is inner:
        return ""
    return next(f"{name}__" for name, one in outer.get_params().items() if one is inner)


def inner_folds(y: np.ndarray, groups: np.ndarray, classes: bool, seed: int) -> Folds:
    """Return folds of targets y (n,) that divide no group of `groups` (n,); none for fewer than two
    groups.

    Classes are spread evenly as far as whole groups allow.
    """
    group = np.unique(groups, return_inverse=True)[1]
    groups_given = int(group.max(initial=-1)) + 1
    wanted = LARGE_FOLDS if len(y) > LARGE and groups_given >= FEW_GROUPS else INNER_FOLDS
    count = min(wanted, groups_given)
    if count < 2:
        return []
    plain = GroupKFold(count, shuffle=True, random_state=seed)
    if not classes or np.unique(y, return_counts=True)[1].max() < count:
        return list(plain.split(y, y, group))
    splitter = StratifiedGroupKFold(count, shuffle=True, random_state=seed)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "The least populated class", UserWarning)
        pairs = list(splitter.split(y, y, group))
    # it may leave a fold empty where groups are few
    return pairs if all(len(test) for _, test in pairs) else list(plain.split(y, y, group))
