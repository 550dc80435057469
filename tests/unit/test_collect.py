"""Results of tasks and embeddings in one table of numbers and one of predictions."""

import csv

import pytest

from ajgdata.evaluate.agreement import why_undefined
from ajgdata.experiments.base import score_table
from ajgdata.paths import Paths
from ajgdata.pipeline.experiments import Measurement
from ajgdata.pipeline.exports import collect
from ajgdata.types.table import table_of

MADE_BY = {"provenance": {"source": "simulated", "git_commit": "abc1234"}, "seed": 7}
FORMULA = '=HYPERLINK("http://example.org","low")'
SCORES = [
    ("latent", "knn:4", "accuracy", "run 0", 0.4),
    ("latent", "knn:4", "accuracy", "mean", 0.5),
    ("raw", "probe:grouped:linear", "rank_correlation of angle", "mean", float("nan")),
]


@pytest.fixture(scope="module")
def collected(tmp_path_factory):
    """What is known, the numbers and the predictions of a task and of an embedding."""
    paths = Paths(tmp_path_factory.mktemp("collected"))
    rows = [("cnn", "grouped", "rmse", "mean", 2.5), ("cnn", "grouped", "r2", "mean", 0.9)]
    predictions = {"recording": "r1", "split": "grouped", "fold": 0, "y_true": FORMULA}
    predictions |= {"y_pred": 12.5, "probability": None}
    outcomes = {
        ("d", "edge", "cross_validation", "cnn"): (
            [
                score_table(rows, "Scores"),
                table_of("predictions", "p", [predictions], **{key: key for key in predictions}),
            ],
            [score_table([("cnn", "cost of grouped", "train_s", "measured", 3.0)], "Cost")],
            {"unit": "mm"},
        ),
        ("d", "poses", "embedding_knn", ""): (
            [score_table(SCORES, "Scores")],
            [score_table([("", "cost of training", "cpu_s", "measured", 20.0)], "Cost")],
            {"unit": ""},
        ),
        ("d", "poses", "embedding_distances", ""): ([], [], {"skipped": "one grasp only"}),
    }
    measured = {}
    for key, (tables, cost, about) in outcomes.items():
        where = dict(zip(("dataset", "task", "experiment", "model"), key, strict=True))
        measured[key] = Measurement(where | about | MADE_BY, tables, cost)
    about = collect(paths, measured)
    with paths.metrics_table.open(encoding="utf-8", newline="") as stream:
        numbers = list(csv.DictReader(stream))
    with paths.predictions.open(encoding="utf-8", newline="") as stream:
        predicted = list(csv.DictReader(stream))
    return about, numbers, predicted


def test_a_row_for_every_number_with_its_seed_and_what_made_it(collected):
    _, rows, _ = collected
    assert {(r["source"], r["seed"], r["commit"]) for r in rows} == {("simulated", "7", "abc1234")}
    keys = ("task", "model", "part", "metric", "statistic", "value", "unit")
    assert [tuple(row[key] for key in keys) for row in rows] == [
        ("edge", "cnn", "grouped", "rmse", "mean", "2.5", "mm"),
        ("edge", "cnn", "grouped", "r2", "mean", "0.9", ""),
        ("edge", "cnn", "cost of grouped", "train_s", "measured", "3.0", ""),
        ("embedding:poses", "latent", "knn:4", "accuracy", "run 0", "0.4", ""),
        ("embedding:poses", "latent", "knn:4", "accuracy", "mean", "0.5", ""),
        ("embedding:poses", "raw", *SCORES[2][1:4], "", ""),  # undefined: an empty cell
        ("embedding:poses", "", "cost of training", "cpu_s", "measured", "20.0", ""),
    ]


def test_what_could_not_be_made_is_returned_with_its_reason(collected):
    _, knn, distances = collected[0]
    assert (knn["dataset"], knn["task"], knn["seed"]) == ("d", "poses", 7)
    assert distances["skipped"] == "one grasp only"


def test_predictions_have_a_table_of_their_own(collected):
    (row,) = collected[2]
    assert (row["task"], row["model"], row["recording"]) == ("edge", "cnn", "r1")
    assert (row["y_true"], row["y_pred"]) == (FORMULA, "12.5")


def test_a_measure_that_is_undefined_says_why():
    """Silhouettes of a data set with one thing of a class: `verify` once failed a right run."""
    reason = why_undefined("silhouette", "silhouette of object", "run 3")
    assert "fewer than two labels" in reason
    assert why_undefined("grouped", "r2", "fold 1") == "all true values are the same"
    assert why_undefined("grouped", "accuracy", "sd") == "one value has no deviation"
    assert why_undefined("grouped", "accuracy", "mean") == ""  # such a one is a defect
    assert why_undefined("cost of grouped", "train_s", "measured") == ""
