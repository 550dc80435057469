"""The paper's network: three 1-D convolutions and one fully connected layer, how it is run, and
Adam over one cycle of the learning rate, by which it is trained."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager

import numpy as np
import torch
from torch import Tensor, nn

CHUNK = 256  # rows per forward pass: bounds memory, and stays in cache


class SpectrumCnn(nn.Module):
    """From a feature as stored to class scores or a number; scaling included, so it exports whole.

    Input (n, n_features), output (n, n_outputs), float32. Buffers hold what is learned from the
    training rows by counting, not by gradient: `scale` () of the compression, `mean` and `std`
    (n_features,) of the compressed bins; `target_mean` and `target_std` (n_outputs,) of regression.
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
    ) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        length, before = n_features, 1
        for width in channels:
            layers.append(nn.Conv1d(before, width, kernel, stride, padding=kernel // 2))
            layers += [nn.BatchNorm1d(width), nn.ReLU()]
            length, before = (length + 2 * (kernel // 2) - kernel) // stride + 1, width
        self.convolutions = nn.Sequential(*layers)
        self.dropout = nn.Dropout(dropout)
        self.dense = nn.Linear(before * length, n_outputs)
        self.register_buffer("scale", torch.ones(()))
        self.register_buffer("mean", torch.zeros(n_features))
        self.register_buffer("std", torch.ones(n_features))
        self.register_buffer("target_mean", torch.zeros(n_outputs))
        self.register_buffer("target_std", torch.ones(n_outputs))

    def compress(self, x: Tensor) -> Tensor:
        """Return asinh(x / scale) of features (n, n_features): logarithmic for loud bins, linear
        for quiet ones, defined at 0."""
        return torch.asinh(x / self.scale)

    def standardise(self, z: Tensor) -> Tensor:
        """Return compressed bins (n, n_features) standardised."""
        return (z - self.mean) / self.std

    def trunk(self, z: Tensor) -> Tensor:
        """Return scores (n, n_outputs) of standardised bins (n, n_features)."""
        z = self.convolutions(z.unsqueeze(1))  # -> (n, channels, length)
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


def batches(rows: int, batch_size: int) -> Iterator[Tensor]:
    """Yield row numbers in a new random order per epoch, without end.

    The batches of an epoch differ by at most one row, so that no batch consists of a single row,
    which would have no variance.
    """
    parts = math.ceil(rows / batch_size)
    while True:
        order = torch.randperm(rows)
        yield from (order[part::parts] for part in range(parts))


class Descent:
    """Adam with `weight_decay` in the gradient, over one cycle of the learning rate up to `peak`
    (Smith, Topin 2019), which `step` can be called `steps` times for."""

    def __init__(
        self, weights: Iterable[Tensor], *, steps: int, peak: float, weight_decay: float
    ) -> None:
        self._adam = torch.optim.Adam(weights, lr=peak, weight_decay=weight_decay, fused=True)
        self._cycle = torch.optim.lr_scheduler.OneCycleLR(self._adam, peak, steps)

    def step(self, loss: Tensor) -> None:
        """Change the weights by the gradient of a loss."""
        self._adam.zero_grad()
        loss.backward()
        self._adam.step()
        self._cycle.step()
