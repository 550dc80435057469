"""Candidates fitted side by side predict what each predicts alone."""

import numpy as np
import pytest
from sklearn.base import BaseEstimator, TransformerMixin, clone
from sklearn.neighbors import KNeighborsClassifier
from sklearn.pipeline import make_pipeline

from ajgdata.models import make_model
from ajgdata.models.scaling import AtLeast
from ajgdata.models.shared_steps import SharedPart
from ajgdata.types import NotPossibleError


def parts(kind):
    generator = np.random.default_rng(5)
    features = generator.uniform(1, 4, (60, 6)).astype(np.float32)
    number = features[:, 0].round() + generator.integers(0, 2, 60)  # classes as common as others
    y = number if kind == "regression" else np.array(list("abcdef"))[number.astype(int)]
    return features[:40], y[:40], features[40:]


@pytest.mark.parametrize(
    "name, kind, period",
    [
        ("knn", "classification", None),
        ("knn", "regression", None),
        ("knn", "regression", 5.0),
        ("ridge", "classification", None),
        ("ridge", "regression", 5.0),
        ("svm", "classification", None),
        ("svm", "regression", 5.0),
    ],
)
def test_every_candidate_predicts_what_it_predicts_alone(name, kind, period):
    train, y, test = parts(kind)
    tuned = make_model(name, kind, period=period)
    shared = SharedPart(train, y, test)
    for label, candidate in tuned.candidates:
        alone = clone(candidate).fit(train, y).predict(test)
        np.testing.assert_array_equal(shared.predicted(clone(candidate)), alone, err_msg=label)


class Counted(TransformerMixin, BaseEstimator):
    """Adds `amount`, and counts how often it was fitted."""

    fits = 0

    def __init__(self, amount=0):
        self.amount = amount

    def fit(self, X, y=None):
        type(self).fits += 1
        return self

    def transform(self, X):
        return X + self.amount


def test_a_step_is_fitted_once_for_all_that_share_its_settings():
    Counted.fits = 0
    train, y, test = parts("classification")
    shared = SharedPart(train, y, test)
    for k, amount in ((1, 0), (5, 0), (1, 2), (7, 2)):
        shared.predicted(make_pipeline(AtLeast(k), Counted(amount), KNeighborsClassifier(k)))
    assert Counted.fits == 2


class Weighted(TransformerMixin, BaseEstimator):
    """Multiplies by `weights`, of which all texts may look alike."""

    def __init__(self, weights):
        self.weights = weights

    def fit(self, X, y=None):
        return self

    def transform(self, X):
        return X * self.weights


def long(middle):
    return np.insert(np.ones(2999), 1500, middle)


@pytest.mark.parametrize(
    "candidates",
    [
        [make_pipeline(KNeighborsClassifier(5, weights=w)) for w in ("uniform", "distance")],
        [make_pipeline(KNeighborsClassifier(5, metric="minkowski", p=p)) for p in (2, 1)],
        [make_pipeline(s, KNeighborsClassifier(5)) for s in ("passthrough", None, AtLeast())],
        [make_pipeline(Weighted(long(w)), KNeighborsClassifier(1)) for w in (1, 1e6)],
    ],
)
def test_what_settings_do_not_name_is_not_shared(candidates):
    generator = np.random.default_rng(6)
    train, test = generator.normal(size=(60, 3000)), generator.normal(size=(20, 3000))
    y = generator.integers(0, 3, 60)
    shared = SharedPart(train, y, test)
    for candidate in candidates:
        alone = clone(candidate).fit(train, y).predict(test)
        np.testing.assert_array_equal(shared.predicted(clone(candidate)), alone)


def test_a_candidate_that_needs_more_rows_is_refused_after_one_that_does_not():
    train, y, test = parts("classification")
    shared = SharedPart(train, y, test)
    shared.predicted(make_pipeline(AtLeast(40), KNeighborsClassifier(1)))
    with pytest.raises(NotPossibleError, match="41 are needed"):
        shared.predicted(make_pipeline(AtLeast(41), KNeighborsClassifier(1)))
