"""`balance`, `by_confidence` and `map` of a task: known answers and messages."""

import dataclasses

import numpy as np
import pytest
from experiment_samples import measured, small_inputs, task_results
from pydantic import ValidationError

from ajgdata.evaluate.calibration import accuracy_of_most_confident
from ajgdata.evaluate.splits import balanced_folds, balanced_rows, grouped_folds
from ajgdata.evaluate.task_data import TaskData
from ajgdata.evaluate.transfer import Adaptation, leave_groups_out
from ajgdata.experiments.cross_validation import EXPERIMENT
from ajgdata.experiments.cross_validation_results import confidence_finding, confidence_table
from ajgdata.experiments.requests import requested_experiments
from ajgdata.experiments.surface_map import points_of
from ajgdata.report.canvas import styled
from ajgdata.report.surface_map import SurfacePoint
from ajgdata.store.features import text_column
from ajgdata.types import DatasetSpec, NotPossibleError

#: 60 recordings of three classes (36, 18 and 6), three of each grasp.
LABELS = np.repeat(["a", "b", "c"], [36, 18, 6])
GRASPS = np.arange(60) // 3


def test_each_class_has_as_many_training_recordings_as_the_smallest_of_as_many_grasps():
    folds = grouped_folds(LABELS, GRASPS, "classification", folds=2)
    for (train, test), (all_rows, same_test) in zip(
        balanced_folds(folds, LABELS, GRASPS), folds, strict=True
    ):
        counts = np.unique(LABELS[train], return_counts=True)[1]
        smallest = np.unique(LABELS[all_rows], return_counts=True)[1].min()
        assert counts.tolist() == [smallest] * 3
        assert set(train) <= set(all_rows) and np.array_equal(test, same_test)
        # of the class a, 6 grasps or more are in the training part: no grasp is drawn twice
        assert len(np.unique(GRASPS[train][LABELS[train] == "a"])) == smallest
    assert balanced_rows(LABELS, GRASPS).tolist() == sorted(set(balanced_rows(LABELS, GRASPS)))


def test_a_guess_of_a_balanced_training_part_is_no_better_than_chance():
    """75 % of the recordings have one class, so a guess is right for 75 %, and balanced for 1/2."""
    label = np.array(["a", "b", "b", "b"] * 12)
    finger = np.repeat(["1", "2"], 24)
    grasp = np.array([str(n) for n in range(48)])
    data = TaskData(np.random.default_rng(0).normal(size=(48, 5)), label, grasp, grasp)
    settings = {"kind": "classification", "model": "knn_plain", "sizes": [1]}
    for is_balanced, chance in ((False, 0.75), (True, 0.5)):
        points = leave_groups_out(
            data,
            finger,
            grasp,
            adaptations=[Adaptation(False, 0)],
            balance=is_balanced,
            **settings,
        )
        assert [point.chance["accuracy"] for point in points] == [chance, chance]


def imbalanced(**settings):
    """The sample task with half of the grasps of two of three classes."""
    inputs = small_inputs(**settings)
    objects = inputs.store.columns["object"].values
    number = np.array([int(name[3:]) for name in inputs.store.columns["grasp_id"].values])
    is_used = (objects == "rod") | (number % 2 == 0)
    columns = {
        key: dataclasses.replace(column, values=column.values[is_used])
        for key, column in inputs.store.columns.items()
    }
    store = dataclasses.replace(
        inputs.store, feature=inputs.store.feature[is_used], columns=columns
    )
    return dataclasses.replace(inputs, store=store)


def test_all_splits_of_a_balanced_task_train_on_balanced_parts():
    for is_balanced, chance in ((False, 0.5), (True, 1 / 3)):
        settings = {"balance": True} if is_balanced else {}
        outcome = measured(
            "cross_validation", imbalanced(**settings), "knn_plain", compare_random=True
        )
        scores = outcome.tables[0].where(metric="accuracy", statistic="chance")
        for row in scores.rows:  # 20 of 40 recordings are rods, and a guess of equal classes: balls
            assert row["value"] == pytest.approx(chance, abs=0.06), row["split"]
        # all recordings are tested
        assert outcome.about["parts"]["grouped"]["recordings"] == 40


def test_accuracy_of_most_confident_is_that_of_the_most_confident_predictions():
    confidence = np.array([0.9, 0.6, 0.8, 0.7])
    is_correct = np.array([True, False, True, False])
    assert accuracy_of_most_confident(
        confidence, is_correct, [0.25, 0.5, 0.75, 1]
    ) == pytest.approx([1, 1, 2 / 3, 1 / 2])
    # equal confidence says nothing: the accuracy does not depend on the share or the order
    equal = np.full(4, 0.5)
    for order in ([0, 1, 2, 3], [1, 3, 0, 2]):
        assert accuracy_of_most_confident(equal, is_correct[order], [0.1, 0.6, 1]) == pytest.approx(
            [0.5, 0.5, 0.5]
        )


def mapped():
    """Inputs and results with a map: both recordings of a grasp have the position of the grasp."""
    inputs = small_inputs(map=("x", "y"), by_confidence=True)
    number = [int(name[3:]) for name in inputs.store.columns["grasp_id"].values]
    columns = {
        **inputs.store.columns,
        "x": text_column([str(0.01 * (n % 6)) for n in number]),
        "y": text_column([str(0.01 * (n // 6)) for n in number]),
    }
    return dataclasses.replace(inputs, store=dataclasses.replace(inputs.store, columns=columns))


def test_the_map_has_a_point_per_position_with_its_most_frequent_prediction():
    outcome = measured("cross_validation", mapped(), "knn_plain")
    results = task_results(
        "cross_validation", {"knn_plain": outcome}, dataset="d", map=("x", "y"), by_confidence=True
    )
    points = points_of(results, "knn_plain")
    assert list(points) == ["s"] and len(points["s"]) == 30
    assert points["s"][7] == SurfacePoint(0.01, 0.01, "box", points["s"][7].predicted)
    figures = {figure.name: figure for figure in EXPERIMENT.figures(results)}
    (name,) = [name for name in figures if "--map--knn_plain" in name]
    right = sum(point.true == point.predicted for point in points["s"])
    assert figures[name].title == f"k-NN, plain: {100 * right / 30:.3g} % of 30 points are correct"
    (panel,) = styled(figures[name].draw)().axes
    squares, dots = panel.collections
    assert np.allclose(squares.get_offsets(), [(p.x, p.y) for p in points["s"]])
    is_equal = (squares.get_facecolors() == dots.get_facecolors()).all(axis=1)
    assert is_equal.tolist() == [p.true == p.predicted for p in points["s"]]


def test_the_figure_of_confidence_ends_at_the_accuracy_of_all_predictions():
    outcome = measured("cross_validation", mapped(), "knn_plain")
    results = task_results(
        "cross_validation", {"knn_plain": outcome}, dataset="d", map=("x", "y"), by_confidence=True
    )
    table = confidence_table(results)
    pooled = outcome.tables[0].where(metric="accuracy", statistic="pooled", split="grouped")
    assert table.rows[-1]["kept"] == 1
    assert table.rows[-1]["accuracy"] == pytest.approx(pooled.numbers("value")[0])
    assert confidence_finding(results).startswith("k-NN, plain: accuracy ")
    assert any(figure.name.endswith("--confidence") for figure in EXPERIMENT.figures(results))
    silent = task_results("cross_validation", {"knn_plain": outcome}, dataset="d")
    assert confidence_table(silent).rows == ()
    assert not any("--map" in figure.name for figure in EXPERIMENT.figures(silent))


def test_positions_must_be_columns_of_numbers():
    inputs = small_inputs(map=("x", "object"))
    with pytest.raises(NotPossibleError, match="map: there is no column 'x'; add it, or remove"):
        measured("cross_validation", inputs, "knn_plain")
    inputs = small_inputs(map=("object", "object"))
    with pytest.raises(NotPossibleError, match="map: column 'object' has cells that are not num"):
        measured("cross_validation", inputs, "knn_plain")


def spec(kind="classification", **task):
    return DatasetSpec.model_validate(
        {"name": "d", "targets": {"t": {"kind": kind}}, "tasks": {"t": {"target": "t", **task}}}
    )


@pytest.mark.parametrize(
    ("key", "value"), [("balance", True), ("by_confidence", True), ("map", ["x", "y"])]
)
def test_the_settings_are_for_classes(key, value):
    assert getattr(spec(**{key: value}).task_settings("t"), key)
    assert key not in spec().task_settings("t").model_fields_set  # results are unchanged
    with pytest.raises(ValidationError, match=f"task t: {key} is not for a regression"):
        spec("regression", **{key: value})


def test_an_experiment_that_does_not_balance_is_refused():
    curve = {"learning_curve": {"groups": [1, 2]}}
    with pytest.raises(ValueError, match="learning_curve does not balance classes: use a task"):
        requested_experiments(spec(balance=True, experiments=curve), "t")
    transfer = {"transfer": {"leave_out": "finger"}}
    assert len(requested_experiments(spec(balance=True, experiments=transfer), "t")) == 2
