"""Targets of several columns: errors by axis and in Euclidean distance, with known answers."""

from dataclasses import replace

import numpy as np
import pytest
from sklearn.linear_model import LinearRegression
from test_cross_validation import inputs, measured
from test_cross_validation import store as recordings
from worlds import Project

import ajgdata
from ajgdata.evaluate import in_use, metrics
from ajgdata.evaluate.crossval import cross_validate
from ajgdata.evaluate.splits import placement_folds
from ajgdata.evaluate.task_data import task_data
from ajgdata.loading import read_predictor
from ajgdata.paths import Paths
from ajgdata.pipeline.train import train_model
from ajgdata.store.features import FeatureColumn, text_column
from ajgdata.store.metrics import PREDICTION_COLUMNS, read_predictions, write_predictions
from ajgdata.types import DataError, NotPossibleError, TrainingSettings

GRASPS = 20
GRASP = np.repeat(np.arange(GRASPS), 2)


def planted(noise=0.0, seed=0):
    """Return features (40, 3) that are a linear map of positions (40, 2), and the positions."""
    random = np.random.default_rng(seed)
    position = np.repeat(random.uniform(-1, 1, (GRASPS, 2)), 2, axis=0)
    linear_map = np.array([[2.0, -1.0, 0.5], [0.3, 1.0, -2.0]])
    return position @ linear_map + noise * random.normal(size=(40, 3)), position


def test_errors_are_euclidean_distances():
    true = np.array([[0.0, 0.0], [10.0, 0.0]])
    predicted = np.array([[3.0, 4.0], [10.0, 0.0]])
    scores = metrics.score(true, predicted, "regression")
    assert scores["rmse"] == pytest.approx(5 / np.sqrt(2), rel=1e-15)
    assert scores["mae"] == 2.5
    assert scores["r2"] == 1 - 25 / 50  # squared distances from the mean (5, 0): 25 + 25
    constant = np.array([[1.0, 2.0], [1.0, 2.0]])
    assert np.isnan(metrics.score(constant, predicted, "regression")["r2"])


def test_a_guess_is_the_mean_vector():
    train = np.array([[0.0, 2.0], [2.0, 0.0]])  # mean (1, 1)
    chance = metrics.chance(train, np.array([[4.0, 5.0]]), "regression")
    assert chance["rmse"] == chance["mae"] == 5.0


def test_a_planted_linear_map_is_found_without_error():
    features, position = planted()
    result = cross_validate(features, position, GRASP, kind="regression", model=LinearRegression())
    assert result.predictions.y_pred == pytest.approx(position, abs=1e-12)
    assert result.scores.mean["rmse"] < 1e-12 and len(result.scores.axes) == 2
    by_axis = np.array([axis.chance["rmse"] for axis in result.scores.axes])
    assert by_axis.min() > 0 and result.scores.chance["rmse"] > by_axis.max()


def test_the_squared_distance_is_the_sum_of_the_squared_errors_of_the_axes():
    features, position = planted(noise=0.2)
    result = cross_validate(features, position, GRASP, kind="regression", model=LinearRegression())
    total = np.square(result.scores.per_fold["rmse"])
    axes = [np.square(axis.per_fold["rmse"]) for axis in result.scores.axes]
    assert total == pytest.approx(axes[0] + axes[1], rel=1e-12)
    # An axis has the scores of its column alone: least squares does not join the columns.
    alone = cross_validate(
        features, position[:, 1], GRASP, kind="regression", model=LinearRegression()
    )
    assert result.scores.axes[1].per_fold["rmse"] == pytest.approx(alone.scores.per_fold["rmse"])
    assert result.scores.axes[1].chance == pytest.approx(alone.scores.chance)
    interval = ajgdata.estimate_score(result, GRASP).interval
    assert interval.low < result.scores.mean["rmse"] < interval.high


@pytest.mark.parametrize("model", ["svm_plain", "boosting"])
def test_models_of_one_column_are_trained_once_per_axis(model):
    features, position = planted(noise=0.1)
    options = {"kind": "regression", "model": model, "folds": 2}
    both = cross_validate(features, position, GRASP, **options).predictions
    for axis in (0, 1):
        own = cross_validate(features, position[:, axis], GRASP, **options).predictions
        np.testing.assert_array_equal(both.y_pred[:, axis], own.y_pred)


def test_equal_vectors_are_one_value_for_folds_of_placements():
    position = np.array([[0, 1], [0, 1], [0, 2], [0, 2]])
    folds = placement_folds(position, ["1/a", "2/a", "1/b", "2/b"], "regression")
    assert [test.tolist() for _, test in folds] == [[0, 2], [1, 3]]


def y_axis(missing=()):
    """Return a second axis, `y_mm`, that decreases with the edge."""
    y_mm = 50.0 - np.repeat(np.arange(10.0), 4)
    y_mm[list(missing)] = np.nan
    return FeatureColumn(y_mm, {"units": "mm"})


def test_a_recording_needs_a_value_of_each_axis():
    table = recordings(y_mm=y_axis(missing=(8, 9)))
    axes = ("edge_mm", "y_mm")
    data = task_data(table, "place", "regression", "grasp_id", axes=axes)
    assert data.value.shape == (34, 2)  # four lack the edge, two lack y
    assert data.values()[0] == (11.0, 49.0)
    with pytest.raises(NotPossibleError, match="there is no column 'z_mm'"):
        task_data(table, "place", "regression", "grasp_id", axes=("edge_mm", "z_mm"))


def test_tables_have_the_error_and_the_predictions_of_each_axis():
    axes = ("edge_mm", "y_mm")
    changes = {"target": "place", "axes": axes, "store": recordings(y_mm=y_axis())}
    tables, _, about = measured(**changes)
    scores = tables["scores"].where(metric="rmse", statistic="mean", split="grouped")
    by_condition = {row["condition"]: row["value"] for row in scores.rows}
    assert list(by_condition) == ["", *axes]
    assert max(by_condition["edge_mm"], by_condition["y_mm"]) < by_condition[""]
    ends = tables["scores"].where(metric="rmse", split="grouped", condition="y_mm")
    assert {"grasp low", "grasp high"} <= {row["statistic"] for row in ends.rows}
    predictions = tables["predictions"]
    keys = [column.key for column in predictions.columns]
    assert keys[-5:-1] == [f"{side}_{axis}" for side in ("y_true", "y_pred") for axis in axes]
    data = inputs(**changes).all_data()
    truth = dict(zip(data.name.tolist(), data.values(), strict=True))
    for row in predictions.rows:
        assert (row["y_true_edge_mm"], row["y_true_y_mm"]) == truth[row["recording"]]
    assert about["parts"]["grouped"]["recordings"] == 36


def test_predictions_of_vectors_are_additional_columns_of_the_file(tmp_path):
    cells = dict.fromkeys(PREDICTION_COLUMNS[:-1], "")
    vector = {key: "" for key in cells if not key.startswith("y_")} | {"y_true_x": 1, "y_pred_x": 2}
    write_predictions(tmp_path / "scalar.csv", [cells])
    header = (tmp_path / "scalar.csv").read_text().splitlines()[0]
    assert header == ",".join(PREDICTION_COLUMNS)
    write_predictions(tmp_path / "both.csv", [{**cells, "y_true": 3}, vector])
    first, second = read_predictions(tmp_path / "both.csv")
    assert (first["y_true"], first["y_true_x"]) == ("3", "")
    assert (second["y_true"], second["y_true_x"], second["y_pred_x"]) == ("", "1", "2")


def test_a_predictor_gives_the_vector_and_its_radius(tmp_path, monkeypatch):
    monkeypatch.setattr(in_use, "CALIBRATION_FOLDS", 3)
    attrs = {"settings": '{"audio": {}, "features": {}}'}
    objects = text_column(["cube"] * 40)
    table = replace(recordings(y_mm=y_axis(), object=objects), attrs=attrs)
    settings = TrainingSettings(
        target="place",
        kind="regression",
        unit="mm",
        groups="grasp_id",
        axes=("edge_mm", "y_mm"),
    )
    train_model(table, settings, model="linear", seed=0, folder=tmp_path)
    predictor = read_predictor(tmp_path, "d", "place")
    assert repr(predictor).startswith(
        "<Predictor d/place/linear: predicts a vector of edge_mm, y_mm"
    )
    (prediction,) = predictor.of_features(table.feature[20:21])
    assert prediction.value == pytest.approx((15.0, 45.0), abs=0.5)
    calibrated = replace(predictor.calibration, half_width=0.25, coverage=0.9)
    (prediction,) = replace(predictor, calibration=calibrated).of_features(table.feature[20:21])
    low, high = prediction.interval
    assert np.mean([low, high], axis=0) == pytest.approx(prediction.value)
    assert np.subtract(high, low) == pytest.approx([0.5, 0.5])


def test_the_radius_is_a_quantile_of_distances():
    features, position = planted(noise=0.2)
    options = {"model": "ridge_plain", "seed": 0}
    distance = in_use.held_out_residuals(features, position, GRASP, **options)
    axes = [in_use.held_out_residuals(features, y, GRASP, **options) for y in position.T]
    assert distance == pytest.approx(np.hypot(*axes))
    radius = in_use.interval_half_width(features, position, GRASP, 0.9, period=None, **options)
    assert 0.85 < np.mean(distance <= radius) < 1


MISTAKES = [
    ({"kind": "classification", "columns": ["x_m", "y_m"]}, {}, "a vector is a regression with"),
    ({"kind": "regression", "columns": ["x_m"]}, {}, "with at least two columns"),
    ({"kind": "regression", "columns": ["x_m", "x_m"]}, {}, "twice"),
    ({"kind": "regression", "columns": ["x_m", "edge_mm"]}, {}, "edge_mm has another unit"),
    ({"kind": "regression", "columns": ["x_m", "what"]}, {}, "what is not a target of numbers"),
    ({"kind": "regression", "columns": ["x_m", "file"]}, {}, "target file has the name of a"),
    ({"kind": "regression", "columns": ["x_m", "y_m"]}, {"withhold": [1]}, "withhold is not for a"),
    ({"kind": "regression", "columns": ["x_m", "y_m"]}, {"period_deg": 9}, "period_deg is not for"),
]


@pytest.mark.parametrize(("target", "task", "message"), MISTAKES)
def test_wrong_vectors_are_one_error(tmp_path, target, task, message):
    project = Project(Paths(tmp_path))
    targets = {
        "edge_mm": {"kind": "regression", "unit": "mm"},
        "what": {"kind": "classification"},
        "place": target,
    }
    project.declare(targets=targets, tasks={"place": {"target": "place", **task}})
    with pytest.raises(DataError, match=message):
        ajgdata.load_dataset("d", project.root)


def test_numbers_of_a_robot_group_recordings():
    place = np.repeat([1.0, 2.5, 4.0, 5.5, 7.0], 8)
    table = recordings(robot_place=FeatureColumn(place))
    data = task_data(table, "edge_mm", "regression", "robot_place")
    assert sorted(set(data.group.tolist())) == ["1.0", "2.5", "4.0", "5.5", "7.0"]
    place[20] = np.nan
    with pytest.raises(NotPossibleError, match="recording 's/20' has no 'robot_place'"):
        task_data(table, "edge_mm", "regression", "robot_place")
