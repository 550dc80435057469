"""What each tuned model is chosen from, by the inner folds of its training part (see `tuning`).

Declared before any score on tested folds was seen, and the same for all tasks, simulated and
recorded. The first of each list is what all tasks had before there was a choice; it wins where
nothing is better.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import product

from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.decomposition import PCA
from sklearn.linear_model import LogisticRegression, Ridge, RidgeClassifier
from sklearn.neighbors import KNeighborsClassifier, KNeighborsRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import Normalizer, StandardScaler
from sklearn.svm import SVC, SVR

from ajgdata.models.baselines import LOGISTIC_STEPS, Compress, scaled_target
from ajgdata.models.scaling import AtLeast, OneScale
from ajgdata.models.tuning import Tuned
from ajgdata.types import Kind

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
#: Gradient at which logistic regression stops on inner folds: a third of the time of 1e-4.
ROUGHLY = 1e-2
SVM_CS = (1.0, 10.0, 100.0)
#: Scalings of k-NN by distance: sums of differences are four times as slow as those of squares.
DISTANCES = {
    "euclidean": ("asinh, per bin", "stored", "L2", "asinh", "log", "asinh, per bin, PCA"),
    "manhattan": ("asinh, per bin", "stored", "L2"),
}
NEIGHBOURS = (5, 1)
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
    (scikit-learn's gamma "scale")."""
    if kind == "regression":
        make = lambda c: scaled_target(SVR(C=c))  # noqa: E731
        return _penalised("C", SVM_CS, make, seed, SQUARE_CHOOSING)
    return _penalised("C", SVM_CS, lambda c: SVC(C=c), seed, SQUARE_CHOOSING)


def nearest_neighbours(kind: Kind, seed: int) -> Tuned:
    """Return k-NN; a candidate needs at least k training rows."""
    knn = KNeighborsRegressor if kind == "regression" else KNeighborsClassifier
    found: Candidates = []
    for metric, scalings in DISTANCES.items():
        for scaling, k in product(scalings, NEIGHBOURS):
            steps = [AtLeast(k), *SCALINGS[scaling](), knn(n_neighbors=k, metric=metric)]
            suffix = "" if metric == "euclidean" else f", {metric.capitalize()}"
            found.append((f"{scaling}, k = {k}{suffix}", make_pipeline(*steps)))
    return Tuned(found, random_state=seed, choosing=SQUARE_CHOOSING)


def _penalised(
    setting: str,
    values: Sequence[float],
    made: Callable[[float], BaseEstimator],
    seed: int,
    choosing: int = CHOOSING,
) -> Tuned:
    """Return the choice among all scalings of PENALISED with all values of a setting."""
    named = [
        (f"{scaling}, {setting} = {value:g}", make_pipeline(*SCALINGS[scaling](), made(value)))
        for scaling, value in product(PENALISED, values)
    ]
    return Tuned(named, random_state=seed, choosing=choosing)
