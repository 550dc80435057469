"""Contrastive loss: values and gradients by hand, also of very small and large numbers."""

import numpy as np
import pytest
import torch

from ajgdata.embed.encoder import Pairs, contrastive_loss, pair_weights


def loss_by_hand(points: np.ndarray, pairs: Pairs, margin: float) -> float:
    """Equation 4 of the paper, pair by pair."""
    total = 0.0
    for i in range(len(points)):
        for j in range(i + 1, len(points)):
            distance = float(np.sqrt(np.sum((points[i] - points[j]) ** 2)))
            total += 0.5 * float(pairs.similar[i, j]) * distance**2
            total += 0.5 * float(pairs.dissimilar[i, j]) * max(0.0, margin - distance) ** 2
    return total


def test_pairs_are_of_one_thing_in_different_grasps():
    instance = np.array(["a", "a", "a", "b"])
    grasp = np.array(["1", "1", "2", "3"])
    pairs = pair_weights(instance, grasp)
    similar, dissimilar = (np.argwhere(w.numpy()).tolist() for w in pairs)
    assert similar == [[0, 2], [1, 2]]  # not (0, 1): one grasp
    assert dissimilar == [[0, 3], [1, 3], [2, 3]]
    assert [w.sum().item() for w in pairs] == pytest.approx([1, 1], rel=1e-15)


@pytest.mark.parametrize("scale", [1e-20, 1.0, 1e20])
def test_value_and_gradient_at_any_scale(scale):
    """Squares of these float32 latents leave float32 on both sides.

    A similar pair pulls by its difference x, and a dissimilar one at distance d below the margin m
    pushes by (m - d) x / d.
    """
    rng = np.random.default_rng(1)
    points = rng.normal(size=(6, 3)).astype(np.float32) * np.float32(scale)
    pairs = pair_weights(np.array(["a", "a", "b", "b", "c", "c"]), np.arange(6))
    margin = 2 * scale  # beyond it lie some pairs, and others do not
    latent = torch.tensor(points, requires_grad=True)
    loss = contrastive_loss(latent, pairs, margin)
    loss.backward()
    exact = points.astype(np.float64)
    assert loss.item() == pytest.approx(loss_by_hand(exact, pairs, margin), rel=1e-13)
    expected = np.zeros_like(exact)
    for i, j in zip(*np.triu_indices(6, 1), strict=True):
        apart = exact[i] - exact[j]
        distance = np.linalg.norm(apart)
        pull = float(pairs.similar[i, j]) * apart
        pull -= float(pairs.dissimilar[i, j]) * max(0.0, margin - distance) * apart / distance
        expected[i] += pull
        expected[j] -= pull
    np.testing.assert_allclose(latent.grad.numpy(), expected, rtol=0, atol=1e-6 * scale)
