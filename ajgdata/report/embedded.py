"""What the page on embeddings is made of: plain values and arrays, as the documents hold them.

Accuracies and precisions are fractions (0..1), distances in units of the space, times in s.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.report.format import Score, Source

Real = NDArray[np.floating]

#: What the spaces of a document are called, in the order of legends.
SPACES = {
    "latent": "latent",
    "raw": "raw features",
    "pca": "PCA",
    "umap": "UMAP",
    "pose_latent": "pose latent",
    "gripper_latent": "latent across grippers",
    "standardised": "standardised per gripper",
    "referenced": "referenced to empty gripper",
    "standardised_latent": "latent across grippers, standardised",
    "referenced_latent": "latent across grippers, referenced",
}
#: What the projections are called, in the order of panels.
METHODS = {"pca": "PCA", "umap": "UMAP", "tsne": "t-SNE"}


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
        """Of all of one fold."""
        return self.fit_s + self.ask_s


class Probe(NamedTuple):
    """What a probe reads from a space; `split` is grouped or unseen."""

    space: str
    probe: str
    target: str
    split: str
    metric: str
    score: Score
    chance: float


class Silhouette(NamedTuple):
    """Silhouette of the labels of a column in a space."""

    space: str
    label: str
    score: Score


class Retrieval(NamedTuple):
    """Precision at k of queries from things never trained on; `gallery` is unseen or all."""

    space: str
    k: int
    gallery: str
    score: Score
    chance: float


@dataclass(frozen=True, eq=False)
class Distances:
    """Mean distances of validation pairs of different grasps in one space.

    `mean`, `sd` (c, c) over runs between categories, `per_run` (runs, c, c) their values, `other`
    and `other_sd` the same with pairs of different things only, `object_mean` (o, o) between
    objects. NaN: there are no such pairs.
    """

    space: str
    categories: tuple[str, ...]
    mean: Real
    sd: Real
    other: Real
    other_sd: Real
    objects: tuple[str, ...]
    object_category: tuple[str, ...]
    object_mean: Real
    per_run: Real

    def __post_init__(self) -> None:
        of_categories = {m.shape for m in (self.mean, self.sd, self.other, self.other_sd)}
        if of_categories != {(len(self.categories),) * 2}:
            raise ValueError(f"{len(self.categories)} categories, but shapes {of_categories}")
        if self.object_mean.shape != (len(self.objects),) * 2:
            raise ValueError(f"{len(self.objects)} objects, but shape {self.object_mean.shape}")

    def between(self, category: int) -> float:
        """Mean over the other categories, or NaN if there are none."""
        others = np.delete(self.mean[category], category)
        return float(others.mean()) if len(others) else math.nan

    def apart(self) -> dict[str, bool]:
        """Whether each category's members lie nearer to one another than to other categories'."""
        return {
            name: bool(self.mean[i, i] < self.between(i)) for i, name in enumerate(self.categories)
        }

    def gaps(self) -> dict[str, Score]:
        """By how much each category's members lie nearer to one another than to other categories':
        mean and sd over runs. None of a category that stands alone."""
        found = {}
        for i, name in enumerate(self.categories):
            within, others = self.per_run[:, i, i], np.delete(self.per_run[:, i], i, axis=1)
            gap = others.mean(axis=1) - within if others.shape[1] else np.empty(0)
            if len(gap := gap[np.isfinite(gap)]) > 1:
                found[name] = Score(float(gap.mean()), float(gap.std(ddof=1)))
        return found


class Moved(NamedTuple):
    """Accuracy on a gripper that was never trained on, after some calibration grasps of each
    thing; `calibration` is None for a classifier trained on that gripper alone."""

    space: str
    gripper: str
    calibration: int | None
    score: Score


@dataclass(frozen=True, eq=False)
class Transfer:
    """From the default gripper to others."""

    training_grippers: tuple[str, ...]
    held_out_grippers: tuple[str, ...]
    dimension: int
    chance: float
    rows: tuple[Moved, ...]
    within: tuple[Moved, ...]
    probes: tuple[Probe, ...]


@dataclass(frozen=True, eq=False)
class Picture:
    """A space as points of a plane: `points` (n, 2) of every recording by one encoder."""

    space: str
    method: str
    points: Real


@dataclass(frozen=True, eq=False)
class Pictured:
    """All pictures of one run, with what is known of each recording.

    `training` (n,): whether the encoder was trained on it. `columns`: text or numbers (n,) by
    name, the first of them the thing itself. Raises ValueError for lengths that differ.
    """

    recording: NDArray[np.str_]
    training: NDArray[np.bool_]
    columns: Mapping[str, NDArray]
    pictures: tuple[Picture, ...]

    def __post_init__(self) -> None:
        counts = {len(self.recording), len(self.training)}
        counts |= {len(values) for values in self.columns.values()}
        counts |= {len(picture.points) for picture in self.pictures}
        if len(counts) != 1:
            raise ValueError(f"pictures and their labels have lengths {sorted(counts)}")


@dataclass(frozen=True, eq=False)
class Embedded:
    """One embedding of one data set. Parts that were not made are empty or None."""

    dataset: str
    name: str
    title: str
    source: Source
    supervision: str
    settings: Mapping[str, object]
    made_by: str
    skipped: Mapping[str, str]
    chance: float = math.nan
    neighbours: tuple[Neighbours, ...] = ()
    distances: tuple[Distances, ...] = ()
    probes: tuple[Probe, ...] = ()
    silhouettes: tuple[Silhouette, ...] = ()
    retrieval: tuple[Retrieval, ...] = ()
    transfer: Transfer | None = None
    networks: int = 0
    training_s: float = math.nan
    transfer_s: float = math.nan
    pictured: Pictured | None = None

    @property
    def id(self) -> str:
        """For file names and links."""
        return f"{self.dataset}--{self.name}"

    def of_space(self, space: str) -> list[Neighbours]:
        """k-NN in a space, by rising dimension."""
        rows = [row for row in self.neighbours if row.space == space]
        return sorted(rows, key=lambda row: row.dimension or 0)

    def best(self, space: str) -> Neighbours | None:
        """The dimension of highest accuracy; of equals, the lowest."""
        rows = self.of_space(space)
        return max(rows, key=lambda row: row.score.mean) if rows else None


def gain(better: Neighbours, than: Neighbours) -> tuple[float, float]:
    """By how much one mean accuracy exceeds another: in percentage points, and relative in %."""
    points = 100 * (better.score.mean - than.score.mean)
    return points, points / than.score.mean if than.score.mean > 0 else math.nan


def ordered(spaces: Sequence[str]) -> list[str]:
    """Distinct spaces in the order of SPACES, unknown ones last."""
    known = [space for space in SPACES if space in spaces]
    return known + sorted(set(spaces) - set(known))
