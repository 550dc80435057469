"""A model chosen among candidates by inner folds of its own training part.

The chosen candidate is trained again on the whole part; `best_estimator_` is then an ordinary
estimator, and the one that is stored.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Self

import numpy as np
from sklearn.base import BaseEstimator, MetaEstimatorMixin, clone
from sklearn.metrics import make_scorer
from sklearn.model_selection import GridSearchCV, GroupKFold, StratifiedGroupKFold
from sklearn.pipeline import Pipeline
from sklearn.utils import get_tags
from sklearn.utils.metaestimators import available_if
from sklearn.utils.validation import check_is_fitted

from ajgdata.models.scaling import AtLeast
from ajgdata.models.thinning import thinned

Folds = list[tuple[np.ndarray, np.ndarray]]
#: Inner folds; two for more than LARGE recordings, because candidates then differ by more than
#: their scatter. Training parts with few groups keep three, because halves would be too small.
INNER_FOLDS, LARGE, LARGE_FOLDS, FEW_GROUPS = 3, 200, 2, 20
NO_GROUPS = "no groups were given to divide the training recordings by"
ONE_GROUP = "the training recordings are of one group: two are needed"
ONE_ROW = "candidates would be trained on one recording: two are needed"
ONE_CLASS = "candidates would be trained on one class: two are needed"


def _first_has(name: str) -> Callable[[Any], bool]:
    return lambda self: hasattr(self.candidates[0][1], name)


def negative_square(y_true: np.ndarray, y_pred: np.ndarray, period: float | None) -> float:
    """Return minus the mean square error, with a `period` of the shortest way around."""
    difference = y_pred - y_true
    if period is not None:
        difference = (difference + period / 2) % period - period / 2
    return -float(np.mean(difference**2))


class Tuned(MetaEstimatorMixin, BaseEstimator):
    """The candidate with the best mean score on inner grouped folds; of equal ones the first.

    `candidates` are pairs of a name and an unfitted estimator, all of one kind. The score is the
    accuracy, or minus the mean square error. Without groups, or with too little data for inner
    folds, the first candidate is used, and `reason_` is the reason. Candidates that need more
    recordings than an inner fold has are excluded (`left_out_`). The choice uses at most `choosing`
    recordings (`chosen_on_`; 0: all) and the cheaper settings `while_choosing`. After `fit`:
    `choice_` (a name), `best_estimator_`, `inner_folds_`, and `inner_scores_` (by name).
    """

    best_estimator_: Any
    choice_: str
    reason_: str
    left_out_: list[str]
    inner_folds_: int
    inner_scores_: dict[str, float]
    chosen_on_: int

    def __init__(
        self,
        candidates: Sequence[tuple[str, BaseEstimator]],
        period: float | None = None,
        random_state: int = 0,
        while_choosing: Mapping[str, Any] | None = None,
        choosing: int = 5_000,
    ) -> None:
        self.candidates = candidates
        self.period = period
        self.while_choosing = while_choosing
        self.random_state = random_state
        self.choosing = choosing

    def __sklearn_tags__(self) -> Any:
        return get_tags(self.candidates[0][1])

    def circular(self, wrap: Callable[[BaseEstimator], BaseEstimator], period: float) -> Tuned:
        """Return the same choice among wrapped candidates, which predict a repeating target."""
        wrapped = [(name, wrap(estimator)) for name, estimator in self.candidates]
        return Tuned(wrapped, period, self.random_state, choosing=self.choosing)

    def fit(self, X: Any, y: Any, groups: Any = None) -> Self:
        """Choose and train on features (n, n_features), targets (n,) and groups (n,)."""
        self.inner_scores_, self.left_out_, self.inner_folds_, self.chosen_on_ = {}, [], 0, 0
        X, y = np.asarray(X), np.asarray(y)
        rows = np.arange(len(y))
        if groups is not None:
            rows = thinned(np.asarray(groups), self.choosing, y)
        folds, self.reason_ = self._folds(y[rows], groups if groups is None else groups[rows])
        self.choice_, best = self.candidates[0]
        if not self.reason_:
            self.choice_, best = self._best(X[rows], y[rows], folds)
            self.inner_folds_ = len(folds)
            self.chosen_on_ = len(rows) if len(rows) < len(y) else 0
        self.best_estimator_ = clone(best).fit(X, y)
        return self

    def _folds(self, y: np.ndarray, groups: np.ndarray | None) -> tuple[Folds, str]:
        """Return the inner folds, or the reason why there are none."""
        if groups is None:
            return [], NO_GROUPS
        classes = get_tags(self).estimator_type == "classifier"
        folds = inner_folds(y, np.asarray(groups), classes, self.random_state)
        if not folds:
            return [], ONE_GROUP
        if min(len(train) for train, _ in folds) < 2:
            return [], ONE_ROW
        if classes and min(len(np.unique(y[train])) for train, _ in folds) < 2:
            return [], ONE_CLASS
        return folds, ""

    def _best(self, X: np.ndarray, y: np.ndarray, folds: Folds) -> tuple[str, BaseEstimator]:
        """Return name and estimator of the best candidate."""
        fewest = min(len(train) for train, _ in folds)
        candidates = [pair for pair in self.candidates if _needs(pair[1]) <= fewest]
        self.left_out_ = [name for name, estimator in self.candidates if _needs(estimator) > fewest]
        settings = self.while_choosing or {}
        cheaper = [clone(estimator).set_params(**settings) for _, estimator in candidates]
        scoring: Any = "accuracy"
        if get_tags(self).estimator_type == "regressor":
            scoring = make_scorer(negative_square, period=self.period)
        search = GridSearchCV(
            Pipeline([("model", cheaper[0])]), {"model": cheaper}, scoring=scoring, cv=folds,
            refit=False, error_score="raise",
        ).fit(X, y)  # fmt: skip
        scores = search.cv_results_["mean_test_score"].tolist()
        names = [name for name, _ in candidates]
        self.inner_scores_ = dict(zip(names, scores, strict=True))
        return candidates[search.best_index_]

    @property
    def classes_(self) -> np.ndarray:
        """Return the classes (k,) of the chosen estimator."""
        return self.best_estimator_.classes_

    @property
    def n_features_in_(self) -> int:
        """Return the number of features that it was trained on."""
        return self.best_estimator_.n_features_in_

    def predict(self, X: Any) -> np.ndarray:
        """Return the predictions (n,) of the chosen estimator."""
        check_is_fitted(self, "best_estimator_")
        return self.best_estimator_.predict(X)

    @available_if(_first_has("predict_proba"))
    def predict_proba(self, X: Any) -> np.ndarray:
        """Return probabilities (n, k) of `classes_` by the chosen estimator."""
        check_is_fitted(self, "best_estimator_")
        return self.best_estimator_.predict_proba(X)


def _needs(candidate: BaseEstimator) -> int:
    """Return how many recordings a candidate needs, by its step `AtLeast`."""
    steps = candidate.get_params().values()
    return max((step.rows for step in steps if isinstance(step, AtLeast)), default=1)


def inner_folds(y: np.ndarray, groups: np.ndarray, classes: bool, seed: int) -> Folds:
    """Return folds of targets y (n,) that divide no group of `groups` (n,); none for fewer than two
    groups.

    Classes are spread evenly as far as whole groups allow.
    """
    group = np.unique(groups, return_inverse=True)[1]
    groups_given = int(group.max(initial=-1)) + 1
    folds_for_size = LARGE_FOLDS if len(y) > LARGE and groups_given >= FEW_GROUPS else INNER_FOLDS
    count = min(folds_for_size, groups_given)
    if count < 2:
        return []
    return whole_groups(y, group, count, classes, seed)


def whole_groups(y: np.ndarray, group: np.ndarray, folds: int, classes: bool, seed: int) -> Folds:
    """Return folds that divide no group (n,); classes y (n,) are spread evenly, unless that leaves
    a fold empty or every class is rarer than the folds."""
    plain = GroupKFold(folds, shuffle=True, random_state=seed)
    if classes and np.unique(y, return_counts=True)[1].max() >= folds:
        splitter = StratifiedGroupKFold(folds, shuffle=True, random_state=seed)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "The least populated class", UserWarning)
            pairs = list(splitter.split(y, y, group))
        if all(len(test) for _, test in pairs):
            return pairs
    return list(plain.split(y, y, group))
