"""Two small runs: rows of metrics.csv and predictions.csv with answers known beforehand."""

from collections.abc import Mapping, Sequence

COMMIT_A, COMMIT_B = "a" * 40, "b" * 40
RMSE = ("size", "edge", "cnn", "grouped", "rmse")
ACCURACY = ("stones", "kind", "cnn", "grouped", "accuracy")


def rows_of(
    key: Sequence[str], values: Mapping[str, float | str], unit: str = "", commit: str = COMMIT_A
) -> list[dict[str, str]]:
    """Return a row for each statistic of one number."""
    named = dict(zip(("dataset", "task", "model", "part", "metric"), key, strict=True))
    told = {"source": "simulated", "unit": unit, "seed": "0", "commit": commit}
    return [{**named, "statistic": s, "value": str(v), **told} for s, v in values.items()]


def folds(*values: float) -> dict[str, float]:
    """Return fold values, without mean and sd: these follow from them."""
    return {f"fold {n}": value for n, value in enumerate(values)}


def predictions(
    key: Sequence[str], predicted: Mapping[str, tuple[int, str, str]]
) -> list[dict[str, str]]:
    """Return rows of predictions.csv; `predicted` gives fold, truth and prediction by recording."""
    named = dict(zip(("dataset", "task", "model", "split"), key, strict=True))
    return [
        {**named, "recording": r, "fold": str(f), "y_true": t, "y_pred": p, "probability": ""}
        for r, (f, t, p) in predicted.items()
    ]
