"""Embedding: k-NN on latents, raw features, PCA and UMAP against dimension and run time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ajgdata.evaluate.agreement import Interval, compare
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
    draw_space,
    illustration,
    run_scores,
    scores_by,
    settings_table,
    space_name,
    trained,
)
from ajgdata.report.blocks import Illustration, ShownTable
from ajgdata.report.comparison import Cost, PaperComparison, mark_of
from ajgdata.report.format import DASH, Caption, Score, mean_sd, number
from ajgdata.report.projections import ordered
from ajgdata.types import Embedding
from ajgdata.types.table import table_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NAME = "embedding_knn"
TITLE = "Embedding: nearest neighbours"
TRAINING = "cost of training"  #: part of the scores of what training all encoders cost
TIMES = ("fit_s", "transform_s", "query_s")


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
    about |= data.thinned
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


def at_shown(results: TaskResults, space: str) -> Neighbours:
    """Return k-NN in the dimension that the settings name, `shown`; in a space without dimensions
    k-NN as it is. No score selects the dimension."""
    rows = neighbours_of(results, space)
    return next(row for row in rows if row.dimension in (None, results.settings.shown))


def accuracy_range(results: TaskResults, space: str) -> str:
    """Return `50 to 55 %`: the accuracies in all dimensions of a space."""
    means = [100 * row.score.mean for row in neighbours_of(results, space)]
    low, high = (number(f(means)) for f in (min, max))
    return f"{low if low == high else f'{low} to {high}'} %"


def finding(results: TaskResults) -> str:
    """Return the accuracy of k-NN on the latent and on raw features."""
    latent, raw = at_shown(results, "latent"), at_shown(results, "raw")
    chance = number(100 * results.results[0].about["chance"])
    return (
        f"k-NN reaches {mean_sd(latent.score, '%', 100)} on a latent of {latent.dimension} "
        f"dimensions, {mean_sd(raw.score, '%', 100)} on raw features (chance {chance} %)"
    )


def figure(results: TaskResults) -> Figure:
    """Return the accuracy of k-NN against the dimension of the space."""
    from ajgdata.report.canvas import WIDTH_IN, new_figure
    from ajgdata.report.labels import reference_line

    rows = neighbours_of(results)
    subtitle = f"{results.title}: validation accuracy, mean ± sd over folds and initialisations"
    drawn = new_figure((WIDTH_IN, 3.9), finding(results), subtitle, [results.source])
    axes = drawn.subplots()
    dimensions = sorted({row.dimension for row in rows if row.dimension})
    for space in ordered([row.space for row in rows]):
        own = neighbours_of(results, space)
        # A space without dimensions is a horizontal line.
        scores = [row.score for row in own] * (1 if own[0].dimension else len(dimensions))
        draw_space(axes, space, dimensions, scores)
    reference_line(axes, "chance", 100 * results.results[0].about["chance"], "chance")
    axes.set(xscale="log", xlabel="dimension", ylabel="accuracy (%)", ylim=(0, None))
    axes.set_xticks(dimensions, map(str, dimensions))
    axes.minorticks_off()
    return drawn


def figures(results: TaskResults) -> list[Illustration]:
    """Return the one figure of all spaces."""
    caption = (
        "Accuracy of k-NN by dimension. PCA and UMAP are fitted to training recordings "
        "without labels. The dimension of the title is fixed in the settings; which dimension is "
        "best is exploratory. Run times are in the table."
    )
    drawn = partial(figure, results)
    return [illustration(results, "", Caption(caption, f"{finding(results)}."), drawn)]


def tables(results: TaskResults) -> Iterable[ShownTable]:
    """Return accuracy and time of a fold by dimension and space, and how it was all made."""
    rows = neighbours_of(results)
    spaces = ordered([row.space for row in rows])
    found = {(row.space, row.dimension): row for row in rows}

    def cell(space: str, dimension: int) -> str:
        row = found.get((space, dimension)) or found.get((space, None))
        return (
            f"{mean_sd(row.score, '%', 100)}; {number(row.fit_s + row.ask_s, 2)} s" if row else DASH
        )

    dimensions = sorted({row.dimension for row in rows if row.dimension})
    yield ShownTable(
        "Accuracy of k-NN and time of one fold, by dimension.",
        ("dimension|", *(f"{space_name(space)}|" for space in spaces)),
        tuple((str(d), *(cell(space, d) for space in spaces)) for d in dimensions),
    )
    yield settings_table(results)


def encoder_cost(results: TaskResults, lookup: Lookup) -> Cost | None:
    """Return what the encoders of the shown dimension cost, where k-NN was measured on them."""
    measured = lookup(NAME, results.dataset, results.task)
    if measured is None or measured.task != results.task or not measured.results:
        return None
    return _cost(measured, at_shown(measured, "latent"))


def _cost(results: TaskResults, at: Neighbours) -> Cost:
    """Return the cost of all folds, one network each; a recording is placed with others."""
    folds = len(at_shown(results, "raw").score.per_fold)
    return Cost(folds * at.fit_s, 1e3 * at.ask_s / at.recordings)


def relative_gain(latent: Score, raw: Score) -> tuple[Score, Interval]:
    """Return by how much (%) k-NN on the latent is better than on raw features, relative to these.

    The interval is that of the mean over folds; each fold is the mean of its initialisations, which
    are one after another in `latent`.
    """
    from ajgdata.evaluate.resampling import corrected_interval

    folds = len(raw.per_fold)
    gains = np.reshape(latent.per_fold, (folds, -1)) - np.array(raw.per_fold)[:, np.newaxis]
    relative = 100 * gains / raw.mean
    low, high = corrected_interval(relative.mean(axis=1).tolist(), folds)
    most = 100 * (1 - raw.mean) / raw.mean  # from no right answer to all right
    interval = Interval(max(low, -100.0), min(high, most))
    return Score(float(relative.mean()), float(relative.std(ddof=1)), (), *interval), interval


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield by how much k-NN on the latent is better than on raw features, relative to these."""
    paper, latent, raw = results.paper, at_shown(results, "latent"), at_shown(results, "raw")
    if paper is None or paper.value is None or not raw.score.mean > 0:
        return
    score, interval = relative_gain(latent.score, raw.score)
    points = 100 * (latent.score.mean - raw.score.mean)
    result = (
        f"{mean_sd(score, '%')} higher ({mean_sd(latent.score, '%', 100)} for "
        f"{mean_sd(raw.score, '%', 100)}: {number(points)} percentage points) at "
        f"{latent.dimension} dimensions; exploratory, by dimension: "
        f"{accuracy_range(results, 'latent')}"
    )
    perfect = 100 * (1 - raw.score.mean) / raw.score.mean
    verdict = compare(score.mean, interval, paper.value, chance=0.0, perfect=perfect)
    yield PaperComparison(
        paper, results.dataset, results.task, results.source, result, "k-NN on the latent",
        verdict, _cost(results, latent), marks=(mark_of("ours", "latent over raw", score),),
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
