"""Small results of cross-validation: a simulated regression, recorded classes, hostile names."""

from collections.abc import Mapping, Sequence

import numpy as np
from experiment_samples import with_task_settings
from report_samples import PAPER, SCRIPT

from ajgdata.evaluate.agreement import GRASP_INTERVAL, Interval
from ajgdata.evaluate.parts import part_columns
from ajgdata.experiments.base import Result, TaskResults
from ajgdata.experiments.cross_validation import PREDICTION_TITLES
from ajgdata.experiments.scores import ScoreKey, ScoreRow, score_table
from ajgdata.report.comparison import PaperFigure
from ajgdata.report.format import Score
from ajgdata.store.metrics import COST as COST_STATISTIC
from ajgdata.types import CrossValidationSettings as Settings
from ajgdata.types.table import table_of

COST = (3.2, 0.21, 512.0)
# Rows: true basalt 3 + 1, true granite 2 + 4; the tag must never reach a page as a tag.
CLASSES = ("basalt", "<b>granite</b>")
TRUE = np.repeat(CLASSES, (4, 6))
PREDICTED = np.array(CLASSES)[[0, 0, 0, 1, 0, 0, 1, 1, 1, 1]]
SIZES = np.repeat([10.0, 20.0, 30.0], 4)
RMSE = Score(2.2, 0.3, (1.9, 2.5))


def paper_figure(name: str, value: float | None, **more) -> PaperFigure:
    given = {"metric": "rmse", "unit": "mm", "text": "as told", "where": f"experiment {name}"}
    return PaperFigure(id=name, value=value, **{**given, **more})


def interval_of(score: Score) -> Interval:
    """Return the interval over grasps of a made-up score: 1.5 sd on both sides."""
    return Interval(score.mean - 1.5 * score.sd, score.mean + 1.5 * score.sd)


def result(
    model: str = "cnn",
    label: str = "CNN",
    *,
    parts: Mapping[str, tuple[Mapping[str, Score], float]],
    predictions: Mapping[str, tuple[np.ndarray, np.ndarray]],
    classes: Sequence[str] = (),
    cost: tuple[float, float, float] = COST,
    counts: Mapping[str, int],
    dataset: str = "size",
) -> Result:
    """Return what is stored of a model; `parts`: metrics of each, and chance of the first."""
    rows = []
    for part, (metrics, chance) in parts.items():
        for i, (metric, score) in enumerate(metrics.items()):
            statistics = {f"fold {n}": v for n, v in enumerate(score.per_fold)}
            statistics |= {"mean": score.mean, "sd": score.sd}
            if score.has_interval:
                statistics |= {"low": score.low, "high": score.high}
            if not i:
                statistics |= dict(zip(GRASP_INTERVAL, interval_of(score), strict=True))
            if not i and not np.isnan(chance):
                statistics["chance"] = chance
            key = ScoreKey(model, *part_columns(part, dataset))
            rows += [ScoreRow(metric, name, v, key) for name, v in statistics.items()]
    predicted = [
        dict(
            zip(
                PREDICTION_TITLES,
                (f"r{n}", *part_columns(part, dataset), n % 2, true, y, None),
                strict=True,
            )
        )
        for part, pair in predictions.items()
        for n, (true, y) in enumerate(zip(*pair, strict=True))
    ]
    measured = {"train_cpu_s": cost[0], "latency_s": cost[1] / 1e3}
    key = ScoreKey(model, "grouped")
    measured = [ScoreRow(name, COST_STATISTIC, v, key) for name, v in measured.items()]
    tables = (
        score_table(rows, "Errors"),
        table_of("predictions", "Predictions", predicted, **PREDICTION_TITLES),
    )
    return Result(
        model,
        label,
        {"parts": {"grouped": counts}, "classes": list(classes)},
        {table.name: table for table in tables},
        {"scores": score_table(measured, "Cost")},
    )


def size_result(model: str = "cnn", label: str = "CNN", **changes) -> Result:
    """Return a regression of sizes; `scores` and `chance` are of the grouped split."""
    scores = changes.pop("scores", {"rmse": RMSE, "r2": Score(np.nan, np.nan, (np.nan,) * 2)})
    parts = {"grouped": (scores, changes.pop("chance", 8.2))} | changes.pop("parts", {})
    predicted = (SIZES, SIZES + np.tile([-1.0, 1.0, -3.0, 3.0], 3))
    given = {
        "parts": parts,
        "predictions": {"grouped": predicted},
        "counts": {"recordings": 12, "groups": 6, "folds": 2},
    }
    return result(model, label, **(given | changes))


def kind_result(model: str = "cnn", label: str = "CNN", **changes) -> Result:
    """Return a classification of stones."""
    score = changes.pop("score", Score(0.7, 0.05, (0.65, 0.75)))
    parts = {"grouped": ({"accuracy": score}, changes.pop("chance", 0.6))}
    given = {
        "parts": parts | changes.pop("parts", {}),
        "predictions": {"grouped": (TRUE, PREDICTED)},
        "classes": CLASSES,
        "dataset": "stones",
        "counts": {"recordings": 10, "groups": 6, "folds": 2},
    }
    return result(model, label, **(given | changes))


def sizes(*results: Result, **changes) -> TaskResults:
    """Return a simulated regression, of a CNN unless others are given."""
    given = {
        "experiment": "cross_validation",
        "dataset": "size",
        "dataset_title": "Cube size",
        "task": "edge",
        "kind": "regression",
        "target": "edge_mm",
        "unit": "mm",
        "groups": "grasp_id",
        "folds": 5,
        "source": "simulated",
        "settings": Settings(),
        "results": results or (size_result(),),
        "papers": {"known": PAPER},
    }
    return TaskResults(**with_task_settings(given | changes))


def kinds(*results: Result, **changes) -> TaskResults:
    """Return recorded classes, of a CNN unless others are given."""
    given = {
        "dataset": "stones",
        "dataset_title": SCRIPT,
        "task": "kind",
        "kind": "classification",
        "target": "kind",
        "unit": "",
        "source": "recorded",
        "papers": {},
        "results": results or (kind_result(),),
    }
    return sizes(**(given | changes))


def random_split(mean: float = 1.1, sd: float = 0.2) -> dict:
    """Return the part of a split that ignores the groups."""
    return {"random": ({"rmse": Score(mean, sd)}, 8.2)}


def two_tasks() -> tuple[TaskResults, TaskResults]:
    """Return both tasks: sizes by two models, one beside a random split; classes by one."""
    knn = size_result(
        "knn", "k-NN", scores={"rmse": Score(4.0, 0.4, (3.6, 4.4))}, cost=(0.0, 0.05, 128.0)
    )
    return sizes(size_result(parts=random_split()), knn), kinds()
