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
from ajgdata.report.format import Caption, Score, mean_sd
from ajgdata.report.projections import ordered
from ajgdata.types import Embedding, NotPossibleError
from ajgdata.types.table import table_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ajgdata.evaluate.embedding_data import EmbeddingData

TITLE = "Embedding: retrieval"
RETRIEVED = (1, 5, 10)


def measure(inputs: Inputs, settings: Embedding, _: str) -> Outcome:
    """Return the precision at k of queries from unseen objects, in the latent and raw.

    Raises NotPossibleError if no network left objects out, or too few grasps can be found.
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
    """Return the precision at the smallest k in the last gallery, for each space."""
    rows = retrieval_of(results)
    k = min(row.k for row in rows)
    here = {r.space: r.score for r in rows if (r.gallery, r.k) == (rows[-1].gallery, k)}
    values = ", ".join(
        f"{space_name(space)} {mean_sd(here[space], '%', 100)}" for space in ordered([*here])
    )
    return f"Precision at {k} for objects never trained on: {values}"


def figure(results: TaskResults) -> Figure:
    """Return precision against k, a panel for each gallery."""
    from ajgdata.report.canvas import WIDTH_IN, new_figure
    from ajgdata.report.labels import REFERENCES, add_to_legend

    rows = sorted(retrieval_of(results), key=lambda row: row.k)
    subtitle = f"{results.title}: recordings of the same object, mean ± sd over runs"
    drawn = new_figure((WIDTH_IN, 3.3), finding(results), subtitle, [results.source])
    panels = drawn.subplots(1, 2, sharey=True)
    for axes, gallery in zip(panels, ("unseen", "all"), strict=True):
        here = [row for row in rows if row.gallery == gallery]
        for space in ordered([row.space for row in here]):
            own = [row for row in here if row.space == space]
            draw_space(axes, space, [row.k for row in own], [row.score for row in own])
        chance = [row for row in here if row.space == here[0].space]
        x, y = [row.k for row in chance], [100 * row.chance for row in chance]
        (line,) = axes.plot(x, y, label="chance", **REFERENCES["chance"])
        add_to_legend(axes, line, "chance")
        axes.set(title=f"gallery: {gallery} objects", xlabel="k", ylim=(0, None), xticks=x)
    panels[0].set_ylabel("precision at k (%)")
    return drawn


def figures(results: TaskResults) -> list[Illustration]:
    """Return the one figure of all spaces."""
    caption = (
        "Share of the k nearest recordings that are of the same object (mean ± sd over runs). "
        "Queries are recordings of objects that the encoder was never trained on; the gallery "
        "excludes the grasp of the query."
    )
    drawn = partial(figure, results)
    return [illustration(results, "", Caption(caption, f"{finding(results)}."), drawn)]


EXPERIMENT = Experiment(
    name="embedding_retrieval",
    title=TITLE,
    settings=Embedding,
    measure=measure,
    figures=figures,
    of_embedding=True,
    asks=lambda settings: settings.leaves_things_out,
    order=84,
)
