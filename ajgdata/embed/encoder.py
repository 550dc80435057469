"""Training of encoders: the paper's convolutional network with a latent in place of the classes.

Networks of all dimensions train as one network, in one pass with one optimiser: a step of nine
small networks on 32 spectra is bound by the cost of starting operations; together they start once.

The loss is contrastive: Hadsell, Chopra and LeCun, "Dimensionality reduction by learning an
invariant mapping", CVPR 2006, equation 4. A similar pair at distance D costs D^2 / 2, a dissimilar
pair max(0, m - D)^2 / 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import NamedTuple, cast

import numpy as np
import torch
from sklearn.pipeline import Pipeline
from torch import Tensor, nn

from ajgdata.models.cnn import FORWARD_ROWS, CnnClassifier, Descent, SpectrumCnn, reproducible
from ajgdata.models.device import training_device
from ajgdata.models.scaling import raw_scaling
from ajgdata.types import Embedding, NotPossibleError


@dataclass(frozen=True, eq=False)
class Encoder:
    """Features as stored -> latents. `scaling` is that of the baselines, from the training rows."""

    scaling: Pipeline
    network: SpectrumCnn

    def encode(self, features: np.ndarray) -> np.ndarray:
        """Return latents (n, d), float32, of features (n, n_features)."""
        rows = torch.from_numpy(self.scaling.transform(features)).float()
        with reproducible(0), torch.inference_mode():
            return torch.cat(
                [self.network.trunk(part) for part in rows.split(FORWARD_ROWS)]
            ).numpy()


def train_encoders(
    features: np.ndarray,
    instance: np.ndarray,
    grasp: np.ndarray,
    *,
    dimensions: Sequence[int],
    settings: Embedding,
    seed: int,
) -> list[Encoder]:
    """Return an encoder for each of `dimensions`, trained together on the same batches.

    `features` (n, n_features) as stored; `instance` and `grasp` (n,) are what the acquisition log
    says of physical things and grasps, and all that the pair rule knows. Same seed, same weights.
    Raises NotPossibleError where there is nothing to learn (see `draw_batches`).
    """
    batches = draw_batches(
        instance,
        grasp,
        instances=settings.batch_instances,
        recordings=settings.batch_recordings,
        epochs=settings.epochs,
        generator=np.random.default_rng(seed),
    )
    scaling, device = raw_scaling().fit(features), training_device()
    inputs = torch.from_numpy(scaling.transform(features)).float().to(device)
    with reproducible(seed):
        networks = [new_network(features.shape[1], dimension) for dimension in dimensions]
        together = StackedEncoders(networks).to(device)
        like = CnnClassifier()
        descent = Descent(together, len(batches), like.max_learning_rate, like.weight_decay)
        for rows in batches:
            weights = pair_weights(instance[rows], grasp[rows])
            pairs = Pairs(*(part.to(device) for part in weights))
            latents = together(inputs[rows])
            loss = torch.stack([contrastive_loss(z, pairs, settings.margin) for z in latents]).sum()
            descent.step(loss)
        together.give_back()
    return [Encoder(scaling, network.eval()) for network in networks]


def new_network(n_features: int, dimension: int) -> SpectrumCnn:
    """Return the classifier's network with `dimension` outputs and without dropout, which would
    shake the distances that are trained."""
    like = CnnClassifier()
    return SpectrumCnn(n_features, dimension, like.channels, like.kernel, like.stride, 0.0)


class StackedEncoders(nn.Module):
    """The networks' trunks side by side; they differ in their outputs only. A convolution per
    network becomes one grouped convolution.

    Takes standardised bins (n, n_features), the same for all; gives the latents (n, d) of each.
    Weights are copies: `give_back` writes them into the networks. Raises TypeError for a layer that
    it cannot join.
    """

    def __init__(self, networks: Sequence[SpectrumCnn]) -> None:
        super().__init__()
        self._networks = tuple(networks)
        layers = zip(*(network.convolutions for network in networks), strict=True)
        joined = [_joined(parts, first=number == 0) for number, parts in enumerate(layers)]
        self.convolutions = nn.Sequential(*joined)
        self.heads = nn.ModuleList(deepcopy(network.dense) for network in networks)

    def forward(self, z: Tensor) -> list[Tensor]:
        """Return latents (n, d) of each network."""
        z = z[:, None, None].contiguous(memory_format=torch.channels_last)  # (n, 1, 1, n_features)
        z = self.convolutions(z)  # (n, networks * channels, 1, length)
        z = z.reshape(len(z), len(self.heads), -1)  # (n, networks, channels * length)
        return [head(z[:, number]) for number, head in enumerate(self.heads)]

    @torch.no_grad()
    def give_back(self) -> None:
        """Write the weights into the networks that this was made of."""
        count = len(self._networks)
        for number, network in enumerate(self._networks):
            for joined, own in zip(self.convolutions, network.convolutions, strict=True):
                of_all = joined.state_dict()
                for name, value in own.state_dict().items():
                    part = of_all[name].chunk(count)[number] if value.ndim else of_all[name]
                    value.copy_(part.reshape(value.shape))
            network.dense.load_state_dict(self.heads[number].state_dict())


def _joined(parts: Sequence[nn.Module], *, first: bool) -> nn.Module:
    """Return one layer that does what `parts` do, each on its channels; the first all on the
    same."""
    count, like = len(parts), parts[0]
    joined: nn.Conv2d | nn.BatchNorm2d
    if isinstance(like, nn.ReLU):
        return nn.ReLU(inplace=True)
    if isinstance(like, nn.BatchNorm1d):
        joined = nn.BatchNorm2d(count * like.num_features, like.eps, like.momentum)
    elif isinstance(like, nn.Conv1d):
        joined = nn.Conv2d(
            like.in_channels * (1 if first else count),
            like.out_channels * count,
            (1, like.kernel_size[0]),
            (1, like.stride[0]),
            (0, cast(int, like.padding[0])),
            groups=1 if first else count,
        )
        # four fifths of the time of the usual layout, which is why it has a dimension of length 1
        joined.weight.data = joined.weight.data.to(memory_format=torch.channels_last)
    else:
        raise TypeError(f"cannot join layers of type {type(like).__name__}")
    with torch.no_grad():
        states = [part.state_dict() for part in parts]
        for name, value in joined.state_dict().items():
            if value.ndim:  # but the count of batches, which is one for all
                value.copy_(torch.cat([state[name] for state in states]).reshape(value.shape))
    return joined


class Pairs(NamedTuple):
    """Weights (..., n, n) of the pairs of a batch, float64, above the diagonal.

    The similar ones of a batch add up to 1, and so do the dissimilar ones: there are some twenty
    times more dissimilar pairs, and the batch must not decide their weight. A batch
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
        raise NotPossibleError("all recordings are of one object: an embedding needs at least two")
    of = [_by_grasp(np.flatnonzero(instance == thing), grasp) for thing in things]
    if all(len(grasps) < 2 for grasps in of):
        raise NotPossibleError(
            "no object was grasped twice: there is no similar pair to learn from"
        )
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
    return [rows[grasp[rows] == grasp_name] for grasp_name in np.unique(grasp[rows])]
