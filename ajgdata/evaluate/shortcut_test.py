"""Shortcut test: dependence of predictions from silent recordings on the label.

A silent recording is made with the speaker switched off. If a model still predicts its target from
silent recordings, it has learned a sound that occurs together with the label, for example a motor
that turns the gripper, a fan, or a person.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import rankdata
from sklearn.metrics import mutual_info_score

from ajgdata.types import Kind, NotPossibleError

#: Measures of dependence. The error is not tested, because silent recordings are unlike all
#: training recordings: predictions can have a large error and still depend on the label.
MEASURES: dict[str, str] = {
    "regression": "rank correlation",
    "periodic": "correlation of angles",
    "classification": "mutual information",
}
#: p value below which a model is flagged.
FLAG_LEVEL = 0.01


@dataclass(frozen=True)
class ShortcutTest:
    """Dependence of predictions from silent recordings on the true labels.

    `value` is the dependence. `null` is its mean over `permutations` of the labels between the
    groups of each fold. `p` = (b + 1) / (n + 1) if b of n permutations have at least this value
    (Phipson & Smyth 2010, Stat. Appl. Genet. Mol. Biol. 9(1)).
    """

    measure: str
    value: float
    null: float
    permutations: int
    p: float


def shortcut_test(
    y_true: np.ndarray,
    y_pred: np.ndarray,
    fold: np.ndarray,
    group: np.ndarray,
    *,
    kind: Kind,
    period: float | None = None,
    permutations: int = 999,
    seed: int = 0,
) -> ShortcutTest:
    """Test whether predictions from silent recordings depend on the true labels, all (n,).

    The measure is the absolute rank correlation for a regression. With a `period` P it is the
    correlation of the points (sin, cos) of 2 pi y / P, the square root of Escoufier's RV
    coefficient. For a classification it is the mutual information (nat). None of them depends on
    the mean or the spread of the predictions. The model of each fold is evaluated separately,
    because the models can have different errors. The result is the mean over folds, weighted by
    their rows. Raises ValueError for a group with several labels.
    """
    rows = [np.flatnonzero(fold == number) for number in np.unique(fold)]
    fold_groups = [_group_labels(y_true[r], group[r]) for r in rows]

    def mean_dependence(labels: list[np.ndarray]) -> float:
        weighted = [
            len(r) * _dependence(y, y_pred[r], kind, period)
            for r, y in zip(rows, labels, strict=True)
        ]
        return float(sum(weighted) / len(y_true))

    generator = np.random.default_rng(seed)
    observed = mean_dependence([y_true[r] for r in rows])
    null = np.empty(permutations)
    for n in range(permutations):
        permuted = [generator.permutation(labels)[number] for labels, number in fold_groups]
        null[n] = mean_dependence(permuted)
    is_periodic = kind == "regression" and period is not None
    return ShortcutTest(
        measure=MEASURES["periodic" if is_periodic else kind],
        value=observed,
        null=float(null.mean()),
        permutations=permutations,
        p=float((np.sum(null >= observed) + 1) / (permutations + 1)),
    )


def _group_labels(y: np.ndarray, group: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the label (groups,) of each group, and the number (n,) of the group of each row."""
    _, first, number = np.unique(group, return_index=True, return_inverse=True)
    labels = y[first]
    if (labels[number] != y).any():
        raise NotPossibleError("a group holds several labels: whole groups cannot exchange theirs")
    return labels, number


def _dependence(y: np.ndarray, predicted: np.ndarray, kind: Kind, period: float | None) -> float:
    """Return the dependence of predictions (n,) on labels (n,), see `shortcut_test`."""
    if kind == "classification":
        return float(mutual_info_score(y, predicted))
    if period is not None:
        return _circular_correlation(y, predicted, period)
    return _rank_correlation(y, predicted)


def _circular_correlation(y: np.ndarray, predicted: np.ndarray, period: float) -> float:
    """Return sqrt(RV) of the points on the circle, in [0, 1]; 0 if either has only one value.

    sqrt(RV) = |C_ab| / sqrt(|C_aa| |C_bb|), with covariance matrices C and Frobenius norms (Robert
    & Escoufier 1976, J. R. Stat. Soc. C 25, 257).
    """
    if np.ptp(y) == 0 or np.ptp(predicted) == 0:
        return 0.0
    a = _centred_points(y, period)
    b = _centred_points(predicted, period)
    scale = np.sqrt(np.linalg.norm(a.T @ a) * np.linalg.norm(b.T @ b))
    return float(np.linalg.norm(a.T @ b) / scale)


def _centred_points(values: np.ndarray, period: float) -> np.ndarray:
    """Return the points (n, 2) of values (n,) on the circle, minus their mean."""
    angle = 2 * np.pi / period * values
    points = np.column_stack([np.sin(angle), np.cos(angle)])
    return points - points.mean(axis=0)


def _rank_correlation(y: np.ndarray, predicted: np.ndarray) -> float:
    """Return the absolute rank correlation; 0 if either has only one value."""
    mean_rank = (len(y) + 1) / 2
    a = rankdata(y) - mean_rank
    b = rankdata(predicted) - mean_rank
    scale = float(np.sqrt(np.sum(a**2) * np.sum(b**2)))
    return abs(float(np.sum(a * b))) / scale if scale else 0.0
