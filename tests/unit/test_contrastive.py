"""Contrastive loss: values by hand, gradients against float64 differences, hard numbers."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from ajgdata.embed.contrastive import Pairs, contrastive_loss, pair_weights


def loss_by_hand(points: np.ndarray, pairs: Pairs, margin: float) -> float:
    """Equation 4 of the paper, pair by pair."""
    total = 0.0
    for i in range(len(points)):
        for j in range(i + 1, len(points)):
            distance = float(np.sqrt(np.sum((points[i] - points[j]) ** 2)))
            total += 0.5 * float(pairs.similar[i, j]) * distance**2
            total += 0.5 * float(pairs.dissimilar[i, j]) * max(0.0, margin - distance) ** 2
    return total


def gradient(points: np.ndarray, pairs: Pairs, margin: float, dtype=torch.float32) -> np.ndarray:
    latent = torch.tensor(points, dtype=dtype, requires_grad=True)
    contrastive_loss(latent, pairs, margin).backward()
    return latent.grad.numpy()


def differences(points: np.ndarray, pairs: Pairs, margin: float) -> np.ndarray:
    """Central differences in float64; the step is the cube root of the rounding error (Nocedal &
    Wright, ch. 8), in units of the points."""
    step = np.finfo(np.float64).eps ** (1 / 3) * np.abs(points).max()
    found = np.empty_like(points)
    for place in np.ndindex(points.shape):
        ends = []
        for sign in (1, -1):
            moved = points.copy()
            moved[place] += sign * step
            ends.append(loss_by_hand(moved, pairs, margin))
        found[place] = (ends[0] - ends[1]) / (2 * step)
    return found


def test_pairs_are_of_one_thing_in_different_grasps():
    instance = np.array(["a", "a", "a", "b"])
    grasp = np.array(["1", "1", "2", "3"])
    pairs = pair_weights(instance, grasp)
    similar, dissimilar = (np.argwhere(w.numpy()).tolist() for w in pairs)
    assert similar == [[0, 2], [1, 2]]  # not (0, 1): one grasp
    assert dissimilar == [[0, 3], [1, 3], [2, 3]]
    assert [w.sum().item() for w in pairs] == pytest.approx([1, 1], rel=1e-15)


@given(seed=st.integers(0, 999), n=st.integers(2, 7), d=st.integers(1, 5), margin=st.floats(0.1, 9))
@settings(max_examples=30, deadline=None, derandomize=True)
def test_value_and_gradient(seed, n, d, margin):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(n, d))
    pairs = pair_weights(rng.integers(0, 3, n), rng.integers(0, 4, n))
    value = contrastive_loss(torch.from_numpy(points), pairs, margin).item()
    assert value == pytest.approx(loss_by_hand(points, pairs, margin), rel=1e-13, abs=1e-15)
    found = gradient(points, pairs, margin, torch.float64)
    # the second derivative jumps at the margin, by the pair's weight of at most 1: across it,
    # central differences err by up to a quarter of their step; elsewhere by its square times a few
    step = np.finfo(np.float64).eps ** (1 / 3) * np.abs(points).max()
    expected = differences(points, pairs, margin)
    np.testing.assert_allclose(found, expected, rtol=0, atol=step / 4)


@pytest.mark.parametrize("scale", [1e-20, 1.0, 1e20])
def test_float32_latents_of_any_scale(scale):
    """Squares of these leave float32 on both sides. Expected values by differences in float64."""
    rng = np.random.default_rng(1)
    points = rng.normal(size=(6, 3)).astype(np.float32) * np.float32(scale)
    instance = np.array(["a", "a", "b", "b", "c", "c"])
    pairs = pair_weights(instance, np.arange(6))
    value = contrastive_loss(torch.from_numpy(points), pairs, scale).item()
    exact = points.astype(np.float64)
    assert value == pytest.approx(loss_by_hand(exact, pairs, scale), rel=1e-13)
    found, expected = gradient(points, pairs, scale), differences(exact, pairs, scale)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * np.abs(expected).max())
