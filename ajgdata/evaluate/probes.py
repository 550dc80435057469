"""Probes: properties read from a space by models too simple to find out what it hides.

A space is a point for each recording, (n, d), scaled as it shall be compared.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.stats import spearmanr
from sklearn.base import BaseEstimator
from sklearn.linear_model import LogisticRegression, Ridge
from sklearn.neighbors import KNeighborsClassifier, KNeighborsRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from ajgdata.evaluate.splits import grouped_folds
from ajgdata.models.baselines import NEIGHBOURS
from ajgdata.types import Kind

ProbeName = Literal["linear", "knn"]
PROBES: tuple[ProbeName, ...] = ("linear", "knn")
SCORES = ("accuracy", "chance", "r2", "rank_correlation")
WITHIN_FOLDS = 5


@dataclass(frozen=True, eq=False)
class Property:
    """A property to be read: `value` (n,), NaN or "" where it is missing, which repeats after
    `period`."""

    value: np.ndarray
    kind: Kind
    period: float | None = None

    @property
    def present(self) -> np.ndarray:
        """Return True for each recording (n,) that has it."""
        return np.isfinite(self.value) if self.kind == "regression" else self.value != ""


def probe(
    space: np.ndarray, prop: Property, name: ProbeName, train: np.ndarray, test: np.ndarray
) -> dict[str, float]:
    """Return the scores of one probe, trained on the rows `train` and tested on `test`.

    Classes: `accuracy`, and `chance`, which is to say always the class that is commonest in both
    parts together (that of the training part alone tends to be rare in the test part: fewer than
    chance would be right). Numbers: `r2` = 1 - sum (y - read)^2 / sum (y - training mean)^2, so
    that chance is 0, with a period of (sin, cos) 2 pi y / period; and `rank_correlation` (Spearman;
    NaN with a period). NaN where nothing can be learned or tested: fewer than two values to learn,
    or none to read.
    """
    known, asked = (rows[prop.present[rows]] for rows in (train, test))
    if not len(asked) or len(np.unique(prop.value[known])) < 2:
        return dict.fromkeys(SCORES, float("nan"))
    return _scores(prop, *_read(space, prop, name, known, asked))


def probe_within(
    space: np.ndarray,
    prop: Property,
    name: ProbeName,
    part: np.ndarray,
    group: np.ndarray,
    rows: np.ndarray,
) -> dict[str, float]:
    """Return the scores of a probe of a property that means something else for each `part` (n,), as
    an angle does for each object: each part's probe learns from some of its groups among `rows` and
    reads the others (5 folds by `group`, (n,)). The scores are of all parts together; a part of one
    group has no say, and without any other the scores are NaN.
    """
    readings = []
    rows = rows[prop.present[rows]]
    for label in np.unique(part[rows]):
        own = rows[part[rows] == label]
        folds = min(WITHIN_FOLDS, len(np.unique(group[own])))
        if folds < 2:
            continue
        for train, test in grouped_folds(np.zeros(len(own)), group[own], "regression", folds, 0):
            readings.append(_read(space, prop, name, own[train], own[test]))
    if not readings:
        return dict.fromkeys(SCORES, float("nan"))
    columns = (np.concatenate(column) for column in zip(*readings, strict=True))
    return _scores(prop, *columns)


def _scores(
    prop: Property, y_true: np.ndarray, y_read: np.ndarray, y_constant: np.ndarray
) -> dict[str, float]:
    if prop.kind == "classification":
        right, chance = np.mean(y_true == y_read), np.mean(y_true == y_constant)
        return {"accuracy": float(right), "chance": float(chance)}
    spread = np.sum((y_true - y_constant) ** 2)
    r2 = 1 - np.sum((y_true - y_read) ** 2) / spread if spread > 0 else np.nan
    rank = _rank_correlation(y_true[:, 0], y_read[:, 0]) if prop.period is None else np.nan
    return {"r2": float(r2), "rank_correlation": rank, "chance": 0.0}


def _read(
    space: np.ndarray, prop: Property, name: ProbeName, known: np.ndarray, asked: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return true values, those that the probe reads, and those that need no reading."""
    y = _encoded(prop)
    model = _model(name, prop.kind, space.shape[1], len(known)).fit(space[known], y[known])
    read = model.predict(space[asked])
    if prop.kind == "classification":
        return y[asked], read, np.full(len(asked), _commonest(y[np.concatenate([known, asked])]))
    constant = np.broadcast_to(y[known].mean(axis=0), y[asked].shape)
    return y[asked], read.reshape(y[asked].shape), constant


def _encoded(prop: Property) -> np.ndarray:
    """Return classes (n,); numbers (n, 1), or (n, 2) with a period."""
    if prop.kind == "classification":
        return prop.value
    if prop.period is None:
        return prop.value[:, None]
    turn = 2 * np.pi * prop.value / prop.period
    return np.column_stack([np.sin(turn), np.cos(turn)])


def _model(name: ProbeName, kind: Kind, dimension: int, rows: int) -> BaseEstimator:
    """Return the baselines' linear model or k-NN, for a space that is compressed already."""
    if name == "knn":
        near = min(NEIGHBOURS, rows)
        classes = kind == "classification"
        return KNeighborsClassifier(near) if classes else KNeighborsRegressor(near)
    # the penalty is one per dimension, as the baselines' is one per bin
    numbers, classes = Ridge(alpha=float(dimension)), LogisticRegression(C=1.0, max_iter=2000)
    return make_pipeline(StandardScaler(), classes if kind == "classification" else numbers)


def _commonest(y: np.ndarray) -> Any:
    values, counts = np.unique(y, return_counts=True)
    return values[counts.argmax()]


def _rank_correlation(y_true: np.ndarray, y_read: np.ndarray) -> float:
    if np.ptp(y_true) == 0 or np.ptp(y_read) == 0:
        return float("nan")
    return float(spearmanr(y_true, y_read).statistic)
