"""Contrastive loss on every pair of a batch, from one matrix of distances.

Hadsell, Chopra and LeCun, "Dimensionality reduction by learning an invariant mapping", CVPR 2006,
equation 4: a similar pair at distance D costs D^2 / 2, a dissimilar one max(0, m - D)^2 / 2.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor


class Pairs(NamedTuple):
    """Weights (..., n, n) of the pairs of a batch, float64, above the diagonal.

    The similar ones of a batch add up to 1, and so do the dissimilar ones: there are some twenty
    times more of these, and the batch's composition shall not decide what they weigh. A batch
    without pairs of a kind has zeros.
    """

    similar: Tensor
    dissimilar: Tensor


def pair_weights(instance: np.ndarray, grasp: np.ndarray) -> Pairs:
    """The pair rule: of one thing in different grasps similar, of different things dissimilar.

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
    """Loss (...) of latents (..., n, d): the mean over similar pairs plus that over dissimilar.

    Computed in double precision from differences, not from scalar products, which lose what lies
    close together: neither squares of float32 latents of 1e-20 and 1e20 nor identical points are
    out of reach. The gradient of a dissimilar pair at distance 0, which has no direction, is 0.
    """
    points = latent.double()
    distance = torch.cdist(points, points, compute_mode="donot_use_mm_for_euclid_dist")
    short = (margin - distance).clamp_min(0.0)
    cost = pairs.similar * distance.square() + pairs.dissimilar * short.square()
    return cost.sum(dim=(-1, -2)) / 2
