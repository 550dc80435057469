"""Training of encoders: all dimensions together against a loop, and against a peer's loss.

    python benchmarks/embedding.py [--steps 20] [--rounds 7]

Random spectra of full size, since times do not depend on what they hold. Every row is measured in
one run, turn by turn with the row that it is compared with; processor time of one thread, the least
of all rounds.
"""

import time
from collections.abc import Callable
from typing import Annotated

import numpy as np
import torch
import typer
from pytorch_metric_learning.distances import LpDistance
from pytorch_metric_learning.losses import ContrastiveLoss
from rich.console import Console
from rich.table import Table
from torch.func import functional_call, stack_module_state, vmap

from ajgdata.embed.contrastive import Pairs, contrastive_loss, draw_batches, pair_weights
from ajgdata.embed.encoder import new_network
from ajgdata.embed.stacked_encoders import StackedEncoders
from ajgdata.models.cnn import CnnClassifier
from ajgdata.models.network import SpectrumCnn
from ajgdata.types import Embedding

BINS, THINGS, GRASPS, SAMPLES = 1025, 16, 16, 2  # the training rows of a fold of ycb
SETTINGS = Embedding(supervision="none", target="object")
Step = Callable[[torch.Tensor, Pairs], None]


def batches_of(recordings: int, things: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    thing = np.repeat(np.arange(THINGS), GRASPS * SAMPLES)
    grasp = np.repeat(np.arange(THINGS * GRASPS), SAMPLES)
    rows = draw_batches(
        thing, grasp, instances=things, recordings=recordings, epochs=2,
        generator=np.random.default_rng(0),
    )  # fmt: skip
    return rows, thing, grasp


def networks() -> list[SpectrumCnn]:
    torch.manual_seed(0)
    return [new_network(BINS, dimension) for dimension in SETTINGS.dimensions]


def loop() -> Step:
    """What one would write first: each dimension by itself."""
    each = [(network, CnnClassifier().descent(network, 10**6)) for network in networks()]

    def step(x: torch.Tensor, pairs: Pairs) -> None:
        for network, descent in each:
            descent.step(contrastive_loss(network.trunk(x), pairs, SETTINGS.margin))

    return step


def together() -> Step:
    joined = StackedEncoders(networks())
    descent = CnnClassifier().descent(joined, 10**6)

    def step(x: torch.Tensor, pairs: Pairs) -> None:
        losses = [contrastive_loss(z, pairs, SETTINGS.margin) for z in joined(x)]
        descent.step(torch.stack(losses).sum())

    return step


def mapped() -> Step:
    """torch.func.vmap over stacked weights: as many networks, all of the largest dimension (it
    cannot stack others), and without its optimiser's step, which favours it."""
    largest = [new_network(BINS, max(SETTINGS.dimensions)) for _ in SETTINGS.dimensions]
    weights, buffers = stack_module_state(largest)

    class Trunk(torch.nn.Module):
        def __init__(self, network: SpectrumCnn) -> None:
            super().__init__()
            self.network = network

        def forward(self, x: torch.Tensor) -> torch.Tensor:
            return self.network.trunk(x)

    trunk = Trunk(largest[0])

    def one(own: dict, held: dict, x: torch.Tensor) -> torch.Tensor:
        named = {f"network.{name}": value for name, value in {**own, **held}.items()}
        return functional_call(trunk, named, (x,))

    def step(x: torch.Tensor, pairs: Pairs) -> None:
        latents = vmap(one, in_dims=(0, 0, None))(weights, buffers, x)
        contrastive_loss(latents, pairs, SETTINGS.margin).sum().backward()

    return step


def least(contestants: dict[str, Callable[[], None]], rounds: int) -> dict[str, float]:
    """Least processor time in s of each, turn by turn after one untimed turn."""
    times: dict[str, list[float]] = {name: [] for name in contestants}
    for _ in range(rounds + 1):
        for name, call in contestants.items():
            start = time.process_time()
            call()
            times[name].append(time.process_time() - start)
    return {name: min(found[1:]) for name, found in times.items()}


def training(batch: tuple[int, int], steps: int, rounds: int) -> dict[str, float]:
    things, recordings = batch
    rows, thing, grasp = batches_of(recordings, things)
    x = torch.randn(len(thing), BINS)

    def runs(step: Step) -> Callable[[], None]:
        def run() -> None:
            for one in rows[:steps]:
                step(x[one], pair_weights(thing[one], grasp[one]))

        return run

    return least({f.__name__: runs(f()) for f in (loop, together, mapped)}, rounds)


def losses(dimension: int, steps: int, rounds: int) -> dict[str, float]:
    """Forward and backward of the loss alone, on the latents of the same batches."""
    rows, thing, grasp = batches_of(SETTINGS.batch_recordings, SETTINGS.batch_instances)
    latents = torch.randn(len(thing), dimension)
    peer = ContrastiveLoss(
        pos_margin=0, neg_margin=SETTINGS.margin, distance=LpDistance(normalize_embeddings=False)
    )

    def ours() -> None:
        for batch in rows[:steps]:
            z = latents[batch].requires_grad_()
            pairs = pair_weights(thing[batch], grasp[batch])
            contrastive_loss(z, pairs, SETTINGS.margin).backward()

    def theirs() -> None:
        for batch in rows[:steps]:
            z = latents[batch].requires_grad_()
            peer(z, torch.from_numpy(thing[batch])).backward()

    return least({"ours": ours, "peer": theirs}, rounds)


def main(
    steps: Annotated[int, typer.Option(help="training steps that are timed at a time")] = 20,
    rounds: Annotated[int, typer.Option(help="turns; the least time counts")] = 7,
) -> None:
    """Print times of a step, and ratios."""
    torch.set_num_threads(1)
    console = Console(width=120)
    count = len(SETTINGS.dimensions)
    table = Table("batch (things x recordings)", f"loop of {count}, ms a step", "together", "vmap",
                  "loop / together", "loop / vmap")  # fmt: skip
    for batch in ((4, 4), (SETTINGS.batch_instances, SETTINGS.batch_recordings), (16, 4)):
        found = training(batch, steps, rounds)
        ms = [f"{1e3 * found[name] / steps:.1f}" for name in ("loop", "together", "mapped")]
        ratios = [f"{found['loop'] / found[name]:.2f}" for name in ("together", "mapped")]
        table.add_row(f"{batch[0]} x {batch[1]}", *ms, *ratios)
    console.print(table)
    table = Table("dimension", "our loss, ms", "pytorch-metric-learning, ms", "peer / ours")
    for dimension in (2, SETTINGS.shown, max(SETTINGS.dimensions)):
        found = losses(dimension, 5 * steps, rounds)
        ms = [f"{1e3 * found[name] / (5 * steps):.2f}" for name in ("ours", "peer")]
        table.add_row(str(dimension), *ms, f"{found['peer'] / found['ours']:.2f}")
    console.print(table)


if __name__ == "__main__":
    typer.run(main)
