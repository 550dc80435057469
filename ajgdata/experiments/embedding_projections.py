"""Embedding: every recording in two dimensions, and how well the objects are separated."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.experiments.base import (
    Experiment,
    Inputs,
    Lookup,
    Outcome,
    TaskResults,
    score_table,
)
from ajgdata.experiments.embedding import (
    ScoreRow,
    by_run,
    run_scores,
    scores_by,
    space_name,
    supervision,
    trained,
)
from ajgdata.experiments.embedding_knn import encoder_cost
from ajgdata.experiments.plots import Plot, illustrations
from ajgdata.report.blocks import Illustration
from ajgdata.report.comparison import PaperComparison, holds, mark_of
from ajgdata.report.format import Caption, Score, mean_sd, words
from ajgdata.report.projections import (
    METHODS,
    PLANE,
    Projection,
    Projections,
    ordered,
    shown_columns,
    text_colours,
)
from ajgdata.types import Embedding
from ajgdata.types.table import Table, table_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.figure import Figure

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
    from ajgdata.evaluate.distances import silhouette
    from ajgdata.evaluate.embedding_data import runs_by_space

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


def figure(results: TaskResults, shown: Projections, column: str) -> Figure:
    """Return a row for each space, a column for each method; filled: training, ring: validation."""
    from ajgdata.report.canvas import WIDTH_IN, new_figure

    spaces = ordered([one.space for one in shown.projections])
    methods = [m for m in METHODS if m in {one.method for one in shown.projections}]
    drawn = new_figure(
        (WIDTH_IN, 1.2 + 2.15 * len(spaces)),
        f"Recordings in two dimensions, by {words(column)}",
        f"{results.title}: colour: {words(column)}; filled: training, rings: validation recordings",
        [results.source],
    )
    panels = drawn.subplots(len(spaces), len(methods), squeeze=False)
    for axes in panels.flat:
        axes.set_axis_off()
    values = shown.columns[column]
    for one in shown.projections:
        axes = panels[spaces.index(one.space), methods.index(one.method)]
        axes.set_title(f"{space_name(one.space)} · {METHODS[one.method]}")
        axes.set_rasterization_zorder(1.5)  # many points: all of a panel in one image
        for name, colour in text_colours(values).items():
            own = values == name
            x, y = one.points[own & shown.training].T
            axes.scatter(x, y, s=7, c=colour, lw=0, alpha=0.75, zorder=1, label=words(name))
            x, y = one.points[own & ~shown.training].T
            axes.scatter(x, y, s=7, facecolors="none", edgecolors=colour, lw=0.8, zorder=1)
        axes.margins(0.06)
    named = axes.get_legend_handles_labels()
    drawn.legend(*named, loc="outside right center", markerscale=2)
    return drawn


def figures(results: TaskResults) -> Iterator[Illustration]:
    """Yield a figure for each column of text that distinguishes recordings, and the silhouettes.

    The interactive plot (`pipeline.explorer`) also colours numbers.
    """
    shown = projections_of(results.results[0].tables)
    columns = [one for one in shown_columns(shown) if shown.columns[one].dtype.kind == "U"]
    for column in columns:
        text = (
            f"{results.title}, {results.source}. Each recording in two dimensions, coloured by "
            f"{words(column)}. PCA and UMAP are fitted to training recordings and then place the "
            "others; t-SNE is fitted to all. Axes have no unit; distances between clusters of "
            "t-SNE and UMAP have no meaning."
        )
        caption = Caption(text, f"Scatter plots of recordings, coloured by {words(column)}.")
        drawn = partial(figure, results, shown, column)
        yield Illustration(results.named(f"by-{column}"), caption, drawn)
    yield from illustrations(results, (SILHOUETTES,))


def by_label(results: TaskResults) -> Table:
    """Return the silhouettes of each run, with the names of spaces."""
    table = results.results[0].tables["silhouettes"]
    rows = tuple(row | {"space": space_name(row["space"])} for row in table.rows)
    return replace(table, rows=rows)


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


def silhouettes_of(results: TaskResults) -> dict[tuple[str, str], Score]:
    """Return the silhouettes by space and column of labels."""
    table = results.results[0].tables["silhouettes"]
    scores = scores_by(table, ("space", "label"), "silhouette")
    return {(space, label): score for (space, label), score in scores.items()}


def paper_comparison(results: TaskResults, lookup: Lookup) -> Iterator[PaperComparison]:
    """Yield whether objects form clusters, by the silhouette of validation points of all runs."""
    column, scores = results.settings.instance, silhouettes_of(results)
    if results.paper is None or ("latent", column) not in scores:
        return
    score, raw = scores["latent", column], scores["raw", column]
    result = (
        f"silhouette of objects {mean_sd(score)} (raw features {mean_sd(raw)}) "
        f"in {results.settings.shown}-D"
    )
    yield PaperComparison(
        results.paper, results.dataset, results.task, results.source, result, "latent",
        holds(score), encoder_cost(results, lookup),
        marks=(mark_of("ours", "latent", score), mark_of("other", "raw", raw)),
    )  # fmt: skip


EXPERIMENT = Experiment(
    name=NAME,
    title=TITLE,
    settings=Embedding,
    measure=measure,
    plots=(SILHOUETTES,),
    figures=figures,
    paper_comparison=paper_comparison,
    summary=supervision,
    of_embedding=True,
    order=80,
    paper="embedding",
)
