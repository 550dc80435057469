"""Embedding: distances within and between categories, and between things, in each space."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.evaluate.agreement import Verdict, together
from ajgdata.experiments.base import (
    Experiment,
    Inputs,
    Lookup,
    Outcome,
    TaskResults,
    score_table,
)
from ajgdata.experiments.embedding import ScoreRow, illustration, space_name, trained
from ajgdata.experiments.embedding_knn import encoder_cost
from ajgdata.report.blocks import Illustration
from ajgdata.report.comparison import Mark, PaperComparison, holds, mark_of
from ajgdata.report.format import Caption, Score, mean_sd, number, words
from ajgdata.types import Embedding
from ajgdata.types.table import Table, table_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ajgdata.evaluate.embedding_data import Run

Real = NDArray[np.floating]

TITLE = "Embedding: distances"
#: Which pairs are counted: all of different grasps, or those of different things alone.
ALL, DIFFERENT = "all", "different things"
#: What the paper says of its categories: these lie together, this one is spread widely.
TOGETHER, SPREAD = ("spherical", "cylindrical"), "other"
#: Figures, and the pairs that they show.
PAIRS = {
    "categories": "categories",
    "different": "categories, different objects only",
    "objects": "objects",
}
MOST_NUMBERS = 5  #: matrices of more names show no numbers
_PARTS = {ALL: "distances", DIFFERENT: "distances, other objects"}


def measure(inputs: Inputs, settings: Embedding, _: str) -> Outcome:
    """Return mean distances of validation pairs of different grasps, in the latent and raw.

    Distances are in units of the space. Raises ValueError where nothing could be trained.
    """
    from ajgdata.evaluate.embedding_data import runs_by_space

    data, latents = trained(inputs, settings)
    category = data.column(settings.category or settings.target).astype(str)
    categories, objects = np.unique(category[category != ""]), np.unique(data.instance)
    scores: list[ScoreRow] = []
    by_category: list[dict[str, Any]] = []
    by_object: list[dict[str, Any]] = []
    spaces = runs_by_space(data, latents.latent[settings.shown], latents.validation_fold)
    for space, runs in spaces:
        for pairs, apart in ((ALL, data.grasp), (DIFFERENT, data.instance)):
            rows = list(_pairs(runs, category, categories, apart))
            for row in rows:
                by_category += (
                    {"space": space, "pairs": pairs, **row, "run": run, "distance": one}
                    for run, one in enumerate(row["values"])
                )
            scores += _scores(space, _PARTS[pairs], rows)
        rows = list(_pairs(runs, data.instance, objects, data.grasp))
        by_object += ({"space": space, **row} for row in rows)
        scores += _scores(space, "distances, objects", rows, of_runs=False)
    columns = {"space": "Space", "first": "First", "second": "Second"}
    runs_of_pairs = {"pairs": "Pairs", **columns, "run": "Run", "distance": "Distance"}
    of_objects = {**columns, "mean": "Mean distance", "sd": "Deviation over runs"}
    tables = (
        score_table(scores, TITLE),
        table_of("categories", f"{TITLE} of categories", by_category, **runs_of_pairs),
        table_of("objects", f"{TITLE} of objects", by_object, **of_objects),
    )
    return Outcome(tables, about={"dimension": settings.shown})


def _pairs(
    runs: Sequence[Run], label: np.ndarray, names: np.ndarray, apart: np.ndarray
) -> Iterator[dict[str, Any]]:
    """Yield the upper half of the matrix of `names`: `values` of the runs, mean and sd."""
    from ajgdata.evaluate.distances import mean_distances

    each = np.array([
        mean_distances(run.points[run.test], label[run.test], names, apart[run.test])
        for run in runs
    ])  # fmt: skip
    mean, sd = mean_sd_of(each)
    for i, j in zip(*np.triu_indices(len(names)), strict=True):
        spread = {"mean": mean[i, j], "sd": sd[i, j], "values": each[:, i, j]}
        yield {"first": names[i], "second": names[j], **spread}


def _scores(
    space: str, part: str, rows: Iterable[dict[str, Any]], of_runs: bool = True
) -> Iterator[ScoreRow]:
    for row in rows:
        metric = f"{row['first']} to {row['second']}"
        yield space, part, metric, "mean", row["mean"]
        yield space, part, metric, "sd", row["sd"]
        for run, value in enumerate(row["values"] if of_runs else ()):
            yield space, part, metric, f"run {run}", value


@dataclass(frozen=True, eq=False)
class Distances:
    """Mean distances of validation pairs of different grasps in one space.

    `runs` (runs, c, c) between categories, `different` the same with pairs of different things
    alone, `object_mean` (o, o) between objects. NaN: there are no such pairs.
    """

    space: str
    categories: tuple[str, ...]
    runs: Real
    different: Real
    objects: tuple[str, ...]
    object_mean: Real

    @property
    def mean(self) -> Real:
        """Return the mean (c, c) over runs, of those that have such pairs."""
        return mean_sd_of(self.runs)[0]

    def between(self, category: int) -> float:
        """Return the mean over the other categories, or NaN if there are none."""
        others = np.delete(self.mean[category], category)
        return float(others.mean()) if len(others) else math.nan

    def apart(self) -> dict[str, bool]:
        """Return of each category whether its members lie nearer to one another than to others."""
        return {
            name: bool(self.mean[i, i] < self.between(i)) for i, name in enumerate(self.categories)
        }

    def gaps(self) -> dict[str, Score]:
        """Return by how much each category's members lie nearer to one another than to other
        categories': mean and sd over runs. None of a category that stands alone."""
        found = {}
        for i, name in enumerate(self.categories):
            within, others = self.runs[:, i, i], np.delete(self.runs[:, i], i, axis=1)
            gap = others.mean(axis=1) - within if others.shape[1] else np.empty(0)
            if len(gap := gap[np.isfinite(gap)]) > 1:
                found[name] = Score(float(gap.mean()), float(gap.std(ddof=1)))
        return found


def mean_sd_of(runs: Real) -> tuple[Real, Real]:
    """Return mean and sample deviation (c, c) over those of `runs` (runs, c, c) that are known.

    Of things that folds hold out whole, a fold knows no distance to those of other folds.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        count = np.isfinite(runs).sum(axis=0)
        mean = np.nansum(runs, axis=0) / count
        return mean, np.sqrt(np.nansum((runs - mean) ** 2, axis=0) / (count - 1))


def distances_of(results: TaskResults) -> list[Distances]:
    """Return the distances in each space, in alphabetical order."""
    tables = results.results[0].tables
    objects = tuple(map(str, dict.fromkeys(tables["objects"].column("first"))))
    found = []
    for space, table in sorted(tables["categories"].parted("space").items()):
        names = tuple(map(str, dict.fromkeys(table.column("first"))))
        every, different = (
            np.array([_matrix_of(run, names, "distance") for run in part.parted("run").values()])
            for part in (table.where(pairs=ALL), table.where(pairs=DIFFERENT))
        )
        of_objects = _matrix_of(tables["objects"].where(space=space), objects, "mean")
        found.append(Distances(space, names, every, different, objects, of_objects))
    return found


def _matrix_of(table: Table, names: Sequence[str], key: str) -> Real:
    """Return the symmetric matrix (c, c) of the pairs of a table."""
    matrix = np.full((len(names),) * 2, np.nan)
    for row, value in zip(table.rows, table.numbers(key), strict=True):
        i, j = names.index(str(row["first"])), names.index(str(row["second"]))
        matrix[i, j] = matrix[j, i] = value
    return matrix


def finding(results: TaskResults) -> str:
    """Return in each space how many categories are nearer within than to others."""
    counts = ", ".join(
        f"{sum(one.apart().values())} of {len(one.categories)} in {space_name(one.space)}"
        for one in distances_of(results)
    )
    return f"Categories whose members lie nearer to one another than to others: {counts}"


def figure(results: TaskResults, part: str) -> Figure:
    """Return a matrix for each space: of `part` "categories", "different" or "objects"."""
    from ajgdata.report.canvas import WIDTH_IN, new_figure

    spaces = distances_of(results)
    count = len(spaces[0].objects if part == "objects" else spaces[0].categories)
    subtitle = f"{results.title}: mean distance of validation pairs of different grasps"
    size_in = WIDTH_IN, 2.2 + max(2.0, 0.2 * count)
    drawn = new_figure(size_in, finding(results), subtitle, [results.source])
    for axes, one in zip(drawn.subplots(1, len(spaces), squeeze=False)[0], spaces, strict=True):
        names = one.objects if part == "objects" else one.categories
        runs = {"categories": one.runs, "different": one.different}.get(part)
        _matrix(axes, names, one.object_mean[np.newaxis] if runs is None else runs)
        axes.set_title(space_name(one.space))
    return drawn


def _matrix(axes: Axes, names: Sequence[str], runs: Real) -> None:
    """Draw a matrix, with its numbers if there are few; a cell without pairs is white."""
    mean, sd = mean_sd_of(runs)
    largest = float(np.nanmax(mean)) if np.isfinite(mean).any() else 1.0
    axes.imshow(mean, cmap="Blues_r", vmin=0, vmax=1.15 * (largest or 1.0), aspect="auto")
    axes.grid(False)
    axes.set_xticks(range(len(names)), [words(name) for name in names], rotation=90)
    axes.set_yticks(range(len(names)), [words(name) for name in names])
    for (row, column), value in np.ndenumerate(mean if len(names) <= MOST_NUMBERS else mean[:0]):
        text = mean_sd(Score(float(value), float(sd[row, column]))).replace(" ± ", "\n± ")
        colour = "white" if value < 0.55 * largest else "#222222"
        axes.text(column, row, text, ha="center", va="center", fontsize=8, color=colour)


def figures(results: TaskResults) -> Iterator[Illustration]:
    """Yield the matrices of categories, of categories without equal objects, and of objects."""
    for part, pairs in PAIRS.items():
        caption = Caption(
            f"Mean distance of pairs of {pairs} (dark: near; ± sd over runs; the diagonal is "
            "within one name). Each space has its own unit.",
            f"{finding(results)}. Distance matrices of {pairs}.",
        )
        yield illustration(results, part, caption, partial(figure, results, part))


def paper_comparison(results: TaskResults, lookup: Lookup) -> Iterator[PaperComparison]:
    """Yield which categories lie together, and whether the one that the paper names is widest."""
    latent = next((one for one in distances_of(results) if one.space == "latent"), None)
    gaps = latent.gaps() if latent else {}
    if results.paper is None or latent is None or not {*TOGETHER, SPREAD} <= set(gaps):
        return
    within = dict(zip(latent.categories, np.diagonal(latent.mean), strict=True))
    told = [
        f"{words(name)} {number(within[name])} within, {mean_sd(gaps[name])} more to others"
        for name in (*TOGETHER, SPREAD)
    ]
    verdicts = {holds(gaps[name]) for name in TOGETHER}
    verdicts.add(_widest(latent))
    yield PaperComparison(
        results.paper, results.dataset, results.task, results.source, "; ".join(told), "latent",
        together(verdicts), encoder_cost(results, lookup), marks=tuple(_marks(latent)),
    )  # fmt: skip


def _marks(latent: Distances) -> Iterator[Mark]:
    """Yield distances within each category that the paper names, and to the others."""
    within = np.diagonal(latent.mean)
    gaps = latent.gaps()
    for name, inner in zip(latent.categories, within, strict=True):
        if name in gaps:
            own = Score(float(inner), 0.0)
            others = Score(float(inner) + gaps[name].mean, gaps[name].sd)
            yield mark_of("ours", "within", own, part=words(name))
            yield mark_of("other", "others", others, part=words(name))


def _widest(latent: Distances) -> Verdict:
    """Return whether distances within SPREAD exceed those within the others, over runs."""
    place = {name: i for i, name in enumerate(latent.categories)}
    inner = latent.runs[:, range(len(place)), range(len(place))]
    most = inner[:, [place[name] for name in TOGETHER]].max(axis=1)
    gap = inner[:, place[SPREAD]] - most
    return holds(Score(float(gap.mean()), float(gap.std(ddof=1))))


EXPERIMENT = Experiment(
    name="embedding_distances",
    title=TITLE,
    settings=Embedding,
    measure=measure,
    figures=figures,
    paper_comparison=paper_comparison,
    of_embedding=True,
    order=82,
    paper="distances",
)
