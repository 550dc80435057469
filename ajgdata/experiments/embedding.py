"""Shared by the experiments on embeddings: their data, scores of runs, looks, and settings."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ajgdata.evaluate.embedding_data import EmbeddingData, embedding_data
from ajgdata.experiments.base import Inputs, TaskResults
from ajgdata.report.blocks import Illustration, ShownTable
from ajgdata.report.format import Caption, Score, sentence, words
from ajgdata.report.projections import SPACES
from ajgdata.types import DataError, Embedding, NotPossibleError
from ajgdata.types.table import Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ajgdata.store.latents import Latents

ScoreRow = tuple[str, str, str, str, float | None]
#: Place among the colours, and the marker, of a space in every figure.
_LOOKS = {
    "latent": (0, "o"),
    "raw": (6, "s"),
    "pca": (5, "^"),
    "umap": (2, "D"),
}


def trained(inputs: Inputs, settings: Embedding) -> tuple[EmbeddingData, Latents]:
    """Return the recordings of things, and their latents in the same order.

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
    """Yield the rows of `score_table` for runs: each, mean and sd, and chance if it is told."""
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


def look(space: str) -> dict[str, Any]:
    """Return colour and marker of a space, the same in every figure."""
    from ajgdata.report.canvas import COLOURS

    colour, marker = _LOOKS[space]
    return {"color": COLOURS[colour], "marker": marker}


def draw_space(axes: Axes, space: str, x: Sequence[float], scores: Sequence[Score]) -> None:
    """Draw the means and deviations (%) of a space over `x` as a line that is named at its end."""
    from ajgdata.report.labels import label_end

    mean = [100 * score.mean for score in scores]
    sd = [100 * np.nan_to_num(score.sd) for score in scores]
    style = {**look(space), "ms": 4.5, "capsize": 2.5}
    axes.errorbar(x, mean, sd, label=space_name(space), **style)
    label_end(axes, x[-1], mean[-1], space_name(space), str(style["color"]))


def space_name(space: str) -> str:
    """Return what a space is called in legends."""
    return SPACES.get(space, space)


def illustration(
    results: TaskResults, part: str, caption: Caption, draw: Callable[[], Figure]
) -> Illustration:
    """Return a figure of an embedding, whose caption says whose it is."""
    text = f"{results.title}, {results.source}. {caption.text}"
    told = Caption(text, f"{sentence(caption.alt)} {results.title}, {results.source}.")
    return Illustration(results.named(*([part] if part else [])), told, draw)


def supervision(results: TaskResults) -> str:
    """Return what the pairs that the encoders learned from had to know."""
    return f"What the pairs are made from: {results.settings.supervision}"


def settings_table(results: TaskResults) -> ShownTable:
    """Return how the embedding was made: first what its pairs had to know."""
    from ajgdata.report.render import setting

    listed = results.settings.model_dump(mode="json")
    rows = [("what the pairs are made from", str(listed.pop("supervision")))]
    rows += [(words(name), setting(listed[name])) for name in sorted(listed)]
    about = results.results[0].about
    if "available" in about:
        rows += [("recordings", "{recordings:,} of {available:,}, evenly of all".format(**about))]
    return ShownTable("Settings of the embedding.", ("setting", "value"), tuple(rows), "Settings")
