"""Shared by the experiments on embeddings: their data, scores of runs, and names of spaces."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ajgdata.evaluate.embedding_data import EmbeddingData, embedding_data
from ajgdata.experiments.base import Inputs, ScoreRow, TaskResults
from ajgdata.report.format import Score
from ajgdata.report.projections import SPACES
from ajgdata.types import DataError, Embedding, NotPossibleError
from ajgdata.types.table import Table

if TYPE_CHECKING:
    from ajgdata.store.latents import Latents


def trained(inputs: Inputs, settings: Embedding) -> tuple[EmbeddingData, Latents]:
    """Return the recordings of objects, and their latents in the same order.

    Raises ValueError, with the reason, where nothing could be trained, and DataError for latents
    of other recordings.
    """
    if inputs.latents is None:
        raise ValueError("no encoder was trained for it")
    if "skipped" in inputs.latents.attrs:
        raise NotPossibleError(str(inputs.latents.attrs["skipped"]))
    data, latents = embedding_data(inputs.store, settings), inputs.latents
    if not np.array_equal(data.column("recording"), latents.columns["recording"].values):
        where = f"latents of {inputs.task} of {inputs.dataset}"
        raise DataError(where, "are not of these features", "delete them and run again")
    return data, latents


def score_of(values: Sequence[float] | np.ndarray) -> Score:
    """Return mean, sample standard deviation (NaN of a single run) and values of runs (n,)."""
    runs = np.asarray(values, float)
    sd = float(np.std(runs, ddof=1)) if len(runs) > 1 else math.nan
    return Score(float(np.mean(runs)), sd, tuple(runs.tolist()))


def run_scores(
    space: str, part: str, metric: str, values: Sequence[float], chance: float | None = None
) -> Iterator[ScoreRow]:
    """Yield the rows of `score_table` for runs: each, mean and sd, and chance if it is known."""
    score = score_of(values)
    for run, one in enumerate(score.per_fold):
        yield space, part, metric, f"run {run}", one
    yield space, part, metric, "mean", score.mean
    yield space, part, metric, "sd", score.sd
    if chance is not None:
        yield space, part, metric, "chance", chance


def by_run(rows: Iterable[dict[str, Any]], key: str) -> Iterator[dict[str, Any]]:
    """Yield a row of a table for each of a row's `values`: its `run`, and itself as `key`."""
    for row in rows:
        for run, one in enumerate(row["values"]):
            yield {**row, "run": run, key: one}


def scores_by(table: Table, keys: Sequence[str], key: str) -> dict[tuple[Any, ...], Score]:
    """Return the score of each combination of `keys`, in order of first appearance."""
    found: dict[tuple[Any, ...], list[float]] = {}
    for row, number in zip(table.rows, table.numbers(key).tolist(), strict=True):
        found.setdefault(tuple(row[k] for k in keys), []).append(number)
    return {names: score_of(values) for names, values in found.items()}


def with_space_titles(table: Table) -> Table:
    """Return a table whose column `space` holds what spaces are called in legends."""
    return replace(table, rows=tuple(row | {"space": SPACES[row["space"]]} for row in table.rows))


def supervision(results: TaskResults) -> str:
    """Return what the pairs that the encoders learned from had to know, and how many recordings
    were used if not all were."""
    about = results.results[0].about
    some = ""
    if "available" in about:
        some = " Recordings used: {recordings:,} of {available:,}.".format(**about)
    return f"What the pairs are made from: {results.settings.supervision}{some}"
