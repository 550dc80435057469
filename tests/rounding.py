"""Tolerances of rounded results, from the number of operations and the precision.

Two processors, libraries or numbers of threads add the terms of a sum in different orders. A sum of
n terms has an error of at most gamma(n) sum |terms|, in any order (Higham, Accuracy and Stability
of Numerical Algorithms, 2002, section 4.2); two results differ by at most twice that. For long
chains this bound is a thousand times too large. If rounding errors are independent with mean zero,
gamma(n) can be replaced by `likely(n)` (Higham and Mary, SIAM J. Sci. Comput. 41, 2019, theorem
2.4), which an error exceeds with a probability of 2 n exp(-SAFETY**2 / 2).
"""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ajgdata.models.network import SpectrumCnn

#: Unit round-off.
U32, U64 = 2.0**-24, 2.0**-53
#: A sum of 600 terms exceeds `likely` in one of 40,000 cases.
SAFETY = 6.0


def gamma(n: float, u: float = U32) -> float:
    """Return n u / (1 - n u), the largest relative error of n roundings."""
    return n * u / (1 - n * u)


def likely(n: float, u: float = U32) -> float:
    """Return the relative error of n independent roundings that is exceeded almost never."""
    return SAFETY * np.sqrt(n) * u


def network_error(module: SpectrumCnn, features: np.ndarray) -> np.ndarray:
    """Return the likely rounding error (n, n_outputs) of a network's outputs in float32.

    Layer by layer for y = W x + b: the sums add likely(n) (|W| |x| + |b|), and earlier errors,
    which are independent, add as squares: var(y) = W**2 var(x) + (likely(n) (|W| |x| + |b|))**2.
    """
    import torch
    from torch import nn

    module = copy.deepcopy(module).double().eval()
    with torch.inference_mode():
        z = module.compress(torch.from_numpy(np.asarray(features, np.float64)))
        # a division, asinh (exact to 4 units), a subtraction, a division
        variance = (likely(7) * (z.abs().unsqueeze(1) + module.mean.abs()) / module.std) ** 2
        z = module.standardise(z).unsqueeze(1)
        for layer in [*module.convolutions, nn.Flatten(), module.dense]:
            if isinstance(layer, (nn.Conv1d, nn.Linear)):
                n = layer.weight[0].numel() + 1
                size, variance = _weighted(layer, z, variance)
                variance += (likely(n) * size) ** 2
            elif isinstance(layer, nn.BatchNorm1d):
                gain = (layer.weight / (layer.running_var + layer.eps).sqrt()).abs()[:, None]
                size = gain * (z.abs() + layer.running_mean.abs()[:, None])
                size += layer.bias.abs()[:, None]
                # the gain has four roundings; a subtraction, a product and a sum follow
                variance = gain**2 * variance + (likely(7) * size) ** 2
            elif isinstance(layer, nn.Flatten):
                variance = layer(variance)
            z = layer(z)
        size = z.abs() * module.target_std + module.target_mean.abs()
        return (variance.sqrt() * module.target_std + likely(2) * size).numpy()


def _weighted(layer, z, variance):
    """Return |W| |z| + |b| and W**2 variance of a layer with weights W and bias b."""
    absolute, squared = copy.deepcopy(layer), copy.deepcopy(layer)
    for parameter in absolute.parameters():
        parameter.abs_()
    squared.weight.square_()
    squared.bias.zero_()
    return absolute(z.abs()), squared(variance)


def softmax_error(logit_error: float) -> float:
    """Return the largest error of a softmax of logits with an error of at most `logit_error`.

    dp_i = p_i (dz_i - sum_k p_k dz_k), so |dp_i| <= 2 p_i (1 - p_i) max |dz| <= max |dz| / 2.
    """
    return logit_error / 2
