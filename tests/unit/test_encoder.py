"""Training of encoders on small spectra that a person can reason about."""

import numpy as np
import pytest
import torch

from ajgdata.embed.encoder import (
    StackedEncoders,
    contrastive_loss,
    draw_batches,
    new_network,
    pair_weights,
    train_encoders,
)
from ajgdata.models.cnn import Descent
from ajgdata.types import Embedding

THINGS = 4
GRASPS = 6
BINS = 96
SETTINGS = Embedding(
    supervision="objects", target="object", epochs=30, batch_instances=4, batch_recordings=4
)


@pytest.fixture(scope="module")
def spectra() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Each thing has a peak of its own, each grasp a level and a tilt; two recordings a grasp."""
    rng = np.random.default_rng(0)
    thing = np.repeat(np.arange(THINGS), GRASPS * 2)
    grasp = np.repeat(np.arange(THINGS * GRASPS), 2)
    bins = np.arange(BINS)
    peak = np.exp(-(((bins - 15 - 20 * thing[:, None]) / 6) ** 2))
    tilt = np.repeat(rng.normal(0, 1, THINGS * GRASPS), 2)[:, None] * (bins / BINS)
    noise = rng.normal(0, 0.02, (len(thing), BINS))
    return np.exp(0.7 * peak + tilt + noise).astype(np.float32), thing, grasp


def test_things_come_apart_and_grasps_together(spectra):
    features, thing, grasp = spectra
    new = grasp % GRASPS == GRASPS - 1  # the last grasp of each thing is not trained on
    (encoder,) = train_encoders(
        features[~new],
        thing[~new],
        grasp[~new],
        dimensions=(2,),
        settings=SETTINGS,
        seed=0,
    )
    latent = encoder.encode(features)
    apart = np.linalg.norm(latent[:, None] - latent[None], axis=-1)
    same = thing[:, None] == thing[None]
    of_new = np.ix_(new, ~new)
    # similar pairs have no distance to rest at, dissimilar ones rest at the margin of 1
    assert apart[of_new][same[of_new]].mean() < 0.5 < apart[of_new][~same[of_new]].mean()


def test_networks_side_by_side_are_each_what_they_were(spectra):
    """Latents and gradients are those of each alone, to rounding; so are weights given back."""
    with torch.random.fork_rng():
        torch.manual_seed(0)
        networks = [new_network(BINS, d) for d in (1, 3, 8)]
    z = torch.from_numpy(spectra[0][:12])
    pairs = pair_weights(spectra[1][:12] % 2, spectra[2][:12])
    together = StackedEncoders(networks)
    for alone, output in zip(networks, together(z), strict=True):
        torch.testing.assert_close(output, alone.trunk(z), rtol=1e-5, atol=1e-5)
    descent = Descent(together, 1, peak=3e-3, weight_decay=0.1)
    loss = torch.stack([contrastive_loss(x, pairs, 1.0) for x in together(z)]).sum()
    loss.backward(retain_graph=True)
    together_after = [p.grad for p in together.convolutions.parameters()]
    for number, network in enumerate(networks):
        contrastive_loss(network.trunk(z), pairs, 1.0).backward()
        for joined, own in zip(together_after, network.convolutions.parameters(), strict=True):
            part = joined.chunk(len(networks))[number].reshape(own.shape)
            torch.testing.assert_close(part, own.grad, rtol=1e-3, atol=1e-5)
    descent.step(loss)
    expected = [x.detach() for x in together.eval()(z)]  # by what it saw of means and variances
    together.write_back()
    for network, latent in zip(networks, expected, strict=True):
        result = network.eval().trunk(z).detach()
        torch.testing.assert_close(result, latent, rtol=1e-5, atol=1e-5)


def test_nothing_to_learn_is_said():
    thing = np.array([0, 1, 1])
    grasp = np.array([0, 1, 1])
    ask = {"instances": 2, "recordings": 2, "epochs": 1, "generator": np.random.default_rng(0)}
    with pytest.raises(ValueError, match="no object was grasped twice"):
        draw_batches(thing, grasp, **ask)


def test_the_seed_draws_the_batches(spectra, monkeypatch):
    """The network is trained on the batches of its seed: equal seeds give equal latents."""
    features, thing, grasp = spectra
    short = SETTINGS.model_copy(update={"epochs": 1})
    drawn = []

    def spy(*labels, **options):
        drawn.append(draw_batches(*labels, **options))
        return drawn[-1]

    monkeypatch.setattr("ajgdata.embed.encoder.draw_batches", spy)
    first, again = (
        train_encoders(features, thing, grasp, dimensions=(2,), settings=short, seed=5)[0]
        for _ in range(2)
    )
    np.testing.assert_array_equal(first.encode(features), again.encode(features))
    expected, other = (
        draw_batches(
            thing, grasp, instances=4, recordings=4, epochs=1, generator=np.random.default_rng(seed)
        )
        for seed in (5, 0)
    )
    np.testing.assert_array_equal(drawn[0], expected)
    assert not np.array_equal(expected, other)
