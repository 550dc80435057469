"""Groups with planted differences: a gain and an offset per bin, a rotation, or only their labels.

The score of each adaptation is known beforehand. A model is then right almost always, or guesses.
"""

import re

import numpy as np
import pytest
from experiment_samples import measured, numbers, small_inputs, small_store, task_results

from ajgdata.evaluate.agreement import Interval
from ajgdata.evaluate.intervals import clopper_pearson
from ajgdata.evaluate.task_data import TaskData
from ajgdata.evaluate.transfer import (
    Adaptation,
    GroupScores,
    aligned,
    anchors,
    group_scale,
    group_scores,
    labelling_order,
    leave_groups_out,
    standardised,
    whitened_space,
)
from ajgdata.experiments.registry import load_experiment
from ajgdata.experiments.settings import TransferSettings
from ajgdata.experiments.transfer import adaptation_text, chance_verdict, gains
from ajgdata.store.feature_array import frequency_axis
from ajgdata.store.features import FeatureRows, text_column
from ajgdata.types import NotPossibleError

CLASSES = 4
GROUPS = 6
GRASPS = 10  # of each class in each group
BINS = 40
PLAIN = Adaptation(False, 0)
NORMALISED = Adaptation(True, 0)


def fingers(change, seed: int = 0, groups: int = GROUPS, grasps: int = GRASPS):
    """Recordings of four classes on fingers, two a grasp; `change(features, finger)` is of a
    finger. Returns the recordings, and finger and grasp of each."""
    generator = np.random.default_rng(seed)
    pattern = 10 + generator.normal(0, 1, (CLASSES, BINS))
    label = np.tile(np.repeat(np.arange(CLASSES), 2 * grasps), groups)
    finger = np.repeat(np.arange(groups), CLASSES * 2 * grasps)
    grasp = np.arange(len(label)) // 2
    feature = pattern[label] + generator.normal(0, 0.3, (grasp.max() + 1, BINS))[grasp]
    feature += generator.normal(0, 0.05, feature.shape)
    for number in range(groups):
        feature[finger == number] = change(feature[finger == number], number)
    names = np.array([f"r{n}" for n in range(len(label))])
    group = np.array([f"g{n:03d}" for n in grasp])
    data = TaskData(feature.astype(np.float32), np.array(list("abcd"))[label], group, names)
    return data, np.array([f"finger {n}" for n in finger]), group


def gain_and_offset(feature: np.ndarray, finger: int) -> np.ndarray:
    """Each bin of a finger has its own gain, a factor of up to 20, and its own offset."""
    generator = np.random.default_rng([7, finger])
    gain = np.exp(generator.uniform(-1.5, 1.5, BINS))
    return gain * feature + generator.uniform(0, 50, BINS)


def rotation(feature: np.ndarray, finger: int) -> np.ndarray:
    """The last finger exchanges bins, so its patterns are those of no other finger."""
    if finger < GROUPS - 1:
        return feature
    return feature[:, np.random.default_rng(3).permutation(BINS)]


def transferred(recordings, adaptations, sizes=(GROUPS - 1,), **changes):
    """Points of logistic regression by adaptation."""
    settings = {"kind": "classification", "model": "linear_plain", "repeats": 2}
    points = leave_groups_out(
        *recordings, sizes=sizes, adaptations=adaptations, **settings | changes
    )
    return {a: [p for p in points if p.adaptation == a] for a in adaptations}


def accuracy(points) -> float:
    return float(np.mean([point.scores["accuracy"] for point in points]))


def test_normalisation_undoes_a_gain_and_an_offset_of_each_bin():
    """Without it, a new finger is almost a guess (25 %). Within a finger, the classes are clear."""
    points = transferred(fingers(gain_and_offset), (PLAIN, NORMALISED))
    assert accuracy(points[PLAIN]) < 0.5
    assert accuracy(points[NORMALISED]) > 0.98
    assert {point.chance["accuracy"] for point in points[PLAIN]} == {1 / CLASSES}


def test_a_finger_without_differences_needs_no_adaptation():
    points = transferred(fingers(lambda feature, _: feature), (PLAIN, NORMALISED))
    assert accuracy(points[PLAIN]) == 1
    assert accuracy(points[NORMALISED]) > 0.98


def test_z_scores_are_the_same_for_any_gain_and_offset():
    """(g x + b - (g m + b)) / (g s) = (x - m) / s; a constant bin is 0."""
    data, finger, _ = fingers(lambda feature, _: feature)
    feature = data.feature.astype(float)
    changed = feature.copy()
    for number, name in enumerate(np.unique(finger)):
        changed[finger == name] = gain_and_offset(changed[finger == name], number)
    np.testing.assert_allclose(
        standardised(changed, finger), standardised(feature, finger), atol=1e-9
    )
    changed[:, 3] = 5.0
    assert not standardised(changed, finger)[:, 3].any()


def test_normalised_features_have_the_scale_of_the_training_groups():
    """Two groups with means 1 and 3, and deviations 1 and 2: together mean 2 and deviation 1.5."""
    feature = np.array([[0.0], [2], [1], [5], [100], [300]])
    group = np.array(["a", "a", "b", "b", "new", "new"])
    scale = group_scale(feature, group, np.array(["a", "b"]))
    restored = scale.restored(standardised(feature, group))
    np.testing.assert_allclose(restored[:, 0], [0.5, 3.5] * 3)


def test_alignment_undoes_exchanged_bins_and_normalisation_does_not():
    aligned_12 = Adaptation(False, 12)
    adaptations = (PLAIN, NORMALISED, aligned_12)
    points = transferred(fingers(rotation), adaptations, repeats=4)
    new = {
        a: accuracy([p for p in points[a] if p.left_out == f"finger {GROUPS - 1}"])
        for a in adaptations
    }
    assert new[PLAIN] < 0.6
    assert new[NORMALISED] < 0.6
    assert new[aligned_12] > 0.98
    others = [p for p in points[aligned_12] if p.left_out != f"finger {GROUPS - 1}"]
    assert accuracy(others) > 0.98


def test_a_planted_affine_map_is_found():
    """Three classes at the corners of a triangle; the new finger turns it by 120 degrees, so that
    each class has the place of the next, and shifts it. Six grasps bring all recordings back."""
    corner = np.exp(2j * np.pi * np.arange(3) / 3)
    label = np.tile(np.arange(3), 40)
    noise = 0.05 * np.random.default_rng(0).normal(size=(2, len(label)))
    place = corner[label] + noise[0] + 1j * noise[1]
    turned = place * corner[1] + 3 - 1j
    known = np.stack([place.real, place.imag], axis=1)
    own = np.stack([turned.real, turned.imag], axis=1)
    target = anchors(label[:6], known, label, "classification")
    space = whitened_space(own, known, label, "classification")
    result = aligned(own, own[:6], target, space)
    assert np.abs(result - known).max() < 0.1
    shifted = aligned(own, own[:2], target[:2], space)  # too few grasps for more than a shift
    np.testing.assert_allclose(shifted, own + (target[:2] - own[:2]).mean(axis=0), rtol=1e-5)


def test_no_map_is_chosen_if_the_groups_are_equal():
    """The labelled grasps are the anchors themselves: any map would only be worse."""
    label = np.tile(np.arange(4), 10)
    known = np.random.default_rng(1).normal(size=(40, 30))
    target = anchors(np.arange(4), known, label, "classification")
    space = whitened_space(known, known, label, "classification")
    assert aligned(known, target, target, space) is known


def test_coordinates_have_unit_variance_within_classes():
    """Grasps scatter by 0.1 in one bin and by 10 in the other, and classes differ by 20."""
    generator = np.random.default_rng(0)
    label = np.repeat([0, 1], 500)
    known = generator.normal(0, [0.1, 10], (1000, 2)) + 20 * label[:, None]
    space = whitened_space(known, known, label, "classification")
    inside = (known - 20 * label[:, None]) @ space.project
    np.testing.assert_allclose(np.cov(inside.T), np.eye(2), atol=0.1)
    np.testing.assert_allclose(space.project @ space.restore, np.eye(2), atol=1e-9)


def test_the_anchor_of_a_number_is_the_mean_of_the_recordings_with_the_nearest_values():
    value = np.repeat([10.0, 20, 30, 40, 50], 4)
    known = np.outer(value, [1.0, 2.0])
    means = anchors(np.array([20.0, 48]), known, value, "regression")
    np.testing.assert_allclose(means, [[20, 40], [50, 100]])
    angle = np.array([0.0, 60, 120])
    means = anchors(np.array([170.0]), np.eye(3), angle, "regression", period=180)
    np.testing.assert_allclose(means, [[1, 0, 0]])
    assert np.isnan(
        anchors(np.array(["x"]), np.eye(2), np.array(["a", "b"]), "classification")
    ).all()


def test_a_class_that_is_not_in_the_training_groups_aligns_nothing():
    feature = np.random.default_rng(0).normal(size=(10, 4)).astype(np.float32)
    missing = np.full((2, 4), np.nan)
    space = whitened_space(feature, feature, np.arange(10) % 2, "classification")
    assert aligned(feature, feature[:2], missing, space) is feature


@pytest.mark.parametrize("adaptation", [PLAIN, NORMALISED, Adaptation(False, 8)])
def test_labels_that_only_depend_on_the_finger_do_not_transfer(adaptation):
    """Nothing but the finger is in the sound, and each finger has mostly one class. A random split
    would be right for most recordings; a new finger is a guess."""
    generator = np.random.default_rng(5)
    finger = np.repeat(np.arange(8), 40)
    common = np.where(
        generator.random(len(finger)) < 0.7, finger % 2, generator.integers(0, 2, 320)
    )
    feature = generator.normal(0, 1, (8, BINS))[finger] + generator.normal(0, 0.1, (320, BINS))
    grasp = np.array([f"g{n:03d}" for n in range(320)])
    data = TaskData(10 + feature, np.array(["a", "b"])[common], grasp, grasp)
    points = transferred((data, finger.astype(str), grasp), (PLAIN, adaptation), sizes=(7,))
    result = group_scores(points[adaptation], "classification")
    assert abs(result.value - 0.5) < 0.12
    assert chance_verdict(result, None, "accuracy") != "better than chance"


def test_each_size_and_group_is_drawn_and_all_adaptations_are_scored_on_the_same_recordings():
    adaptations = (PLAIN, NORMALISED, Adaptation(False, 3), Adaptation(True, 5))
    recordings = fingers(gain_and_offset, groups=4)
    points = transferred(recordings, adaptations, sizes=(1, 3), repeats=3, model="knn_plain")
    for own in points.values():
        assert len(own) == 4 * 2 * 3
        assert {(p.training_groups, p.draw) for p in own} == {
            (n, d) for n in (1, 3) for d in range(3)
        }
    for same in zip(*points.values(), strict=True):
        assert len({p.grasp.tobytes() for p in same}) == 1
        # 40 grasps of a finger, five of which are labelled, two recordings each
        assert {len(p.y_true) for p in same} == {70}
    alone = transferred(recordings, (PLAIN,), sizes=(3,), repeats=3)[PLAIN]
    assert [(p.draw, len(p.y_true)) for p in alone] == [(0, 80)] * 4


def test_labels_of_scored_grasps_change_no_prediction(monkeypatch):
    """Six grasps are labelled, and never scored. All other labels of the new finger are replaced,
    and every prediction for it stays."""
    monkeypatch.setattr(
        "ajgdata.evaluate.transfer.labelling_order", lambda value, grasp, *_: np.unique(grasp)[::7]
    )
    data, finger, grasp = fingers(rotation)
    adaptations = (PLAIN, Adaptation(False, 6), Adaptation(True, 6))
    points = transferred((data, finger, grasp), adaptations)
    for number in (0, GROUPS - 1):
        own = np.unique(grasp[finger == f"finger {number}"])
        is_labelled = np.isin(grasp, own[::7])
        wrong = np.where((finger == f"finger {number}") & ~is_labelled, "a", data.value)
        changed = transferred((data._replace(value=wrong), finger, grasp), adaptations)
        for adaptation in adaptations:
            before = points[adaptation][2 * number]
            after = changed[adaptation][2 * number]
            assert before.left_out == after.left_out == f"finger {number}"
            assert np.array_equal(np.setdiff1d(own, before.grasp), own[::7])
            assert np.array_equal(before.y_pred, after.y_pred)
            assert set(after.y_true) == {"a"}


def test_a_grasp_of_two_fingers_is_not_trained_on():
    """Each recording has a bin of its own grasp, the only sign of its class. A grasp was recorded
    by two fingers: a model that was trained on the other finger would know it."""
    generator = np.random.default_rng(0)
    label = np.array(list("ab"))[generator.integers(0, 2, 60)]
    feature = np.tile(np.eye(60), (2, 1)) * 10 + 1
    both = np.tile(label, 2)
    grasp = np.tile([f"g{n:02d}" for n in range(60)], 2)
    grasp[50:60] = [f"only {n}" for n in range(10)]  # a few grasps remain to train on
    grasp[110:] = [f"other {n}" for n in range(10)]
    finger = np.repeat(["left", "right"], 60)
    data = TaskData(feature, both, grasp, grasp)
    points = transferred((data, finger, grasp), (PLAIN,), sizes=(1,), model="knn_plain")[PLAIN]
    for point in points:
        shared = np.char.startswith(point.grasp, "g")
        assert (point.y_pred == point.y_true)[shared].mean() < 0.75


def test_labelled_grasps_cover_the_classes_in_turn():
    label = np.repeat(["a", "b", "c"], 10)
    grasp = np.array([f"g{n:02d}" for n in range(30)])
    classes = dict(zip(grasp.tolist(), label.tolist(), strict=True))
    order = labelling_order(label, grasp, "classification", np.random.default_rng(0))
    assert sorted(order) == sorted(grasp)
    for start in range(0, 30, 3):
        assert {classes[name] for name in order[start : start + 3].tolist()} == {"a", "b", "c"}
    value = np.arange(30.0)
    order = labelling_order(value, grasp, "regression", np.random.default_rng(0))
    eighths = {int(int(name[1:]) / 29 * 7.999) for name in order[:8].tolist()}
    assert len(eighths) == 8


def test_a_regression_is_aligned_and_normalised():
    """Positions in cm; each finger has its own gain per bin."""
    generator = np.random.default_rng(2)
    position = np.tile(np.linspace(0, 9, 40), 5)
    finger = np.repeat(np.arange(5), 40)
    feature = 10 + np.outer(position, generator.normal(0, 1, BINS))
    feature += generator.normal(0, 0.2, feature.shape)
    for number in range(5):
        feature[finger == number] = gain_and_offset(feature[finger == number], number)
    grasp = np.array([f"g{n:03d}" for n in range(200)])
    data = TaskData(feature, position, grasp, grasp)
    adaptations = (PLAIN, NORMALISED, Adaptation(True, 5))
    points = transferred((data, finger.astype(str), grasp), adaptations, (4,), kind="regression")
    rmse = {a: np.mean([p.scores["rmse"] for p in own]) for a, own in points.items()}
    assert rmse[PLAIN] > 2  # a guess has 2.7
    assert rmse[NORMALISED] < 0.5
    assert rmse[Adaptation(True, 5)] < 0.6


# Intervals and verdicts


def test_the_interval_over_groups_is_that_of_folds():
    """Accuracies 0.5, 0.6, 0.7 of three groups: t(2) sqrt((1/3 + 1/2) 0.01) = 0.393."""
    points = [
        point
        for number, correct in enumerate((10, 12, 14))
        for point in [_point(f"finger {number}", correct, 20)]
    ]
    result = group_scores(points, "classification")
    assert result.value == pytest.approx(0.6)
    assert result.over_groups == pytest.approx((0.6 - 0.393, 0.6 + 0.393), abs=1e-3)
    assert result.interval.low <= result.over_grasps.low
    assert result.interval.high >= result.over_groups.high


def _point(name: str, correct: int, count: int, training_groups: int = 2):
    from ajgdata.evaluate.transfer import TransferPoint

    truth = np.repeat(["a"], count)
    predicted = np.where(np.arange(count) < correct, "a", "b")
    grasp = np.array([f"{name}/{n}" for n in range(count)])
    scores = {"accuracy": correct / count}
    chance = {"accuracy": 0.5}
    return TransferPoint(name, training_groups, 0, PLAIN, truth, predicted, grasp, scores, chance)


def test_groups_that_are_all_right_have_the_interval_over_grasps():
    """All folds are equal, so a further group is not known: 60 of 60 grasps bound the score."""
    result = group_scores([_point(f"f{n}", 20, 20) for n in range(3)], "classification")
    assert not result.over_groups.is_defined
    assert result.interval == pytest.approx(clopper_pearson(60, 60))


@pytest.mark.parametrize(
    ("interval", "placebo", "verdict"),
    [
        (Interval(0.6, 0.9), None, "better than chance"),
        (Interval(0.4, 0.9), None, "inconclusive"),
        (Interval(0.1, 0.4), None, "worse than chance"),
        (Interval(np.nan, np.nan), None, "inconclusive"),
        (Interval(0.6, 0.9), Interval(0.55, 0.8), "inconclusive"),
        (Interval(0.6, 0.9), Interval(0.48, 0.52), "better than chance"),
    ],
)
def test_the_verdict_compares_with_chance_and_with_the_placebo(interval, placebo, verdict):
    def scores(own: Interval) -> GroupScores:
        return GroupScores({}, float(np.mean(own)), own, own, 0.5)

    control = None if placebo is None else scores(placebo)
    assert chance_verdict(scores(interval), control, "accuracy") == verdict


# The experiment


def store_of_fingers(change, **options) -> FeatureRows:
    """A feature file of `fingers`, with the column `finger`."""
    data, finger, grasp = fingers(change, **options)
    columns = {
        "recording": text_column([f"{f}/{n}" for f, n in zip(finger, data.name, strict=True)]),
        "grasp_id": text_column(grasp.tolist()),
        "object": text_column(data.value.tolist()),
        "session_id": text_column([f"s {name}" for name in finger]),
        "finger": text_column(finger.tolist()),
    }
    return FeatureRows(
        data.feature, (frequency_axis(np.arange(float(BINS))),), columns, small_store().attrs
    )


SETTINGS = {"leave_out": "finger", "groups": [2], "align": [0, 4], "repeats": 2}


@pytest.fixture(scope="module")
def outcomes():
    inputs = small_inputs(store=store_of_fingers(gain_and_offset))
    return {m: measured("transfer", inputs, m, **SETTINGS) for m in ("linear_plain", "knn_plain")}


def test_numbers_have_columns(outcomes):
    tables = outcomes["linear_plain"].tables
    identity = {"split": "leave one finger out", "condition": "5 training groups", "grasps": 0}
    normalised = {**identity, "comparison": "normalised per group", "metric": "accuracy"}
    per_group = [numbers(tables, **normalised, statistic=f"group finger {n}")[0] for n in range(6)]
    assert numbers(tables, **normalised, statistic="mean") == [pytest.approx(np.mean(per_group))]
    assert min(per_group) > 0.9
    (low,) = numbers(tables, **normalised, statistic="grasp low")  # no group has another score
    assert clopper_pearson(216, 216).low <= low <= clopper_pearson(240, 240).low
    assert numbers(tables, **normalised, statistic="chance") == [0.25]
    scores = next(table for table in tables if table.name == "scores")
    assert set(scores.column("condition")) == {"2 training groups", "5 training groups"}
    assert set(scores.column("grasps")) == {0, 4}
    keys = [tuple(v for k, v in row.items() if k != "value") for row in scores.rows]
    assert len(set(keys)) == len(keys)


def test_the_page_states_the_finding_and_the_corrected_gains(outcomes):
    results = task_results("transfer", outcomes, settings=SETTINGS)
    experiment = load_experiment("transfer")
    means, groups = experiment.figures(results)
    assert re.fullmatch(
        r"Logistic regression, plain, new finger: \d+ %, normalised, aligned with 4 grasps "
        r"\d+ % \(better\)",
        means.title,
    )
    assert re.fullmatch(
        r"Logistic regression, plain, normalised, aligned with 4 grasps: "
        r"\d+ % on finger \d to \d+ % on finger \d",
        groups.title,
    )
    text = experiment.summary(results)
    assert "logistic regression, plain, normalised: gain" in text
    assert "p is corrected for all gains on this page (Holm)." in text
    described = gains(results)
    assert len(described) == 2 * 3
    by_name = {(gain.model, gain.adaptation): gain for gain in described}
    gain = by_name["logistic regression, plain", "normalised"]
    assert gain.verdict == "better"
    assert gain.interval.low > 0
    uncorrected = outcomes["linear_plain"].tables[-1].where(adaptation=gain.adaptation).rows[0]["p"]
    assert uncorrected <= gain.p <= 6 * uncorrected
    assert len(list(experiment.rows(results))) == 2 * 4 * 2


def test_a_small_gain_of_few_groups_is_inconclusive(outcomes):
    inputs = small_inputs(store=store_of_fingers(lambda x, _: x, groups=3, grasps=4, seed=3))
    outcome = measured("transfer", inputs, "knn_plain", leave_out="finger", align=[0, 1])
    results = task_results(
        "transfer", {"knn_plain": outcome}, settings={"leave_out": "finger", "align": [0, 1]}
    )
    assert {gain.verdict for gain in gains(results)} <= {"inconclusive", "no difference"}


def test_a_single_number_of_groups_is_drawn_as_rows():
    inputs = small_inputs(store=store_of_fingers(gain_and_offset, groups=3))
    outcome = measured("transfer", inputs, "knn_plain", leave_out="session_id")
    results = task_results("transfer", {"knn_plain": outcome}, settings={"leave_out": "session_id"})
    figures = load_experiment("transfer").figures(results)
    assert len(figures) == 2
    assert figures[0].title.startswith("k-NN, plain, new session:")


def test_the_placebo_of_the_data_set_is_measured_with_the_same_groups():
    """One object under two names: nothing distinguishes them, on any finger."""
    store = store_of_fingers(lambda feature, _: feature)
    generator = np.random.default_rng(0)
    names = store.columns["object"].values
    placebo = np.where(generator.random(len(names)) < 0.5, "p1", "p2")
    placebo = placebo[np.unique(store.columns["grasp_id"].values, return_inverse=True)[1]]
    columns = {
        **store.columns,
        "object": text_column(np.where(names == "d", placebo, names).tolist()),
    }
    inputs = small_inputs(
        store=FeatureRows(store.feature, store.axes, columns, store.attrs),
        placebo_objects=("p1", "p2"),
    )
    outcome = measured("transfer", inputs, "linear_plain", leave_out="finger")
    (row, _) = outcome.tables[2].rows
    assert row["value"] == 1
    assert abs(row["placebo"] - 0.5) < 0.15
    assert row["verdict"] == "better than chance"
    assert numbers(outcome.tables, target_values="placebo", statistic="mean")


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"leave_out": "nothing"}, "experiments.transfer.leave_out: there is no column 'nothing'"),
        ({"groups": [6]}, "6 training groups: there are 6, and one is left out; lower experiments"),
        ({"align": [0, 40]}, "40 labelled grasps: the group 'finger 0' has 40, and some must be"),
    ],
)
def test_settings_that_the_data_do_not_allow_are_named(settings, message):
    inputs = small_inputs(store=store_of_fingers(lambda feature, _: feature))
    with pytest.raises(NotPossibleError, match=re.escape(message)):
        measured("transfer", inputs, "knn_plain", **{"leave_out": "finger", **settings})


def test_groups_that_are_in_every_left_out_group_leave_nothing_to_train_on():
    data, finger, grasp = fingers(lambda feature, _: feature, groups=2)
    tap = data._replace(group=np.array([str(n % 20) for n in range(len(finger))]))
    with pytest.raises(NotPossibleError, match="each of the task's groups also has recordings"):
        leave_groups_out(
            tap,
            finger,
            grasp,
            kind="classification",
            model="knn_plain",
            sizes=[1],
            adaptations=[Adaptation(False, 0)],
        )


def test_sessions_of_one_object_each_cannot_be_trained_on():
    data, finger, grasp = fingers(lambda feature, _: feature, groups=4)
    confounded = data._replace(value=finger)
    with pytest.raises(NotPossibleError, match="fewer than two values of the target"):
        transferred((confounded, finger, grasp), (PLAIN,), sizes=(1,))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"normalise": ["group"]}, "normalise must list none"),
        ({"align": [4]}, "align must list 0"),
        ({"normalise": ["sessions"]}, "none"),
    ],
)
def test_settings_need_what_gains_are_measured_against(settings, message):
    with pytest.raises(ValueError, match=message):
        TransferSettings.model_validate({"leave_out": "finger", **settings})


def test_adaptations_have_names():
    assert adaptation_text(PLAIN) == "unchanged"
    assert adaptation_text(Adaptation(False, 1)) == "aligned with 1 grasp"
