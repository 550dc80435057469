"""Data, scores of runs, and names of spaces for all experiments on embeddings."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ajgdata.evaluate.embedding_data import EmbeddingData, embedding_data
from ajgdata.experiments.base import Inputs
from ajgdata.experiments.scores import ScoreKey, ScoreRow
from ajgdata.report.format import Score
from ajgdata.store.features import Latents
from ajgdata.types import DataError, Embedding, NotPossibleError
from ajgdata.types.table import Table

#: Names of spaces for people.
SPACES = {"latent": "latent", "raw": "raw features", "pca": "PCA", "umap": "UMAP"}


def trained(inputs: Inputs, settings: Embedding) -> tuple[EmbeddingData, Latents]:
    """Return the recordings of objects, and their latents in the same order.

    Raises ValueError with the reason if no encoder was trained, and DataError for latents of other
    recordings.
    """
    if inputs.latents is None:
        raise ValueError("no encoder was trained for it")
    if "skipped" in inputs.latents.attrs:
        raise NotPossibleError(str(inputs.latents.attrs["skipped"]))
    data = embedding_data(inputs.store, settings)
    latents = inputs.latents
    if not np.array_equal(data.column("recording"), latents.columns["recording"].values):
        where = f"latents of {inputs.task} of {inputs.dataset}"
        raise DataError(where, "belong to other features", "delete them and run again")
    return data, latents


def run_scores(
    metric: str, values: Sequence[float], key: ScoreKey, chance: float | None = None
) -> Iterator[ScoreRow]:
    """Yield the score of each run, mean and sd, and chance if it is known."""
    score = score_of(values)
    statistics = {f"run {run}": value for run, value in enumerate(score.per_fold)}
    statistics["mean"] = score.mean
    statistics["sd"] = score.sd
    if chance is not None:
        statistics["chance"] = chance
    for statistic, value in statistics.items():
        yield ScoreRow(metric, statistic, value, key)


def space_key(space: str, settings: Embedding, condition: str) -> ScoreKey:
    """Return the key of scores in a space; of the latent, the dimension `shown` is measured."""
    dimension = settings.shown if space == "latent" else None
    return ScoreKey(space, dimension=dimension, condition=condition)


def score_of(values: Sequence[float] | np.ndarray) -> Score:
    """Return mean, sample standard deviation (NaN of a single run) and values of runs (n,)."""
    runs = np.asarray(values, float)
    mean = float(np.mean(runs)) if len(runs) else math.nan
    sd = float(np.std(runs, ddof=1)) if len(runs) > 1 else math.nan
    return Score(mean, sd, tuple(runs.tolist()))


def scores_by(table: Table, keys: Sequence[str], key: str) -> dict[tuple[Any, ...], Score]:
    """Return the score of each combination of `keys`, in order of first appearance."""
    runs: dict[tuple[Any, ...], list[float]] = {}
    for row, number in zip(table.rows, table.numbers(key).tolist(), strict=True):
        runs.setdefault(tuple(row[k] for k in keys), []).append(number)
    return {names: score_of(values) for names, values in runs.items()}


def with_space_titles(table: Table) -> Table:
    """Return a table with the names of spaces for people in its column `space`."""
    return replace(table, rows=tuple(row | {"space": SPACES[row["space"]]} for row in table.rows))
