"""Feature store -> what the paper's further experiments ask of a task: one document each.

Curve, permutation test and sorting, in this order; a task that lacks what one needs is written as
such with the reason, as evaluations are.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.evaluate.task_data import TaskData, split_withheld, task_data
from ajgdata.store.features import read_store
from ajgdata.store.files import json_bytes, write_bytes
from ajgdata.store.tables import plain
from ajgdata.types import Kind

#: Hundreds of times trained: of the models that train at once, the better one on ycb's inner folds
#: (docs/models.md).
PERMUTED_MODEL = "ridge"
RUNS = 500  #: simulated runs of sorting, each with its own seed


def curve_task(
    store: Path,
    *,
    target: str,
    kind: Kind,
    unit: str,
    groups: str,
    folds: int,
    period_deg: float | None,
    withhold: Sequence[float],
    model: str,
    sizes: Sequence[int],
    repeats: int,
    seed: int,
    output: Path,
) -> None:
    """Learning curve of `model`: errors on the same grasps for each number of training grasps."""
    from ajgdata.evaluate.curves import learning_curve
    from ajgdata.evaluate.metrics import METRICS

    def made(rows: TaskData) -> dict[str, Any]:
        points = learning_curve(
            rows.feature, rows.value, rows.group,
            kind=kind, model=model, sizes=sizes, repeats=repeats, folds=folds, seed=seed,
            period=period_deg,
        )  # fmt: skip
        metric = METRICS[kind][0]
        return {"metric": metric, "points": [dataclasses.asdict(point) for point in points]}

    about = {"target": target, "kind": kind, "unit": unit, "groups": groups, "model": model}
    _write(store, {**about, "seed": seed, "folds": folds}, withhold, made, output)


def permute_task(
    store: Path,
    *,
    target: str,
    kind: Kind,
    unit: str,
    groups: str,
    folds: int,
    period_deg: float | None,
    withhold: Sequence[float],
    permutations: int,
    seed: int,
    output: Path,
) -> None:
    """Permutation test against chance, with the model PERMUTED_MODEL."""
    from ajgdata.evaluate.permutations import permutation_test

    def made(rows: TaskData) -> dict[str, Any]:
        found = permutation_test(
            rows.feature, rows.value, rows.group,
            kind=kind, model=PERMUTED_MODEL, permutations=permutations, folds=folds, seed=seed,
            period=period_deg,
        )  # fmt: skip
        return dataclasses.asdict(found)

    about = {"target": target, "kind": kind, "unit": unit, "groups": groups}
    about |= {"model": PERMUTED_MODEL}
    _write(store, {**about, "seed": seed, "folds": folds}, withhold, made, output)


def sort_task(
    store: Path,
    *,
    target: str,
    kind: Kind,
    unit: str,
    groups: str,
    folds: int,
    period_deg: float | None,
    withhold: Sequence[float],
    model: str,
    objects: Sequence[str],
    threshold: float,
    seed: int,
    output: Path,
) -> None:
    """Calibration of `model`, trained on `objects` only, and runs of sorting them by it."""

    def made(rows: TaskData) -> dict[str, Any]:
        if missing := sorted(set(objects) - set(rows.value.tolist())):
            raise ValueError(f"sorting: there is no {target} {missing[0]!r}")
        return _sorted_by(rows.where(np.isin(rows.value, objects)), model, threshold, folds, seed)

    about = {"target": target, "kind": kind, "unit": unit, "groups": groups, "model": model}
    chosen = {"objects": list(objects), "threshold": threshold}
    _write(store, {**about, **chosen, "seed": seed, "folds": folds}, withhold, made, output)


def energy_task(
    store: Path,
    *,
    target: str,
    kind: Kind,
    unit: str,
    groups: str,
    reference: str,
    band_hz: tuple[float, float],
    output: Path,
) -> None:
    """Energies of the classes of `target` within `band_hz` against those of `reference`."""
    from ajgdata.evaluate.energy import band_energy, relative_energies

    shard = read_store(store)
    matched = dict(
        zip(shard.columns["recording"].values, shard.columns["object"].values, strict=True)
    )

    def made(rows: TaskData) -> dict[str, Any]:
        found = relative_energies(
            band_energy(rows.feature, shard.frequency_hz, band_hz),
            rows.value, rows.group, np.array([matched[name] for name in rows.name]), reference,
        )  # fmt: skip
        return {"parts": [dataclasses.asdict(one) for one in found]}

    about = {"target": target, "kind": kind, "unit": unit, "groups": groups, "model": ""}
    chosen = {"reference": reference, "band_hz": list(band_hz), "seed": None}
    _write(store, {**about, **chosen}, (), made, output)


def calibrate_task(
    store: Path,
    *,
    target: str,
    kind: Kind,
    unit: str,
    groups: str,
    folds: int,
    period_deg: float | None,
    withhold: Sequence[float],
    model: str,
    others: Mapping[str, Path],
    grasps: Sequence[int],
    seed: int,
    output: Path,
) -> None:
    """Errors of `model` on `others`, stores by data set, for each number of calibration grasps."""
    from ajgdata.evaluate.cross_gripper import cross_gripper
    from ajgdata.evaluate.crossval import ExtraTestSet
    from ajgdata.evaluate.metrics import METRICS

    def made(rows: TaskData) -> dict[str, Any]:
        own, on = ExtraTestSet(rows.feature, rows.value, rows.group), {}
        for name, path in others.items():
            theirs = split_withheld(task_data(read_store(path), target, kind, groups), withhold)[0]
            points = cross_gripper(
                own, ExtraTestSet(theirs.feature, theirs.value, theirs.group),
                kind=kind, model=model, sizes=grasps, folds=folds, seed=seed, period=period_deg,
            )  # fmt: skip
            on[name] = [dataclasses.asdict(point) for point in points]
        return {"metric": METRICS[kind][0], "on": on}

    about = {"target": target, "kind": kind, "unit": unit, "groups": groups, "model": model}
    _write(store, {**about, "seed": seed, "folds": folds}, withhold, made, output)


def _sorted_by(
    rows: TaskData, model: str, threshold: float, folds: int, seed: int
) -> dict[str, Any]:
    from ajgdata.evaluate.calibration import calibrated, calibration_error, reliability
    from ajgdata.evaluate.sorting import accepted, decisions, sort_stream

    found = calibrated(rows.feature, rows.value, rows.group, model=model, folds=folds, seed=seed)
    label = np.searchsorted(found.classes, rows.value)
    document: dict[str, Any] = {"temperatures": found.temperatures, "recordings": len(label)}
    for name, probability in (("plain", found.plain), ("scaled", found.scaled)):
        right = probability.argmax(axis=1) == label
        bins = reliability(probability.max(axis=1), right)
        taken = decisions(probability, threshold)
        runs = [sort_stream(taken, label, seed + n) for n in range(RUNS)]
        document[name] = {
            "accuracy": right.mean(),
            "calibration_error": calibration_error(bins),
            "bins": [dataclasses.asdict(one) for one in bins],
            "accepted": dataclasses.asdict(accepted(taken, label)),
            "sorts": [run.sorts for run in runs],
            "mistakes": [run.mistakes for run in runs],
            "before_mistake": [run.before_mistake for run in runs],
        }
    return document


def _write(
    store: Path,
    document: dict[str, Any],
    withhold: Sequence[float],
    made: Callable[[TaskData], dict[str, Any]],
    output: Path,
) -> None:
    """Write `document` with what `made` finds in the rows of its task, or why it cannot."""
    shard = read_store(store)
    document |= {"provenance": dict(shard.attrs)}
    try:
        rows = task_data(shard, document["target"], document["kind"], document["groups"])
        document |= made(split_withheld(rows, withhold)[0])
    except ValueError as error:
        document["skipped"] = str(error)
    write_bytes(output, json_bytes(plain(document)))
