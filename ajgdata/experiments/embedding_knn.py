"""Embedding: k-NN on latents, raw features, PCA and UMAP against dimension and run time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ajgdata.evaluate.agreement import Interval, compare
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
    draw_space,
    illustration,
    look,
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
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NAME = "embedding_knn"
TITLE = "Embedding: nearest neighbours"
TRAINING = "cost of training"  #: part of the scores of what training all encoders cost
TIMES = ("fit_s", "transform_s", "query_s")
#: A time measured as zero has no place on a log axis.
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


def dimensions_of(rows: Sequence[Neighbours]) -> list[int]:
    """Return the distinct dimensions in rising order."""
    return sorted({row.dimension for row in rows if row.dimension})


def finding(results: TaskResults) -> str:
    """Return the accuracy of k-NN on the latent and on raw features."""
    latent, raw = at_shown(results, "latent"), at_shown(results, "raw")
    chance = number(100 * results.results[0].about["chance"])
    return (
        f"k-NN reaches {_percent(latent)} on a latent of {latent.dimension} dimensions, "
        f"{_percent(raw)} on raw features (chance {chance} %)"
    )


def _percent(row: Neighbours) -> str:
    return mean_sd(row.score, "%", 100)


def figure(results: TaskResults) -> Figure:
    """Return the accuracy of k-NN against the dimension, and against the time of one fold."""
    from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator

    from ajgdata.report.canvas import WIDTH_IN, new_figure
    from ajgdata.report.labels import REFERENCES, reference_line

    rows = neighbours_of(results)
    drawn = new_figure(
        (WIDTH_IN, 3.9),
        finding(results),
        f"{results.title}: validation accuracy, mean ± sd over folds and initialisations; grey "
        "line: beaten by nothing in both accuracy and time",
        [results.source],
    )
    left, right = drawn.subplots(1, 2, sharey=True)
    for space in ordered([row.space for row in rows]):
        _against_dimension(left, neighbours_of(results, space))
        _against_time(right, neighbours_of(results, space), results.settings.shown)
    _front(right, rows)
    chance = 100 * results.results[0].about["chance"]
    reference_line(left, "chance", chance, "chance")
    right.axhline(chance, label="chance", **REFERENCES["chance"])
    for axes in (left, right):
        axes.set_xscale("log")
        axes.margins(x=0.1)
        axes.set_ylim(bottom=0)
        axes.xaxis.set_minor_formatter(NullFormatter())
    dimensions = dimensions_of(rows)
    left.set_xticks(dimensions, map(str, dimensions))
    left.xaxis.set_minor_locator(NullLocator())
    left.set(xlabel="dimension", ylabel="accuracy (%)")
    right.xaxis.set_major_formatter(FuncFormatter(lambda s, _: number(s)))
    right.set_xlabel("s of one fold: space, points, k-NN")
    return drawn


def _against_dimension(axes: Axes, rows: list[Neighbours]) -> None:
    """Draw a line with error bars, named at its end; a space without dimensions is a band."""
    from ajgdata.report.labels import label_end

    first = rows[0]
    if first.dimension is not None:
        scores = [row.score for row in rows]
        draw_space(axes, first.space, [row.dimension or 0 for row in rows], scores)
        return
    colour, label = look(first.space)["color"], space_name(first.space)
    mean, sd = 100 * first.score.mean, 100 * np.nan_to_num(first.score.sd)
    axes.axhspan(mean - sd, mean + sd, color=colour, alpha=0.12, lw=0)
    axes.axhline(mean, color=colour, lw=1.2, ls=(0, (5, 3)), label=label)
    label_end(axes, None, mean, label, colour)


def _against_time(axes: Axes, rows: list[Neighbours], shown: int) -> None:
    """Draw a marker for each dimension; that of the settings, or else the last, is named."""
    from ajgdata.report.labels import label_end

    style = look(rows[0].space)
    named = next((row for row in rows if row.dimension in (None, shown)), rows[-1])
    for row in rows:
        place = max(row.seconds, SHORTEST), 100 * row.score.mean
        sd = 100 * np.nan_to_num(row.score.sd)
        axes.errorbar(*place, sd, ms=4.5, elinewidth=0.8, capsize=0, **style)
        if row is named:
            name = space_name(row.space) + (f", {row.dimension}-D" if row.dimension else "")
            label_end(axes, *place, name, style["color"])


def _front(axes: Axes, rows: Sequence[Neighbours]) -> None:
    """Draw a line through what nothing else beats in both accuracy and time."""
    from ajgdata.report.canvas import GREY, pareto_front

    seconds = np.array([max(row.seconds, SHORTEST) for row in rows])
    accuracy = np.array([100 * row.score.mean for row in rows])
    best = np.flatnonzero(pareto_front(seconds, -accuracy))
    best = best[np.lexsort((accuracy[best], seconds[best]))]
    axes.plot(seconds[best], accuracy[best], color=GREY, lw=1, zorder=1, label="Pareto front")


def gain_text(results: TaskResults) -> str:
    """Return by how much the latent is better than raw features."""
    latent, raw = at_shown(results, "latent"), at_shown(results, "raw")
    points = 100 * (latent.score.mean - raw.score.mean)
    relative = points / raw.score.mean if raw.score.mean > 0 else float("nan")
    sense = "higher" if points >= 0 else "lower"
    return (
        f"k-NN on the latent reaches {mean_sd(latent.score, '%', 100)} at {latent.dimension} "
        f"dimensions, on raw features {mean_sd(raw.score, '%', 100)}: {number(abs(points))} "
        f"percentage points, or {number(abs(relative))} %, {sense}"
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
        f"{gain_text(results)}. Settings fix this dimension beforehand; which dimension is best is "
        f"exploratory ({accuracy_range(results, 'latent')} over all). Left: against the "
        "dimension of the space; dashed with its band: raw features. Right: against the time of "
        "one fold, each space named at the same dimension; grey: what nothing else beats. PCA "
        "and UMAP "
        "learn from training points alone, and nothing of what they are of; the latent was told "
        "which of them are alike. The time of a latent is its share of a training of all "
        "dimensions together. The times belong to the machine that made this page.",
        f"{finding(results)}. Accuracy by space and dimension: {listed}.",
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
        tuple((str(d), *(cell(space, d) for space in spaces)) for d in dimensions_of(rows)),
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
