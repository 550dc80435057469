"""The models that the CNN must beat: standardise, then a linear model or the nearest neighbours.

One setting for all tasks, none of them tuned to a data set.
"""

from __future__ import annotations

from sklearn.linear_model import LogisticRegression, Ridge
from sklearn.neighbors import KNeighborsClassifier, KNeighborsRegressor
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler

from ajgdata.types import Kind

NEIGHBOURS = 5  # scikit-learn's default; the paper does not give its k


def linear(kind: Kind) -> Pipeline:
    """Logistic regression, or ridge.

    Both penalties are 1 per unit of squared weight on standardised bins (C = 1, alpha = 1).
    """
    if kind == "regression":
        return make_pipeline(StandardScaler(), Ridge(alpha=1.0))
    # lbfgs needs a few dozen steps on standardised spectra; 2000 leaves room for separable data
    return make_pipeline(StandardScaler(), LogisticRegression(C=1.0, max_iter=2000))


def nearest_neighbours(kind: Kind) -> Pipeline:
    """k-NN on the Euclidean distance of standardised bins; needs at least k training rows."""
    knn = KNeighborsRegressor if kind == "regression" else KNeighborsClassifier
    return make_pipeline(StandardScaler(), knn(n_neighbors=NEIGHBOURS))
