"""A small report: a simulated regression and a recorded classification with hostile names."""

import numpy as np

from ajgdata.report.content import (
    Cost,
    DatasetSummary,
    Predictions,
    Provenance,
    Report,
    Spectra,
    TaskResult,
)
from ajgdata.report.format import Score
from ajgdata.report.paper import PaperFigure
from ajgdata.types import FeatureSettings, Finding

SCRIPT = "<script>alert(1)</script>"
PAPER = PaperFigure(
    id="size",
    metric="rmse",
    value=2.6,
    unit="mm",
    text="RMSE 2.6 mm overall",
    where="cubes",
    source="arXiv 2603.00351",
)
COST = Cost(3.2, 0.21, 512.0)
# Rows: true basalt 3 + 1, true granite 2 + 4; the tag must never reach a page as a tag.
CLASSES = ("basalt", "<b>granite</b>")
TRUE = np.repeat(CLASSES, (4, 6))
PREDICTED = np.array(CLASSES)[[0, 0, 0, 1, 0, 0, 1, 1, 1, 1]]


def regression_result(**changes) -> TaskResult:
    y_true = np.repeat([10.0, 20.0, 30.0], 4)
    y_pred = y_true + np.tile([-1.0, 1.0, -3.0, 3.0], 3)
    values = {
        "dataset": "size",
        "dataset_title": "Cube size",
        "task": "edge",
        "model": "cnn",
        "model_label": "CNN",
        "kind": "regression",
        "target": "edge_mm",
        "unit": "mm",
        "source": "simulated",
        "metrics": {
            "rmse": Score(2.2, 0.3, (1.9, 2.5)),
            "r2": Score(np.nan, np.nan, (np.nan,) * 2),
        },
        "chance": 8.2,
        "n_recordings": 12,
        "n_groups": 6,
        "group_column": "grasp_id",
        "folds": 2,
        "cost": COST,
        "predictions": Predictions(y_true, y_pred, np.arange(12) % 2),
        "random_split": Score(1.1, 0.2),
        "paper": PAPER,
    }
    return TaskResult(**{**values, **changes})


def classes_result(**changes) -> TaskResult:
    values = {
        "dataset": "stones",
        "dataset_title": SCRIPT,
        "task": "kind",
        "kind": "classification",
        "target": "kind",
        "unit": "",
        "source": "recorded",
        "metrics": {"accuracy": Score(0.7, 0.05, (0.65, 0.75))},
        "chance": 0.6,
        "n_recordings": 10,
        "predictions": Predictions(TRUE, PREDICTED, np.arange(10) % 2, CLASSES),
        "random_split": None,
        "paper": None,
    }
    return regression_result(**{**values, **changes})


def dataset(name: str, source: str, **changes) -> DatasetSummary:
    frequency_hz = np.arange(33) * 44_100 / 64
    mean = np.stack([np.exp(-frequency_hz / 9_000), np.exp(-frequency_hz / 7_000)])
    values = {
        "name": name,
        "title": f"Data set {name}",
        "source": source,
        "description": "One-second sweeps.",
        "n_recordings": 1200,
        "n_sessions": 1,
        "sample_rate_hz": 44_100,
        "licence": "CC-BY-4.0",
        "citation": "The authors, 2026.",
        "features": FeatureSettings(band_hz=(100.0, 18_000.0)),
        "provenance": Provenance("0.1.0", "abc1234", "c0ffee", "f00d"),
        "spectra": Spectra(frequency_hz, ("basalt", "<b>granite</b>"), mean, "kind"),
    }
    return DatasetSummary(**{**values, **changes})


def sample_report() -> Report:
    problem = Finding("s1", "r7", f"audio/{SCRIPT}.wav", "error", "truncated", SCRIPT, "repeat it")
    flagged = Finding("s1", "r8", "audio/r8.wav", "warning", "clipped", "clips", "lower the gain")
    results = (
        regression_result(),
        regression_result(
            model="knn",
            model_label="k-NN",
            metrics={"rmse": Score(4.0, 0.4, (3.6, 4.4))},
            cost=Cost(0.0, 0.05, 128.0),
            random_split=None,
        ),
        classes_result(),
    )
    datasets = (
        dataset("size", "simulated", title="Cube size", facts={"grid spacing (mm)": 2.0}),
        dataset("stones", "recorded", title=SCRIPT, findings=(problem, flagged)),
    )
    return Report("Results", "0.1.0", "abc1234", datasets, results)
