"""Networks of one architecture as one network: same batches, one pass, one optimiser.

A convolution per network becomes one grouped convolution, and channels are normalised as ever. A
step of nine small networks on 32 spectra is bound by the cost of starting
operations; together they start once.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import torch
from torch import Tensor, nn

from ajgdata.models.network import SpectrumCnn


class StackedEncoders(nn.Module):
    """The networks' trunks side by side; they differ in their outputs only.

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
        self.heads = nn.ModuleList(_copied(network.dense) for network in networks)

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


def _copied(dense: nn.Linear) -> nn.Linear:
    copy = nn.Linear(dense.in_features, dense.out_features)
    copy.load_state_dict(dense.state_dict())
    return copy


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
