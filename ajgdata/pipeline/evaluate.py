"""Feature store -> errors, cost and predictions of one model on one task."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ajgdata.store.features import Shard, read_store
from ajgdata.store.files import csv_bytes, json_bytes, write_bytes
from ajgdata.types import Kind

if TYPE_CHECKING:
    from ajgdata.evaluate.crossval import Scores

PREDICTION_COLUMNS = ("recording", "split", "fold", "y_true", "y_pred", "probability")


def evaluate_task(
    store: Path,
    *,
    target: str,
    kind: Kind,
    unit: str,
    groups: str,
    folds: int,
    model: str,
    compare_random: bool,
    seed: int,
    metrics: Path,
    cost: Path,
    predictions: Path,
) -> None:
    """Cross-validate `model` on the recordings of `store` that have `target`.

    Writes what is determined by the inputs (`metrics`, `predictions`) apart from what is measured
    (`cost`). With fewer groups than `folds` each group is a fold; `metrics` say how many there
    were. A task that cannot be evaluated, for instance with a single group, is written as such with
    the reason: the rest of the run goes on.
    """
    from ajgdata.evaluate.crossval import cross_validate

    shard = read_store(store)
    task = {"target": target, "kind": kind, "unit": unit, "groups": groups, "model": model}
    document: dict[str, Any] = {**task, "seed": seed, "provenance": dict(shard.attrs)}
    results = {}
    try:
        features, values, group, names = rows_of(shard, target, kind, groups)
        folds = min(folds, len(np.unique(group)))
        splits = {"grouped": group, "random": None} if compare_random else {"grouped": group}
        for split, labels in splits.items():
            with np.errstate(over="ignore", invalid="ignore"):  # _computable tells
                results[split] = cross_validate(
                    features, values, labels,
                    kind=kind, model=model, folds=folds, seed=seed,
                )  # fmt: skip
            if not _computable(results[split].scores):
                problem = f"errors of {target!r} are too large or too small to compute with"
                raise ValueError(f"{problem}: give it in another unit")
    except ValueError as error:
        results = {}
        document["skipped"] = str(error)
    for split, result in results.items():
        document[split] = plain(dataclasses.asdict(result.scores))
    rows = [row for split, r in results.items() for row in _rows(names, split, r.predictions)]
    write_bytes(predictions, csv_bytes(PREDICTION_COLUMNS, rows))
    measured = {split: plain(dataclasses.asdict(r.cost)) for split, r in results.items()}
    write_bytes(cost, json_bytes(measured))
    write_bytes(metrics, json_bytes(document))


def _computable(scores: Scores) -> bool:
    """Whether the leading error, and what it is compared with, are finite and not rounded to 0."""
    from ajgdata.evaluate.metrics import METRICS

    name = METRICS[scores.kind][0]
    numbers = (scores.mean[name], scores.sd[name], scores.chance[name])
    return all(map(math.isfinite, numbers)) and (scores.kind != "regression" or numbers[2] > 0)


def rows_of(
    shard: Shard, target: str, kind: Kind, groups: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Features, target values, groups and names of the recordings whose target is not missing.

    Raises ValueError when the store lacks rows or a column, when all values or all groups are the
    same, and when a recording belongs to no group.
    """
    if not len(shard.feature):
        raise ValueError("no recording can be used: the quarantine says why")
    for column in (target, groups):
        if column not in shard.columns:
            raise ValueError(f"there is no column {column!r}: add it to recordings.csv")
    values = shard.columns[target].values
    present = np.isfinite(values) if kind == "regression" else values != ""
    if not present.any():
        raise ValueError(f"no recording has a value of {target!r}")
    if (values[present] == values[present][0]).all():
        raise ValueError(f"every recording has the same {target!r}: there is nothing to tell apart")
    group = shard.columns[groups].values.astype(str)
    names = shard.columns["recording"].values
    if (homeless := present & np.isin(group, ["", "nan"])).any():
        raise ValueError(
            f"recording {str(names[homeless][0])!r} has no {groups!r}, which groups folds"
        )
    if len(np.unique(group[present])) < 2:
        raise ValueError(f"all recordings have the same {groups!r}: folds need at least two")
    return shard.feature[present], values[present], group[present], names[present]


def plain(value: Any) -> Any:
    """Nested dataclass content as JSON: NaN becomes null, numpy becomes Python."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _rows(names: np.ndarray, split: str, found: Any) -> list[dict[str, object]]:
    probability = found.probability if found.probability is not None else [""] * len(names)
    columns = (names, found.fold, found.y_true, found.y_pred, probability)
    return [
        {"recording": n, "split": split, "fold": f, "y_true": t, "y_pred": p, "probability": q}
        for n, f, t, p, q in zip(*(np.asarray(c).tolist() for c in columns), strict=True)
    ]
