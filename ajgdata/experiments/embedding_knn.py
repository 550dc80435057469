"""Embedding: k-NN on latents, raw features, PCA and UMAP against dimension and run time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ajgdata.experiments.base import (
    SCORES,
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
    illustration,
    look,
    run_scores,
    scores_by,
    settings_table,
    space_name,
    trained,
)
from ajgdata.report.blocks import Illustration, ShownTable
from ajgdata.report.comparison import Cost, PaperComparison, agreement
from ajgdata.report.format import DASH, Caption, Score, mean_sd, number
from ajgdata.report.projections import ordered
from ajgdata.types import Embedding
from ajgdata.types.table import table_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


NAME = "embedding_knn"
TITLE = "Embedding: nearest neighbours"
TRAINING = "cost of training"  #: part of the scores of what training all encoders cost
TIMES = ("fit_s", "transform_s", "query_s")
# A time measured as zero has no place on a log axis.
SHORTEST = 1e-4


def measure(inputs: Inputs, settings: Embedding, _: str) -> Outcome:
    """Return the accuracy of k-NN in each space by dimension, fold and initialisation.

    Raises ValueError where nothing could be trained.
    """
    from ajgdata.evaluate.neighbours import scores_by_space
    from ajgdata.models.baselines import NEIGHBOURS

    data, latents = trained(inputs, settings)
    value = data.column(settings.target)
    scored = list(scores_by_space(data, latents, value, settings.dimensions, inputs.seed))
    rows = [
        {"space": space, "dimension": dimension, "values": [run.accuracy for run in runs]}
        for space, dimension, runs in scored
    ]
    chance = np.unique(value[value != ""], return_counts=True)[1].max() / np.sum(value != "")
    columns = {"space": "Space", "dimension": "Dimension", "run": "Run", "accuracy": "Accuracy"}
    tables = (
        score_table(_score_rows(rows, float(chance)), TITLE),
        table_of("knn", TITLE, by_run(rows, "accuracy"), **columns),
    )
    tested = len(data.feature) / len({*latents.validation_fold.tolist()})
    times = list(_times(scored, inputs.training_cost, tested))
    cost_scores: list[ScoreRow] = [
        ("", TRAINING, name, "measured", spent) for name, spent in inputs.training_cost.items()
    ]
    cost_scores += [
        (row["space"], f"cost of {_part(row)}", name, "measured", row[name])
        for row in times
        for name in TIMES
    ]
    cost = (
        score_table(cost_scores, f"{TITLE}: cost"),
        table_of(
            "times", f"{TITLE}: times of a fold", times,
            space="Space", dimension="Dimension", fit_s="Fitting the space, s",
            transform_s="Placing validation points, s", query_s="k-NN, s", recordings="Recordings",
        ),
    )  # fmt: skip
    about = {"k": NEIGHBOURS, "target": settings.target, "chance": float(chance)}
    return Outcome(tables, cost, about)


def _times(
    scored: Sequence[tuple[str, int | None, list[Any]]], spent: Any, tested: float
) -> Iterator[dict[str, Any]]:
    """Yield the mean times of a fold; a latent was made by another job, which trained all."""
    for space, dimension, runs in scored:
        seconds = {name: float(np.mean([getattr(run, name) for run in runs])) for name in TIMES}
        if space == "latent":
            seconds["fit_s"] = spent["cpu_s"] / spent["networks"]
            seconds["transform_s"] = spent["encode_s_per_recording"] * tested
        yield {"space": space, "dimension": dimension, **seconds, "recordings": tested}


def _part(row: dict[str, Any]) -> str:
    return "knn" if row["dimension"] is None else f"knn:{row['dimension']}"


def _score_rows(rows: Sequence[dict[str, Any]], chance: float) -> Iterator[ScoreRow]:
    raw = float(np.mean(next(row["values"] for row in rows if row["space"] == "raw")))
    for row in rows:
        yield from run_scores(row["space"], _part(row), "accuracy", row["values"], chance)
        gain = float(np.mean(row["values"])) - raw
        yield row["space"], _part(row), "gain_points", "mean", 100 * gain
        yield row["space"], _part(row), "gain_relative", "mean", gain / raw


class Neighbours(NamedTuple):
    """k-NN in one space: validation accuracy, s of fitting the space for one fold, and s of placing
    its validation `recordings` there and asking k-NN."""

    space: str
    dimension: int | None
    score: Score
    fit_s: float
    ask_s: float
    recordings: float

    @property
    def seconds(self) -> float:
        """Return the time of all of one fold."""
        return self.fit_s + self.ask_s


def neighbours_of(results: TaskResults, space: str = "") -> list[Neighbours]:
    """Return k-NN in every space, or in one of them by rising dimension."""
    result = results.results[0]
    scores = scores_by(result.tables["knn"], ("space", "dimension"), "accuracy")
    found = []
    for row in result.cost["times"].rows:
        key = row["space"], row["dimension"]
        asked = row["transform_s"] + row["query_s"]
        found.append(Neighbours(*key, scores[key], row["fit_s"], asked, row["recordings"]))
    if not space:
        return found
    return sorted((row for row in found if row.space == space), key=lambda r: r.dimension or 0)


def best_of(results: TaskResults, space: str) -> Neighbours | None:
    """Return the dimension of highest accuracy; of equals, the lowest."""
    return max(neighbours_of(results, space), key=lambda row: row.score.mean, default=None)


def figure(results: TaskResults) -> Figure:
    """Return the accuracy of k-NN against the dimension, and against the time of one fold."""
    from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator

    from ajgdata.report.canvas import GREY, WIDTH_IN, new_figure

    rows = neighbours_of(results)
    drawn = new_figure(
        (WIDTH_IN, 4.1),
        f"{results.title} · k-NN",
        "validation accuracy of k-NN, mean ± sd over folds and initialisations",
        [results.source],
    )
    left, right = drawn.subplots(1, 2, sharey=True)
    for space in ordered([row.space for row in rows]):
        _against_dimension(left, neighbours_of(results, space))
        _against_time(right, neighbours_of(results, space))
    _front(right, rows)
    chance = 100 * results.results[0].about["chance"]
    for axes in (left, right):
        axes.axhline(chance, color=GREY, ls=":", lw=1.1, label="chance")
        axes.set_xscale("log")
        axes.margins(x=0.1)
        axes.set_ylim(bottom=0)
        axes.xaxis.set_minor_formatter(NullFormatter())
    dimensions = _dimensions(rows)
    left.set_xticks(dimensions, map(str, dimensions))
    left.xaxis.set_minor_locator(NullLocator())
    left.set(xlabel="dimension", ylabel="accuracy (%)")
    right.xaxis.set_major_formatter(FuncFormatter(lambda s, _: number(s)))
    right.set_xlabel("time of one fold (s): space, validation points, k-NN")
    handles, labels = left.get_legend_handles_labels()
    shown = dict(zip(labels, handles, strict=True))
    drawn.legend(shown.values(), shown.keys(), loc="outside lower center", ncols=len(shown))
    return drawn


def _dimensions(rows: Sequence[Neighbours]) -> list[int]:
    return sorted({row.dimension for row in rows if row.dimension})


def _against_dimension(axes: Axes, rows: list[Neighbours]) -> None:
    """Draw a line with error bars; what has no dimension is a band."""
    style, label = look(rows[0].space), space_name(rows[0].space)
    if rows[0].dimension is None:
        mean, sd = 100 * rows[0].score.mean, 100 * np.nan_to_num(rows[0].score.sd)
        axes.axhspan(mean - sd, mean + sd, color=style["color"], alpha=0.12, lw=0)
        axes.axhline(mean, color=style["color"], lw=1.2, ls=(0, (5, 3)), label=label)
        return
    axes.errorbar(
        [row.dimension or 0 for row in rows],
        [100 * row.score.mean for row in rows],
        [100 * np.nan_to_num(row.score.sd) for row in rows],
        ms=4.5, capsize=2.5, label=label, **style,
    )  # fmt: skip


def _against_time(axes: Axes, rows: list[Neighbours]) -> None:
    """Draw a marker for each dimension; the lowest, the highest and the best are named."""
    best, style = max(rows, key=lambda row: row.score.mean), look(rows[0].space)
    for row in rows:
        place = max(row.seconds, SHORTEST), 100 * row.score.mean
        sd = 100 * np.nan_to_num(row.score.sd)
        axes.errorbar(*place, sd, ms=4.5, elinewidth=0.8, capsize=0, **style)
        if row.dimension is not None and row in (rows[0], rows[-1], best):
            axes.annotate(
                str(row.dimension), place, (3, 3), textcoords="offset points", fontsize=6.5,
                color=style["color"],
            )  # fmt: skip


def _front(axes: Axes, rows: Sequence[Neighbours]) -> None:
    """Draw a line through what nothing else beats in both accuracy and time."""
    from ajgdata.report.canvas import GREY, pareto_front

    seconds = np.array([max(row.seconds, SHORTEST) for row in rows])
    accuracy = np.array([100 * row.score.mean for row in rows])
    best = np.flatnonzero(pareto_front(seconds, -accuracy))
    best = best[np.lexsort((accuracy[best], seconds[best]))]
    axes.plot(seconds[best], accuracy[best], color=GREY, lw=1, zorder=1, label="Pareto front")


def gain_text(results: TaskResults) -> str:
    """Return by how much the latent's best dimension is better than raw features, or nothing."""
    best, raw = best_of(results, "latent"), best_of(results, "raw")
    if best is None or raw is None:
        return ""
    points = 100 * (best.score.mean - raw.score.mean)
    relative = points / raw.score.mean if raw.score.mean > 0 else float("nan")
    sense = "higher" if points >= 0 else "lower"
    return (
        f"k-NN on the latent reaches {mean_sd(best.score, '%', 100)} at its best dimension, "
        f"{best.dimension}, on raw features {mean_sd(raw.score, '%', 100)}: "
        f"{number(abs(points))} percentage points, or {number(abs(relative))} %, {sense}"
    )


def caption(results: TaskResults) -> Caption:
    """Return the caption of `figure`."""
    listed = "; ".join(
        f"{space_name(space)}: "
        + ", ".join(
            (f"{row.dimension}: " if row.dimension else "") + mean_sd(row.score, "%", 100)
            for row in neighbours_of(results, space)
        )
        for space in ordered([row.space for row in neighbours_of(results)])
    )
    return Caption(
        f"{gain_text(results)}. The best of several dimensions was chosen on the points "
        "that it is scored on, which flatters it a little; the figure shows all. Left: against the "
        "dimension of the space; dashed with its band: raw features. Right: against the time of "
        "one fold, some with their dimension; grey: what nothing else beats. PCA and UMAP "
        "learn from training points alone, and nothing of what they are of; the latent was told "
        "which of them are alike. The time of a latent is its share of a training of all "
        "dimensions together. The times belong to the machine that made this page.",
        f"Accuracy of k-NN by space and dimension. {listed}.",
    )


def figures(results: TaskResults) -> list[Illustration]:
    """Return the one figure of all spaces."""
    return [illustration(results, "", caption(results), partial(figure, results))]


def tables(results: TaskResults) -> Iterable[ShownTable]:
    """Return accuracy and time of a fold by dimension and space, and how it was all made."""
    rows = neighbours_of(results)
    spaces = ordered([row.space for row in rows])
    found = {(row.space, row.dimension): row for row in rows}

    def cell(space: str, dimension: int) -> str:
        row = found.get((space, dimension)) or found.get((space, None))
        return f"{mean_sd(row.score, '%', 100)}; {number(row.seconds, 2)} s" if row else DASH

    spent = results.results[0].cost[SCORES].where(part=TRAINING)
    told = {row["metric"]: row["value"] for row in spent.rows}
    trained_in = (
        f" {told['networks']} networks were trained in {number(told['cpu_s'])} s of one core."
        if told else ""
    )  # fmt: skip
    yield ShownTable(
        f"Accuracy of k-NN and time of one fold, by dimension.{trained_in}",
        ("dimension|", *(f"{space_name(space)}|" for space in spaces)),
        tuple((str(d), *(cell(space, d) for space in spaces)) for d in _dimensions(rows)),
    )
    yield settings_table(results)


def encoder_cost(results: TaskResults, lookup: Lookup) -> Cost | None:
    """Return what the encoders of the shown dimension cost, where k-NN was measured on them."""
    measured = lookup(NAME, results.dataset, results.task)
    if measured is None or measured.task != results.task or not measured.results:
        return None
    rows = neighbours_of(measured, "latent")
    shown = [row for row in rows if row.dimension == results.settings.shown]
    return _cost(measured, shown[0]) if shown else None


def _cost(results: TaskResults, at: Neighbours) -> Cost:
    """Return the cost of all folds, one network each; a recording is placed with others."""
    folds = len(raw.score.per_fold) if (raw := best_of(results, "raw")) else 1
    return Cost(folds * at.fit_s, 1e3 * at.ask_s / at.recordings)


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield by how much k-NN on the latent is better than on raw features, relative to these."""
    paper, best, raw = results.paper, best_of(results, "latent"), best_of(results, "raw")
    if paper is None or paper.value is None or best is None or raw is None:
        return
    if not raw.score.mean > 0:
        return
    # of each fold there are as many runs as initialisations, one after another
    latent = np.reshape(best.score.per_fold, (len(raw.score.per_fold), -1))
    gains = (latent - np.array(raw.score.per_fold)[:, np.newaxis]).ravel()
    relative = 100 * gains / raw.score.mean
    score = Score(float(relative.mean()), float(relative.std(ddof=1)))
    result = (
        f"{mean_sd(score, '%')} higher ({mean_sd(best.score, '%', 100)} for "
        f"{mean_sd(raw.score, '%', 100)}: {number(100 * gains.mean())} percentage points), best at "
        f"{best.dimension} dimensions"
    )
    yield PaperComparison(
        paper, results.dataset, results.task, results.source, result, "k-NN on the latent",
        agreement(score, paper.value), _cost(results, best),
    )  # fmt: skip


EXPERIMENT = Experiment(
    name=NAME,
    title=TITLE,
    settings=Embedding,
    measure=measure,
    figures=figures,
    tables=tables,
    paper_comparison=paper_comparison,
    of_embedding=True,
    order=81,
    paper="latent-knn",
)
