"""The network's training: the weights of autograd, the cycle of its rate, and its batches."""

from itertools import islice

import pytest
import torch
from torch.nn import functional

from ajgdata.models.cnn import CnnClassifier
from ajgdata.models.network import SpectrumCnn, reproducible
from ajgdata.models.training import (
    batches,
    cross_entropy_slope,
    one_cycle,
    squared_error_slope,
    train,
)

STEPS, BATCH = 40, 8


def network(n_features, n_outputs, inputs, dropout):
    return SpectrumCnn(n_features, n_outputs, (8, 16, 4), 9, 4, dropout, inputs)


def by_autograd(module, inputs, target, loss, made):
    """The same as torch writes it: a graph, `backward`, an optimiser and its schedule."""
    optimiser, schedule = made.descent(module, STEPS)
    for rows in islice(batches(len(inputs), BATCH), STEPS):
        value = loss(module.trunk(inputs[rows]), target[rows])
        optimiser.zero_grad()
        value.backward()
        optimiser.step()
        schedule.step()


@pytest.mark.parametrize("n_features", [17, 300])
@pytest.mark.parametrize(
    ("loss", "slope", "n_outputs", "inputs", "dropout"),
    [
        (functional.cross_entropy, cross_entropy_slope, 5, 1, 0.5),
        (functional.cross_entropy, cross_entropy_slope, 2, 2, 0.0),
        (functional.mse_loss, squared_error_slope, 1, 1, 0.2),
        (functional.mse_loss, squared_error_slope, 3, 2, 0.5),
    ],
)
def test_every_weight_is_bit_for_bit_what_autograd_gives(
    loss, slope, n_outputs, inputs, dropout, n_features
):
    draw = torch.Generator().manual_seed(1)
    bins = torch.randn(29, inputs, n_features, generator=draw)
    if loss is functional.mse_loss:
        target = torch.randn(29, n_outputs, generator=draw)
    else:
        target = torch.randint(n_outputs, (29,), generator=draw)
    made = CnnClassifier(max_learning_rate=3e-3, weight_decay=0.1)
    with reproducible(3):
        expected = network(n_features, n_outputs, inputs, dropout)
        by_autograd(expected, bins, target, loss, made)
    with reproducible(3):
        found = network(n_features, n_outputs, inputs, dropout)
        begun = {name: value.clone() for name, value in found.state_dict().items()}
        train(
            found, bins, target, slope,
            steps=STEPS, batch_size=BATCH, peak=3e-3, weight_decay=0.1,
        )  # fmt: skip
    own = found.state_dict()
    for name, value in expected.state_dict().items():
        assert torch.equal(own[name], value), name
    for name, _ in found.named_parameters():
        assert not torch.equal(own[name], begun[name]), name
    assert found.convolutions[1].num_batches_tracked == STEPS


@pytest.mark.parametrize("steps", [1, 2, 5, 60, 301])
def test_the_cycle_of_the_rate_is_that_of_torch(steps):
    optimiser = torch.optim.Adam([torch.zeros(())], 2e-3)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, 2e-3, total_steps=steps)
    for step, (rate, beta) in enumerate(one_cycle(2e-3, steps)):
        (group,) = optimiser.param_groups
        assert (rate, beta) == (group["lr"], group["betas"][0])
        optimiser.step()
        if step + 1 < steps:
            schedule.step()
    assert step + 1 == steps


@pytest.mark.parametrize("rows", [2, 8, 9, 17, 64])
def test_an_epoch_is_every_row_once_in_parts_that_differ_by_one_at_most(rows):
    taken = list(islice(batches(rows, BATCH), 3 * -(-rows // BATCH)))
    per_epoch = len(taken) // 3
    for epoch in range(3):
        parts = taken[epoch * per_epoch : (epoch + 1) * per_epoch]
        sizes = [len(part) for part in parts]
        assert sorted(torch.cat(parts).tolist()) == list(range(rows))
        assert max(sizes) <= BATCH and max(sizes) - min(sizes) <= 1 and min(sizes) > 1
