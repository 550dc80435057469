"""Feature store -> errors, cost and predictions of one model on one task."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ajgdata.evaluate.task_data import TaskData, is_among, split_withheld, task_data
from ajgdata.store.features import read_store
from ajgdata.store.files import csv_bytes, json_bytes, write_bytes
from ajgdata.store.tables import plain
from ajgdata.types import Kind

if TYPE_CHECKING:
    from ajgdata.evaluate.crossval import CrossValidation, Predictions, Scores

PREDICTION_COLUMNS = ("recording", "split", "fold", "y_true", "y_pred", "probability")
WITHHELD = "withheld"  #: split name of the rows that no fold trained on
MAX_VALUES = 50  #: a target with more distinct values is continuous: no table by value


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
    withhold: Sequence[float] = (),
    period_deg: float | None = None,
    others: Mapping[str, Path] | None = None,
    silent: Sequence[str] = (),
) -> None:
    """Cross-validate `model` on the recordings of `store` that have `target`.

    Recordings whose target is in `withhold` are trained on by no fold and predicted by all. So are
    those of the stores `others` (by data set) whose grasp is not of `store`, too; of a grasp that
    is, only the fold that holds it out predicts. Withheld values are left out of `others`, so that
    their errors compare with those of the known ones.
    Predictions from `silent`, names among `others`, are tested for what they know of the target.
    Writes what is determined by the inputs (`metrics`, `predictions`) apart from what is measured
    (`cost`). With fewer groups than `folds` each group is a fold; `metrics` say how many there
    were. A task that cannot be evaluated, for instance with a single group, is written as such with
    the reason: the rest of the run goes on.
    """
    from ajgdata.evaluate.crossval import ExtraTestSet, cross_validate

    shard = read_store(store)
    task: dict[str, Any] = {
        "target": target,
        "kind": kind,
        "unit": unit,
        "groups": groups,
        "model": model,
    }
    task |= {"withhold": list(withhold), "period": period_deg}
    document: dict[str, Any] = {**task, "seed": seed, "provenance": dict(shard.attrs)}
    results: dict[str, CrossValidation] = {}
    tested: dict[str, TaskData] = {}
    try:
        rows = task_data(shard, target, kind, groups)
        known, held = split_withheld(rows, withhold)
        folds = min(folds, len(np.unique(known.group)))
        if withhold:
            tested[WITHHELD] = held
        for name, path in (others or {}).items():
            other = task_data(read_store(path), target, kind, groups)
            tested[f"on:{name}"] = other.where(~is_among(other.value, withhold))
        extra = {n: ExtraTestSet(r.feature, r.value, r.group) for n, r in tested.items()}
        for split in ("grouped", "random") if compare_random else ("grouped",):
            with np.errstate(over="ignore", invalid="ignore"):  # _computable tells
                results[split] = cross_validate(
                    known.feature, known.value, known.group if split == "grouped" else None,
                    kind=kind, model=model, folds=folds, seed=seed, period=period_deg,
                    extra_tests=extra if split == "grouped" else None,
                )  # fmt: skip
            if not _computable(results[split].scores):
                problem = f"errors of {target!r} are too large or too small to compute with"
                raise ValueError(f"{problem}: give it in another unit")
    except ValueError as error:
        results = {}
        document["skipped"] = str(error)
    lines = []
    for split, result in results.items():
        document[split] = plain(dataclasses.asdict(result.scores))
        lines += _lines(known.name, split, result.predictions)
        for name, found in result.extra_tests.items():
            document[name] = plain(dataclasses.asdict(found.scores))
            lines += _lines(tested[name].name, name, found.predictions)
    document["by_value"] = []
    if results and kind == "regression":
        document |= plain(_by_value(results["grouped"], period_deg))
    document["silent"] = {}
    if results:
        document["silent"] = {
            name: _heard(results["grouped"], tested, f"on:{name}", kind, period_deg, seed)
            for name in silent
        }
    write_bytes(predictions, csv_bytes(PREDICTION_COLUMNS, lines))
    measured = {split: plain(dataclasses.asdict(r.cost)) for split, r in results.items()}
    write_bytes(cost, json_bytes(measured))
    write_bytes(metrics, json_bytes(document))


def _by_value(found: CrossValidation, period: float | None) -> dict[str, Any]:
    """Errors value by value, and those of known and withheld values together."""
    from ajgdata.evaluate.crossval import deviation
    from ajgdata.evaluate.withheld import by_value, overall

    made: dict[str, Any] = {}
    held = found.extra_tests[WITHHELD].predictions if WITHHELD in found.extra_tests else None
    if len(np.unique(found.predictions.y_true)) <= MAX_VALUES:
        values = by_value(found.predictions, held, period)
        made["by_value"] = [dataclasses.asdict(one) for one in values]
    if held is not None:
        per_fold = overall(found.predictions, held, period)
        made["overall"] = {
            "per_fold": per_fold,
            "mean": {name: np.mean(values) for name, values in per_fold.items()},
            "sd": {name: deviation(values) for name, values in per_fold.items()},
            "folds": found.scores.folds,
            "recordings": len(np.unique(held.row)) + len(found.predictions.row),
        }
    return made


def _heard(
    found: CrossValidation,
    tested: Mapping[str, TaskData],
    name: str,
    kind: Kind,
    period: float | None,
    seed: int,
) -> dict[str, Any]:
    """What predictions from silent recordings know of the target."""
    from ajgdata.evaluate.shortcut_test import shortcut_test

    p = found.extra_tests[name].predictions
    group = tested[name].group[p.row]
    test = shortcut_test(p.y_true, p.y_pred, p.fold, group, kind=kind, period=period, seed=seed)
    return dataclasses.asdict(test)


def _computable(scores: Scores) -> bool:
    """Whether the leading error, and what it is compared with, are finite and not rounded to 0."""
    from ajgdata.evaluate.metrics import METRICS

    name = METRICS[scores.kind][0]
    numbers = (scores.mean[name], scores.sd[name], scores.chance[name])
    return all(map(math.isfinite, numbers)) and (scores.kind != "regression" or numbers[2] > 0)


def _lines(names: np.ndarray, split: str, found: Predictions) -> list[dict[str, object]]:
    probability = [""] * len(found.row) if found.probability is None else found.probability
    columns = (names[found.row], found.fold, found.y_true, found.y_pred, probability)
    return [
        {"recording": n, "split": split, "fold": f, "y_true": t, "y_pred": p, "probability": q}
        for n, f, t, p, q in zip(*(np.asarray(c).tolist() for c in columns), strict=True)
    ]
