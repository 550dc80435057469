"""Results of tasks and embeddings in one table of numbers and one of predictions."""

import csv
import math

import pytest

from ajgdata.evaluate.agreement import why_undefined
from ajgdata.experiments.scores import ScoreKey, ScoreRow, score_table
from ajgdata.paths import Paths
from ajgdata.pipeline.collect import metric_rows, prediction_rows
from ajgdata.pipeline.task_results import Measurement
from ajgdata.store.metrics import (
    COUNTS,
    FACTS,
    KEYS,
    read_metrics,
    write_metrics,
    write_predictions,
)
from ajgdata.types.formats import METRICS_FORMAT
from ajgdata.types.table import table_of

MADE_BY = {"provenance": {"source": "simulated", "git_commit": "abc1234"}, "seed": 7}
MADE_BY["groups"] = "grasp_id"
FORMULA = '=HYPERLINK("http://example.org","low")'
SCORES = [
    ScoreRow("accuracy", "run 0", 0.4, ScoreKey("latent", dimension=4)),
    ScoreRow("accuracy", "mean", 0.5, ScoreKey("latent", dimension=4)),
    ScoreRow("silhouette", "mean", float("nan"), ScoreKey("raw", condition="object")),
]


@pytest.fixture(scope="module")
def collected(tmp_path_factory):
    """Numbers and predictions of a task and of an embedding."""
    paths = Paths(tmp_path_factory.mktemp("collected"))
    key = ScoreKey("cnn", "grouped", "d", "training")
    rows = [ScoreRow("rmse", "mean", 2.5, key), ScoreRow("r2", "mean", 0.9, key)]
    predictions = {"recording": "r1", "split": "grouped", "test_set": "d"}
    predictions |= {"target_values": "training", "fold": 0, "y_true": FORMULA}
    predictions |= {"y_pred": 12.5, "probability": None}
    outcomes = {
        ("d", "edge", "cross_validation", "cnn"): (
            [
                score_table(rows, "Scores"),
                table_of("predictions", "p", [predictions], **{key: key for key in predictions}),
            ],
            [score_table([ScoreRow("train_s", "cost", 3.0, ScoreKey("cnn", "grouped"))], "Cost")],
            {"unit": "mm"},
        ),
        ("d", "poses", "embedding_knn", ""): (
            [score_table(SCORES, "Scores")],
            [score_table([ScoreRow("cpu_s", "cost", 20.0)], "Cost")],
            {"unit": ""},
        ),
        ("d", "poses", "embedding_distances", ""): ([], [], {"skipped": "one grasp only"}),
    }
    measured = {}
    for key, (tables, cost, about) in outcomes.items():
        where = dict(zip(("dataset", "task", "experiment", "model"), key, strict=True))
        measured[key] = Measurement(where | about | MADE_BY, tables, cost)
    write_metrics(paths.metrics_table, metric_rows(measured.values()))
    write_predictions(paths.predictions, prediction_rows(measured.values()))
    with paths.predictions.open(encoding="utf-8", newline="") as stream:
        predicted = list(csv.DictReader(stream))
    return read_metrics(paths.metrics_table), predicted


@pytest.mark.parametrize("values", [(2, 3), (2.5, 3), (None, None), (2, None), ()])
def test_the_types_of_columns_do_not_depend_on_their_contents(tmp_path, values):
    texts = dict.fromkeys((*KEYS, *FACTS[:-1]), "")
    path = tmp_path / "metrics.csv"
    write_metrics(path, [{**texts, "value": value, "grasps": 3} for value in values])
    metrics = read_metrics(path)
    assert metrics["value"].dtype == "float64"
    assert {str(metrics[name].dtype) for name in COUNTS} == {"Int64"}
    assert {str(dtype) for dtype in metrics.drop(columns=["value", *COUNTS]).dtypes} == {
        str(metrics["dataset"].dtype)
    }


def test_a_row_for_every_number_with_its_seed_and_what_made_it(collected):
    metrics, _ = collected
    facts = metrics[["source", "seed", "commit", "groups", "format"]].drop_duplicates()
    assert facts.to_numpy().tolist() == [
        ["simulated", 7, "abc1234", "grasp_id", METRICS_FORMAT.version]
    ]
    keys = ["task", "experiment", "model", "split", "dimension", "metric", "statistic"]
    shown = metrics[[*keys, "unit"]].astype(object).where(metrics[[*keys, "unit"]].notna(), None)
    none = None
    assert shown.to_numpy().tolist() == [
        ["edge", "cross_validation", "cnn", "grouped", none, "rmse", "mean", "mm"],
        ["edge", "cross_validation", "cnn", "grouped", none, "r2", "mean", ""],
        ["edge", "cross_validation", "cnn", "grouped", none, "train_s", "cost", ""],
        ["poses", "embedding_knn", "latent", "", 4, "accuracy", "run 0", ""],
        ["poses", "embedding_knn", "latent", "", 4, "accuracy", "mean", ""],
        ["poses", "embedding_knn", "raw", "", none, "silhouette", "mean", ""],
        ["poses", "embedding_knn", "", "", none, "cpu_s", "cost", ""],
    ]
    values = metrics["value"].tolist()
    assert values[:5] == [2.5, 0.9, 3.0, 0.4, 0.5] and math.isnan(values[5])
    assert "fewer than two labels" in metrics["reason"][5]
    assert set(metrics["test_set"]) == {"d", ""}


def test_predictions_have_a_table_of_their_own(collected):
    (row,) = collected[1]
    assert (row["task"], row["model"], row["recording"]) == ("edge", "cnn", "r1")
    assert (row["split"], row["test_set"], row["target_values"]) == ("grouped", "d", "training")
    assert (row["y_true"], row["y_pred"]) == (FORMULA, "12.5")


def test_a_measure_that_is_undefined_says_why():
    """Silhouettes of a data set with one thing of a class: `verify` once failed a right run."""
    reason = why_undefined("silhouette", "run 3", "object")
    assert "fewer than two labels" in reason
    assert why_undefined("r2", "fold 1") == "all true values are the same"
    assert why_undefined("accuracy", "sd") == "one value has no deviation"
    assert why_undefined("accuracy", "mean") == ""  # such a one is a defect
    assert why_undefined("train_s", "cost") == ""
    assert why_undefined("accuracy", "pooled", "plain, accepted") == "nothing was accepted"
