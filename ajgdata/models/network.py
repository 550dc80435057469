"""The paper's network: three 1-D convolutions and one fully connected layer, and how it is run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
import torch
from torch import Tensor, nn

CHUNK = 256  # rows per forward pass: bounds memory, and stays in cache


class SpectrumCnn(nn.Module):
    """From a feature as stored to class scores or a number; scaling included, so it exports whole.

    Input (n, n_features), output (n, n_outputs), float32. Buffers hold what is learned from the
    training rows by counting, not by gradient: `scale` () of the compression, `mean` and `std`
    of the compressed bins, (n_features,), or (inputs, n_features) of an input scaled in several
    ways side by side; `target_mean` and `target_std` (n_outputs,) of regression.
    """

    scale: Tensor
    mean: Tensor
    std: Tensor
    target_mean: Tensor
    target_std: Tensor

    def __init__(
        self,
        n_features: int,
        n_outputs: int,
        channels: Sequence[int],
        kernel: int,
        stride: int,
        dropout: float,
        inputs: int = 1,
    ) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        length, before = n_features, inputs
        for width in channels:
            layers.append(nn.Conv1d(before, width, kernel, stride, padding=kernel // 2))
            layers += [nn.BatchNorm1d(width), nn.ReLU()]
            length, before = (length + 2 * (kernel // 2) - kernel) // stride + 1, width
        self.convolutions = nn.Sequential(*layers)
        self.dropout = nn.Dropout(dropout)
        self.dense = nn.Linear(before * length, n_outputs)
        self.register_buffer("scale", torch.ones(()))
        shape = (n_features,) if inputs == 1 else (inputs, n_features)
        self.register_buffer("mean", torch.zeros(shape))
        self.register_buffer("std", torch.ones(shape))
        self.register_buffer("target_mean", torch.zeros(n_outputs))
        self.register_buffer("target_std", torch.ones(n_outputs))

    def compress(self, x: Tensor) -> Tensor:
        """Return asinh(x / scale) of features (n, n_features): logarithmic for loud bins, linear
        for quiet ones, defined at 0."""
        return torch.asinh(x / self.scale)

    def standardise(self, z: Tensor) -> Tensor:
        """Return compressed bins (n, n_features) standardised, (n, inputs, n_features)."""
        return (z.unsqueeze(1) - self.mean) / self.std

    def trunk(self, z: Tensor) -> Tensor:
        """Return scores (n, n_outputs) of standardised bins (n, inputs, n_features), or
        (n, n_features) of one input."""
        z = z.unsqueeze(1) if z.ndim == 2 else z
        z = self.convolutions(z)  # -> (n, channels, length)
        z = z.flatten(1)  # -> (n, channels * length)
        return self.dense(self.dropout(z))  # -> (n, n_outputs)

    def forward(self, x: Tensor) -> Tensor:
        """Return class scores, or the target in its own unit, (n, n_outputs), of features
        (n, n_features) as stored."""
        scores = self.trunk(self.standardise(self.compress(x)))
        return scores * self.target_std + self.target_mean


def in_chunks(X: np.ndarray) -> Iterator[Tensor]:
    """Yield float32 rows (n, n_features) in turn, CHUNK of them at a time, as copies."""
    for start in range(0, len(X), CHUNK):
        yield torch.from_numpy(X[start : start + CHUNK].copy())


@contextmanager
def reproducible(seed: int) -> Iterator[None]:
    """Give torch one thread and a random state of `seed`; the caller's are restored.

    With one thread sums are added up in one order, whatever the number of cores.
    """
    threads = torch.get_num_threads()
    with torch.random.fork_rng(devices=[]):
        torch.set_num_threads(1)
        torch.default_generator.manual_seed(seed)
        try:
            yield
        finally:
            torch.set_num_threads(threads)
