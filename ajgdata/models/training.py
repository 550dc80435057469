"""The network's training, operation by operation: the weights that autograd gives, bit for bit.

A step on eight spectra takes longer to arrange than to compute. Here torch's own forward and
backward operations follow one another on plain tensors: no graph is recorded, no module is called,
and no optimiser is made. `tests/unit/test_training.py`
holds the weights to those of `loss.backward()` and `Adam.step()`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import cache
from itertools import islice
from typing import Any, cast

import torch
from torch import Tensor, nn
from torch.nn import functional
from torch.optim.adam import adam

from ajgdata.models.network import SpectrumCnn

backwards = torch.ops.aten
#: The gradient of a loss by scores (n, n_outputs), of these and the target of each.
Slope = Callable[[Tensor, Tensor], Tensor]


def cross_entropy_slope(scores: Tensor, target: Tensor) -> Tensor:
    """Return the gradient (n, k) of the mean cross-entropy, for class numbers `target` (n,)."""
    log_p = scores.log_softmax(dim=1)
    by_log_p = torch.zeros_like(log_p)
    by_log_p.scatter_(1, target.unsqueeze(1), -1 / len(target))
    return backwards._log_softmax_backward_data(by_log_p, log_p, 1, log_p.dtype)


def squared_error_slope(scores: Tensor, target: Tensor) -> Tensor:
    """Return the gradient (n, k) of the mean squared error, for numbers `target` (n, k)."""
    return backwards.mse_loss_backward(scores.new_ones(()), scores, target, 1)


def batches(rows: int, batch_size: int) -> Iterator[Tensor]:
    """Yield numbers of rows, in a new random order each epoch, without end.

    Parts of an epoch differ by one row at most: never one alone, which has no variance.
    """
    parts = math.ceil(rows / batch_size)
    while True:
        order = torch.randperm(rows)
        yield from (order[part::parts] for part in range(parts))


@cache
def one_cycle(peak: float, steps: int) -> tuple[tuple[float, float], ...]:
    """Return learning rate and first beta of Adam in each step: one cycle (Smith, Topin 2019).

    Along cosines, over the first 0.3 of the steps from 1/25 of the peak to the peak and from 0.95
    to 0.85, and back: as torch's OneCycleLR, whose optimiser would load a compiler for a second.
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


class Layer:
    """A convolution with its normalisation and rectifier, on images that are one pixel high: torch
    turns its one-dimensional convolutions into these, too.

    Weights and running statistics are those of the modules: what changes there changes here.
    """

    def __init__(self, convolution: nn.Conv1d, norm: nn.BatchNorm1d) -> None:
        self.weight, self.bias = convolution.weight.unsqueeze(2), convolution.bias
        self.norm, self.momentum = norm, cast(float, norm.momentum)
        self.stride, self.padding = (1, *convolution.stride), (0, *convolution.padding)

    def forward(self, x: Tensor) -> Tensor:
        """Return what follows from x (n, before, 1, length): (n, channels, 1, length)."""
        self.x = x
        self.y = torch.conv2d(x, self.weight, self.bias, self.stride, self.padding)
        norm = self.norm
        z, *self.statistics = torch.native_batch_norm(
            self.y, norm.weight, norm.bias, norm.running_mean, norm.running_var, True,
            self.momentum, norm.eps,
        )  # fmt: skip
        self.z = z.relu_()
        return self.z

    def backward(self, slope: Tensor, *, needs_input: bool) -> tuple[Tensor, list[Tensor]]:
        """Return the gradient by x (if it is needed), and by the four weights in their order, for
        that by what `forward` returned."""
        norm, ones = self.norm, (1, 1)
        slope = backwards.threshold_backward(slope, self.z, 0)
        slope, scale, shift = backwards.native_batch_norm_backward(
            slope, self.y, norm.weight, norm.running_mean, norm.running_var, *self.statistics,
            True, norm.eps, [True, True, True],
        )  # fmt: skip
        before, weight, bias = backwards.convolution_backward(
            slope, self.x, self.weight, [len(self.weight)], self.stride, self.padding, ones, False,
            (0, 0), 1, [needs_input, True, True],
        )  # fmt: skip
        return before, [weight.squeeze(2), bias, scale, shift]


class Passes:
    """Scores of the network in training, and what they change with."""

    @torch.no_grad()
    def __init__(self, module: SpectrumCnn) -> None:
        layers: list[Any] = list(module.convolutions)
        self.layers = [Layer(*pair) for pair in zip(layers[::3], layers[1::3], strict=True)]
        self.dense, self.dropout = module.dense, module.dropout.p

    @torch.no_grad()
    def scores(self, x: Tensor) -> Tensor:
        """Return scores (n, n_outputs) of standardised bins x (n, inputs, 1, n_features)."""
        for layer in self.layers:
            x = layer.forward(x)
        self.shape, flat = x.shape, x.flatten(1)
        self.noise = functional.dropout(torch.ones_like(flat), self.dropout)
        self.flat = flat * self.noise
        return functional.linear(self.flat, self.dense.weight, self.dense.bias)

    @torch.no_grad()
    def gradients(self, slope: Tensor) -> list[Tensor]:
        """Return the gradients by all weights, in the order of the module's, for that by scores."""
        found = [slope.t().mm(self.flat), slope.sum(0)]
        slope = (slope.mm(self.dense.weight) * self.noise).view(self.shape)
        for number, layer in reversed(list(enumerate(self.layers))):
            slope, of_layer = layer.backward(slope, needs_input=number > 0)
            found = of_layer + found
        return found


def train(
    module: SpectrumCnn,
    inputs: Tensor,
    target: Tensor,
    slope: Slope,
    *,
    steps: int,
    batch_size: int,
    peak: float,
    weight_decay: float,
) -> None:
    """Train on standardised bins (n, inputs, n_features) and targets (n, ...) for `slope`.

    One cycle of the learning rate up to `peak`, by Adam with `weight_decay` in the gradient.
    Random numbers are torch's: the same state gives the same weights.
    """
    passes, weights = Passes(module), [weight.detach() for weight in module.parameters()]
    mean, square = ([torch.zeros_like(w) for w in weights] for _ in range(2))
    done = [torch.zeros(()) for _ in weights]
    bins = inputs.unsqueeze(2)  # (n, inputs, 1, n_features)
    taken = islice(batches(len(inputs), batch_size), steps)
    for rows, (rate, beta) in zip(taken, one_cycle(peak, steps), strict=True):
        gradients = passes.gradients(slope(passes.scores(bins[rows]), target[rows]))
        adam(
            weights, gradients, mean, square, [], done, fused=True, amsgrad=False,
            beta1=beta, beta2=0.999, lr=rate, weight_decay=weight_decay, eps=1e-8, maximize=False,
        )  # fmt: skip
    for layer in passes.layers:
        cast(Tensor, layer.norm.num_batches_tracked).add_(steps)
