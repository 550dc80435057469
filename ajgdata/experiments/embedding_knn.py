"""Embedding: k-NN on latents, raw features, PCA and UMAP against the dimension."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ajgdata.evaluate.agreement import Estimate, Interval, compare_with_published
from ajgdata.evaluate.fold_tests import corrected_interval
from ajgdata.evaluate.neighbours import scores_by_space
from ajgdata.experiments.base import (
    Experiment,
    Inputs,
    Lookup,
    Outcome,
    TaskResults,
)
from ajgdata.experiments.built_in import BUILT_IN
from ajgdata.experiments.embedding import run_scores, scores_by, trained, with_space_titles
from ajgdata.experiments.plots import Plot, value_range
from ajgdata.experiments.scores import ScoreKey, ScoreRow, score_table
from ajgdata.models.baselines import NEIGHBOURS
from ajgdata.report.comparison import PaperComparison, ResultCost
from ajgdata.report.format import Score, mean_sd, number
from ajgdata.store.metrics import COST
from ajgdata.types import Embedding
from ajgdata.types.table import Table, table_of

NAME = "embedding_knn"
TITLE = "Embedding: nearest neighbours"
TIMES = ("fit_s", "transform_s", "query_s")


def measure(inputs: Inputs, settings: Embedding, _: str) -> Outcome:
    """Return the accuracy of k-NN in each space by dimension, fold and initialisation.

    Raises ValueError if no encoder could be trained.
    """
    data, latents = trained(inputs, settings)
    value = data.column(settings.target)
    scored = list(scores_by_space(data, latents, value, settings.dimensions, inputs.seed))
    chance = np.unique(value[value != ""], return_counts=True)[1].max() / np.sum(value != "")
    scores = (
        row
        for space, dimension, runs in scored
        for row in run_scores(
            "accuracy",
            [run.accuracy for run in runs],
            ScoreKey(space, dimension=dimension),
            float(chance),
        )
    )
    accuracies = (
        {"space": space, "dimension": dimension, "run": number, "accuracy": run.accuracy}
        for space, dimension, runs in scored
        for number, run in enumerate(runs)
    )
    columns = {"space": "Space", "dimension": "Dimension", "run": "Run", "accuracy": "Accuracy"}
    tables = score_table(scores, TITLE), table_of("knn", TITLE, accuracies, **columns)
    tested = len(data.feature) / len({*latents.validation_fold.tolist()})
    cost = _cost_tables(list(_times(scored, inputs.training_cost, tested)), inputs.training_cost)
    about = {"k": NEIGHBOURS, "target": settings.target, "chance": float(chance)}
    return Outcome(tables, cost, about | data.thinned)


def _cost_tables(
    times: Sequence[dict[str, Any]], training_cost: Mapping[str, float]
) -> tuple[Table, Table]:
    """Return the scores of training all encoders and of a fold in each space, and `times`."""
    scores: list[ScoreRow] = [ScoreRow(name, COST, value) for name, value in training_cost.items()]
    scores += [
        ScoreRow(name, COST, row[name], ScoreKey(row["space"], dimension=row["dimension"]))
        for row in times
        for name in TIMES
    ]
    columns = {
        "space": "Space",
        "dimension": "Dimension",
        "fit_s": "Fitting the space, s",
        "transform_s": "Placing validation points, s",
        "query_s": "k-NN, s",
        "recordings": "Recordings",
    }
    table = table_of("times", f"{TITLE}: times of a fold", times, **columns)
    return score_table(scores, f"{TITLE}: cost"), table


def _times(
    scored: Sequence[tuple[str, int | None, list[Any]]], spent: Any, tested: float
) -> Iterator[dict[str, Any]]:
    """Yield the mean times of a fold. The encoders of the latent were trained by another job."""
    for space, dimension, runs in scored:
        seconds = {name: float(np.mean([getattr(run, name) for run in runs])) for name in TIMES}
        if space == "latent":
            seconds["fit_s"] = spent["cpu_s"] / spent["networks"]
            seconds["transform_s"] = spent["encode_s_per_recording"] * tested
        yield {"space": space, "dimension": dimension, **seconds, "recordings": tested}


def at_shown(results: TaskResults, space: str) -> tuple[Score, dict[str, Any]]:
    """Return the validation accuracy of k-NN, and the times of a fold.

    The dimension is `shown` of the settings, so no score selects it. A space such as raw features
    has no dimension to choose.
    """
    result = results.results[0]
    shown = (None, results.settings.shown)
    scores = scores_by(result.tables["knn"], ("space", "dimension"), "accuracy")
    times = result.cost["times"].where(space=space).rows
    row = next(row for row in times if row["dimension"] in shown)
    return scores[space, row["dimension"]], row


def by_dimension(results: TaskResults) -> Table:
    """Return the accuracy of each run. A space without dimensions has it at every dimension."""
    result = results.results[0]
    rows = []
    for row in with_space_titles(result.tables["knn"]).rows:
        known = row | {"chance": result.about["chance"]}
        own = results.settings.dimensions if row["dimension"] is None else [row["dimension"]]
        rows += [known | {"dimension": dimension} for dimension in sorted(own)]
    columns = {"space": "Space", "dimension": "Dimension", "accuracy": "Accuracy"}
    return table_of("knn", TITLE, rows, **columns, chance="Chance")


def finding(results: TaskResults) -> str:
    """Return the accuracy of k-NN on the latent and on raw features."""
    latent, raw = (at_shown(results, space)[0] for space in ("latent", "raw"))
    chance = number(100 * results.results[0].about["chance"])
    return (
        f"k-NN reaches {mean_sd(latent, '%', 100)} on a latent of {results.settings.shown} "
        f"dimensions, {mean_sd(raw, '%', 100)} on raw features (chance {chance} %)"
    )


def encoder_cost(results: TaskResults, lookup: Lookup) -> ResultCost | None:
    """Return the cost of the encoders of the shown dimension: one network per fold.

    Return None if k-NN was not measured on them.
    """
    measured = lookup(NAME, results.dataset, results.task)
    if measured is None or measured.task != results.task:
        return None
    (raw, _), (_, times) = (at_shown(measured, space) for space in ("raw", "latent"))
    predict_s = times["transform_s"] + times["query_s"]
    return ResultCost(len(raw.per_fold) * times["fit_s"], 1e3 * predict_s / times["recordings"])


def relative_gain(latent: Score, raw: Score) -> tuple[Score, Interval]:
    """Return by how much (%) k-NN on the latent is better than on raw features, relative to these.

    The interval is that of the mean over folds; each fold is the mean of its initialisations, which
    are one after another in `latent`.
    """
    folds = len(raw.per_fold)
    gains = np.reshape(latent.per_fold, (folds, -1)) - np.array(raw.per_fold)[:, np.newaxis]
    relative = 100 * gains / raw.mean
    low, high = corrected_interval(relative.mean(axis=1).tolist(), folds)
    upper = 100 * (1 - raw.mean) / raw.mean  # from no right answer to all right
    interval = Interval(max(low, -100.0), min(high, upper))
    return Score(float(relative.mean()), float(relative.std(ddof=1)), (), *interval), interval


def paper_comparison(results: TaskResults, lookup: Lookup) -> Iterator[PaperComparison]:
    """Yield by how much k-NN on the latent is better than on raw features, relative to these."""
    paper = results.paper
    latent, raw = (at_shown(results, space)[0] for space in ("latent", "raw"))
    if paper is None or paper.value is None or not raw.mean > 0:
        return
    score, interval = relative_gain(latent, raw)
    points = 100 * (latent.mean - raw.mean)
    knn = results.results[0].tables["knn"].where(space="latent")
    means = [100 * score.mean for score in scores_by(knn, ("dimension",), "accuracy").values()]
    result = (
        f"{mean_sd(score, '%')} higher ({mean_sd(latent, '%', 100)} for "
        f"{mean_sd(raw, '%', 100)}: {number(points)} percentage points) at "
        f"{results.settings.shown} dimensions; exploratory, by dimension: {value_range(means, '%')}"
    )
    perfect = 100 * (1 - raw.mean) / raw.mean
    gain = Estimate(score.mean, interval, chance=0.0, perfect=perfect)
    verdict = compare_with_published(gain, paper.value)
    cost = encoder_cost(results, lookup)
    yield results.compared(paper, result, "k-NN on the latent", verdict, cost=cost)


ACCURACY_PLOT = Plot(
    "lines",
    by_dimension,
    "accuracy of k-NN by dimension; PCA and UMAP are fitted to training recordings without labels, "
    "and the dimension of the title is fixed in the settings",
    value="accuracy",
    x="dimension",
    series=("space",),
    over="folds and initialisations",
    chance="chance",
    title=finding,
    percent=("accuracy",),
)
EXPERIMENT = Experiment(
    BUILT_IN["embedding_knn"],
    measure=measure,
    plots=(ACCURACY_PLOT,),
    paper_comparison=paper_comparison,
)
