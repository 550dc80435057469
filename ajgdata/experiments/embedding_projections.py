"""Embedding: every recording in two dimensions, and how well the objects are separated."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial
from typing import Any

import numpy as np

from ajgdata.embed.projections import project
from ajgdata.evaluate.embedding_data import EmbeddingData, runs_by_space
from ajgdata.evaluate.neighbours import silhouette
from ajgdata.experiments.base import Experiment, Inputs, Lookup, Outcome, TaskResults
from ajgdata.experiments.built_in import BUILT_IN
from ajgdata.experiments.embedding import (
    SPACES,
    run_scores,
    scores_by,
    space_key,
    trained,
    with_space_titles,
)
from ajgdata.experiments.embedding_knn import encoder_cost
from ajgdata.experiments.plots import Plot
from ajgdata.experiments.scores import score_table
from ajgdata.models.scaling import raw_scaling
from ajgdata.report.comparison import PaperComparison, holds
from ajgdata.report.format import Caption, mean_sd, words
from ajgdata.report.projections import projections_figure
from ajgdata.report.report_data import Illustration
from ajgdata.store.features import Latents
from ajgdata.types import Embedding
from ajgdata.types.table import Table, table_of

TITLE = "Embedding: projections"
#: Fold and initialisation of the run that is shown.
FOLD = 0
INIT = 0
#: The method of a space that has two dimensions and is shown as it is.
PLANE = "plane"
METHODS = {"pca": "PCA", "umap": "UMAP", PLANE: "2-D"}


def measure(inputs: Inputs, settings: Embedding, _: str) -> Outcome:
    """Return the projections of one run, and the silhouettes of all runs, in the latent and raw.

    A latent of two dimensions is included as it is. Each recording has its object, category,
    targets, session and grasp. Raises NotPossibleError if nothing could be trained.
    """
    data, latents = trained(inputs, settings)
    training = latents.validation_fold != FOLD
    planes = _planes(data, latents, settings, training, inputs.seed)
    points = (
        {"space": space, "method": method, "x": _seven_digits(x), "y": _seven_digits(y)}
        for (space, method), plane in planes.items()
        for x, y in plane
    )
    note = "The points of each space and method are in the order of the recordings."
    titles = {"space": "Space", "label": "Labels", "run": "Run", "silhouette": "Silhouette"}
    silhouettes = table_of(
        "silhouettes", "Silhouettes", _silhouettes(data, latents, settings), **titles
    )
    scores = (
        row
        for (space, label), score in scores_by(
            silhouettes, ("space", "label"), "silhouette"
        ).items()
        for row in run_scores("silhouette", score.per_fold, space_key(space, settings, label))
    )
    tables = (
        score_table(scores, TITLE),
        silhouettes,
        _recordings(data, settings, inputs.task_settings.kinds, training),
        table_of("points", TITLE, points, note, space="Space", method="Method", x="x", y="y"),
    )
    about = {"fold": FOLD, "init": INIT, "dimension": settings.shown, **data.thinned}
    return Outcome(tables, about=about)


def _planes(
    data: EmbeddingData, latents: Latents, settings: Embedding, training: np.ndarray, seed: int
) -> dict[tuple[str, str], np.ndarray]:
    """Return every recording in the plane (n, 2), by space and method."""
    raw = raw_scaling().fit(data.feature[training]).transform(data.feature)
    spaces = {"raw": raw, "latent": latents.latent[settings.shown][FOLD, INIT]}
    planes = {
        (space, method): plane
        for space, points in spaces.items()
        for method, plane in project(points, training, seed).items()
    }
    if 2 in latents.latent:
        planes = {("latent", PLANE): latents.latent[2][FOLD, INIT]} | planes
    return planes


def _recordings(
    data: EmbeddingData, settings: Embedding, targets: Iterable[str], training: np.ndarray
) -> Table:
    """Return the labels of each recording; `training` (n,) is True for training recordings."""
    names = [settings.instance, settings.category or settings.target]
    names += [name for name in targets if name in data.columns]
    columns = {
        "recording": data.column("recording"),
        "training": training,
        **{name: data.column(name) for name in (*names, "session_id", settings.groups)},
    }
    values = zip(*columns.values(), strict=True)
    rows = (dict(zip(columns, row, strict=True)) for row in values)
    return table_of("recordings", "Recordings", rows, **{name: words(name) for name in columns})


def _silhouettes(
    data: EmbeddingData, latents: Latents, settings: Embedding
) -> Iterator[dict[str, Any]]:
    """Yield the silhouette of validation points by space, column of labels and run."""
    shown = latents.latent[settings.shown], latents.validation_fold
    for space, runs in runs_by_space(data, *shown):
        for label in dict.fromkeys([settings.instance, settings.category or settings.target]):
            value = data.column(label).astype(str)
            for run, (points, _, test) in enumerate(runs):
                score = silhouette(points[test], value[test])
                yield {"space": space, "label": label, "run": run, "silhouette": score}


def _seven_digits(value: float) -> float:
    """Return a number with seven digits, the precision of float32."""
    return float(f"{value:.7g}")


def own_figures(results: TaskResults) -> Iterator[Illustration]:
    """Yield the figure of the recordings in the plane, one panel per space and method."""
    tables = results.results[0].tables
    labels = np.array(tables["recordings"].column(results.settings.instance), dtype=str)
    is_training = np.array(tables["recordings"].column("training"), dtype=bool)
    planes = {
        f"{SPACES[space]}, {METHODS[method]}": np.stack([plane.numbers("x"), plane.numbers("y")], 1)
        for space, methods in tables["points"].split_by("space").items()
        for method, plane in methods.split_by("method").items()
    }
    count = len(labels)
    text = (
        f"{results.title}, {results.source}. {count:,} recordings of {len({*labels})} objects; "
        "filled: training recordings, open: validation recordings. Axes have no unit."
    )
    alt = f"Scatter plots of {count:,} recordings: {'; '.join(planes)}."
    draw = partial(projections_figure, planes, labels, is_training, results.title, results.source)
    yield Illustration(results.named("points"), Caption(text, alt), draw)


def with_titles(results: TaskResults) -> Table:
    """Return the silhouettes of each run."""
    return with_space_titles(results.results[0].tables["silhouettes"])


def paper_comparison(results: TaskResults, lookup: Lookup) -> Iterator[PaperComparison]:
    """Yield whether objects form clusters, by the silhouette of validation points of all runs."""
    column = results.settings.instance
    table = results.results[0].tables["silhouettes"]
    scores = scores_by(table, ("space", "label"), "silhouette")
    if results.paper is None or ("latent", column) not in scores:
        return
    latent = scores["latent", column]
    raw = scores["raw", column]
    text = (
        f"silhouette of objects {mean_sd(latent)} (raw features {mean_sd(raw)}) "
        f"in {results.settings.shown}-D"
    )
    cost = encoder_cost(results, lookup)
    yield results.compared(results.paper, text, "latent", holds(latent), cost=cost)


def supervision(results: TaskResults) -> str:
    """Return what the pairs that the encoders learned from had to know, and how many recordings
    were used if not all were."""
    about = results.results[0].about
    count = ""
    if "available" in about:
        count = " Recordings used: {recordings:,} of {available:,}.".format(**about)
    return f"Source of the pairs: {results.settings.supervision}{count}"


SILHOUETTES_PLOT = Plot(
    "rows",
    with_titles,
    "silhouette (Rousseeuw 1987) of validation points by object and by category",
    value="silhouette",
    x="label",
    series=("space",),
    over="folds and initialisations",
    name="silhouettes",
)
EXPERIMENT = Experiment(
    BUILT_IN["embedding_projections"],
    measure=measure,
    plots=(SILHOUETTES_PLOT,),
    own_figures=own_figures,
    paper_comparison=paper_comparison,
    summary=supervision,
)
