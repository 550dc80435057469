"""Training of networks: batches, one cycle of the learning rate, and Adam on autograd's gradients.

Adam's functional form is used, because torch's optimiser objects load a compiler: 1.7 s in each
process, as long as a whole training.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from functools import cache

import torch
from torch import Tensor
from torch.optim.adam import adam


def batches(rows: int, batch_size: int) -> Iterator[Tensor]:
    """Yield row numbers in a new random order per epoch, without end.

    The batches of an epoch differ by at most one row, so that no batch consists of a single row,
    which would have no variance.
    """
    parts = math.ceil(rows / batch_size)
    while True:
        order = torch.randperm(rows)
        yield from (order[part::parts] for part in range(parts))


@cache
def one_cycle(peak: float, steps: int) -> tuple[tuple[float, float], ...]:
    """Return learning rate and first beta of Adam in each step: one cycle (Smith, Topin 2019).

    Along cosines, over the first 0.3 of the steps from 1/25 of the peak to the peak and from 0.95
    to 0.85, and back: the same numbers as torch's OneCycleLR.
    """
    first, top, last = peak / 25, 0.3 * steps - 1, steps - 1
    cycle = []
    for step in range(steps):
        if step <= top:
            share, (start, end), (low, high) = step / top, (first, peak), (0.95, 0.85)
        else:
            share, (start, end) = (step - top) / (last - top), (peak, first / 1e4)
            low, high = 0.85, 0.95
        way = math.cos(math.pi * share) + 1
        cycle.append((end + (start - end) / 2 * way, high + (low - high) / 2 * way))
    return tuple(cycle)


class Descent:
    """Adam with `weight_decay` in the gradient, over one cycle of the learning rate up to `peak`.

    `weights` are changed in place by `step`, which can be called `steps` times.
    """

    def __init__(
        self, weights: Iterable[Tensor], *, steps: int, peak: float, weight_decay: float
    ) -> None:
        self.weights = list(weights)
        self.weight_decay = weight_decay
        self._cycle = iter(one_cycle(peak, steps))
        self._means, self._squares = (
            [torch.zeros_like(weight) for weight in self.weights] for _ in range(2)
        )
        self._counts = [torch.zeros(()) for _ in self.weights]

    def step(self, loss: Tensor) -> None:
        """Change the weights by the gradient of a loss."""
        gradients = torch.autograd.grad(loss, self.weights)
        rate, beta = next(self._cycle)
        with torch.no_grad():
            adam(
                self.weights, list(gradients), self._means, self._squares, [], self._counts,
                fused=True, amsgrad=False, beta1=beta, beta2=0.999, lr=rate,
                weight_decay=self.weight_decay, eps=1e-8, maximize=False,
            )  # fmt: skip
