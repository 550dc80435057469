"""Embedding: finding recordings of things that no encoder was trained on."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ajgdata.experiments.base import Experiment, Inputs, Outcome, TaskResults, score_table
from ajgdata.experiments.embedding import (
    by_run,
    draw_space,
    illustration,
    run_scores,
    scores_by,
    space_name,
    trained,
)
from ajgdata.report.blocks import Illustration
from ajgdata.report.comparison import mark_of
from ajgdata.report.format import Caption, Score, mean_sd
from ajgdata.report.panel import Highlight
from ajgdata.report.projections import ordered
from ajgdata.types import Embedding, NotPossibleError
from ajgdata.types.table import table_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ajgdata.evaluate.embedding_data import EmbeddingData

TITLE = "Embedding: retrieval"
RETRIEVED = (1, 5, 10)


def measure(inputs: Inputs, settings: Embedding, _: str) -> Outcome:
    """Return the precision at k of queries from unseen things, in the latent and raw.

    Raises ValueError where no network left things out, or none has enough grasps to be found.
    """
    from ajgdata.evaluate.distances import precision_at
    from ajgdata.evaluate.embedding_data import runs_by_space

    data, latents = trained(inputs, settings)
    if latents.unseen is None:
        raise NotPossibleError("retrieval_folds is 0: no network left things out")
    at = [k for k in RETRIEVED if k <= _findable(data)]
    if not at:
        raise NotPossibleError("most things were grasped once: there is nothing to be found")
    rows: list[dict[str, Any]] = []
    for space, runs in runs_by_space(data, latents.unseen, latents.unseen_fold):
        for gallery in ("unseen", "all"):
            each = [
                precision_at(
                    points, data.instance, data.grasp, queries=test,
                    gallery=test if gallery == "unseen" else np.arange(len(points)), at=at,
                )
                for points, _, test in runs
            ]  # fmt: skip
            chance = float(np.mean([one.chance for one in each]))
            for place, k in enumerate(at):
                values = [one.precision[place] for one in each]
                about = {"space": space, "gallery": gallery, "k": k}
                rows.append({**about, "chance": chance, "values": values})
    scores = (
        score
        for row in rows
        for score in run_scores(
            row["space"], f"retrieval:{row['gallery']}", f"precision at {row['k']}",
            row["values"], row["chance"],
        )
    )  # fmt: skip
    columns = {"space": "Space", "gallery": "Gallery", "k": "k", "chance": "Chance", "run": "Run"}
    columns |= {"precision": "Precision"}
    found = table_of("retrieval", TITLE, by_run(rows, "precision"), **columns)
    return Outcome((score_table(scores, TITLE), found), about={"dimension": settings.shown})


def _findable(data: EmbeddingData) -> float:
    """Return how many recordings there are to find of a thing besides those of one grasp, in the
    middle of all things."""
    found = []
    for one in np.unique(data.instance):
        counts = np.unique(data.grasp[data.instance == one], return_counts=True)[1]
        found.append(counts.sum() - counts.max())
    return float(np.median(found))


class Retrieval(NamedTuple):
    """Precision at k of queries from things never trained on; `gallery` is unseen or all."""

    space: str
    gallery: str
    k: int
    chance: float
    score: Score


def retrieval_of(results: TaskResults) -> list[Retrieval]:
    """Return the precisions of all spaces and galleries."""
    table = results.results[0].tables["retrieval"]
    scores = scores_by(table, ("space", "gallery", "k", "chance"), "precision")
    return [
        Retrieval(space, gallery, k, math.nan if chance is None else chance, score)
        for (space, gallery, k, chance), score in scores.items()
    ]


def finding(results: TaskResults) -> str:
    """Return how often the nearest recording is of the same thing, for each space."""
    rows = retrieval_of(results)
    gallery = rows[-1].gallery
    first = min(row.k for row in rows)
    here = [row for row in rows if (row.gallery, row.k) == (gallery, first)]
    told = ", ".join(
        f"{mean_sd(row.score, '%', 100)} ({space_name(space)})"
        for space in ordered([row.space for row in here])
        for row in here
        if row.space == space
    )
    nearest = "nearest recording is" if first == 1 else f"{first} nearest recordings are"
    return f"Of a thing never trained on, the {nearest} of the same thing in {told}"


def figure(results: TaskResults) -> Figure:
    """Return precision against k, a panel for each gallery."""
    from ajgdata.report.canvas import WIDTH_IN, new_figure

    rows = retrieval_of(results)
    galleries = list(dict.fromkeys(row.gallery for row in rows))
    drawn = new_figure(
        (WIDTH_IN, 3.3),
        finding(results),
        f"{results.title}: share of the k nearest recordings that are of the same thing, mean ± sd "
        "over runs",
        [results.source],
    )
    panels = drawn.subplots(1, len(galleries), sharey=True, squeeze=False)[0]
    for axes, gallery in zip(panels, galleries, strict=True):
        _panel(axes, [row for row in rows if row.gallery == gallery])
        axes.set(title=f"gallery: {gallery} things", xlabel="k", ylim=(0, None))
    panels[0].set_ylabel("precision at k (%)")
    return drawn


def _panel(axes: Axes, here: list[Retrieval]) -> None:
    """Draw the spaces of one gallery, named at their ends, and chance."""
    from ajgdata.report.labels import GREY, REFERENCES, label_end

    for space in ordered([row.space for row in here]):
        own = sorted((row for row in here if row.space == space), key=lambda row: row.k)
        draw_space(axes, space, [row.k for row in own], [row.score for row in own])
    chance = sorted({(row.k, 100 * row.chance) for row in here if math.isfinite(row.chance)})
    axes.plot(*np.reshape(chance, (-1, 2)).T, label="chance", **REFERENCES["chance"])
    if chance:
        label_end(axes, *chance[-1], "chance", GREY)
    axes.set_xticks(sorted({row.k for row in here}))


def caption(results: TaskResults) -> Caption:
    """Return the caption of `figure`."""
    listed = "; ".join(
        f"{space_name(row.space)}, k = {row.k}, gallery {row.gallery}: "
        f"{mean_sd(row.score, '%', 100)}"
        for row in retrieval_of(results)
    )
    return Caption(
        "Queries are recordings of things that the encoder was never trained on; the "
        "recordings of the query's own grasp are left out of the gallery.",
        f"{finding(results)}. Precision at k: {listed}.",
    )


def figures(results: TaskResults) -> list[Illustration]:
    """Return the one figure of all spaces."""
    return [illustration(results, "", caption(results), partial(figure, results))]


def highlights(results: TaskResults) -> list[Highlight]:
    """Return how precisely things never trained on are found, among as many as are looked at."""
    rows = retrieval_of(results)
    most = max((row.k for row in rows), default=0)
    found = {row.space: row for row in rows if row.k == most and row.gallery == rows[0].gallery}
    if not {"latent", "raw"} <= set(found):
        return []
    latent, raw = found["latent"], found["raw"]
    marks = (
        mark_of("ours", "latent", latent.score, 100),
        mark_of("other", "raw", raw.score, 100),
        mark_of("chance", "chance", Score(latent.chance, 0.0), 100),
    )
    return [Highlight("New objects", f"right of {most} nearest", "%", marks)]


EXPERIMENT = Experiment(
    name="embedding_retrieval",
    title=TITLE,
    settings=Embedding,
    measure=measure,
    figures=figures,
    highlights=highlights,
    of_embedding=True,
    asks=lambda settings: settings.leaves_things_out,
    order=84,
)
