"""Is it better than chance? Train and test again with labels that cannot be told from the sound."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from ajgdata.evaluate import metrics
from ajgdata.evaluate.splits import grouped_folds
from ajgdata.models import fit_model, make_model
from ajgdata.types import Kind, NotPossibleError


@dataclass(frozen=True)
class PermutationTest:
    """`value`: the headline metric (see `metrics.METRICS`) of all out-of-fold predictions together;
    `null`: the same with permuted labels, one number per permutation.

    `p` = (b + 1) / (n + 1), b of n permutations doing at least as well (Phipson & Smyth 2010,
    Stat. Appl. Genet. Mol. Biol. 9(1)): never 0, and at least 1 / (n + 1).
    """

    metric: str
    value: float
    null: tuple[float, ...]
    p: float


def permutation_test(
    features: np.ndarray,
    target: np.ndarray,
    groups: np.ndarray,
    *,
    kind: Kind,
    model: str,
    permutations: int,
    folds: int = 5,
    seed: int = 0,
    period: float | None = None,
    progress: Callable[[], object] = lambda: None,
) -> PermutationTest:
    """Test the hypothesis that the features of a group tell nothing of its label.

    `features` (n, n_features), `target` (n,), `groups` (n,). Labels are exchanged between whole
    groups: recordings of one grasp are near copies, and exchanging those would make any accuracy
    look improbable. Folds are made anew from the permuted labels, as they were from the true ones.
    Raises ValueError for a group of several labels.
    """
    y = np.asarray(target)
    group = np.unique(np.asarray(groups), return_inverse=True)[1]
    label_of = np.empty(group.max() + 1, y.dtype)
    label_of[group] = y
    if (label_of[group] != y).any():
        raise NotPossibleError("a group holds several labels: whole groups cannot exchange theirs")
    name = metrics.METRICS[kind][0]

    def value(labels: np.ndarray) -> float:
        predicted = np.empty_like(labels)
        for train, test in grouped_folds(labels, group, kind, folds, seed):
            made = make_model(model, kind, seed, period)
            fitted = fit_model(made, features[train], labels[train], group[train])
            predicted[test] = fitted.predict(features[test])
        return metrics.score(labels, predicted, kind, period)[name]

    generator = np.random.default_rng(seed)
    null = []
    with threadpool_limits(limits=1):
        observed = value(y)
        for _ in range(permutations):
            null.append(value(generator.permutation(label_of)[group]))
            progress()
    as_good = np.asarray(null) <= observed if name == "rmse" else np.asarray(null) >= observed
    return PermutationTest(
        name, observed, tuple(null), float((as_good.sum() + 1) / (permutations + 1))
    )
