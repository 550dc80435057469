"""Baseline models for comparison with the CNN: a scaling, followed by a scikit-learn model.

Forest, boosting and MLP have one setting for all tasks. A tuned model chooses among candidates by
inner folds of its training part (see `tuning`). The candidates are the same for all tasks and were
declared before any score on test folds was known. The first candidate is the plain model, except
for k-NN.
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

#: Classes can have few spectra, so leaves are small. A split chooses among a tenth of the bins:
#: neighbouring bins are correlated, training takes a tenth of the time, and trees differ more.
BOOSTING = {
    "max_iter": 50,
    "learning_rate": 0.2,
    "max_leaf_nodes": 8,
    "min_samples_leaf": 5,
    "max_features": 0.1,
    "max_bins": 32,  # 255 take four times as long, with the same error
    "early_stopping": False,
}
FOREST = {"n_estimators": 200, "max_features": "sqrt"}
#: Training stops when the loss decreases by less than 1e-4 in 10 epochs, long before `max_iter`.
MLP = {"hidden_layer_sizes": (128,), "alpha": 1e-4, "max_iter": 2000}
#: Scale of a compression that is a logarithm except for bins a thousand times below the mean.
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
    # components that explain 95 % of the variance; models with a penalty do not need them
    "asinh, per bin, PCA": lambda: [Compress(), StandardScaler(), PCA(0.95)],
}
#: Scalings for models with a penalty, which is suitable for bins with a variance near 1.
PENALISED = ("asinh, per bin", "log, per bin", "L2, one scale", "one scale")
#: With C = 1, most training parts are separated, so larger values have little effect.
LOGISTIC_C = (1.0, 0.01)
RIDGE_ALPHAS = (1000.0, 10.0, 100_000.0)
#: Largest number of steps. A few dozen are usual; perfectly separated classes need more.
LOGISTIC_STEPS = 2000
#: Gradient at which logistic regression stops in the search. The search takes a third of the time
#: that it takes with the default, 1e-4.
LOGISTIC_SEARCH_TOLERANCE = 1e-2
SVM_CS = (1.0, 10.0, 100.0)
#: Scalings of k-NN by distance. The Manhattan distance takes four times as long.
DISTANCES = {
    "euclidean": ("asinh, per bin", "stored", "L2", "asinh", "log", "asinh, per bin, PCA"),
    "manhattan": ("asinh, per bin", "stored", "L2"),
}
#: k of k-NN: the default of scikit-learn, because the paper does not state k.
NEIGHBOURS = 5
#: Largest number of recordings of the search.
SEARCH_ROWS = 5_000
#: The same for models whose time grows with the square of this number.
SQUARE_SEARCH_ROWS = 2_000

Candidates = list[tuple[str, BaseEstimator]]


def linear(kind: Kind, seed: int) -> Tuned:
    """Return tuned logistic regression (lbfgs); for a regression tuned ridge."""
    if kind == "regression":
        return ridge(kind, seed)
    logistic = partial(LogisticRegression, max_iter=LOGISTIC_STEPS)
    tuned = _penalised("C", LOGISTIC_C, lambda c: logistic(C=c), seed)
    settings = {"logisticregression__tol": LOGISTIC_SEARCH_TOLERANCE}
    return tuned.set_params(search_settings=settings)


def ridge(kind: Kind, seed: int) -> Tuned:
    """Return tuned least squares with a penalty; for classes with targets -1 and 1 per class."""
    model = Ridge if kind == "regression" else RidgeClassifier
    return _penalised("alpha", RIDGE_ALPHAS, lambda alpha: model(alpha=alpha), seed)


def support_vectors(kind: Kind, seed: int) -> Tuned:
    """Return a tuned support vector machine with a Gaussian kernel.

    The width of the kernel follows the scaling (scikit-learn's gamma "scale"). The classifier has
    no probabilities: they would have to be fitted to its margins on a further split.
    """

    def machine(c: float) -> BaseEstimator:
        return scaled_target(SVR(C=c)) if kind == "regression" else SVC(C=c)

    return _penalised("C", SVM_CS, machine, seed, SQUARE_SEARCH_ROWS)


def _penalised(
    setting: str,
    values: Sequence[float],
    make: Callable[[float], BaseEstimator],
    seed: int,
    search_rows: int = SEARCH_ROWS,
) -> Tuned:
    """Return the choice among all scalings of PENALISED with all values of a setting."""
    candidates = [
        (f"{scaling}, {setting} = {value:g}", make_pipeline(*SCALINGS[scaling](), make(value)))
        for scaling, value in product(PENALISED, values)
    ]
    return Tuned(candidates, random_state=seed, search_rows=search_rows)


def nearest_neighbours(kind: Kind, seed: int) -> Tuned:
    """Return tuned k-NN. A candidate needs at least k training recordings."""
    knn = KNeighborsRegressor if kind == "regression" else KNeighborsClassifier
    candidates: Candidates = []
    for metric, scalings in DISTANCES.items():
        suffix = "" if metric == "euclidean" else f", {metric.capitalize()}"
        for scaling, k in product(scalings, (NEIGHBOURS, 1)):
            steps = [AtLeast(k), *SCALINGS[scaling](), knn(n_neighbors=k, metric=metric)]
            candidates.append((f"{scaling}, k = {k}{suffix}", make_pipeline(*steps)))
    return Tuned(candidates, random_state=seed, search_rows=SQUARE_SEARCH_ROWS)


def linear_plain(kind: Kind, seed: int) -> BaseEstimator:
    """Return the first candidate of `linear`: C = 1 (ridge: alpha = 1000)."""
    return _candidate(linear(kind, seed))


def ridge_plain(kind: Kind, seed: int) -> BaseEstimator:
    """Return the first candidate of `ridge`: alpha = 1000. Its direct solution is fast."""
    return _candidate(ridge(kind, seed))


def support_vectors_plain(kind: Kind, seed: int) -> BaseEstimator:
    """Return the first candidate of `support_vectors`: C = 1."""
    return _candidate(support_vectors(kind, seed))


def nearest_neighbours_plain(kind: Kind, seed: int) -> BaseEstimator:
    """Return k-NN with the Euclidean distance of stored features: the paper states no scaling."""
    return _candidate(nearest_neighbours(kind, seed), f"stored, k = {NEIGHBOURS}")


def _candidate(tuned: Tuned, name: str = "") -> BaseEstimator:
    """Return the candidate with this name, or the first one."""
    if not name:
        return tuned.candidates[0][1]
    return dict(tuned.candidates)[name]


def boosting(kind: Kind, seed: int) -> Pipeline:
    """Return gradient boosting of histogram trees."""
    if kind == "regression":
        return _after_scaling(HistGradientBoostingRegressor(**BOOSTING, random_state=seed))
    return _after_scaling(HistGradientBoostingClassifier(**BOOSTING, random_state=seed))


def forest(kind: Kind, seed: int) -> Pipeline:
    """Return a random forest. A split chooses among √n of n bins."""
    trees = RandomForestRegressor if kind == "regression" else RandomForestClassifier
    return _after_scaling(trees(**FOREST, random_state=seed))


def perceptron(kind: Kind, seed: int) -> Pipeline:
    """Return a multilayer perceptron with one hidden layer, trained by Adam."""
    if kind == "regression":
        return _after_scaling(scaled_target(MLPRegressor(**MLP, random_state=seed)))
    return _after_scaling(MLPClassifier(**MLP, random_state=seed))


def _after_scaling(model: BaseEstimator) -> Pipeline:
    """Return a model after a scaling that compresses and standardises each bin."""
    return make_pipeline(Compress(), StandardScaler(), model)
