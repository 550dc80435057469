"""Latents -> what they are worth: distances, k-NN, probes, retrieval; one document each.

Beside each number of a latent stands that of the raw features, on the same recordings.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.pipeline.embed import Logged, logged_of, runs_of, summary, write_document
from ajgdata.store.features import read_store
from ajgdata.store.files import json_bytes, read_json, write_bytes
from ajgdata.store.latents import Latents, read_latents
from ajgdata.types import Embedding, Kind

RETRIEVED = (1, 5, 10)
Run = tuple[np.ndarray, np.ndarray, np.ndarray]


def knn_task(
    store: Path,
    latents: Path,
    training_cost: Path,
    *,
    settings: Embedding,
    seed: int,
    output: Path,
    cost: Path,
) -> None:
    """k-NN on latents, raw features, PCA and UMAP against the dimension; times into `cost`."""
    times: list[dict[str, Any]] = []

    def made(logged: Logged, found: Latents) -> dict[str, Any]:
        from ajgdata.models.baselines import NEIGHBOURS

        spent = read_json(training_cost)
        share = spent["cpu_s"] / spent["networks"]
        value = logged.column(settings.target)
        scored = list(_scored(logged, found, value, settings, seed))
        raw = float(np.mean([one.accuracy for space, _, runs in scored for one in runs
                             if space == "raw"]))  # fmt: skip
        rows = []
        for space, dimension, runs in scored:
            row = {"space": space, "dimension": dimension}
            found_here = summary([one.accuracy for one in runs])
            gain = found_here["mean"] - raw
            rows.append(row | found_here | {"gain_points": 100 * gain, "gain_relative": gain / raw})
            seconds = {
                name: float(np.mean([getattr(one, name) for one in runs]))
                for name in ("fit_s", "transform_s", "query_s")
            }
            tested = len(logged.feature) / len({*found.validation_fold.tolist()})
            if space == "latent":  # made by another job
                encoded = {"transform_s": spent["encode_s_per_recording"] * tested}
                seconds |= {"fit_s": share, **encoded}
            times.append(row | seconds | {"recordings": tested})
        chance = np.unique(value[value != ""], return_counts=True)[1].max() / np.sum(value != "")
        return {"k": NEIGHBOURS, "target": settings.target, "chance": chance, "rows": rows}

    _write(store, latents, settings, made, output)
    write_bytes(cost, json_bytes({"rows": times}))


def _scored(
    logged: Logged, found: Latents, value: np.ndarray, settings: Embedding, seed: int
) -> Iterator[tuple[str, int | None, list[Any]]]:
    """Space, dimension and what each run scored."""
    from ajgdata.embed.projections import REDUCERS
    from ajgdata.evaluate import neighbours

    present = value != ""

    def known(rows: np.ndarray) -> np.ndarray:
        return rows[present[rows]]

    folds = [
        (known(np.flatnonzero(found.validation_fold != k)),
         known(np.flatnonzero(found.validation_fold == k)))
        for k in range(found.validation_fold.max() + 1)
    ]  # fmt: skip
    yield "raw", None, [neighbours.score_raw(logged.feature, value, *fold) for fold in folds]
    for dimension in settings.dimensions:
        runs = runs_of(found.latent[dimension], found.validation_fold)
        scores = [neighbours.score_latent(z, value, known(a), known(b)) for z, a, b in runs]
        yield "latent", dimension, scores
    for reducer in REDUCERS:
        neighbours.warm_up(reducer)
        for dimension in settings.dimensions:
            reduced = [
                neighbours.score_reduced(
                    logged.feature, value, *fold, reducer=reducer, dimension=dimension, seed=seed
                )
                for fold in folds
            ]
            if all(reduced):
                yield reducer, dimension, reduced


def measure_task(
    store: Path,
    latents: Path,
    *,
    settings: Embedding,
    kinds: Mapping[str, Kind],
    distances: Path,
    probes: Path,
    retrieval: Path,
) -> None:
    """Distances, probes and retrieval; `kinds` are of the columns that are targets."""
    _write(store, latents, settings, lambda of, found: _distances(of, found, settings), distances)
    _write(store, latents, settings, lambda of, found: _probes(of, found, settings, kinds), probes)
    _write(store, latents, settings, lambda of, found: _retrieval(of, found, settings), retrieval)


def _write(
    store: Path,
    latents: Path,
    settings: Embedding,
    made: Callable[[Logged, Latents], dict[str, Any]],
    output: Path,
) -> None:
    """Write what `made` says of the recordings and their latents, or why it cannot."""
    found = read_latents(latents)
    try:
        if "skipped" in found.attrs:
            raise ValueError(str(found.attrs["skipped"]))
        content = made(logged_of(read_store(store), settings), found)
    except ValueError as error:
        content = {"skipped": str(error)}
    write_document(output, settings, found.attrs, content)


def _spaces(
    logged: Logged, latent: np.ndarray, fold: np.ndarray
) -> Iterator[tuple[str, list[Run]]]:
    """Runs of the latent, and of the raw features, which have one for each fold."""
    from ajgdata.embed.encoder import raw_scaling

    yield "latent", list(runs_of(latent, fold))
    runs = []
    for number in range(len(latent)):
        train, test = np.flatnonzero(fold != number), np.flatnonzero(fold == number)
        scaling = raw_scaling().fit(logged.feature[train])
        runs.append((scaling.transform(logged.feature), train, test))
    yield "raw", runs


def _distances(logged: Logged, found: Latents, settings: Embedding) -> dict[str, Any]:
    from ajgdata.evaluate.distances import mean_distances

    category = logged.column(settings.category or settings.target).astype(str)
    categories, objects = np.unique(category[category != ""]), np.unique(logged.instance)
    of_object = [str(category[logged.instance == one][0]) for one in objects]

    def matrices(
        runs: Sequence[Run], label: np.ndarray, names: np.ndarray, apart: np.ndarray
    ) -> dict[str, Any]:
        each = np.array([
            mean_distances(z[test], label[test], names, apart[test]) for z, _, test in runs
        ])  # fmt: skip
        # of things that folds hold out whole, a fold knows no distance to those of other folds
        with np.errstate(invalid="ignore"):
            count = np.isfinite(each).sum(axis=0)
            mean = np.nansum(each, axis=0) / count
            sd = np.sqrt(np.nansum((each - mean) ** 2, axis=0) / (count - 1))
        return {"mean": mean, "sd": sd, "per_run": each}

    spaces = {}
    runs: list[Run]
    for space, runs in _spaces(logged, found.latent[settings.shown], found.validation_fold):
        by_object = matrices(runs, logged.instance, objects, logged.grasp)
        spaces[space] = {
            "categories": categories,
            **matrices(runs, category, categories, logged.grasp),
            "other_objects": matrices(runs, category, categories, logged.instance),
            "objects": objects,
            "object_category": of_object,
            "object_mean": by_object["mean"],
            "object_sd": by_object["sd"],
        }
    return {"dimension": settings.shown, "spaces": spaces}


def _probes(
    logged: Logged, found: Latents, settings: Embedding, kinds: Mapping[str, Kind]
) -> dict[str, Any]:
    splits = {} if logged.separated else {
        "grouped": (found.latent[settings.shown], found.validation_fold)
    }  # fmt: skip
    if found.unseen is not None:
        splits["unseen"] = (found.unseen, found.unseen_fold)
    rows = [
        {"space": space, "split": split, **row}
        for split, (latent, fold) in splits.items()
        for space, runs in _spaces(logged, latent, fold)
        for row in probe_rows(logged, runs, settings, kinds, unseen=split == "unseen")
    ]
    return {"dimension": settings.shown, "rows": rows,
            "silhouette": list(_silhouettes(logged, found, settings))}  # fmt: skip


def probe_rows(
    logged: Logged,
    runs: Sequence[Run],
    settings: Embedding,
    kinds: Mapping[str, Kind],
    *,
    unseen: bool,
) -> Iterator[dict[str, Any]]:
    """Scores of all probes in one space. Of unseen things none can say which they are.

    What is read thing by thing is read of unseen things alone, learned from some of their grasps
    and tested on others: the latents of a thing that was trained on lie where its new grasps do
    not, and a probe would learn from what it is not tested on.
    """
    from ajgdata.evaluate.probes import PROBES, Property, probe, probe_within

    for column, how in settings.probes.items():
        if bool(how.within) > unseen or (unseen and column in (settings.instance, "object")):
            continue
        kind = kinds.get(column, "classification")
        prop = Property(logged.column(column), kind, how.period_deg)
        for name in PROBES:
            if how.within:
                part = logged.column(how.within)
                scores = [probe_within(z, prop, name, part, logged.grasp, b) for z, _, b in runs]
            else:
                scores = [probe(z, prop, name, a, b) for z, a, b in runs]
            for metric in ["accuracy"] if kind == "classification" else ["r2", "rank_correlation"]:
                yield {
                    "probe": name, "target": column, "kind": kind, "metric": metric,
                    **summary([one[metric] for one in scores]),
                    "chance": np.mean([one["chance"] for one in scores]),
                }  # fmt: skip


def _silhouettes(logged: Logged, found: Latents, settings: Embedding) -> Iterator[dict[str, Any]]:
    from ajgdata.evaluate.distances import silhouette

    labels = dict.fromkeys([settings.instance, settings.category or settings.target])
    for space, runs in _spaces(logged, found.latent[settings.shown], found.validation_fold):
        for label in labels:
            value = logged.column(label).astype(str)
            scores = [silhouette(z[test], value[test]) for z, _, test in runs]
            yield {"space": space, "label": label, **summary(scores)}


def _retrieval(logged: Logged, found: Latents, settings: Embedding) -> dict[str, Any]:
    from ajgdata.evaluate.distances import precision_at

    if found.unseen is None:
        raise ValueError("retrieval_folds is 0: no network left things out")
    at = [k for k in RETRIEVED if k <= _findable(logged)]
    if not at:
        raise ValueError("most things were grasped once: there is nothing to be found")
    rows = []
    for space, runs in _spaces(logged, found.unseen, found.unseen_fold):
        for gallery in ("unseen", "all"):
            each = [
                precision_at(
                    z, logged.instance, logged.grasp,
                    queries=test, gallery=test if gallery == "unseen" else np.arange(len(z)),
                    at=at,
                )
                for z, _, test in runs
            ]  # fmt: skip
            for number, k in enumerate(at):
                rows.append({
                    "space": space, "k": k, "gallery": gallery,
                    **summary([one.precision[number] for one in each]),
                    "chance": np.mean([one.chance for one in each]),
                })  # fmt: skip
    return {"dimension": settings.shown, "rows": rows}


def _findable(logged: Logged) -> float:
    """How many recordings there are to find of a thing besides those of one grasp, in the middle of
    all things."""
    found = []
    for one in np.unique(logged.instance):
        counts = np.unique(logged.grasp[logged.instance == one], return_counts=True)[1]
        found.append(counts.sum() - counts.max())
    return float(np.median(found))
