"""Target values that were never trained on, beside those that were."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ajgdata.evaluate import metrics
from ajgdata.evaluate.crossval import Predictions


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
