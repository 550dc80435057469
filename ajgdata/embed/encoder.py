"""Training of encoders: the paper's convolutional network with a latent in place of the classes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from sklearn.pipeline import Pipeline

from ajgdata.embed.contrastive import contrastive_loss, draw_batches, pair_weights
from ajgdata.embed.stacked_encoders import StackedEncoders
from ajgdata.models.baselines import raw_scaling
from ajgdata.models.cnn import CnnClassifier
from ajgdata.models.network import SpectrumCnn, reproducible

CHUNK = 256  # rows per forward pass: bounds memory


@dataclass(frozen=True)
class Training:
    """Settings of the training; see `types.Embedding` for what they mean."""

    margin: float
    epochs: int
    batch_instances: int
    batch_recordings: int


@dataclass(frozen=True, eq=False)
class Encoder:
    """Features as stored -> latents. `scaling` is that of the baselines, from the training rows."""

    scaling: Pipeline
    network: SpectrumCnn

    def encode(self, features: np.ndarray) -> np.ndarray:
        """Return latents (n, d), float32, of features (n, n_features)."""
        rows = torch.from_numpy(self.scaling.transform(features)).float()
        with reproducible(0), torch.inference_mode():
            return torch.cat([self.network.trunk(part) for part in rows.split(CHUNK)]).numpy()


def train_encoders(
    features: np.ndarray,
    instance: np.ndarray,
    grasp: np.ndarray,
    *,
    dimensions: Sequence[int],
    training: Training,
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
        instances=training.batch_instances,
        recordings=training.batch_recordings,
        epochs=training.epochs,
        generator=np.random.default_rng(seed),
    )
    scaling = raw_scaling().fit(features)
    inputs = torch.from_numpy(scaling.transform(features)).float()
    with reproducible(seed):
        networks = [new_network(features.shape[1], dimension) for dimension in dimensions]
        together = StackedEncoders(networks)
        descent = CnnClassifier().descent(together, len(batches))
        for rows in batches:
            pairs = pair_weights(instance[rows], grasp[rows])
            latents = together(inputs[rows])
            loss = torch.stack([contrastive_loss(z, pairs, training.margin) for z in latents]).sum()
            descent.step(loss)
        together.give_back()
    return [Encoder(scaling, network.eval()) for network in networks]


def new_network(n_features: int, dimension: int) -> SpectrumCnn:
    """Return the classifier's network with `dimension` outputs and without dropout, which would
    shake the distances that are trained."""
    like = CnnClassifier()
    return SpectrumCnn(n_features, dimension, like.channels, like.kernel, like.stride, 0.0)
