"""Contrastive training: batches of recordings, and the loss on every pair of a batch.

Hadsell, Chopra and LeCun, "Dimensionality reduction by learning an invariant mapping", CVPR 2006,
equation 4: a similar pair at distance D costs D^2 / 2, a dissimilar one max(0, m - D)^2 / 2.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from ajgdata.types import NotPossibleError


class Pairs(NamedTuple):
    """Weights (..., n, n) of the pairs of a batch, float64, above the diagonal.

    The similar ones of a batch add up to 1, and so do the dissimilar ones: there are some twenty
    times more of these, and the batch's composition shall not decide what they weigh. A batch
    without pairs of a kind has zeros.
    """

    similar: Tensor
    dissimilar: Tensor


def pair_weights(instance: np.ndarray, grasp: np.ndarray) -> Pairs:
    """Return the weights of the pair rule: recordings of one thing in different grasps are similar,
    of different things dissimilar.

    `instance`, `grasp` (..., n) are labels of recordings, from the acquisition log. Two recordings
    of one grasp are neither: they differ by noise alone, and teach nothing of grasps.
    """
    same_thing = instance[..., :, None] == instance[..., None, :]
    same_grasp = grasp[..., :, None] == grasp[..., None, :]
    above = np.triu(np.ones((instance.shape[-1],) * 2, bool), 1)
    return Pairs(_normalised(above & same_thing & ~same_grasp), _normalised(above & ~same_thing))


def _normalised(chosen: np.ndarray) -> Tensor:
    count = chosen.sum(axis=(-1, -2), keepdims=True)
    return torch.from_numpy(chosen / np.maximum(count, 1))


def contrastive_loss(latent: Tensor, pairs: Pairs, margin: float) -> Tensor:
    """Return the loss (...) of latents (..., n, d): the mean over similar pairs plus that over
    dissimilar.

    Computed in double precision from differences, not from scalar products, which lose what lies
    close together: neither squares of float32 latents of 1e-20 and 1e20 nor identical points are
    out of reach. The gradient of a dissimilar pair at distance 0, which has no direction, is 0.
    """
    points = latent.double()
    distance = torch.cdist(points, points, compute_mode="donot_use_mm_for_euclid_dist")
    short = (margin - distance).clamp_min(0.0)
    cost = pairs.similar * distance.square() + pairs.dissimilar * short.square()
    return cost.sum(dim=(-1, -2)) / 2


def draw_batches(
    instance: np.ndarray,
    grasp: np.ndarray,
    *,
    instances: int,
    recordings: int,
    epochs: int,
    generator: np.random.Generator,
) -> np.ndarray:
    """Return row numbers (steps, instances * recordings): `recordings` of each of some things.

    `instance`, `grasp` (n,) are labels. A thing's recordings in a batch are of different grasps as
    long as it has such; a thing with fewer grasps stands there with some of them twice, and such a
    pair counts as none. An epoch is as many batches as hold n recordings. Raises ValueError for
    fewer than two things, and when no thing has two grasps: there is then nothing to learn.
    """
    things = np.unique(instance)
    if len(things) < 2:
        raise NotPossibleError("all recordings are of one thing: an embedding needs at least two")
    of = [_by_grasp(np.flatnonzero(instance == thing), grasp) for thing in things]
    if all(len(grasps) < 2 for grasps in of):
        raise NotPossibleError("no thing was grasped twice: there is no similar pair to learn from")
    chosen = min(instances, len(things))
    per_epoch = -(-len(instance) // (chosen * recordings))
    batches = np.empty((epochs * per_epoch, chosen, recordings), dtype=np.int64)
    for batch in batches:
        for rows, thing in zip(batch, generator.permutation(len(things)), strict=False):
            grasps = of[thing]
            picked = np.resize(generator.permutation(len(grasps)), recordings)
            rows[:] = [generator.choice(grasps[number]) for number in picked]
    return batches.reshape(len(batches), -1)


def _by_grasp(rows: np.ndarray, grasp: np.ndarray) -> list[np.ndarray]:
    return [rows[grasp[rows] == one] for one in np.unique(grasp[rows])]
