"""Target values that were never trained on, beside those that were."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ajgdata.evaluate import metrics
from ajgdata.evaluate.crossval import Predictions, deviation


@dataclass(frozen=True)
class OneValue:
    """Errors at one value of the target. `bias` is the mean of prediction minus truth.

    Of a withheld value, `rmse_sd` is the standard deviation of the RMSE over the folds' models; of
    a known one, each recording has one prediction and it is over the folds that held some out.
    """

    value: float
    withheld: bool
    recordings: int
    rmse: float
    rmse_sd: float
    mae: float
    bias: float


def overall(
    known: Predictions, withheld: Predictions, period: float | None = None
) -> dict[str, tuple[float, ...]]:
    """Return metrics of known and withheld recordings together, one value per fold.

    A fold tests a part of the known recordings, but all withheld ones. The weights make the known
    ones count as often as there are of them: each recording of the data set counts once.
    """
    per_fold = []
    for fold in np.unique(known.fold):
        test, new = known.fold == fold, withheld.fold == fold
        weight = np.concatenate(
            [np.full(test.sum(), len(known.fold) / test.sum()), np.ones(new.sum())]
        )
        y_true = np.concatenate([known.y_true[test], withheld.y_true[new]])
        y_pred = np.concatenate([known.y_pred[test], withheld.y_pred[new]])
        per_fold.append(metrics.regression(y_true, y_pred, period, weight))
    return {name: tuple(one[name] for one in per_fold) for name in metrics.METRICS["regression"]}


def overall_chance(
    known: Predictions, withheld: Predictions, period: float | None = None
) -> dict[str, tuple[float, ...]]:
    """Return the metrics of `overall` for a guess: the mean of a fold's training recordings."""
    middle = {
        fold: metrics.middle(known.y_true[known.fold != fold], period)
        for fold in np.unique(known.fold)
    }

    def guess(part: Predictions) -> Predictions:
        return replace(part, y_pred=np.array([middle[fold] for fold in part.fold]))

    return overall(guess(known), guess(withheld), period)


def by_value(
    known: Predictions, withheld: Predictions | None, period: float | None = None
) -> tuple[OneValue, ...]:
    """Return errors value by value, in rising order."""
    parts = [_of_values(known, False, period)]
    if withheld is not None:
        parts.append(_of_values(withheld, True, period))
    return tuple(sorted((error for part in parts for error in part), key=lambda error: error.value))


def _of_values(predictions: Predictions, withheld: bool, period: float | None) -> list[OneValue]:
    values = []
    for value in np.unique(predictions.y_true):
        rows = predictions.y_true == value
        error = metrics.wrapped(predictions.y_pred[rows] - value, period)
        fold = predictions.fold[rows]
        rmse = [float(np.sqrt(np.mean(error[fold == f] ** 2))) for f in np.unique(fold)]
        values.append(
            OneValue(
                value=float(value),
                withheld=withheld,
                recordings=len(np.unique(predictions.row[rows])),
                rmse=float(np.sqrt(np.mean(error**2))),
                rmse_sd=deviation(rmse),
                mae=float(np.mean(np.abs(error))),
                bias=float(np.mean(error)),
            )
        )
    return values
