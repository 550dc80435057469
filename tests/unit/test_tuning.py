"""Tuned models: what is chosen, from which rows, and what is kept of it."""

import numpy as np
import pytest
from sklearn.base import BaseEstimator, ClassifierMixin, RegressorMixin, clone
from sklearn.utils.estimator_checks import parametrize_with_checks

from ajgdata.evaluate.crossval import cross_validate
from ajgdata.evaluate.splits import grouped_folds
from ajgdata.models import fit_model, make_model, search_result, tuning
from ajgdata.models.scaling import AtLeast, OneScale
from ajgdata.models.tuning import LARGE, LARGE_FOLDS, Tuned
from ajgdata.types import NotPossibleError


class Spy(ClassifierMixin, BaseEstimator):
    """Notes the first feature of the rows that it is trained on and predicts, and predicts 0."""

    seen: list = []  # noqa: RUF012  of all clones

    def fit(self, X, y):
        self.classes_ = np.unique(y)
        self.seen.append((X[:, 0].copy(), None))
        return self

    def predict(self, X):
        self.seen[-1] = (self.seen[-1][0], X[:, 0].copy())
        return np.full(len(X), self.classes_[0])


class Constant(RegressorMixin, BaseEstimator):
    def __init__(self, value=0.0):
        self.value = value

    def fit(self, X, y):
        self.value_ = self.value
        return self

    def predict(self, X):
        return np.full(len(X), self.value_)


@parametrize_with_checks([AtLeast(), OneScale()])
def test_scalings_follow_the_conventions_of_scikit_learn(estimator, check):
    check(estimator)


def test_one_scale_keeps_the_proportions_of_bins():
    x = np.random.default_rng(0).normal(3, [[1.0, 10.0]], (400, 2))
    z = OneScale().fit_transform(x)
    np.testing.assert_allclose(z.mean(axis=0), 0, atol=1e-12)
    np.testing.assert_allclose((z**2).mean(), 1)
    np.testing.assert_allclose(z[:, 1].std() / z[:, 0].std(), x[:, 1].std() / x[:, 0].std())
    assert (OneScale().fit_transform(np.ones((3, 2))) == 0).all()


@pytest.mark.parametrize("rows", [60, LARGE + 40])
def test_inner_folds_see_no_row_of_the_outer_test_part_and_divide_no_group(rows):
    x = np.arange(rows, dtype=float)[:, None] + np.zeros((1, 3))
    groups = np.arange(rows) // 4
    y = np.arange(rows) // 4 % 2
    Spy.seen.clear()
    cross_validate(
        x, y, groups, kind="classification", model=Tuned([("a", Spy()), ("b", Spy())]), folds=3
    )
    inner = LARGE_FOLDS if 2 * rows / 3 > LARGE else 3
    each = 2 * inner + 1  # two candidates on the inner folds, and the best on the whole part
    assert len(Spy.seen) == 3 * each
    for number, (train, test) in enumerate(grouped_folds(y, groups, "classification", 3, 0)):
        *tried, (whole, _) = Spy.seen[number * each : (number + 1) * each]
        assert set(whole) == set(train)
        for fit, held in tried:
            assert not set(fit) & set(test)
            assert not set(held) & set(test)
            assert not set(groups[fit.astype(int)]) & set(groups[held.astype(int)])
            assert set(fit) | set(held) == set(train)


def leaking(groups=24, repeats=6):
    """Two bins that nearly tell the class, and two that tell the group exactly and nothing else."""
    generator = np.random.default_rng(2)
    group = np.repeat(np.arange(groups), repeats)
    y = group % 2
    honest = y[:, None] + generator.normal(0, 0.4, (len(y), 2))
    leak = generator.normal(size=(groups, 2))[group]
    return np.hstack([honest, leak]), y, group


def amplitudes(rows=96):
    """Spectra of two shapes that loudness hides."""
    generator = np.random.default_rng(3)
    y = np.arange(rows) // 2 % 2
    bins = np.arange(1, 13)
    shape = np.where(y[:, None] == 1, bins, bins[::-1]) ** 0.15
    loud = np.exp(generator.normal(0, 1.5, rows))
    x = loud[:, None] * shape * (1 + 0.02 * generator.normal(size=(rows, 12)))
    return x, y, np.arange(rows) // 2


@pytest.mark.parametrize(
    ("name", "kind"),
    [("linear", "classification"), ("ridge", "regression"), ("knn", "classification")],
)
def test_what_is_kept_is_the_chosen_candidate_and_nothing_more(name, kind):
    x, y, group = amplitudes()
    fitted = fit_model(make_model(name, kind, 5), x, y, group)
    again = fit_model(make_model(name, kind, 5), x, y, group)
    kept, about = search_result(fitted)
    assert about == search_result(again)[1]
    assert about["choice"] == max(about["scores"], key=about["scores"].get)
    assert (about["reason"], about["inner_folds"]) == ("", 3)
    candidate = dict(make_model(name, kind, 5).candidates)[about["choice"]]
    assert repr(kept) == repr(candidate)
    plain = clone(candidate).fit(x, y)
    for model in (fitted, kept):
        np.testing.assert_array_equal(model.predict(x), plain.predict(x))


def test_without_inner_folds_the_first_is_taken_and_the_reason_told():
    x, y, _ = leaking()
    model = make_model("linear", "classification")
    first = model.candidates[0][0]
    lone = np.arange(len(y)) > 0  # the first recording alone on one side
    for groups, reason in (
        (None, tuning.NO_GROUPS),
        (np.zeros(len(y)), tuning.ONE_GROUP),
        (lone, tuning.ONE_ROW),
        (y, tuning.ONE_CLASS),
    ):
        about = search_result(fit_model(clone(model), x, y, groups))[1]
        none = {"inner_folds": 0, "scores": {}}
        assert about == {"choice": first, "reason": reason, **none}


def test_a_candidate_that_needs_more_rows_is_passed_over():
    x, y, group = leaking(groups=4, repeats=1)  # k = 5 neighbours are not to be had
    fitted = fit_model(make_model("knn", "classification"), x, y, group)
    assert "k = 1" in fitted.choice_
    assert all("k = 1" in name for name in fitted.inner_scores_)
    names = [name for name, _ in fitted.candidates]
    assert search_result(fitted)[1]["left_out"] == [name for name in names if "k = 1" not in name]
    with pytest.raises(NotPossibleError, match="4 recordings to learn from: 5 are needed"):
        make_model("knn_plain", "classification").fit(x, y)


def test_numbers_that_repeat_are_compared_the_shortest_way_round():
    y = np.tile([179.0, 1.0, 178.0, 2.0], 3)
    model = Tuned([("half a turn", Constant(90.0)), ("near", Constant(0.0))], period=180.0)
    fitted = model.fit(np.zeros((12, 1)), y, groups=np.arange(12))
    assert fitted.choice_ == "near"
    assert fitted.inner_scores_["near"] == pytest.approx(-2.5)  # (1 + 1 + 4 + 4) / 4
