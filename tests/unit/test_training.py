"""The training of networks: Adam, the cycle of the learning rate, and the batches."""

from itertools import islice

import pytest
import torch
from torch.nn import functional

from ajgdata.models.network import SpectrumCnn, reproducible
from ajgdata.models.training import Descent, batches, one_cycle

STEPS, BATCH = 40, 8


@pytest.mark.parametrize("n_outputs", [1, 3])
def test_the_weights_are_those_of_the_optimiser_of_torch(n_outputs):
    draw = torch.Generator().manual_seed(1)
    bins = torch.randn(29, 1, 100, generator=draw)
    target = torch.randn(29, n_outputs, generator=draw)

    def trained(make):
        with reproducible(3):
            module = SpectrumCnn(100, n_outputs, (8, 16, 4), 9, 4, 0.5)
            step = make(module)
            for rows in islice(batches(len(bins), BATCH), STEPS):
                step(functional.mse_loss(module.trunk(bins[rows]), target[rows]))
        return module.state_dict()

    def of_torch(module):
        optimiser = torch.optim.Adam(module.parameters(), 3e-3, weight_decay=0.1, fused=True)
        schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, 3e-3, total_steps=STEPS)

        def step(loss):
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            schedule.step()

        return step

    def ours(module):
        return Descent(module.parameters(), steps=STEPS, peak=3e-3, weight_decay=0.1).step

    expected, found = trained(of_torch), trained(ours)
    for name, value in expected.items():
        assert torch.equal(found[name], value), name
    assert found["convolutions.1.num_batches_tracked"] == STEPS


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
