"""Probes, retrieval, distances, k-NN and transfer on points whose answers are known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ajgdata.evaluate import distances
from ajgdata.evaluate.distances import mean_distances, precision_at, silhouette
from ajgdata.evaluate.latent_transfer import calibration_draws, transfer_accuracy
from ajgdata.evaluate.probes import Property, probe, probe_within

EVEN, ODD = np.arange(0, 80, 2), np.arange(1, 80, 2)


@pytest.fixture
def plane() -> np.ndarray:
    return np.random.default_rng(0).uniform(-1, 1, (80, 2))


@pytest.mark.parametrize("name", ["linear", "knn"])
def test_a_class_that_a_line_parts_is_read(plane, name):
    points = plane[np.abs(plane[:, 0]) > 0.4]
    value = np.where(points[:, 0] > 0, "right", "left")
    train, test = np.arange(0, len(points), 2), np.arange(1, len(points), 2)
    found = probe(points, Property(value, "classification"), name, train, test)
    assert found["accuracy"] == 1.0
    commonest = "right" if np.mean(value == "right") > 0.5 else "left"
    assert found["chance"] == np.mean(value[test] == commonest)


def test_folds_of_equal_classes_have_their_chance(plane):
    """Each part holds 25 of one class and 15 of the other, and the other part has them the other
    way round: the commonest class of the training part would be right in 15 of 40, in both."""
    value = np.tile(["a", "b"], 40)
    swapped = np.r_[np.arange(0, 50, 2), np.arange(51, 80, 2)]  # 25 a, 15 b
    others = np.setdiff1d(np.arange(80), swapped)
    prop = Property(value, "classification")
    chances = [
        probe(plane, prop, "knn", *parts)["chance"]
        for parts in ((swapped, others), (others, swapped))
    ]
    assert np.mean(chances) == 0.5


@pytest.mark.parametrize("name", ["linear", "knn"])
def test_numbers_are_read_and_noise_is_not(plane, name):
    value = 3 * plane[:, 0] + 5
    found = probe(plane, Property(value, "regression"), name, EVEN, ODD)
    assert found["r2"] > 0.8  # five of 40 neighbours reach 0.2 far, of a spread of 0.6
    assert found["rank_correlation"] > 0.8
    noise = np.random.default_rng(1).normal(size=80)
    found = probe(plane, Property(noise, "regression"), name, EVEN, ODD)
    assert found["r2"] < 0.2
    assert abs(found["rank_correlation"]) < 0.48  # three standard errors of 40 unrelated pairs


def test_a_constant_reading_scores_exactly_nothing(plane):
    """R2 is held against the training mean, so that 0 is what needs no sound."""
    value = np.where(np.arange(80) % 4 < 2, 1.0, 4.0)
    found = probe(np.zeros((80, 2)), Property(value, "regression"), "linear", EVEN, ODD)
    assert found["r2"] == pytest.approx(0, abs=1e-12)
    assert np.isnan(found["rank_correlation"])


def test_an_angle_is_read_across_the_seam():
    angle = np.random.default_rng(0).uniform(-90, 90, 80)
    turn = 2 * np.pi * angle / 180
    space = np.column_stack([np.sin(turn), np.cos(turn)])
    found = probe(space, Property(angle, "regression", 180.0), "linear", EVEN, ODD)
    plain = probe(space, Property(angle, "regression"), "linear", EVEN, ODD)
    assert found["r2"] > 0.98  # the ridge shrinks by 2 of 40 rows' weight: (1 / 21)^2
    assert found["r2"] > plain["r2"] + 0.2


def test_missing_values_are_left_out(plane):
    value = np.where(plane[:, 0] > 0, "right", "left").astype(object)
    value[:10] = ""
    prop = Property(value, "classification")
    everything = probe(plane, prop, "knn", EVEN, ODD)
    assert everything == probe(plane, prop, "knn", EVEN[EVEN >= 10], ODD[ODD >= 10])


def test_one_value_cannot_be_learned(plane):
    found = probe(plane, Property(np.ones(80), "regression"), "knn", EVEN, ODD)
    assert all(np.isnan(score) for score in found.values())


def test_what_means_something_else_for_each_part_is_read_part_by_part():
    """y = x in one part and -x in the other: nothing together, everything apart."""
    x = np.random.default_rng(0).uniform(-1, 1, 80)
    part = np.repeat(["a", "b"], 40)
    value = np.where(part == "a", x, -x)
    prop, group = Property(value, "regression"), np.repeat(np.arange(40), 2)
    apart = probe_within(x[:, None], prop, "linear", part, group, np.arange(80))
    together = probe(x[:, None], prop, "linear", EVEN, ODD)
    assert apart["r2"] > 0.98
    assert together["r2"] < 0.2
    once = np.append(part, "c")  # one grasp of a third: it cannot be held out and learned from
    longer = Property(np.append(value, 0.5), "regression"), "linear", once, np.append(group, 99)
    more = probe_within(np.append(x, 0.0)[:, None], *longer, np.arange(81))
    assert more == apart
    alone = probe_within(np.append(x, 0.0)[:, None], *longer, np.array([80]))
    assert np.isnan(alone["r2"])


def test_precision_by_hand():
    space = np.array([[0.0], [0.1], [1.0], [1.5], [1.2], [9.0]])
    thing = np.array(["a", "a", "a", "a", "b", "b"])
    grasp = np.array(["a1", "a1", "a2", "a3", "b1", "b2"])
    found = precision_at(
        space, thing, grasp, queries=np.array([0]), gallery=np.arange(6), at=(1, 2)
    )
    # without its own grasp: 1.0 (a), 1.2 (b), 1.5 (a), 9.0 (b)
    assert found.precision == (1.0, 0.5)
    assert found.chance == 0.5
    assert found.queries == 1


def test_queries_that_could_not_reach_1_are_left_out():
    space, thing = np.arange(5.0)[:, None], np.array(["a", "a", "a", "b", "b"])
    found = precision_at(
        space, thing, np.arange(5), queries=np.arange(5), gallery=np.arange(5), at=(2,)
    )
    assert found.queries == 3
    with pytest.raises(ValueError, match="no thing has 4"):
        precision_at(space, thing, np.arange(5), queries=np.arange(5), gallery=np.arange(5), at=[4])


@given(seed=st.integers(0, 99))
@settings(max_examples=15, deadline=None, derandomize=True)
def test_random_points_retrieve_by_chance(seed):
    rng = np.random.default_rng(seed)
    thing = np.repeat(np.arange(10), 20)
    found = precision_at(
        rng.normal(size=(200, 3)), thing, np.arange(200),
        queries=np.arange(200), gallery=np.arange(200), at=(10,),
    )  # fmt: skip
    assert found.chance == pytest.approx(19 / 199)
    # 2000 answers, at most as dependent as if each came 4 times: sd sqrt(p q / 500) = 0.013
    assert found.precision[0] == pytest.approx(found.chance, abs=4 * 0.013)


def test_mean_distances_by_hand():
    space = np.array([[0.0], [3.0], [4.0], [10.0]])
    label, names = np.array(["x", "x", "x", "y"]), np.array(["x", "y"])
    grasp = np.array([1, 2, 2, 3])
    found = mean_distances(space, label, names, grasp)
    assert found[0, 0] == (3 + 4) / 2  # not between the second and third: one grasp
    assert found[0, 1] == found[1, 0] == pytest.approx((10 + 7 + 6) / 3)
    assert np.isnan(found[1, 1])  # there is one of y


def test_silhouette_of_far_clusters_is_nearly_1():
    space = np.concatenate([np.zeros((5, 2)), np.full((5, 2), 9.0)])
    assert silhouette(space, np.repeat([0, 1], 5)) == 1.0
    assert np.isnan(silhouette(space, np.zeros(10)))
    assert np.isnan(silhouette(space, np.arange(10)))


def test_a_silhouette_of_some_is_of_all_sessions(monkeypatch):
    """Two things lie apart in the first session, and are exchanged in the second."""
    session, thing = np.repeat([0, 1], 20), np.arange(40) % 2
    space = np.where(session == thing, 0.0, 9.0)[:, None]
    whole = silhouette(space, thing)
    assert whole < 0
    monkeypatch.setattr(distances, "MOST_SILHOUETTE", 20)
    assert silhouette(space, thing) < 0  # of the first session alone it is 1


def test_draws_test_every_grasp_and_never_calibrate_with_it():
    thing = np.repeat(["a", "b"], 12)
    grasp = np.repeat(np.arange(12), 2)
    rows = np.arange(24)
    draws = list(calibration_draws(thing, grasp, rows, 4, seed=0))
    assert len(draws) == 3
    tested = np.concatenate([draw.test for draw in draws])
    assert sorted(tested) == rows.tolist()
    for draw in draws:
        given = np.concatenate(draw.calibration)
        assert not set(grasp[given]) & set(grasp[draw.test])
        for one in draw.calibration:  # a grasp of each thing
            assert sorted(thing[one]) == ["a", "a", "b", "b"]
            assert len(set(grasp[one])) == 2
    with pytest.raises(ValueError, match="has 6 grasps, all needed"):
        list(calibration_draws(thing, grasp, rows, 6, seed=0))


def test_calibration_mends_what_a_shift_breaks():
    """On the other gripper everything lies where another thing lay on the first."""
    thing = np.array(["a", "a", "b", "b", *"aaaabbbb"])
    grasp = np.arange(12)
    space = np.array([0.0, 0.1, 1.0, 1.1, *([1.05] * 4), *([2.0] * 4)])[:, None]
    (draw, *_) = calibration_draws(thing, grasp, np.arange(4, 12), 2, seed=0)
    base = np.arange(4)
    assert transfer_accuracy(space, thing, base, draw, 0) == 0.5
    assert transfer_accuracy(space, thing, base, draw, 1) == 1.0
    assert transfer_accuracy(space, thing, np.zeros(0, int), draw, 1) == 1.0
