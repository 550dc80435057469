"""Embedding: how well a classifier of one gripper serves on others that no encoder saw."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ajgdata.evaluate.agreement import together
from ajgdata.experiments import embedding_probes
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
    supervision,
)
from ajgdata.experiments.embedding_probes import probe_rows, probe_scores, probe_table
from ajgdata.report.blocks import Illustration, ShownTable
from ajgdata.report.comparison import (
    Cost,
    PaperComparison,
    holds,
    range_of,
)
from ajgdata.report.format import Caption, Score, mean_sd, number, words
from ajgdata.report.projections import ordered
from ajgdata.types import Embedding, Kind, NotPossibleError
from ajgdata.types.table import table_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ajgdata.evaluate.latent_transfer import BothGrippers

TITLE = "Embedding: transfer to other grippers"
CALIBRATION = (0, 1, 2, 4)
PROBE_FOLDS = 5
Spaces = Mapping[str, list[np.ndarray]]


def measure(inputs: Inputs, settings: Embedding, _: str) -> Outcome:
    """Return the accuracy of classifiers of the base data set on the grippers that are held out,
    in each space and with each number of calibration grasps.

    A session of the store is one gripper. Raises ValueError as `both_grippers` does, and for a
    held-out session that there is not.
    """
    from ajgdata.evaluate.latent_transfer import BASE, both_grippers, transfer_spaces

    wall, cpu = time.perf_counter(), time.process_time()
    both = both_grippers(inputs.store, inputs.others[str(settings.base)], settings)
    if unknown := sorted(set(settings.held_out) - set(both.session)):
        raise NotPossibleError(f"held_out: there is no session {unknown[0]!r}")
    spaces = dict(transfer_spaces(both, settings, inputs.seed))
    chance = 1 / len(np.unique(both.data.instance))
    rows = list(_accuracies(both, spaces, settings, inputs.seed))
    probed = list(_probes(both, spaces, settings, inputs.kinds, inputs.seed))
    scores = [*_score_rows(rows, chance), *probe_scores(probed)]
    columns = {"space": "Space", "gripper": "Gripper", "calibration": "Calibration grasps"}
    columns |= {"run": "Run", "accuracy": "Accuracy"}
    note = "Without a number of calibration grasps: trained on that gripper alone."
    tables = (
        score_table(scores, TITLE),
        table_of("transfer", TITLE, by_run(rows, "accuracy"), note, **columns),
        probe_table(probed),
    )
    spent = {"wall_s": time.perf_counter() - wall, "cpu_s": time.process_time() - cpu}
    cost: list[ScoreRow] = [("", "cost of transfer", k, "measured", v) for k, v in spent.items()]
    about = {
        "training_grippers": sorted(set(both.session) - {BASE, *settings.held_out}),
        "held_out_grippers": list(settings.held_out),
        "dimension": settings.shown,
        "chance": chance,
        **both.data.thinned,
    }
    return Outcome(tables, (score_table(cost, f"{TITLE}: cost"),), about)


def _accuracies(
    both: BothGrippers, spaces: Spaces, settings: Embedding, seed: int
) -> Iterator[dict[str, Any]]:
    """Yield, of each held-out gripper, the accuracy of a classifier that was brought along, and
    (without a number of calibration grasps) of one trained on that gripper alone."""
    from ajgdata.evaluate.latent_transfer import calibration_draws, transfer_accuracy

    thing, nothing, most = both.data.instance, np.zeros(0, int), max(CALIBRATION)
    for gripper in settings.held_out:
        of_gripper = np.flatnonzero(both.session == gripper)
        draws = list(calibration_draws(thing, both.data.grasp, of_gripper, most, seed))
        for name, points in spaces.items():
            runs = [(z, draw) for z in points for draw in draws]
            about = {"space": name, "gripper": gripper}
            for n in CALIBRATION:
                scores = [transfer_accuracy(z, thing, both.on_base, draw, n) for z, draw in runs]
                yield {**about, "calibration": n, "values": scores}
            scores = [transfer_accuracy(z, thing, nothing, draw, most) for z, draw in runs]
            yield {**about, "calibration": None, "values": scores}


def _score_rows(rows: list[dict[str, Any]], chance: float) -> Iterator[ScoreRow]:
    for row in rows:
        alone = row["calibration"] is None
        part = f"transfer:{row['gripper']}:{'within' if alone else row['calibration']}"
        told = None if alone else chance
        yield from run_scores(row["space"], part, "accuracy", row["values"], told)


def _probes(
    both: BothGrippers, spaces: Spaces, settings: Embedding, kinds: Mapping[str, Kind], seed: int
) -> Iterator[dict[str, Any]]:
    """Yield which thing and which gripper it was, read of the held-out grippers."""
    from ajgdata.evaluate.embedding_data import Run
    from ajgdata.evaluate.splits import grouped_folds

    new = np.flatnonzero(np.isin(both.session, settings.held_out))
    instance, grasp = both.data.instance[new], both.data.grasp[new]
    folds = grouped_folds(instance, grasp, "classification", PROBE_FOLDS, seed)
    for name, points in spaces.items():
        runs = [Run(z, new[a], new[b]) for z in points for a, b in folds]
        for row in probe_rows(both.data, runs, settings, kinds, unseen=False):
            yield {"space": name, "split": "grouped", **row}


class TransferScore(NamedTuple):
    """Accuracy on a gripper that was never trained on, after some calibration grasps of each
    thing; `calibration` is None for a classifier trained on that gripper alone."""

    space: str
    gripper: str
    calibration: int | None
    score: Score


def transfer_of(results: TaskResults) -> tuple[list[TransferScore], list[TransferScore]]:
    """Return the accuracies of classifiers brought along, and of those trained there alone."""
    table = results.results[0].tables["transfer"]
    scores = scores_by(table, ("space", "gripper", "calibration"), "accuracy")
    listed = [TransferScore(space, on, n, score) for (space, on, n), score in scores.items()]
    brought = [row for row in listed if row.calibration is not None]
    return brought, [row for row in listed if row.calibration is None]


def finding(results: TaskResults) -> str:
    """Return the space that serves best on unseen grippers, without and with calibration."""
    brought, _ = transfer_of(results)
    few, most = (f({row.calibration or 0 for row in brought}) for f in (min, max))
    spaces = list(dict.fromkeys(row.space for row in brought))
    best = max(spaces, key=lambda space: _mean(brought, space, few))
    last = max(spaces, key=lambda space: _mean(brought, space, most))
    chance = number(100 * results.results[0].about["chance"])
    told = (
        f"Unseen grippers, on average: at best {number(100 * _mean(brought, best, few))} % with "
        f"{few} grasps ({space_name(best)}; chance {chance} %)"
    )
    if few == most:
        return told
    reached = number(100 * _mean(brought, last, most))
    return f"{told}, {reached} % with {most} of each thing ({space_name(last)})"


def figure(results: TaskResults) -> Figure:
    """Return accuracy by space and calibration grasps, a panel for each unseen gripper."""
    from ajgdata.report.canvas import WIDTH_IN, new_figure

    grippers = results.results[0].about["held_out_grippers"]
    brought, _ = transfer_of(results)
    spaces = ordered([row.space for row in brought])
    grasps = sorted({row.calibration for row in brought if row.calibration is not None})
    columns, rows = min(len(grippers), 2), math.ceil(len(grippers) / 2)
    drawn = new_figure(
        (WIDTH_IN, 1.3 + rows * (0.7 + 0.21 * len(spaces))),
        finding(results),
        f"{results.title}: k-NN trained on the default gripper and {grasps[0]} (small) to "
        f"{grasps[-1]} (large) grasps of each thing; hollow: trained there alone; mean ± sd",
        [results.source],
    )
    grid = drawn.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    panels = grid.ravel().tolist()
    for axes, gripper in zip(panels, grippers, strict=False):
        _panel(axes, results, gripper, spaces)
        axes.set_title(words(gripper))
    for axes in panels[len(grippers) :]:
        axes.set_visible(False)
    for axes in grid[-1]:
        axes.set_xlabel("accuracy (%)")
    panels[0].set_yticks(range(len(spaces)), map(space_name, spaces))
    panels[0].set_ylim(len(spaces) - 0.5, -0.5)
    panels[0].set_xlim(left=0)
    return drawn


def _panel(axes: Axes, results: TaskResults, gripper: str, spaces: list[str]) -> None:
    """Draw a row for each space: markers grow with the calibration grasps."""
    from ajgdata.report.labels import REFERENCES

    brought, within = transfer_of(results)
    rows = [row for row in brought if row.gripper == gripper]
    grasps = sorted({row.calibration for row in rows if row.calibration is not None})
    for place, space in enumerate(spaces):
        own = {row.calibration: row.score for row in rows if row.space == space}
        mean = [100 * own[n].mean for n in grasps]
        style = look(space)
        axes.plot(mean, [place] * len(mean), label=space_name(space), color=style["color"], lw=0.8)
        for i, (n, x) in enumerate(zip(grasps, mean, strict=True)):
            grown = i / max(len(grasps) - 1, 1)
            sd = 100 * np.nan_to_num(own[n].sd) if grown in (0, 1) else None
            size: dict[str, Any] = {"ms": 3 + 4 * grown, "elinewidth": 0.7}
            axes.errorbar(x, place + 0.16 * grown, xerr=sd, **size, **style)
    for row in within:
        if row.gripper == gripper:
            above = spaces.index(row.space) - 0.22
            axes.plot(100 * row.score.mean, above, mfc="white", ms=5, **look(row.space))
    axes.axvline(100 * results.results[0].about["chance"], label="chance", **REFERENCES["chance"])
    axes.tick_params(axis="y", length=0)


def caption(results: TaskResults) -> Caption:
    """Return the caption of `figure`."""
    listed = "; ".join(
        f"{space_name(row.space)} on {words(row.gripper)}, {row.calibration} "
        f"grasps: {mean_sd(row.score, '%', 100)}"
        for row in transfer_of(results)[0]
    )
    return Caption(
        "A classifier of things, trained on the default gripper, is asked on grippers "
        "that no encoder was trained on, after none to some calibration grasps of each thing. "
        "Markers grow with these grasps, with bars at the fewest and the most. Hollow: trained on "
        "4 grasps of each thing on that gripper and nothing else. "
        "What is standardised per gripper knows all recordings of the new one, those asked about "
        "included, but no labels; what is referenced knows its recordings of nothing. "
        "Dotted: chance.",
        f"{finding(results)}. Accuracy by calibration grasps: {listed}.",
    )


def figures(results: TaskResults) -> Iterator[Illustration]:
    """Yield the figure of probes, where there are any, then that of transfer."""
    yield from embedding_probes.figures(results)
    yield illustration(results, "", caption(results), partial(figure, results))


def tables(results: TaskResults) -> Iterator[ShownTable]:
    """Yield the mean over the unseen grippers, the probes, and how it was all made."""
    brought, _ = transfer_of(results)
    grasps = sorted({row.calibration for row in brought if row.calibration is not None})
    chance = number(100 * results.results[0].about["chance"])
    yield ShownTable(
        "Mean accuracy over the unseen grippers, by calibration grasps of each thing "
        f"(chance {chance} %).",
        ("space", *(f"{n} grasps|" for n in grasps)),
        tuple(
            (space_name(space), *(f"{number(100 * _mean(brought, space, n))} %" for n in grasps))
            for space in ordered([row.space for row in brought])
        ),
    )
    yield from embedding_probes.tables(results)
    yield settings_table(results)


def _mean(rows: list[TransferScore], space: str, calibration: int) -> float:
    """Return the mean accuracy over grippers."""
    asked = [r.score.mean for r in rows if (r.space, r.calibration) == (space, calibration)]
    return float(np.mean(asked))


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield, of each unseen gripper, the pose latent brought along against a few grasps there."""
    brought, within = transfer_of(results)
    rows = [r for r in brought if r.space == "pose_latent" and r.calibration == 0]
    if results.paper is None or not rows:
        return
    own = {r.gripper: r.score for r in within if r.space == "pose_latent"}
    gaps = [Score(own[r.gripper].mean - r.score.mean, own[r.gripper].sd) for r in rows]
    spaces = list(dict.fromkeys(r.space for r in brought))
    best = max(spaces, key=lambda space: _mean(brought, space, 0))
    told = ", ".join(f"{number(100 * r.score.mean)} %" for r in rows)
    few = max(r.calibration or 0 for r in brought)
    instead = ", ".join(f"{number(100 * own[r.gripper].mean)} %" for r in rows)
    result = (
        f"{told} on unseen grippers, where {few} grasps of each thing alone give {instead}; best "
        f"of all spaces on average: {space_name(best)}, {number(100 * _mean(brought, best, 0))} %"
    )
    spent = results.results[0].cost[SCORES].where(metric="cpu_s").numbers("value")
    yield PaperComparison(
        results.paper, results.dataset, results.task, results.source, result, "pose latent",
        together({holds(gap) for gap in gaps}), Cost(float(spent[0]), math.nan),
        marks=(
            range_of("ours", "elsewhere", [100 * r.score.mean for r in rows]),
            range_of("other", f"{few} grasps", [100 * own[r.gripper].mean for r in rows]),
        ),
        shown_unit="%", label="latent",
    )  # fmt: skip


EXPERIMENT = Experiment(
    name="embedding_transfer",
    title=TITLE,
    settings=Embedding,
    measure=measure,
    figures=figures,
    summary=supervision,
    tables=tables,
    paper_comparison=paper_comparison,
    of_embedding=True,
    of_base=True,
    order=85,
    paper="transfer",
)
