"""Embedding: properties that probes read from each space, and how well things are separated."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

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
    illustration,
    run_scores,
    scores_by,
    space_name,
    trained,
)
from ajgdata.experiments.embedding_knn import encoder_cost
from ajgdata.experiments.embedding_projections import clusters_of
from ajgdata.report.blocks import Illustration, ShownTable
from ajgdata.report.comparison import PaperComparison, holds, mark_of
from ajgdata.report.format import DASH, Score, mean_sd, number, words
from ajgdata.report.projections import ordered
from ajgdata.types import Embedding, Kind
from ajgdata.types.table import Table, table_of

if TYPE_CHECKING:
    from ajgdata.evaluate.embedding_data import EmbeddingData, Run

TITLE = "Embedding: what it encodes"
PROBES = {"linear": "linear", "knn": "k-NN"}
SPLITS = {"grouped": "new grasps of known things", "unseen": "unseen things"}
METRICS = {"accuracy": "accuracy", "r2": "R²", "rank_correlation": "rank correlation"}


def measure(inputs: Inputs, settings: Embedding, _: str) -> Outcome:
    """Return the scores of probes in the latent and raw, and silhouettes of the things.

    Raises ValueError where nothing could be trained.
    """
    from ajgdata.evaluate import distances
    from ajgdata.evaluate.embedding_data import runs_by_space

    data, latents = trained(inputs, settings)
    seen = latents.latent[settings.shown], latents.validation_fold
    splits = {} if data.separated else {"grouped": seen}
    if latents.unseen is not None:
        splits["unseen"] = (latents.unseen, latents.unseen_fold)
    probed = [
        {"space": space, "split": split, **row}
        for split, (latent, fold) in splits.items()
        for space, runs in runs_by_space(data, latent, fold)
        for row in probe_rows(data, runs, settings, inputs.kinds, unseen=split == "unseen")
    ]
    labels = dict.fromkeys([settings.instance, settings.category or settings.target])
    silhouettes: list[dict[str, Any]] = []
    for space, runs in runs_by_space(data, *seen):
        for label in labels:
            value = data.column(label).astype(str)
            values = [distances.silhouette(points[test], value[test]) for points, _, test in runs]
            silhouettes.append({"space": space, "label": label, "values": values})
    scores = list(probe_scores(probed))
    for row in silhouettes:
        metric = f"silhouette of {row['label']}"
        scores += run_scores(str(row["space"]), "silhouette", metric, row["values"])
    columns = {"space": "Space", "label": "Labels", "run": "Run", "silhouette": "Silhouette"}
    tables = (
        score_table(scores, TITLE),
        probe_table(probed),
        table_of("silhouettes", "Silhouettes", by_run(silhouettes, "silhouette"), **columns),
    )
    about = {"dimension": settings.shown}
    tested = max(len(test) for _, _, test in runs)
    if tested > distances.MOST_SILHOUETTE:
        about |= {"silhouette_on": distances.MOST_SILHOUETTE, "silhouette_of": tested}
    return Outcome(tables, about=about)


def probe_rows(
    data: EmbeddingData,
    runs: Sequence[Run],
    settings: Embedding,
    kinds: Mapping[str, Kind],
    *,
    unseen: bool,
) -> Iterator[dict[str, Any]]:
    """Yield the scores of all probes in one space, `values` of the runs and their mean chance.

    No probe can say which thing it is that it never met. What is read thing by thing is read of
    unseen things alone, learned from some of their grasps and tested on others: the latents of a
    thing that was trained on lie where its new grasps do not, and a probe would learn from what it
    is not tested on.
    """
    from ajgdata.evaluate.probes import PROBES, Property, probe, probe_within

    for column, how in settings.probes.items():
        if bool(how.within) > unseen or (unseen and column in (settings.instance, "object")):
            continue
        kind = kinds.get(column, "classification")
        prop = Property(data.column(column), kind, how.period_deg)
        for name in PROBES:
            if how.within:
                part = data.column(how.within)
                scores = [probe_within(z, prop, name, part, data.grasp, b) for z, _, b in runs]
            else:
                scores = [probe(z, prop, name, a, b) for z, a, b in runs]
            chance = float(np.mean([one["chance"] for one in scores]))
            for metric in ["accuracy"] if kind == "classification" else ["r2", "rank_correlation"]:
                values = [one[metric] for one in scores]
                about = {"probe": name, "target": column, "metric": metric}
                yield {**about, "chance": chance, "values": values}


def probe_scores(rows: Iterable[dict[str, Any]]) -> Iterator[ScoreRow]:
    """Yield the rows of `score_table` for rows of probes."""
    for row in rows:
        part, metric = f"probe:{row['split']}:{row['probe']}", f"{row['metric']} of {row['target']}"
        yield from run_scores(row["space"], part, metric, row["values"], row["chance"])


def probe_table(rows: Iterable[dict[str, Any]]) -> Table:
    """Return rows of probes as a table, one a run."""
    return table_of(
        "probes", "Probes", by_run(rows, "value"),
        space="Space", split="Tested on", probe="Probe", target="Target", metric="Metric",
        chance="Chance", run="Run", value="Value",
    )  # fmt: skip


class Probe(NamedTuple):
    """The score of a probe in a space; `split` is grouped or unseen."""

    space: str
    probe: str
    target: str
    split: str
    metric: str
    chance: float
    score: Score


def probes_of(results: TaskResults) -> list[Probe]:
    """Return the probes, without those that say nothing: a rank of angles, for instance."""
    table = results.results[0].tables["probes"]
    keys = ("space", "probe", "target", "split", "metric", "chance")
    listed = [
        Probe(space, probe, target, split, metric, math.nan if chance is None else chance, score)
        for (space, probe, target, split, metric, chance), score in scores_by(
            table, keys, "value"
        ).items()
    ]
    return [one for one in listed if math.isfinite(one.score.mean)]


def figures(results: TaskResults) -> list[Illustration]:
    """Return the figure of all probes; none where none was asked for."""
    from ajgdata.experiments.drawings.embedding_probes import caption, figure

    if not probes_of(results):
        return []
    return [illustration(results, "probes", caption(results), partial(figure, results))]


def tables(results: TaskResults) -> Iterator[ShownTable]:
    """Yield the probes, and the silhouettes where they were measured."""
    if probes := probes_of(results):
        yield _probes_shown(probes)
    if "silhouettes" not in results.results[0].tables:
        return
    told = silhouettes_of(results)
    spaces = ordered([space for space, _ in told])
    labels = dict.fromkeys(label for _, label in told)
    about = results.results[0].about
    thinned = "silhouette_on" in about
    on = " ({silhouette_on:,} of {silhouette_of:,} in a run)".format(**about) if thinned else ""
    yield ShownTable(
        f"Silhouettes (Rousseeuw 1987) of validation points{on}.",
        ("silhouette of", *(f"{space_name(space)}|" for space in spaces)),
        tuple((words(x), *(mean_sd(told[space, x]) for space in spaces)) for x in labels),
    )


def silhouettes_of(results: TaskResults) -> dict[tuple[str, str], Score]:
    """Return the silhouettes by space and column of labels."""
    table = results.results[0].tables["silhouettes"]
    scores = scores_by(table, ("space", "label"), "silhouette")
    return {(space, label): score for (space, label), score in scores.items()}


def _probes_shown(probes: Sequence[Probe]) -> ShownTable:
    """Return a row for each target, metric and split, a column for each space and probe."""
    kinds = [(space, probe) for space in ordered([p.space for p in probes]) for probe in PROBES]
    rows: dict[tuple[str, str, str], dict[tuple[str, str], Probe]] = {}
    for p in probes:
        rows.setdefault((p.target, p.split, p.metric), {})[p.space, p.probe] = p
    return ShownTable(
        "Scores of probes, mean ± sd over runs.",
        (
            "target", "tested on", "metric", "chance|",
            *(f"{space_name(space)}, {PROBES[probe]}|" for space, probe in kinds),
        ),
        tuple(
            (
                words(target),
                SPLITS[split],
                METRICS.get(metric, metric),
                number(next(iter(cells.values())).chance),
                *(mean_sd(cells[kind].score) if kind in cells else DASH for kind in kinds),
            )
            for (target, split, metric), cells in rows.items()
        ),
    )  # fmt: skip


def paper_comparison(results: TaskResults, lookup: Lookup) -> Iterator[PaperComparison]:
    """Yield whether things form clusters, by their silhouette on validation points of all runs."""
    column, told = results.settings.instance, silhouettes_of(results)
    if results.paper is None or ("latent", column) not in told:
        return
    score, raw = told["latent", column], told["raw", column]
    result = (
        f"silhouette of objects {mean_sd(score)} (raw features {mean_sd(raw)}) "
        f"in {results.settings.shown}-D"
    )
    drawn = lookup("embedding_projections", results.dataset, results.task)
    if drawn and drawn.task == results.task and (seen := clusters_of(drawn)):
        result += f"; in two dimensions, of the validation points {seen}"
    yield PaperComparison(
        results.paper, results.dataset, results.task, results.source, result, "latent",
        holds(score), encoder_cost(results, lookup),
        marks=(mark_of("ours", "latent", score), mark_of("other", "raw", raw)),
    )  # fmt: skip


EXPERIMENT = Experiment(
    name="embedding_probes",
    title=TITLE,
    settings=Embedding,
    measure=measure,
    figures=figures,
    tables=tables,
    paper_comparison=paper_comparison,
    of_embedding=True,
    order=83,
    paper="embedding",
)
