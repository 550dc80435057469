"""The models that the CNN must beat: scale, then one of scikit-learn's.

Forest, boosting and MLP have one setting for all tasks. The tuned models choose among candidates by
the inner folds of their training part (see `tuning`). The candidates are the same for all tasks and
were declared before any score on test folds. The first candidate of each list is the plain model.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import product

from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.decomposition import PCA
from sklearn.ensemble import (
    HistGradientBoostingClassifier,
    HistGradientBoostingRegressor,
    RandomForestClassifier,
    RandomForestRegressor,
)
from sklearn.linear_model import LogisticRegression, Ridge, RidgeClassifier
from sklearn.neighbors import KNeighborsClassifier, KNeighborsRegressor
from sklearn.neural_network import MLPClassifier, MLPRegressor
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import Normalizer, StandardScaler
from sklearn.svm import SVC, SVR

from ajgdata.models.scaling import AtLeast, Compress, OneScale, scaled_target
from ajgdata.models.tuning import Tuned
from ajgdata.types import Kind

#: A class may have no more than some dozens of spectra, hence small leaves; few features a split
#: because neighbouring bins say the same: a tenth of the time, and trees that differ.
BOOSTING = {
    "max_iter": 50,
    "learning_rate": 0.2,
    "max_leaf_nodes": 8,
    "min_samples_leaf": 5,
    "max_features": 0.1,
    "max_bins": 32,  # of some hundred spectra; 255 take four times as long and err as often
    "early_stopping": False,
}
FOREST = {"n_estimators": 200, "max_features": "sqrt"}
#: Stops when the training loss no longer falls (1e-4 in 10 epochs), long before `max_iter`.
MLP = {"hidden_layer_sizes": (128,), "alpha": 1e-4, "max_iter": 2000}
#: asinh with so small a scale is a logarithm, but at bins a thousand times below the mean.
LOG = 1e-3
SCALINGS: dict[str, Callable[[], list[TransformerMixin]]] = {
    "asinh, per bin": lambda: [Compress(), StandardScaler()],
    "log, per bin": lambda: [Compress(LOG), StandardScaler()],
    "L2, one scale": lambda: [Normalizer(), OneScale()],
    "one scale": lambda: [OneScale()],
    "stored": list,
    "L2": lambda: [Normalizer()],
    "asinh": lambda: [Compress()],
    "log": lambda: [Compress(LOG)],
    # what explains 95 % of the variance; models with a penalty have no need of it
    "asinh, per bin, PCA": lambda: [Compress(), StandardScaler(), PCA(0.95)],
}
#: Scalings of models with a penalty: it supposes bins of order one.
PENALISED = ("asinh, per bin", "log, per bin", "L2, one scale", "one scale")
LOGISTIC_C = (1.0, 0.01)  # at 1 it separates most training parts: more changes little
RIDGE_ALPHAS = (1000.0, 10.0, 100_000.0)
#: A few dozen are usual; the limit leaves room for data that separate perfectly.
LOGISTIC_STEPS = 2000
#: Gradient at which logistic regression stops on inner folds: a third of the time of 1e-4.
ROUGHLY = 1e-2
SVM_CS = (1.0, 10.0, 100.0)
#: Scalings of k-NN by distance: sums of differences are four times as slow as those of squares.
DISTANCES = {
    "euclidean": ("asinh, per bin", "stored", "L2", "asinh", "log", "asinh, per bin, PCA"),
    "manhattan": ("asinh, per bin", "stored", "L2"),
}
NEIGHBOURS = 5  # scikit-learn's default; the paper does not give its k
#: Recordings that are used for the choice; fewer if the cost grows as their square.
CHOOSING, SQUARE_CHOOSING = 5_000, 2_000

Candidates = list[tuple[str, BaseEstimator]]


def linear(kind: Kind, seed: int) -> Tuned:
    """Return logistic regression (lbfgs), or ridge."""
    if kind == "regression":
        return ridge(kind, seed)
    logistic = partial(LogisticRegression, max_iter=LOGISTIC_STEPS)
    tuned = _penalised("C", LOGISTIC_C, lambda c: logistic(C=c), seed)
    return tuned.set_params(while_choosing={"logisticregression__tol": ROUGHLY})


def ridge(kind: Kind, seed: int) -> Tuned:
    """Return least squares with a penalty; for classes on -1 and 1 of each."""
    cls = Ridge if kind == "regression" else RidgeClassifier
    return _penalised("alpha", RIDGE_ALPHAS, lambda alpha: cls(alpha=alpha), seed)


def support_vectors(kind: Kind, seed: int) -> Tuned:
    """Return a support vector machine with a Gaussian kernel, whose width follows the scaling
    (scikit-learn's gamma "scale").

    As a classifier it has no probabilities: its margins are not any, and fitting some to them would
    take a split of its own.
    """
    if kind == "regression":
        make = lambda c: scaled_target(SVR(C=c))  # noqa: E731
        return _penalised("C", SVM_CS, make, seed, SQUARE_CHOOSING)
    return _penalised("C", SVM_CS, lambda c: SVC(C=c), seed, SQUARE_CHOOSING)


def nearest_neighbours(kind: Kind, seed: int) -> Tuned:
    """Return k-NN; a candidate needs at least k training rows."""
    knn = KNeighborsRegressor if kind == "regression" else KNeighborsClassifier
    candidates: Candidates = []
    for metric, scalings in DISTANCES.items():
        for scaling, k in product(scalings, (NEIGHBOURS, 1)):
            steps = [AtLeast(k), *SCALINGS[scaling](), knn(n_neighbors=k, metric=metric)]
            suffix = "" if metric == "euclidean" else f", {metric.capitalize()}"
            candidates.append((f"{scaling}, k = {k}{suffix}", make_pipeline(*steps)))
    return Tuned(candidates, random_state=seed, choosing=SQUARE_CHOOSING)


def linear_plain(kind: Kind, seed: int) -> BaseEstimator:
    """Return the first candidate of `linear`: C = 1."""
    return _candidate(linear(kind, seed))


def ridge_plain(kind: Kind, seed: int) -> BaseEstimator:
    """Return the first candidate of `ridge`: solved directly, so it is fast."""
    return _candidate(ridge(kind, seed))


def support_vectors_plain(kind: Kind, seed: int) -> BaseEstimator:
    """Return the first candidate of `support_vectors`: C = 1."""
    return _candidate(support_vectors(kind, seed))


def nearest_neighbours_plain(kind: Kind, seed: int) -> BaseEstimator:
    """Return k-NN by the Euclidean distance of features as they are stored, as the paper says
    nothing of a scaling."""
    return _candidate(nearest_neighbours(kind, seed), f"stored, k = {NEIGHBOURS}")


def _candidate(tuned: Tuned, name: str = "") -> BaseEstimator:
    """Return a candidate by its name, or the first one."""
    return dict(tuned.candidates)[name or tuned.candidates[0][0]]


def _penalised(
    setting: str,
    values: Sequence[float],
    make: Callable[[float], BaseEstimator],
    seed: int,
    choosing: int = CHOOSING,
) -> Tuned:
    """Return the choice among all scalings of PENALISED with all values of a setting."""
    named = [
        (f"{scaling}, {setting} = {value:g}", make_pipeline(*SCALINGS[scaling](), make(value)))
        for scaling, value in product(PENALISED, values)
    ]
    return Tuned(named, random_state=seed, choosing=choosing)


def boosting(kind: Kind, seed: int) -> Pipeline:
    """Return gradient boosting of histogram trees."""
    if kind == "regression":
        return _after_scaling(HistGradientBoostingRegressor(**BOOSTING, random_state=seed))
    return _after_scaling(HistGradientBoostingClassifier(**BOOSTING, random_state=seed))


def forest(kind: Kind, seed: int) -> Pipeline:
    """Return a random forest, each split among the root of the number of bins."""
    trees = RandomForestRegressor if kind == "regression" else RandomForestClassifier
    return _after_scaling(trees(**FOREST, random_state=seed))


def perceptron(kind: Kind, seed: int) -> Pipeline:
    """Return a multilayer perceptron with one hidden layer, trained by Adam."""
    if kind == "regression":
        return _after_scaling(scaled_target(MLPRegressor(**MLP, random_state=seed)))
    return _after_scaling(MLPClassifier(**MLP, random_state=seed))


def _after_scaling(model: BaseEstimator) -> Pipeline:
    return make_pipeline(Compress(), StandardScaler(), model)
