"""Choice of a model among candidates by inner folds of its training part.

The best candidate is trained again on the complete training part. It is an ordinary scikit-learn
estimator (`best_estimator_`), and only this estimator is stored.
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
#: Number of inner folds.
INNER_FOLDS = 3
#: Number of inner folds for more than LARGE recordings in at least FEW_GROUPS groups. Two folds are
#: faster, and scores of candidates differ by more than their scatter. With few groups, half of them
#: would be a small training part.
LARGE_FOLDS = 2
LARGE = 200
FEW_GROUPS = 20
#: Reasons why a model was not chosen.
NO_GROUPS = "no groups were given to divide the training recordings by"
ONE_GROUP = "the training recordings are of one group: two are needed"
ONE_ROW = "candidates would be trained on one recording: two are needed"
ONE_CLASS = "candidates would be trained on one class: two are needed"


def _first_candidate_has(method: str) -> Callable[[Any], bool]:
    """Return a check of a `Tuned` model: whether its first candidate has a method."""
    return lambda model: hasattr(model.candidates[0][1], method)


class Tuned(MetaEstimatorMixin, BaseEstimator):
    """The candidate with the best mean score on inner folds, the first of several equal ones.

    `candidates` are pairs of a name and an unfitted estimator, all of one kind. The score is the
    accuracy, or minus the mean squared error. Inner folds keep groups together. Without groups, or
    with too little data for inner folds, the first candidate is used, and `reason_` is the reason.
    The search uses at most `search_rows` recordings, and candidates with the `search_settings`,
    which make it faster. After `fit`:

    - `best_estimator_`, and its name `choice_`;
    - `inner_folds_`, the number of inner folds, and `inner_scores_` by name;
    - `left_out_`, the names of candidates that need more recordings than an inner fold has;
    - `chosen_on_`, the number of recordings of the search; 0 if the search used all.
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
        search_settings: Mapping[str, Any] | None = None,
        search_rows: int = 5_000,
    ) -> None:
        self.candidates = candidates
        self.period = period
        self.random_state = random_state
        self.search_settings = search_settings
        self.search_rows = search_rows

    def __sklearn_tags__(self) -> Any:
        return get_tags(self.candidates[0][1])

    def wrapped(
        self, wrap: Callable[[BaseEstimator], BaseEstimator], period: float | None = None
    ) -> Tuned:
        """Return the same choice among wrapped candidates, e.g. for a target with a period."""
        wrapped = [(name, wrap(estimator)) for name, estimator in self.candidates]
        return Tuned(wrapped, period, self.random_state, search_rows=self.search_rows)

    def fit(self, X: Any, y: Any, groups: Any = None) -> Self:
        """Choose and train on features (n, n_features), targets (n,) and groups (n,)."""
        X = np.asarray(X)
        y = np.asarray(y)
        self.inner_scores_ = {}
        self.left_out_ = []
        self.inner_folds_ = 0
        self.chosen_on_ = 0
        rows = np.arange(len(y))
        if groups is not None:
            rows = thinned(np.asarray(groups), self.search_rows, y)
        folds, self.reason_ = self._folds(y[rows], None if groups is None else groups[rows])
        self.choice_, best = self.candidates[0]
        if not self.reason_:
            self.choice_, best = self._search(X[rows], y[rows], folds)
            self.inner_folds_ = len(folds)
            if len(rows) < len(y):
                self.chosen_on_ = len(rows)
        self.best_estimator_ = clone(best).fit(X, y)
        return self

    def _folds(self, y: np.ndarray, groups: np.ndarray | None) -> tuple[Folds, str]:
        """Return the inner folds and "", or no folds and the reason."""
        if groups is None:
            return [], NO_GROUPS
        is_classifier = get_tags(self).estimator_type == "classifier"
        folds = inner_folds(y, np.asarray(groups), is_classifier, self.random_state)
        if not folds:
            return [], ONE_GROUP
        if min(len(train) for train, _ in folds) < 2:
            return [], ONE_ROW
        if is_classifier and min(len(np.unique(y[train])) for train, _ in folds) < 2:
            return [], ONE_CLASS
        return folds, ""

    def _search(self, X: np.ndarray, y: np.ndarray, folds: Folds) -> tuple[str, BaseEstimator]:
        """Return name and unfitted estimator of the best candidate."""
        fewest = min(len(train) for train, _ in folds)
        candidates = []
        for name, estimator in self.candidates:
            if _required_rows(estimator) <= fewest:
                candidates.append((name, estimator))
            else:
                self.left_out_.append(name)
        settings = self.search_settings or {}
        faster = [clone(estimator).set_params(**settings) for _, estimator in candidates]
        scoring: Any = "accuracy"
        if get_tags(self).estimator_type == "regressor":
            scoring = make_scorer(negative_square, period=self.period)
        search = GridSearchCV(
            Pipeline([("model", faster[0])]),
            {"model": faster},
            scoring=scoring,
            cv=folds,
            refit=False,
            error_score="raise",
        )
        search.fit(X, y)
        scores = search.cv_results_["mean_test_score"].tolist()
        names = [name for name, _ in candidates]
        self.inner_scores_ = dict(zip(names, scores, strict=True))
        return candidates[search.best_index_]

    @property
    def classes_(self) -> np.ndarray:
        """Return the classes (k,) of the best estimator."""
        return self.best_estimator_.classes_

    @property
    def n_features_in_(self) -> int:
        """Return the number of features of the training recordings."""
        return self.best_estimator_.n_features_in_

    def predict(self, X: Any) -> np.ndarray:
        """Return the predictions (n,) of the best estimator."""
        check_is_fitted(self, "best_estimator_")
        return self.best_estimator_.predict(X)

    @available_if(_first_candidate_has("predict_proba"))
    def predict_proba(self, X: Any) -> np.ndarray:
        """Return the probabilities (n, k) of `classes_` by the best estimator."""
        check_is_fitted(self, "best_estimator_")
        return self.best_estimator_.predict_proba(X)


def _required_rows(candidate: BaseEstimator) -> int:
    """Return the number of recordings that a candidate needs, from its steps `AtLeast`."""
    steps = candidate.get_params().values()
    return max((step.rows for step in steps if isinstance(step, AtLeast)), default=1)


def negative_square(y_true: np.ndarray, y_pred: np.ndarray, period: float | None) -> float:
    """Return minus the mean squared error; differences are modulo a `period`, if there is one."""
    difference = y_pred - y_true
    if period is not None:
        difference = (difference + period / 2) % period - period / 2
    return -float(np.mean(difference**2))


def inner_folds(y: np.ndarray, groups: np.ndarray, is_classifier: bool, seed: int) -> Folds:
    """Return the inner folds for targets y (n,) and groups (n,) that divide no group.

    The folds are stratified by class as far as whole groups allow. There are none for one group.
    """
    group = np.unique(groups, return_inverse=True)[1]
    group_count = int(group.max(initial=-1)) + 1
    is_large = len(y) > LARGE and group_count >= FEW_GROUPS
    count = min(LARGE_FOLDS if is_large else INNER_FOLDS, group_count)
    if count < 2:
        return []
    return whole_groups(y, group, count, is_classifier, seed)


def whole_groups(
    y: np.ndarray, group: np.ndarray, folds: int, is_classifier: bool, seed: int
) -> Folds:
    """Return folds for targets y (n,) that divide no group (n,).

    The folds of a classifier are stratified by class, unless every class has fewer rows than there
    are folds, or a stratified fold would be empty.
    """
    if is_classifier and np.unique(y, return_counts=True)[1].max() >= folds:
        splitter = StratifiedGroupKFold(folds, shuffle=True, random_state=seed)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "The least populated class", UserWarning)
            pairs = list(splitter.split(y, y, group))
        if all(len(test) for _, test in pairs):
            return pairs
    return list(GroupKFold(folds, shuffle=True, random_state=seed).split(y, y, group))
