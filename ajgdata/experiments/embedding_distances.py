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
from ajgdata.report.projections import category_colours
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
#: Light to dark: near things are dark.
SHADES = "Blues_r"
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
    members = ({"object": o, "category": category[data.instance == o][0]} for o in objects)
    columns = {"space": "Space", "first": "First", "second": "Second"}
    runs_of_pairs = {"pairs": "Pairs", **columns, "run": "Run", "distance": "Distance"}
    of_objects = {**columns, "mean": "Mean distance", "sd": "Deviation over runs"}
    tables = (
        score_table(scores, TITLE),
        table_of("categories", f"{TITLE} of categories", by_category, **runs_of_pairs),
        table_of("objects", f"{TITLE} of things", by_object, **of_objects),
        table_of("members", "Things", members, object="Thing", category="Category"),
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
    object_category: tuple[str, ...]
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
    members = tables["members"]
    objects, category = (tuple(map(str, members.column(k))) for k in ("object", "category"))
    found = []
    for space, table in sorted(tables["categories"].parted("space").items()):
        names = tuple(map(str, dict.fromkeys(table.column("first"))))
        every, different = (
            np.array([_matrix_of(run, names, "distance") for run in part.parted("run").values()])
            for part in (table.where(pairs=ALL), table.where(pairs=DIFFERENT))
        )
        of_objects = _matrix_of(tables["objects"].where(space=space), objects, "mean")
        found.append(Distances(space, names, every, different, objects, category, of_objects))
    return found


def _matrix_of(table: Table, names: Sequence[str], key: str) -> Real:
    """Return the symmetric matrix (c, c) of the pairs of a table."""
    matrix = np.full((len(names),) * 2, np.nan)
    for row, value in zip(table.rows, table.numbers(key), strict=True):
        i, j = names.index(str(row["first"])), names.index(str(row["second"]))
        matrix[i, j] = matrix[j, i] = value
    return matrix


def category_finding(results: TaskResults) -> str:
    """Return of each space how many categories lie nearer within than to others."""
    told = []
    for one in distances_of(results):
        apart = one.apart()
        told.append(f"{sum(apart.values())} of {len(apart)} in {space_name(one.space)}")
    return f"Categories whose members lie nearer to one another than to others: {', '.join(told)}"


def object_finding(one: Distances) -> str:
    """Return which two things lie nearest to one another in a space."""
    between = np.where(np.eye(len(one.objects), dtype=bool), np.nan, one.object_mean)
    if not np.isfinite(between).any():
        return f"One thing in {space_name(one.space)}"
    i, j = np.unravel_index(int(np.nanargmin(between)), between.shape)
    pair = " and ".join(sorted(words(one.objects[k]) for k in (int(i), int(j))))
    return f"Nearest of different things in {space_name(one.space)}: {pair}"


def category_figure(results: TaskResults) -> Figure:
    """Return a matrix of categories for each space (columns), of all pairs and different things."""
    from ajgdata.report.canvas import WIDTH_IN, new_figure

    spaces = distances_of(results)
    side = max(1.9, 0.72 * len(spaces[0].categories))
    drawn = new_figure(
        (WIDTH_IN, 2 * side + 2.1),
        category_finding(results),
        f"{results.title}: mean distance of validation pairs of different grasps ± sd over runs; "
        "dark: near",
        [results.source],
    )
    panels = drawn.subplots(2, len(spaces), squeeze=False)
    for column, one in enumerate(spaces):
        _matrix(panels[0, column], one.categories, one.runs)
        panels[0, column].set_title(f"{space_name(one.space)}: all pairs")
        _matrix(panels[1, column], one.categories, one.different)
        panels[1, column].set_title(f"{space_name(one.space)}: different things only")
    return drawn


def _matrix(axes: Axes, names: Sequence[str], runs: Real) -> None:
    """Draw cells with their numbers; a cell without pairs is left white."""
    mean, sd = mean_sd_of(runs)
    largest = float(np.nanmax(mean)) if np.isfinite(mean).any() else 1.0
    axes.imshow(mean, cmap=SHADES, vmin=0, vmax=1.15 * (largest or 1.0))
    axes.grid(False)
    axes.spines[:].set_visible(False)
    axes.set_xticks(range(len(names)), [words(name) for name in names])
    axes.set_yticks(range(len(names)), [words(name) for name in names])
    for (row, column), value in np.ndenumerate(mean):
        dark = np.isfinite(value) and value < 0.55 * largest
        text = mean_sd(Score(float(value), float(sd[row, column]))).replace(" ± ", "\n± ")
        axes.text(
            column, row, text, ha="center", va="center", fontsize=8,
            fontweight="bold" if row == column else "normal",
            color="white" if dark else "#222222",
        )  # fmt: skip


def object_figure(results: TaskResults, one: Distances) -> Figure:
    """Return the matrix of things in the order of the tree beside it, coloured by category."""
    from scipy.cluster.hierarchy import dendrogram

    from ajgdata.report.canvas import GREY, new_figure
    from ajgdata.report.labels import width_in

    n, order = len(one.objects), leaves(one)
    label = max(width_in(words(name), 8) for name in one.objects)
    side = max(2.0, 0.2 * n)
    subtitle = f"{results.title}: mean distance of validation pairs of different grasps; dark: near"
    size_in = side + label + 3.0, side + label + 1.1
    drawn = new_figure(size_in, object_finding(one), subtitle, [results.source])
    branches, axes = drawn.subplots(1, 2, width_ratios=[1.2, side])
    branches.set_axis_off()
    if n > 1:
        dendrogram(
            links(one),
            ax=branches,
            orientation="left",
            no_labels=True,
            color_threshold=0,
            above_threshold_color=GREY,
        )
        branches.invert_yaxis()
    image = axes.imshow(one.object_mean[np.ix_(order, order)], cmap=SHADES, aspect="auto")
    axes.grid(False)
    axes.spines[:].set_visible(False)
    names = [words(one.objects[i]) for i in order]
    axes.set_xticks(range(n), names, rotation=90)
    axes.set_yticks(range(n), names)
    axes.tick_params(length=0)
    colours = category_colours(one.object_category)
    for axis in (axes.xaxis, axes.yaxis):
        for i, text in zip(order, axis.get_ticklabels(), strict=True):
            text.set_color(colours[one.object_category[i]])
    bar = drawn.colorbar(image, ax=axes, label="distance", pad=0.02, shrink=0.8)
    bar.outline.set_visible(False)
    return drawn


def links(one: Distances) -> Real:
    """Return scipy's average linkage of the things; unknown distances count as the largest."""
    from scipy.cluster.hierarchy import linkage
    from scipy.spatial.distance import squareform

    condensed = squareform((one.object_mean + one.object_mean.T) / 2, checks=False)
    known = condensed[np.isfinite(condensed)]
    largest = known.max() if len(known) else 1.0
    return linkage(np.nan_to_num(condensed, nan=largest), "average", optimal_ordering=True)


def leaves(one: Distances) -> list[int]:
    """Return the things in the order of the tree, which puts near ones side by side."""
    from scipy.cluster.hierarchy import leaves_list

    return leaves_list(links(one)).tolist() if len(one.objects) > 1 else [0]


def category_caption(results: TaskResults) -> Caption:
    """Return the caption of `category_figure`."""
    told = "; ".join(f"{space_name(one.space)}: {apart_text(one)}" for one in distances_of(results))
    return Caption(
        "Rows and columns are categories; the diagonal (bold) is within a category. "
        "Top: pairs of different grasps, of the same thing or not. Bottom: pairs of different "
        f"things only. Spaces have units of their own. {told}.",
        f"{category_finding(results)}. Mean distances: {told}.",
    )


def apart_text(one: Distances) -> str:
    """Return of each category the distance within it against that between it and others."""
    return ", ".join(
        f"{words(name)} {number(one.mean[i, i])} within "
        f"{'<' if apart else 'not <'} {number(one.between(i))} between"
        for i, (name, apart) in enumerate(one.apart().items())
        if math.isfinite(one.between(i))
    )


def object_caption(one: Distances) -> Caption:
    """Return the caption of `object_figure`."""
    names = [words(one.objects[i]) for i in leaves(one)]
    return Caption(
        "Dark: near. The diagonal is the distance between different grasps of one "
        "thing. The tree joins what is nearest on average (average linkage). Names have the "
        "colour of their category.",
        f"{object_finding(one)}. Distance matrix of {len(names)} objects with a "
        "dendrogram, in its order: "
        f"{', '.join(names)}.",
    )


def figures(results: TaskResults) -> Iterator[Illustration]:
    """Yield the figure of categories, then one of things for each space."""
    draw = partial(category_figure, results)
    yield illustration(results, "categories", category_caption(results), draw)
    for one in distances_of(results):
        draw = partial(object_figure, results, one)
        yield illustration(results, f"objects-{one.space}", object_caption(one), draw)


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
