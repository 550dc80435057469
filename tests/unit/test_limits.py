"""A model learns from no more recordings than its limit, evenly of groups."""

from dataclasses import replace

import numpy as np
import pytest

from ajgdata.evaluate.crossval import cross_validate
from ajgdata.models import fit_model, make_model, search_result
from ajgdata.models.thinning import thinned
from ajgdata.types import MODELS


def spectra(groups=20, each=3):
    group = np.repeat(np.arange(groups), each)
    y = np.array(list("ab"))[group % 2]
    generator = np.random.default_rng(0)
    x = generator.normal(size=(len(y), 8)) ** 2 + (group % 2)[:, None]
    return x.astype(np.float32), y, group


@pytest.mark.parametrize("most", [3, 10])
def test_rows_are_left_out_of_the_largest_groups_first(most):
    groups = np.random.default_rng(1).permutation(np.repeat([3, 1, 4, 5], [1, 2, 5, 6]))
    rows = thinned(groups, most)
    assert len(rows) == len(set(rows.tolist())) == most
    assert (np.diff(rows) > 0).all()
    had, kept = (np.bincount(some, minlength=6)[[3, 1, 4, 5]] for some in (groups, groups[rows]))
    # a group from which something is missing is as large as any other, but for the last round
    assert (kept[kept < had] >= kept.max() - 1).all()


def test_every_class_of_a_session_loses_as_many():
    session = np.repeat(np.arange(4), 2500)
    y = np.tile(np.repeat(np.arange(20), 125), 4)
    rows = thinned(session, 5000, y)
    kept = np.bincount(session[rows] * 20 + y[rows], minlength=80)
    assert kept.min() == 62 and kept.max() == 63  # 5000 / 80 is 62.5


@pytest.mark.parametrize("group", [np.arange(200), np.repeat(np.arange(10), 20)])
def test_no_class_goes_with_groups_that_are_left_out(group):
    y = np.tile(np.arange(5), 40)
    rows = thinned(group, 20, y)
    assert np.bincount(y[rows]).tolist() == [4] * 5
    assert thinned(group, 20, y).tolist() == rows.tolist()


def test_beyond_its_limit_a_model_learns_from_some_of_each_group(monkeypatch):
    x, y, group = spectra()
    everything = cross_validate(x, y, group, kind="classification", model="knn_plain", folds=5)
    assert everything.thinned == ()
    fitted = fit_model(make_model("knn_plain", "classification"), x, y, group, 16)
    np.testing.assert_array_equal(fitted[-1]._fit_X, x[thinned(group, 16, y)])
    few = replace(MODELS["knn_plain"], most_recordings=16)
    monkeypatch.setitem(MODELS, "knn_plain", few)
    result = cross_validate(x, y, group, kind="classification", model="knn_plain", folds=5)
    assert result.thinned == ((16, 48),) * 5
    assert result.scores.recordings == 60  # all are predicted


def test_a_tuned_model_is_chosen_on_some_and_learns_from_all():
    x, y, group = spectra()
    some = thinned(group, 20, y)
    tuned = make_model("knn", "classification").set_params(search_rows=20)
    fitted = fit_model(tuned, x, y, group)
    alone = fit_model(make_model("knn", "classification"), x[some], y[some], group[some])
    assert fitted.inner_scores_ == alone.inner_scores_
    assert fitted.best_estimator_[-1].n_samples_fit_ == 60
    assert search_result(fitted)[1]["chosen_on"] == 20
    assert "chosen_on" not in search_result(alone)[1]
