"""What stands beside the paper's figures on embeddings."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

from ajgdata.report.comparison import Beside, Spent, agreement, holds, together
from ajgdata.report.content import Report
from ajgdata.report.embedded import SPACES, Distances, Embedded, Neighbours, Transfer
from ajgdata.report.embedding_blocks import flat
from ajgdata.report.format import Score, mean_sd, number, words
from ajgdata.report.latents import clusters_text

#: What the paper says of its categories: these lie together, this one is spread widely.
TOGETHER, SPREAD = ("spherical", "cylindrical"), "other"
Found = tuple[str, str, str, Spent | None]  #: result, model, whether they agree, cost


def of_embedding(report: Report, one: Embedded) -> Iterator[Beside]:
    """A row for each of the paper's figures that the embedding speaks of."""
    for paper in report.paper:
        if paper.id in FINDINGS and (found := FINDINGS[paper.id](one, paper.value)):
            result, model, agrees, cost = found
            reasons = tuple(reason for reason in report.reasons if paper.id in reason.of)
            yield Beside(paper, one.dataset, one.source, result, model, cost, agrees, reasons)


def _gain(one: Embedded, paper: float | None) -> Found | None:
    """By how much k-NN on the latent is better than on raw features, relative to these."""
    best, raw = one.best("latent"), one.best("raw")
    if best is None or raw is None or paper is None or not raw.score.mean > 0:
        return None
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
    return result, "k-NN on the latent", agreement(score, paper), _spent(one, best)


def _spent(one: Embedded, at: Neighbours) -> Spent:
    """Of all folds, one network each; a recording is placed and classified with others."""
    folds = len(raw.score.per_fold) if (raw := one.best("raw")) else 1
    return Spent(folds * at.fit_s, 1e3 * at.ask_s / at.recordings)


def _encoder(one: Embedded) -> Spent | None:
    shown = [row for row in one.of_space("latent") if row.dimension == one.settings["shown"]]
    return _spent(one, shown[0]) if shown else None


def _apart(one: Embedded, _: float | None) -> Found | None:
    """Which categories lie together, and whether the one that the paper names is the widest."""
    latent = next((d for d in one.distances if d.space == "latent"), None)
    gaps = latent.gaps() if latent else {}
    if latent is None or not {*TOGETHER, SPREAD} <= set(gaps):
        return None
    within = dict(zip(latent.categories, np.diagonal(latent.mean), strict=True))
    told = [
        f"{words(name)} {number(within[name])} within, {mean_sd(gaps[name])} more to others"
        for name in (*TOGETHER, SPREAD)
    ]
    verdicts = {holds(gaps[name], "no: not nearer within") for name in TOGETHER}
    verdicts.add(_widest(latent))
    return "; ".join(told), "latent", together(verdicts), _encoder(one)


def _widest(latent: Distances) -> str:
    """Whether distances within SPREAD exceed those within the others, over runs."""
    place = {name: i for i, name in enumerate(latent.categories)}
    inner = latent.per_run[:, range(len(place)), range(len(place))]
    most = inner[:, [place[name] for name in TOGETHER]].max(axis=1)
    gap = inner[:, place[SPREAD]] - most
    return holds(Score(float(gap.mean()), float(gap.std(ddof=1))), "no: not the widest")


def _clusters(one: Embedded, _: float | None) -> Found | None:
    """Clusters are told by the silhouette of the things, on validation points of all runs."""
    column = one.settings["instance"]
    told = {row.space: row.score for row in one.silhouettes if row.label == column}
    if "latent" not in told:
        return None
    raw = f" (raw features {mean_sd(told['raw'])})" if "raw" in told else ""
    result = f"silhouette of objects {mean_sd(told['latent'])}{raw} in {one.settings['shown']}-D"
    plane = flat(one)
    if plane and (seen := clusters_text(plane)):
        result += f"; in two dimensions, of the validation points {seen}"
    return result, "latent", holds(told["latent"], "no: they overlap"), _encoder(one)


def _transferred(one: Embedded, _: float | None) -> Found | None:
    """Of each unseen gripper: what was learned elsewhere, and on it with a few grasps."""
    if one.transfer is None:
        return None
    rows = [r for r in one.transfer.rows if r.space == "pose_latent" and r.calibration == 0]
    own = {r.gripper: r.score for r in one.transfer.within if r.space == "pose_latent"}
    if not rows:
        return None
    gaps = [Score(own[r.gripper].mean - r.score.mean, own[r.gripper].sd) for r in rows]
    best, accuracy = _best_space(one.transfer)
    told = ", ".join(f"{number(100 * r.score.mean)} %" for r in rows)
    few = max(r.calibration or 0 for r in one.transfer.rows)
    instead = ", ".join(f"{number(100 * own[r.gripper].mean)} %" for r in rows)
    result = (
        f"{told} on unseen grippers, where {few} grasps of each thing alone give {instead}; best "
        f"of all spaces on average: {SPACES.get(best, best)}, {number(100 * accuracy)} %"
    )
    verdicts = {holds(gap, "no: it works") for gap in gaps}
    return result, "pose latent", together(verdicts), Spent(one.transfer_s, math.nan)


def _best_space(transfer: Transfer) -> tuple[str, float]:
    """The space that serves best on unseen grippers without calibration, and its accuracy."""
    scores: dict[str, list[float]] = {}
    for row in transfer.rows:
        if row.calibration == 0:
            scores.setdefault(row.space, []).append(row.score.mean)
    best = max(scores, key=lambda space: float(np.mean(scores[space])))
    return best, float(np.mean(scores[best]))


#: By the paper's entry.
FINDINGS: dict[str, Callable[[Embedded, float | None], Found | None]] = {
    "latent-knn": _gain,
    "distances": _apart,
    "embedding": _clusters,
    "transfer": _transferred,
}
