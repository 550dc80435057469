"""Embedding: every recording in two dimensions, and how well the objects are separated."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.experiments.base import (
    Experiment,
    Inputs,
    Lookup,
    Outcome,
    ScoreRow,
    TaskResults,
    score_table,
)
from ajgdata.experiments.embedding import (
    by_run,
    run_scores,
    scores_by,
    supervision,
    trained,
    with_space_titles,
)
from ajgdata.experiments.embedding_knn import encoder_cost
from ajgdata.experiments.plots import Plot
from ajgdata.report.comparison import PaperComparison, holds
from ajgdata.report.format import mean_sd, words
from ajgdata.report.projections import PLANE, Projection, Projections
from ajgdata.types import Embedding
from ajgdata.types.table import Table, table_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ajgdata.evaluate.embedding_data import EmbeddingData
    from ajgdata.store.latents import Latents

NAME = "embedding_projections"
TITLE = "Embedding: projections"
#: The run that is looked at.
FOLD, INIT = 0, 0


def measure(inputs: Inputs, settings: Embedding, _: str) -> Outcome:
    """Return the projections of one run, and the silhouettes of all runs, in the latent and raw.

    A latent of two dimensions is included as it is. Each recording has its object, category,
    targets, session and grasp. Raises NotPossibleError if nothing could be trained.
    """
    from ajgdata.embed.projections import project
    from ajgdata.models.baselines import raw_scaling

    data, latents = trained(inputs, settings)
    training = latents.validation_fold != FOLD
    raw = raw_scaling().fit(data.feature[training]).transform(data.feature)
    spaces = {"raw": raw, "latent": latents.latent[settings.shown][FOLD, INIT]}
    planes = {
        (space, method): plane
        for space, points in spaces.items()
        for method, plane in project(points, training, inputs.seed).items()
    }
    if 2 in latents.latent:
        planes = {("latent", PLANE): latents.latent[2][FOLD, INIT]} | planes
    first = settings.instance, settings.category or settings.target
    targets = [name for name in inputs.kinds if name in data.columns]
    names = dict.fromkeys((*first, *targets, "session_id", settings.groups))
    known = {"recording": data.column("recording"), "training": training}
    known |= {name: data.column(name) for name in names}
    recordings = (dict(zip(known, row, strict=True)) for row in zip(*known.values(), strict=True))
    points = (
        {"space": space, "method": method, "x": _seven_digits(x), "y": _seven_digits(y)}
        for (space, method), plane in planes.items()
        for x, y in plane
    )
    note = "The points of each space and method are in the order of the recordings."
    silhouettes = list(_silhouettes(data, latents, settings))
    labels = {"space": "Space", "label": "Labels", "run": "Run", "silhouette": "Silhouette"}
    tables = (
        score_table(_silhouette_scores(silhouettes), TITLE),
        table_of("silhouettes", "Silhouettes", by_run(silhouettes, "silhouette"), **labels),
        table_of("recordings", "Recordings", recordings, **{name: words(name) for name in known}),
        table_of("points", TITLE, points, note, space="Space", method="Method", x="x", y="y"),
    )
    about = {"fold": FOLD, "init": INIT, "dimension": settings.shown, **data.thinned}
    return Outcome(tables, about=about)


def _silhouettes(
    data: EmbeddingData, latents: Latents, settings: Embedding
) -> Iterator[dict[str, Any]]:
    """Yield the silhouettes of validation points by space and column of labels."""
    from ajgdata.evaluate.embedding_data import runs_by_space
    from ajgdata.evaluate.neighbours import silhouette

    seen = latents.latent[settings.shown], latents.validation_fold
    for space, runs in runs_by_space(data, *seen):
        for label in dict.fromkeys([settings.instance, settings.category or settings.target]):
            value = data.column(label).astype(str)
            values = [silhouette(points[test], value[test]) for points, _, test in runs]
            yield {"space": space, "label": label, "values": values}


def _silhouette_scores(rows: Iterable[dict[str, Any]]) -> Iterator[ScoreRow]:
    for row in rows:
        metric = f"silhouette of {row['label']}"
        yield from run_scores(row["space"], "silhouette", metric, row["values"])


def _seven_digits(value: float) -> float:
    """Return a float32 as JSON shows it: more than seven digits would be made up."""
    return float(f"{value:.7g}")


def projections_of(tables: Mapping[str, Table]) -> Projections:
    """Return the projections, the latent of two dimensions first, as the tables hold them."""
    recordings, points = tables["recordings"], tables["points"]
    columns = {
        column.key: _column(recordings, column.key)
        for column in recordings.columns
        if column.key not in ("recording", "training")
    }
    return Projections(
        recording=np.array(recordings.column("recording"), np.str_),
        training=np.array(recordings.column("training"), bool),
        columns=columns,
        projections=tuple(
            Projection(space, method, np.column_stack([part.numbers("x"), part.numbers("y")]))
            for space, of_space in points.parted("space").items()
            for method, part in of_space.parted("method").items()
        ),
    )


def _column(table: Table, key: str) -> NDArray[Any]:
    """Return text or float64."""
    values = table.column(key)
    if any(isinstance(value, str) for value in values):
        return np.array(values, np.str_)
    return table.numbers(key)


def by_label(results: TaskResults) -> Table:
    """Return the silhouettes of each run."""
    return with_space_titles(results.results[0].tables["silhouettes"])


SILHOUETTES = Plot(
    "rows",
    by_label,
    "silhouette (Rousseeuw 1987) of validation points by object and by category",
    value="silhouette",
    x="label",
    series=("space",),
    over="folds and initialisations",
    better="high",
    name="silhouettes",
)


def paper_comparison(results: TaskResults, lookup: Lookup) -> Iterator[PaperComparison]:
    """Yield whether objects form clusters, by the silhouette of validation points of all runs."""
    column, table = results.settings.instance, results.results[0].tables["silhouettes"]
    scores = scores_by(table, ("space", "label"), "silhouette")
    if results.paper is None or ("latent", column) not in scores:
        return
    score, raw = scores["latent", column], scores["raw", column]
    result = (
        f"silhouette of objects {mean_sd(score)} (raw features {mean_sd(raw)}) "
        f"in {results.settings.shown}-D"
    )
    cost = encoder_cost(results, lookup)
    yield results.compared(results.paper, result, "latent", holds(score), cost=cost)


EXPERIMENT = Experiment(
    name=NAME,
    title=TITLE,
    settings=Embedding,
    measure=measure,
    plots=(SILHOUETTES,),
    paper_comparison=paper_comparison,
    summary=supervision,
    of_embedding=True,
    order=80,
    paper="embedding",
)
