"""Embedding: distances within and between categories in each space."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from ajgdata.evaluate.agreement import PaperVerdict, joint_verdict
from ajgdata.evaluate.embedding_data import runs_by_space
from ajgdata.evaluate.neighbours import mean_distances
from ajgdata.experiments.base import (
    Experiment,
    Inputs,
    Lookup,
    Outcome,
    TaskResults,
)
from ajgdata.experiments.built_in import BUILT_IN
from ajgdata.experiments.embedding import (
    SPACES,
    score_of,
    scores_by,
    space_key,
    trained,
    with_space_titles,
)
from ajgdata.experiments.embedding_knn import encoder_cost
from ajgdata.experiments.plots import Plot
from ajgdata.experiments.scores import ScoreRow, score_table
from ajgdata.report.comparison import PaperComparison, holds
from ajgdata.report.format import Score, mean_sd, number, words
from ajgdata.types import Embedding
from ajgdata.types.table import Table, table_of

TITLE = "Embedding: distances"
#: Categories that lie close together in the paper, and the category that is spread widely.
CLOSE_CATEGORIES = ("spherical", "cylindrical")
SPREAD_CATEGORY = "other"


def measure(inputs: Inputs, settings: Embedding, _: str) -> Outcome:
    """Return mean distances of validation pairs of different grasps, in the latent and raw.

    Distances are in units of the space. Raises ValueError if no encoder could be trained.
    """
    data, latents = trained(inputs, settings)
    category = data.column(settings.category or settings.target).astype(str)
    names = np.unique(category[category != ""])
    rows: list[dict[str, Any]] = []
    spaces = runs_by_space(data, latents.latent[settings.shown], latents.validation_fold)
    for space, runs in spaces:
        for run, (points, _train, test) in enumerate(runs):
            matrix = mean_distances(points[test], category[test], names, data.grasp[test])
            for i, j in zip(*np.triu_indices(len(names)), strict=True):
                rows.append(
                    {
                        "space": space,
                        "first": names[i],
                        "second": names[j],
                        "run": run,
                        "distance": matrix[i, j],
                    }
                )
    columns = {
        "space": "Space",
        "first": "First",
        "second": "Second",
        "run": "Run",
        "distance": "Distance",
    }
    categories = table_of("categories", TITLE, rows, **columns)
    return Outcome(
        (score_table(_scores(categories, settings), TITLE), categories),
        about={"dimension": settings.shown},
    )


def _scores(categories: Table, settings: Embedding) -> Iterator[ScoreRow]:
    """Yield mean, sample deviation and values over the runs that have such pairs."""
    keys = ("space", "first", "second")
    for (space, first, second), score in scores_by(categories, keys, "distance").items():
        known = score_of(np.array(score.per_fold)[np.isfinite(score.per_fold)])
        statistics = {
            "mean": known.mean,
            "sd": known.sd,
            **{f"run {run}": value for run, value in enumerate(score.per_fold)},
        }
        key = space_key(space, settings, f"{first} to {second}")
        for statistic, value in statistics.items():
            yield ScoreRow("distance", statistic, value, key)


class CategoryDistances(NamedTuple):
    """Distances of a category in each run.

    `within` (runs,) is the mean distance within the category. `gaps` (runs,) is the mean distance
    to other categories minus `within`.
    """

    within: np.ndarray
    gaps: np.ndarray

    @property
    def gap(self) -> Score | None:
        """Return mean and sd of the finite `gaps`; None if fewer than two runs have one."""
        gaps = self.gaps[np.isfinite(self.gaps)]
        if len(gaps) < 2:
            return None
        return Score(float(gaps.mean()), float(gaps.std(ddof=1)))


def categories_of(results: TaskResults, space: str) -> dict[str, CategoryDistances]:
    """Return each category in a space, of pairs of different grasps."""
    table = results.results[0].tables["categories"].where(space=space)
    scores = scores_by(table, ("first", "second"), "distance")
    runs = {pair: np.array(score.per_fold) for pair, score in scores.items()}
    categories = {}
    for name in dict.fromkeys(map(str, table.column("first"))):
        within = runs[name, name]
        between = [runs[pair] for pair in runs if name in pair and pair != (name, name)]
        known = np.ma.masked_invalid(between or np.full((1, len(within)), np.nan))
        categories[name] = CategoryDistances(within, known.mean(axis=0).filled(np.nan) - within)
    return categories


def finding(results: TaskResults) -> str:
    """Return in each space how many categories are nearer within than to others."""
    counts = []
    for space in sorted(results.results[0].tables["categories"].split_by("space")):
        gaps = [category.gap for category in categories_of(results, space).values()]
        near = sum(gap is not None and gap.mean > 0 for gap in gaps)
        counts.append(f"{near} of {len(gaps)} in {SPACES[space]}")
    return f"Distance within categories smaller than between: {', '.join(counts)}"


def by_pair(results: TaskResults) -> Table:
    """Return the distances of each pair of categories, in units of each space."""
    rows = [
        row | {"pair": " to ".join(words(row[key]) for key in ("first", "second"))}
        for row in with_space_titles(results.results[0].tables["categories"]).rows
    ]
    columns = {"space": "Space", "pair": "Categories", "distance": "Distance"}
    return table_of("pairs", TITLE, rows, **columns)


class Claim(NamedTuple):
    """A statement of the paper: it holds if the difference, over runs, is above 0."""

    text: str
    difference: Score

    @property
    def verdict(self) -> PaperVerdict:
        """Return whether the difference is above 0 by two standard deviations."""
        return holds(self.difference)


def claims_of(results: TaskResults) -> list[Claim]:
    """Return the statements of the paper on distances in the latent.

    Empty if one of its categories is missing, or has distances in fewer than two runs.
    """
    latent = categories_of(results, "latent")
    gaps = {name: category.gap for name, category in latent.items() if category.gap}
    if not {*CLOSE_CATEGORIES, SPREAD_CATEGORY} <= set(gaps):
        return []
    claims = [
        Claim(f"{words(name)} has a smaller distance within than between", gaps[name])
        for name in CLOSE_CATEGORIES
    ]
    widest = np.max([latent[name].within for name in CLOSE_CATEGORIES], axis=0)
    wider = latent[SPREAD_CATEGORY].within - widest
    difference = Score(float(wider.mean()), float(wider.std(ddof=1)))
    claims.append(Claim(f"{words(SPREAD_CATEGORY)} has the largest distance within", difference))
    return claims


def paper_comparison(results: TaskResults, lookup: Lookup) -> Iterator[PaperComparison]:
    """Yield which categories lie together, and whether the one that the paper names is widest."""
    claims = claims_of(results)
    if results.paper is None or not claims:
        return
    latent = categories_of(results, "latent")
    text = []
    for name, claim in zip((*CLOSE_CATEGORIES, SPREAD_CATEGORY), claims, strict=True):
        within = float(np.nanmean(latent[name].within))
        gap = latent[name].gap or claim.difference
        text.append(f"{words(name)} {number(within)} within, {mean_sd(gap)} more to others")
    yield results.compared(
        results.paper,
        "; ".join(text),
        "latent",
        joint_verdict({claim.verdict for claim in claims}),
        cost=encoder_cost(results, lookup),
        remark=reason(claims),
    )


def reason(claims: Sequence[Claim]) -> str:
    """Return the verdict on each statement that does not agree; "" if all agree."""
    texts = [
        f"“{claim.text}” {claim.verdict.replace('inconclusive', 'is inconclusive')}"
        f" (difference {mean_sd(claim.difference)}, over folds and initialisations)"
        for claim in claims
        if claim.verdict != "agrees"
    ]
    count = len(claims) - len(texts)
    agree = f"{count} of {len(claims)} statements of the paper agree"
    return f"{agree}, but {'; '.join(texts)}" if texts else ""


DISTANCES_PLOT = Plot(
    "rows",
    by_pair,
    "mean distance of validation pairs of different grasps, in the unit of each space",
    value="distance",
    x="pair",
    series=(),
    panel="space",
    over="folds and initialisations",
    title=finding,
)
EXPERIMENT = Experiment(
    BUILT_IN["embedding_distances"],
    measure=measure,
    plots=(DISTANCES_PLOT,),
    paper_comparison=paper_comparison,
)
