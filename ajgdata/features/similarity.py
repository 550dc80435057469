"""Recordings of one sound, detected by their spectra: copies that differ in format, gain or length.

A fingerprint is a spectrum in equal bands between the limits of `COMPARED_BAND_HZ`. With b the mean
magnitude of a band over the mean of all bands, the fingerprint is log(b + FLOOR) minus its own
mean, over the root of the number of bands. The Euclidean distance of two fingerprints is then the
root mean square difference of two levels, in nepers (1 neper = 8.7 dB).

- A gain changes no level relative to the mean. An offset of the samples is below the first band.
- A file of 22.05 kHz contains the complete bands, so resampling changes little.
- In the logarithm, noise has equal weight in loud and in quiet bands. Two recordings of one scene
  have different noise; two copies of one recording have the same noise.
- FLOOR reduces the weight of bands 20 dB below the mean. Rounding to 16 bits changes these bands,
  and so does the level of noise relative to a decaying sound when its start is removed.

A copy of noise that lacks the share p differs from the original by sqrt(p / (2 (1 - p))) of the
distance between two independent recordings: the mean over 1 - p of the frames has 1 / (1 - p) times
the variance of the mean over all frames, and both share these frames.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
RowNumbers = NDArray[np.intp]

#: Band of the comparison, between the leakage of an offset and the filter of a file of 22.05 kHz.
COMPARED_BAND_HZ = (50.0, 9_500.0)
#: Largest number of bands. With the default features, each bin of the band (439) is a band.
BANDS = 512
#: Number that is added to the level of each band, in units of the mean.
FLOOR = 0.1
#: Largest distance of copies. We measured synthetic decaying sounds of 0.25 s (16 bits): 50 ms
#: removed at the start .082, at the end .046. Other repeats of these sounds differ by .14 or more.
LARGEST_OF_COPIES = 0.09
#: Distance of copies that differ in format only. We measured up to .0023 for these sounds as files
#: of 22.05 or 48 kHz, and with noise of one quantum.
FORMAT = 0.004
#: Share of the distance between independent recordings. By the formula above, a copy may lack a
#: third of its sound.
SHARE = 1 / 2
#: Quantile of the distances within a grasp. It is low, because recordings may differ in more than
#: noise.
QUANTILE = 0.1
#: Quantile of the distances of nearest neighbours. One recording in seven may have a copy, and
#: each object with a quarter of the recordings sets the scale by its own scatter.
NEAREST_QUANTILE = 1 / 4
#: Least rank of this quantile, from 0, because one copy already gives two small distances.
LEAST_RANK = 2
#: Least share of recordings that are repeats of a grasp, for a tolerance from their distances.
FEWEST_REPEATS = 1 / 4
#: Recordings whose nearest neighbours are searched for a tolerance.
SAMPLED_ROWS = 500
#: Bins in `COMPARED_BAND_HZ` that a comparison in this band requires: a sixteenth of the default
#: window.
FEWEST_BINS = 64
#: Bands that a comparison requires. With fewer bands, different sounds can have equal levels.
FEWEST_BANDS = 16
#: Pairs within grasps whose distances are computed for a tolerance.
SAMPLED_PAIRS = 2_000
#: Pairs after which a search stops: no user reads more, and memory remains bounded.
MOST_PAIRS = 100_000
#: Dimensions of the projection that selects candidates.
_PROJECTED = 128
#: Rows that are compared at once: 16 MiB of distances.
_BLOCK = 2_048
#: Rows that are compared with all other rows at once.
_NEAREST_BLOCK = 64
#: Error of a float32 matrix product of _PROJECTED + 2 terms, relative to its largest terms.
_ROUNDING = 1e-5


@dataclass(frozen=True)
class SimilarPairs:
    """Rows `first` (m,) and `second` (m,) of near fingerprints with their `distance` (m,).

    The list is incomplete if the search stopped after `MOST_PAIRS`.
    """

    first: RowNumbers
    second: RowNumbers
    distance: NDArray[np.float64]
    complete: bool


def fingerprints(
    spectra: NDArray[np.floating], frequency_hz: NDArray[np.float64], quantity: str
) -> Float32:
    """Return fingerprints (n, b) of spectra (n, f) with bins at `frequency_hz` (f,).

    `quantity` is that of `FeatureSettings`; the root of a power is a magnitude. Spectra with fewer
    than `FEWEST_BINS` bins in `COMPARED_BAND_HZ` are compared in all bins above its lower limit,
    because these bins can be a small part of the recorded band. With fewer bins than `BANDS`, each
    bin is a band. Callers compare no fingerprints with fewer than `FEWEST_BANDS` bands.

    >>> import numpy as np
    >>> from ajgdata.features.similarity import fingerprints
    >>> spectra = np.array([[1.0, 2.0], [10.0, 20.0]])
    >>> fingerprints(spectra, np.array([100.0, 200.0]), "magnitude").round(3)
    array([[-0.221,  0.221],
           [-0.221,  0.221]], dtype=float32)
    """
    columns = _compared_bins(frequency_hz)
    edges = np.linspace(0, len(columns), min(BANDS, len(columns)) + 1).astype(int)
    prints = np.empty((len(spectra), len(edges) - 1), np.float32)
    for start in range(0, len(spectra), _BLOCK):
        values = spectra[start : start + _BLOCK, columns].astype(np.float64)
        if quantity == "power":
            values = np.sqrt(values)
        prints[start : start + _BLOCK] = _levels(values, edges)
    return prints


def _compared_bins(frequency_hz: NDArray[np.float64]) -> RowNumbers:
    """Return the columns (m,) of bins that are compared."""
    above = frequency_hz >= COMPARED_BAND_HZ[0]
    inside = above & (frequency_hz <= COMPARED_BAND_HZ[1])
    if inside.sum() >= FEWEST_BINS:
        return np.flatnonzero(inside)
    return np.flatnonzero(above if above.any() else np.ones_like(above))


def _levels(values: NDArray[np.float64], edges: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return centred logarithms (n, b) of mean magnitudes between edges (b + 1,) of columns."""
    level = np.add.reduceat(values, edges[:-1], axis=1) / np.diff(edges)
    mean = level.mean(axis=1, keepdims=True)
    relative = np.divide(level, mean, out=np.zeros_like(level), where=mean > 0)
    logarithm = np.log(relative + FLOOR)
    centred = logarithm - logarithm.mean(axis=1, keepdims=True)
    return centred / np.sqrt(level.shape[1])


def tolerance(prints: Float32, grasp: Sequence[str]) -> float:
    """Return the distance up to which recordings of different grasps are reported as similar.

    It is `SHARE` of the distance between independent recordings, from `FORMAT` to
    `LARGEST_OF_COPIES`. This distance is a low quantile within the grasps if enough grasps are
    repeated; a few repeats can be copies that share a grasp. Otherwise it is a low quantile of the
    distances between each recording and its nearest neighbour of another grasp. These neighbours
    are grasps of one object if objects have several grasps, for any number of objects. All pairs
    would mainly measure the distance between objects, which is no scale for grasps of one object.

    With fewer than three grasps it is `FORMAT`. If many recordings have copies, the quantile is a
    distance of copies; those that differ in format only are then still within `FORMAT`.
    """
    groups = np.unique(np.asarray(grasp, np.str_), return_inverse=True)[1]
    first, second = _pairs_of_grasps(groups)
    if len(first) and len(first) >= FEWEST_REPEATS * len(prints):
        typical = float(np.quantile(distances(prints[first], prints[second]), QUANTILE))
    elif len(np.unique(groups)) <= LEAST_RANK:
        return FORMAT
    else:
        rows = _sampled_rows(len(prints))
        nearest = np.sort(nearest_distances(prints, grasp, rows))
        rank = max(LEAST_RANK, int(NEAREST_QUANTILE * (len(nearest) - 1)))
        typical = float(nearest[rank])
    return min(LARGEST_OF_COPIES, max(FORMAT, SHARE * typical))


def nearest_distances(
    prints: Float32, grasp: Sequence[str], rows: RowNumbers
) -> NDArray[np.float64]:
    """Return the distance (m,) between each of `rows` (m,) and the nearest row of another grasp.

    It is infinite if there is no other grasp.
    """
    if not len(rows):
        return np.zeros(0)
    groups = np.unique(np.asarray(grasp, np.str_), return_inverse=True)[1]
    centred = prints - prints.mean(axis=0)
    squares = np.einsum("ij,ij->i", centred, centred)
    nearest = np.empty(len(rows))
    for start in range(0, len(rows), _NEAREST_BLOCK):
        block = rows[start : start + _NEAREST_BLOCK]
        # without the square of the row itself, which changes no order
        squared = squares - 2 * centred[block] @ centred.T
        squared[groups[block][:, np.newaxis] == groups] = np.inf
        other = squared.argmin(axis=1)
        exact = distances(prints[block], prints[other])
        is_alone = np.isinf(squared.min(axis=1))
        nearest[start : start + len(block)] = np.where(is_alone, np.inf, exact)
    return nearest


def _sampled_rows(count: int) -> RowNumbers:
    """Return all of `count` rows, or a random sample with a constant seed."""
    if count <= SAMPLED_ROWS:
        return np.arange(count)
    return np.random.default_rng(0).choice(count, SAMPLED_ROWS, replace=False)


def _pairs_of_grasps(groups: NDArray[np.intp]) -> tuple[RowNumbers, RowNumbers]:
    """Return pairs of rows with the same group: neighbours within a group, evenly sampled."""
    order = np.argsort(groups, kind="stable")
    same = np.flatnonzero(groups[order][1:] == groups[order][:-1])
    if len(same) > SAMPLED_PAIRS:
        same = same[np.linspace(0, len(same) - 1, SAMPLED_PAIRS).astype(int)]
    return order[same], order[same + 1]


def equal_groups(prints: Float32) -> list[list[int]]:
    """Return the rows of each group of two or more identical fingerprints."""
    rows_of: dict[bytes, list[int]] = {}
    for row, values in enumerate(prints):
        rows_of.setdefault(values.tobytes(), []).append(row)
    return [rows for rows in rows_of.values() if len(rows) > 1]


def similar_pairs(prints: Float32, grasp: Sequence[str], limit: float) -> SimilarPairs:
    """Return all pairs of rows of different grasps whose distance is up to `limit`.

    The search has no false negatives. `first` is the earlier row of a pair.
    """
    return _search(prints, prints, grasp, grasp, limit, same_set=True)


def similar_between(
    own: Float32, other: Float32, own_grasp: Sequence[str], other_grasp: Sequence[str], limit: float
) -> SimilarPairs:
    """Return all pairs of a row of `own` and a row of `other` whose distance is up to `limit` and
    whose grasps have different names."""
    return _search(own, other, own_grasp, other_grasp, limit, same_set=False)


def nearer_than_own(
    pairs: SimilarPairs,
    own: Float32,
    other: Float32,
    own_grasp: Sequence[str],
    other_grasp: Sequence[str],
) -> SimilarPairs:
    """Return the pairs of `similar_between` that are copies by the neighbours of both rows.

    Their distance is up to `SHARE` of the distance of each row to the nearest other grasp of its
    own set, or up to `FORMAT`.
    """
    limit = np.full(len(pairs.distance), np.inf)
    sets = ((pairs.first, own, own_grasp), (pairs.second, other, other_grasp))
    for rows, prints, grasp in sets:
        used, place = np.unique(rows, return_inverse=True)
        limit = np.minimum(limit, SHARE * nearest_distances(prints, grasp, used)[place])
    near = pairs.distance <= np.maximum(limit, FORMAT)
    return SimilarPairs(pairs.first[near], pairs.second[near], pairs.distance[near], pairs.complete)


def _search(
    own: Float32,
    other: Float32,
    own_grasp: Sequence[str],
    other_grasp: Sequence[str],
    limit: float,
    *,
    same_set: bool,
) -> SimilarPairs:
    """Return pairs of a row of `own` and a row of `other`, of grasps with different names.

    If both are the same set, each pair occurs once.
    """
    names = np.asarray([*own_grasp, *other_grasp], np.str_)
    codes = np.unique(names, return_inverse=True)[1]
    own_code = codes[: len(own)]
    other_code = codes[len(own) :]
    parts: list[tuple[RowNumbers, RowNumbers, NDArray[np.float64]]] = []
    count = 0
    for own_rows, other_rows in _candidates(own, other, limit, same_set=same_set):
        differs = own_code[own_rows] != other_code[other_rows]
        first = own_rows[differs]
        second = other_rows[differs]
        for start in range(0, len(first), _BLOCK):
            rows = slice(start, start + _BLOCK)
            distance = distances(own[first[rows]], other[second[rows]])
            near = distance <= limit
            parts.append((first[rows][near], second[rows][near], distance[near]))
            count += int(near.sum())
            if count >= MOST_PAIRS:
                return _joined(parts, complete=False, same_set=same_set)
    return _joined(parts, complete=True, same_set=same_set)


def _joined(
    parts: Sequence[tuple[RowNumbers, RowNumbers, NDArray[np.float64]]],
    *,
    complete: bool,
    same_set: bool,
) -> SimilarPairs:
    """Return pairs in the order of their rows."""
    first = np.concatenate([part[0] for part in parts] or [np.zeros(0, np.intp)])
    second = np.concatenate([part[1] for part in parts] or [np.zeros(0, np.intp)])
    distance = np.concatenate([part[2] for part in parts] or [np.zeros(0)])
    if same_set:
        earlier = np.minimum(first, second)
        second = np.maximum(first, second)
        first = earlier
    order = np.lexsort((second, first))
    return SimilarPairs(first[order], second[order], distance[order], complete)


def _candidates(
    own: Float32, other: Float32, limit: float, *, same_set: bool
) -> Iterator[tuple[RowNumbers, RowNumbers]]:
    """Yield pairs of rows that include all with a distance up to `limit`.

    A projection never increases a distance. Rows are projected on sums of neighbouring bands, whose
    noise is correlated, and sorted by the direction of largest variance: blocks further apart than
    `limit` are not compared. All other blocks are compared by a matrix product, whose time does not
    depend on the data.
    """
    if not len(own) or not len(other):
        return
    centre = own.mean(axis=0)
    own_rows = _projected(own - centre)
    other_rows = _projected(other - centre)
    direction = _largest_direction(own_rows)
    own_order = np.argsort(own_rows @ direction, kind="stable")
    other_order = np.argsort(other_rows @ direction, kind="stable")
    own_place = (own_rows @ direction)[own_order]
    other_place = (other_rows @ direction)[other_order]
    left = _left_factors(own_rows[own_order])
    right = _right_factors(other_rows[other_order])
    largest = float(left[:, -2].max() + right[:, -1].max())
    slack = _ROUNDING * largest
    reach = limit + np.sqrt(slack)
    for start in range(0, len(left), _BLOCK):
        stop = min(start + _BLOCK, len(left))
        low = np.searchsorted(other_place, own_place[start] - reach)
        high = np.searchsorted(other_place, own_place[stop - 1] + reach, "right")
        for begin in range(start if same_set else int(low), int(high), _BLOCK):
            end = min(begin + _BLOCK, int(high))
            squared = left[start:stop] @ right[begin:end].T
            rows, columns = np.nonzero(squared <= limit**2 + slack)
            if same_set:
                later = columns + begin > rows + start
                rows = rows[later]
                columns = columns[later]
            if len(rows):
                yield own_order[rows + start], other_order[columns + begin]


def _projected(rows: Float32) -> Float32:
    """Return the projection (n, p) of rows (n, b) on orthonormal vectors, which are constant within
    groups of neighbouring bands."""
    bands = rows.shape[1]
    edges = np.linspace(0, bands, min(_PROJECTED, bands) + 1).astype(int)
    sums = np.add.reduceat(rows, edges[:-1], axis=1)
    return (sums / np.sqrt(np.diff(edges))).astype(np.float32)


def _largest_direction(rows: Float32) -> Float32:
    """Return the unit vector (b,) of largest variance of up to 2,000 rows (n, b)."""
    sample = rows[:: max(1, len(rows) // SAMPLED_PAIRS)].astype(np.float64)
    vectors = np.linalg.eigh(sample.T @ sample)[1]
    return vectors[:, -1].astype(np.float32)


def _left_factors(rows: Float32) -> Float32:
    """Return rows (n, b + 2), whose products with the `_right_factors` are squared distances."""
    squares = _squares(rows)
    return np.concatenate([rows, squares, np.ones_like(squares)], axis=1)


def _right_factors(rows: Float32) -> Float32:
    """Return rows (n, b + 2) for the products of `_left_factors`."""
    squares = _squares(rows)
    return np.concatenate([-2 * rows, np.ones_like(squares), squares], axis=1)


def _squares(rows: Float32) -> Float32:
    """Return the squared norms (n, 1) of rows (n, b)."""
    return np.einsum("ij,ij->i", rows, rows)[:, np.newaxis]


def distances(first: Float32, second: Float32) -> NDArray[np.float64]:
    """Return the distances (m,) of fingerprints (m, b)."""
    difference = first.astype(np.float64) - second
    return np.sqrt(np.einsum("ij,ij->i", difference, difference))
