"""Does a model hear something else than the object? It is asked about silence.

A model that still predicts its target from recordings made with the speaker silent has learned a
sound that comes with the label: a motor that turns the gripper, a fan, a person.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.stats import rankdata
from sklearn.metrics import mutual_info_score

from ajgdata.types import Kind, NotPossibleError

#: Silent recordings are unlike all that a model was trained on: its predictions may be far off and
#: still follow the target. So not the error is tested, but whether they depend on it.
MEASURES: dict[str, str] = {
    "regression": "rank correlation",
    "periodic": "correlation of angles",
    "classification": "mutual information",
}
FLAG_LEVEL = 0.01  #: of p, below which a model is flagged


@dataclass(frozen=True)
class ShortcutTest:
    """Dependence of predictions from silence on the truth: `value`, and `null`, its mean when the
    groups of a fold exchange their labels.

    `p` = (b + 1) / (n + 1), b of n permutations depending at least as much (Phipson & Smyth 2010,
    Stat. Appl. Genet. Mol. Biol. 9(1)): never 0, and at least 1 / (n + 1).
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
    """Test whether predictions from silent recordings, all (n,), depend on the truth.

    Each fold's model is evaluated separately, since they may be far off in different ways: the
    absolute rank correlation; with a `period` that of the points (sin, cos) of 2 pi y / period, the
    root of Escoufier's RV coefficient; of classes the mutual information (nat). All are blind to
    where predictions lie and how far they spread. The result is the mean over folds, by their
    rows. Raises ValueError for a group of several labels.
    """
    name = "periodic" if period is not None and kind == "regression" else kind
    measure = _measure(kind, period)
    rows = [np.flatnonzero(fold == number) for number in np.unique(fold)]
    members = [_groups(y_true[r], group[r]) for r in rows]

    def value(labels: list[np.ndarray]) -> float:
        weighted = [len(r) * measure(y, y_pred[r]) for r, y in zip(rows, labels, strict=True)]
        return float(sum(weighted) / len(y_true))

    generator = np.random.default_rng(seed)
    observed = value([y_true[r] for r in rows])
    null = np.array(
        [
            value([generator.permutation(labels)[of] for labels, of in members])
            for _ in range(permutations)
        ]
    )
    p = float((np.sum(null >= observed) + 1) / (permutations + 1))
    return ShortcutTest(MEASURES[name], observed, float(null.mean()), permutations, p)


def _groups(y: np.ndarray, group: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the label of each group, and number of the group of each row."""
    _, first, of = np.unique(group, return_index=True, return_inverse=True)
    labels = y[first]
    if (labels[of] != y).any():
        raise NotPossibleError("a group holds several labels: whole groups cannot exchange theirs")
    return labels, of


def _measure(kind: Kind, period: float | None) -> Callable[[np.ndarray, np.ndarray], float]:
    if kind == "classification":
        return lambda y, predicted: float(mutual_info_score(y, predicted))
    if period is not None:
        return lambda y, predicted: _circular_correlation(y, predicted, period)
    return _rank_correlation


def _circular_correlation(y: np.ndarray, predicted: np.ndarray, period: float) -> float:
    """Return sqrt(RV) of the points on the circle, in [0, 1]; 0 where either never changes.

    |C_ab| / sqrt(|C_aa| |C_bb|): covariance matrices, Frobenius norms (Robert & Escoufier 1976).
    """
    if np.ptp(y) == 0 or np.ptp(predicted) == 0:
        return 0.0
    turns = (2 * np.pi / period * values for values in (y, predicted))
    a, b = (np.column_stack([np.sin(t), np.cos(t)]) for t in turns)
    a, b = a - a.mean(axis=0), b - b.mean(axis=0)
    scale = np.sqrt(np.linalg.norm(a.T @ a) * np.linalg.norm(b.T @ b))
    return float(np.linalg.norm(a.T @ b) / scale)


def _rank_correlation(y: np.ndarray, predicted: np.ndarray) -> float:
    """Return the absolute rank correlation, 0 where either never changes."""
    a, b = (rankdata(values) - (len(y) + 1) / 2 for values in (y, predicted))
    scale = float(np.sqrt(np.sum(a**2) * np.sum(b**2)))
    return abs(float(np.sum(a * b))) / scale if scale else 0.0
