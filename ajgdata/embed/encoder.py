"""Training of encoders: the network of the paper with an embedding instead of class scores.

The loss is contrastive (Hadsell, Chopra & LeCun, "Dimensionality reduction by learning an invariant
mapping", CVPR 2006, equation 4). With the distance D of a pair, a similar pair costs D² / 2, and a
dissimilar pair max(0, m - D)² / 2, where m is the margin.

Encoders of several dimensions are trained together as one network with one optimiser. The time of
one step of nine small networks on 32 spectra is mostly the time to start the operations; one
network starts them once.
"""

from __future__ import annotations

import math
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
    """Encoder from features as stored to embeddings.

    `scaling` is the scaling of the baselines, fitted to the training rows.
    """

    scaling: Pipeline
    network: SpectrumCnn

    def encode(self, features: np.ndarray) -> np.ndarray:
        """Return embeddings (n, d), float32, of features (n, n_features)."""
        rows = torch.from_numpy(self.scaling.transform(features)).float()
        with reproducible(0), torch.inference_mode():
            parts = [self.network.trunk(part) for part in rows.split(FORWARD_ROWS)]
            return torch.cat(parts).numpy()


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

    `features` (n, n_features) as stored. `instance` and `grasp` (n,) are labels of objects and
    grasps from the acquisition log; the training uses no other labels. The same seed gives the same
    weights. Raises NotPossibleError if there are no pairs (see `draw_batches`).
    """
    batches = draw_batches(
        instance,
        grasp,
        instances=settings.batch_instances,
        recordings=settings.batch_recordings,
        epochs=settings.epochs,
        generator=np.random.default_rng(seed),
    )
    scaling = raw_scaling().fit(features)
    device = training_device()
    inputs = torch.from_numpy(scaling.transform(features)).float().to(device)
    with reproducible(seed):
        networks = [new_network(features.shape[1], dimension) for dimension in dimensions]
        together = StackedEncoders(networks).to(device)
        defaults = CnnClassifier()
        descent = Descent(together, len(batches), defaults.max_learning_rate, defaults.weight_decay)
        for rows in batches:
            weights = pair_weights(instance[rows], grasp[rows])
            pairs = Pairs(weights.similar.to(device), weights.dissimilar.to(device))
            losses = [contrastive_loss(z, pairs, settings.margin) for z in together(inputs[rows])]
            descent.step(torch.stack(losses).sum())
        together.write_back()
    return [Encoder(scaling, network.eval()) for network in networks]


def draw_batches(
    instance: np.ndarray,
    grasp: np.ndarray,
    *,
    instances: int,
    recordings: int,
    epochs: int,
    generator: np.random.Generator,
) -> np.ndarray:
    """Return batches of row numbers (steps, instances * recordings).

    `instance` and `grasp` (n,) are labels. A batch has `recordings` recordings of each of
    `instances` objects, or of all objects if there are fewer. The recordings of an object are of
    different grasps; if it has fewer grasps, some grasps occur again. An epoch has as many batches
    as are needed for n recordings. Raises NotPossibleError for fewer than two objects, and if no
    object has two grasps, because there is then no similar pair.
    """
    objects = np.unique(instance)
    if len(objects) < 2:
        raise NotPossibleError("all recordings are of one object: an embedding needs at least two")
    object_grasps = [_rows_by_grasp(np.flatnonzero(instance == name), grasp) for name in objects]
    if all(len(grasps) < 2 for grasps in object_grasps):
        raise NotPossibleError(
            "no object was grasped twice: there is no similar pair to learn from"
        )
    objects_per_batch = min(instances, len(objects))
    batches_per_epoch = math.ceil(len(instance) / (objects_per_batch * recordings))
    steps = epochs * batches_per_epoch
    batches = np.empty((steps, objects_per_batch, recordings), dtype=np.int64)
    for batch in batches:
        drawn = generator.permutation(len(objects))[:objects_per_batch]
        for rows, number in zip(batch, drawn, strict=True):
            grasps = object_grasps[number]
            picked = np.resize(generator.permutation(len(grasps)), recordings)
            rows[:] = [generator.choice(grasps[n]) for n in picked]
    return batches.reshape(steps, -1)


def _rows_by_grasp(rows: np.ndarray, grasp: np.ndarray) -> list[np.ndarray]:
    """Return the row numbers of each grasp among `rows` (m,), with `grasp` (n,) of all rows."""
    return [rows[grasp[rows] == name] for name in np.unique(grasp[rows])]


def new_network(n_features: int, dimension: int) -> SpectrumCnn:
    """Return the network of the classifier with `dimension` outputs and without dropout.

    Dropout would add noise to the distances of the loss.
    """
    defaults = CnnClassifier()
    return SpectrumCnn(
        n_features, dimension, defaults.channels, defaults.kernel, defaults.stride, dropout=0.0
    )


class StackedEncoders(nn.Module):
    """Several networks as one; only their numbers of outputs differ.

    The convolutions of all networks become one grouped convolution. The input is standardised bins
    (n, n_features), the same for all networks. The weights are copies; `write_back` copies them
    into the networks. Raises TypeError for a layer of another type than those of `SpectrumCnn`.
    """

    def __init__(self, networks: Sequence[SpectrumCnn]) -> None:
        super().__init__()
        self._networks = tuple(networks)
        layers = zip(*(network.convolutions for network in networks), strict=True)
        joined = [_joined(parts, is_first=number == 0) for number, parts in enumerate(layers)]
        self.convolutions = nn.Sequential(*joined)
        self.heads = nn.ModuleList(deepcopy(network.dense) for network in networks)

    def forward(self, z: Tensor) -> list[Tensor]:
        """Return the embeddings (n, d) of each network for bins z (n, n_features)."""
        z = z[:, None, None].contiguous(memory_format=torch.channels_last)  # (n, 1, 1, n_features)
        z = self.convolutions(z)  # (n, networks * channels, 1, length)
        z = z.reshape(len(z), len(self.heads), -1)  # (n, networks, channels * length)
        return [head(z[:, number]) for number, head in enumerate(self.heads)]

    @torch.no_grad()
    def write_back(self) -> None:
        """Copy the weights into the networks."""
        count = len(self._networks)
        for number, network in enumerate(self._networks):
            for joined, own in zip(self.convolutions, network.convolutions, strict=True):
                joined_state = joined.state_dict()
                for name, value in own.state_dict().items():
                    new = joined_state[name]
                    if value.ndim:  # the number of batches, a scalar, is the same for all networks
                        new = new.chunk(count)[number]
                    value.copy_(new.reshape(value.shape))
            network.dense.load_state_dict(self.heads[number].state_dict())


def _joined(parts: Sequence[nn.Module], *, is_first: bool) -> nn.Module:
    """Return one layer that computes the layers `parts`, each on its own channels.

    All parts of the first layer have the same input channel.
    """
    count = len(parts)
    layer = parts[0]
    joined: nn.Conv2d | nn.BatchNorm2d
    if isinstance(layer, nn.ReLU):
        return nn.ReLU(inplace=True)
    if isinstance(layer, nn.BatchNorm1d):
        joined = nn.BatchNorm2d(count * layer.num_features, layer.eps, layer.momentum)
    elif isinstance(layer, nn.Conv1d):
        groups = 1 if is_first else count
        joined = nn.Conv2d(
            layer.in_channels * groups,
            layer.out_channels * count,
            (1, layer.kernel_size[0]),
            (1, layer.stride[0]),
            (0, cast(int, layer.padding[0])),
            groups=groups,
        )
        # This layout takes four fifths of the time of the default. It needs a 2-D convolution, so
        # there is a dimension of length 1.
        joined.weight.data = joined.weight.data.to(memory_format=torch.channels_last)
    else:
        raise TypeError(f"cannot join layers of type {type(layer).__name__}")
    with torch.no_grad():
        states = [part.state_dict() for part in parts]
        for name, value in joined.state_dict().items():
            if value.ndim:  # not the number of batches, which is 0 for all
                value.copy_(torch.cat([state[name] for state in states]).reshape(value.shape))
    return joined


class Pairs(NamedTuple):
    """Weights (..., n, n) of the pairs of a batch, float64, above the diagonal.

    The weights of the similar pairs of a batch add up to 1, and so do those of the dissimilar
    pairs. A batch has about twenty times more dissimilar pairs, which must not decide the loss.
    Without pairs of one type, its weights are 0.
    """

    similar: Tensor
    dissimilar: Tensor


def pair_weights(instance: np.ndarray, grasp: np.ndarray) -> Pairs:
    """Return the weights of pairs of recordings, from labels (..., n) of objects and grasps.

    Recordings of one object in different grasps are similar. Recordings of different objects are
    dissimilar. Two recordings of one grasp are neither, because they differ only by noise.
    """
    same_object = instance[..., :, None] == instance[..., None, :]
    same_grasp = grasp[..., :, None] == grasp[..., None, :]
    n = instance.shape[-1]
    above = np.triu(np.ones((n, n), bool), 1)
    return Pairs(
        similar=_equal_weights(above & same_object & ~same_grasp),
        dissimilar=_equal_weights(above & ~same_object),
    )


def _equal_weights(chosen: np.ndarray) -> Tensor:
    """Return equal weights of the chosen pairs (..., n, n), which add up to 1 in a batch."""
    count = chosen.sum(axis=(-1, -2), keepdims=True)
    return torch.from_numpy(chosen / np.maximum(count, 1))


def contrastive_loss(latent: Tensor, pairs: Pairs, margin: float) -> Tensor:
    """Return the loss (...) of embeddings (..., n, d).

    This is the mean cost of the similar pairs plus the mean cost of the dissimilar pairs (see the
    head of this module). Distances are computed in double precision from differences of points,
    because scalar products lose small distances. The gradient of a dissimilar pair at distance 0
    has no direction and is 0.
    """
    points = latent.double()
    distance = torch.cdist(points, points, compute_mode="donot_use_mm_for_euclid_dist")
    missing = (margin - distance).clamp_min(0.0)
    cost = pairs.similar * distance.square() + pairs.dissimilar * missing.square()
    return cost.sum(dim=(-1, -2)) / 2
