"""A model learns from no more recordings than its limit, evenly of groups, and it is told."""

import numpy as np
import pytest
from experiment_samples import measured, small_inputs
from scipy.spatial.distance import cdist
from sklearn.neighbors import KNeighborsClassifier, KNeighborsRegressor
from sklearn.svm import SVC, SVR

from ajgdata.evaluate import distances
from ajgdata.evaluate.crossval import cross_validate
from ajgdata.models import fit_model, limits, make_model, tuning
from ajgdata.types import MODELS


def spectra(groups=20, each=3):
    group = np.repeat(np.arange(groups), each)
    y = np.array(list("ab"))[group % 2]
    generator = np.random.default_rng(0)
    x = generator.normal(size=(len(y), 8)) ** 2 + (group % 2)[:, None]
    return x.astype(np.float32), y, group


@pytest.mark.parametrize("most", [1, 3, 4, 9, 10, 14])
def test_rows_are_left_out_of_the_largest_groups_first(most):
    groups = np.random.default_rng(1).permutation(np.repeat([3, 1, 4, 5], [1, 2, 5, 6]))
    rows = limits.thinned(groups, most)
    assert len(rows) == len(set(rows.tolist())) == most
    assert (np.diff(rows) > 0).all()
    had, kept = (np.bincount(some, minlength=6)[[3, 1, 4, 5]] for some in (groups, groups[rows]))
    # a group from which something is missing is as large as any other, but for the last round
    assert (kept[kept < had] >= kept.max() - 1).all()


def test_more_groups_than_rows_leave_groups_evenly_spaced():
    assert limits.thinned(np.arange(12), 4).tolist() == [0, 3, 6, 9]


@pytest.mark.parametrize("kind, period", [("classification", None), ("regression", 3.0)])
def test_limits_reach_through_scalings_and_targets_that_repeat(kind, period):
    classes = kind == "classification"
    for name, of in (
        ("knn_plain", KNeighborsClassifier if classes else KNeighborsRegressor),
        ("svm_plain", SVC if classes else SVR),
    ):
        assert limits.most_recordings(make_model(name, kind, period=period)) == limits.MOST[of]
    assert limits.most_recordings(make_model("ridge_plain", kind, period=period)) is None


def test_every_model_but_those_that_cost_as_much_a_recording_has_a_limit():
    free = {"linear_plain", "ridge_plain", "forest", "boosting"}
    tuned = {name for name in MODELS.names() if MODELS[name].plain}
    for name in set(MODELS.names()) - free - tuned:
        assert limits.most_recordings(make_model(name, "classification")), name


def test_beyond_its_limit_a_model_learns_from_some_of_each_group(monkeypatch):
    x, y, group = spectra()
    everything = cross_validate(x, y, group, kind="classification", model="knn_plain", folds=5)
    assert everything.thinned == ()
    monkeypatch.setitem(limits.MOST, KNeighborsClassifier, 16)
    fitted = fit_model(make_model("knn_plain", "classification"), x, y, group)
    np.testing.assert_array_equal(fitted[-1]._fit_X, x[limits.thinned(group, 16)])
    found = cross_validate(x, y, group, kind="classification", model="knn_plain", folds=5)
    assert found.thinned == ((16, 48),) * 5
    assert found.scores.recordings == 60  # all are predicted


def test_a_tuned_model_is_chosen_on_some_and_learns_from_all(monkeypatch):
    x, y, group = spectra()
    monkeypatch.setattr(tuning, "MOST_TO_CHOOSE", 20)
    some = limits.thinned(group, 20)
    fitted = fit_model(make_model("knn", "classification"), x, y, group)
    alone = fit_model(make_model("knn", "classification"), x[some], y[some], group[some])
    assert fitted.inner_scores_ == alone.inner_scores_
    assert fitted.best_estimator_[-1].n_samples_fit_ == 60


def test_metrics_say_on_how_many_of_how_many(monkeypatch):
    inputs = small_inputs()
    monkeypatch.setitem(limits.MOST, KNeighborsClassifier, 6)
    monkeypatch.setitem(limits.MOST, KNeighborsRegressor, 6)
    scores = measured("cross_validation", inputs, model="knn_plain").tables[0]
    told = {r["metric"]: r["value"] for r in scores.where(part="training of grouped").rows}
    assert told["trained_on"] == 6 < told["available"]


def test_blocks_of_distances_are_all_distances(monkeypatch):
    generator = np.random.default_rng(2)
    space, thing = generator.normal(size=(30, 4)), np.repeat(np.arange(5), 6)
    grasp, rows = np.arange(30) // 2, np.arange(30)
    named = {"queries": rows, "gallery": rows, "at": (1, 3)}
    whole = distances.precision_at(space, thing, grasp, **named)
    means = distances.mean_distances(space, thing, np.arange(5), grasp)
    monkeypatch.setattr(distances, "BLOCK", 70)  # two rows at once
    assert distances.precision_at(space, thing, grasp, **named) == whole
    np.testing.assert_allclose(
        distances.mean_distances(space, thing, np.arange(5), grasp), means, rtol=1e-13
    )
    two = cdist(space[:6], space[6:12]).mean()  # of other things, hence of other grasps
    assert means[0, 1] == pytest.approx(two, rel=1e-13)
