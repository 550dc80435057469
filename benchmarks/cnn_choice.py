"""The CNN's settings chosen on one data set's inner split: error and training time of each.

    python benchmarks/cnn_choice.py [results/features/ycb.nc]

Only the training part of the data set's first outer fold is looked at; its rows are divided again
into inner folds by grasp. One setting after the other is varied, in the order of CHOICES, and the
winner is kept for the next. The winner is the cheapest to train of those whose error cannot be told
from the lowest: by no more than one standard error of the paired difference, over grasps. Times
within CLOSE of the cheapest are equal, and the lower error decides. No other fold, data set or
figure of the paper is consulted, and what is chosen is used for every task.
"""

import math
import time
from collections.abc import Callable
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import torch
import typer
from threadpoolctl import threadpool_limits
from torch import Tensor, nn
from torch.nn import functional

from ajgdata.evaluate.splits import grouped_folds
from ajgdata.evaluate.task_data import TaskData, task_data
from ajgdata.models import make_model
from ajgdata.models.cnn import CnnClassifier
from ajgdata.models.network import SpectrumCnn
from ajgdata.models.training import batches
from ajgdata.store.features import Shard, read_store
from ajgdata.types import MODELS

#: Everything that is tried, in this order. The first value of each is where the search begins.
CHOICES: dict[str, tuple[Any, ...]] = {
    "max_learning_rate": (3e-3, 3e-4, 1e-3, 1e-2),
    "optimiser": ("adamw", "adam", "nesterov"),
    "schedule": ("one cycle", "cosine", "constant"),
    "channels": ((16, 32, 64), (8, 16, 32), (32, 64, 128), (32, 32, 32)),
    "kernel": (9, 5, 17, 31),
    "shrink": ("stride 4", "stride 2", "pool 4"),
    "norm": ("layer", "batch", "none"),
    "head": ("flat", "mean"),
    "dropout": (0.5, 0.0, 0.2),
    "weight_decay": (1e-2, 0.0, 1e-1, 1.0),
    "label_smoothing": (0.1, 0.0, 0.2),
    "compression": (0.1, 0.01, 1.0),
    "batch_size": (16, 8, 32, 64),
    "epochs": (10, 5, 15, 20, 40),
    "scaling": ("per_bin", "global", "both"),  # decided by benchmarks/cnn_scaling.py
}
CLOSE = 1.15
INNER_FOLDS, SEEDS = 4, 3
#: Of plain gradient descent: its step is larger than Adam's, whose gradients are normalised.
NESTEROV_RATE = 30.0


class Network(SpectrumCnn):
    """The network with its other ways to normalise, to shrink and to read out."""

    def __init__(self, n: int, k: int, settings: dict[str, Any]) -> None:
        channels, kernel, norm = settings["channels"], settings["kernel"], settings["norm"]
        how, factor = settings["shrink"].split()
        pool, stride = (int(factor), 1) if how == "pool" else (1, int(factor))
        inputs = 2 if settings["scaling"] == "both" else 1
        super().__init__(n, k, channels, kernel, stride * pool, settings["dropout"], inputs)
        layers: list[nn.Module] = []
        for before, width in zip((inputs, *channels), channels, strict=False):
            layers.append(nn.Conv1d(before, width, kernel, stride, padding=kernel // 2))
            if norm != "none":
                layers.append(nn.GroupNorm(1, width) if norm == "layer" else nn.BatchNorm1d(width))
            layers += [nn.ReLU(), *([nn.MaxPool1d(pool, ceil_mode=True)] if pool > 1 else [])]
        self.convolutions = nn.Sequential(*layers)
        self.mean_head = settings["head"] == "mean"
        if self.mean_head:
            self.dense = nn.Linear(channels[-1], k)

    def trunk(self, z: Tensor) -> Tensor:
        if not self.mean_head:
            return super().trunk(z)
        return self.dense(
            self.dropout(self.convolutions(z.reshape(len(z), -1, z.shape[-1])).mean(dim=2))
        )


class Candidate(CnnClassifier):
    """The classifier of the project, with settings that it does not have as well."""

    OWN = ("optimiser", "schedule", "shrink", "norm", "head", "label_smoothing")

    def __init__(self, settings: dict[str, Any], random_state: int) -> None:
        shared = {name: value for name, value in settings.items() if name not in self.OWN}
        super().__init__(**shared, min_steps=0, random_state=random_state)
        self.settings = settings

    def _module(self, n_features: int) -> SpectrumCnn:
        return Network(n_features, self._n_outputs(), self.settings)

    def _optimiser(self, module: SpectrumCnn, steps: int) -> tuple[Any, Any]:
        rate, name = self.max_learning_rate, self.settings["optimiser"]
        weights, decay = module.parameters(), self.weight_decay
        optimiser: torch.optim.Optimizer
        if name == "nesterov":
            rate *= NESTEROV_RATE
            optimiser = torch.optim.SGD(
                weights, rate, momentum=0.9, nesterov=True, weight_decay=decay / NESTEROV_RATE
            )
        else:
            cls = torch.optim.AdamW if name == "adamw" else torch.optim.Adam
            optimiser = cls(weights, rate, weight_decay=decay, fused=True)
        of = torch.optim.lr_scheduler
        schedules = {
            "one cycle": lambda: of.OneCycleLR(optimiser, rate, total_steps=steps),
            "cosine": lambda: of.CosineAnnealingLR(optimiser, steps),
            "constant": lambda: of.ConstantLR(optimiser, 1.0),
        }
        return optimiser, schedules[self.settings["schedule"]]()

    def _train(self, module: SpectrumCnn, inputs: Tensor, target: Tensor) -> None:
        steps = self.epochs * math.ceil(len(inputs) / self.batch_size)
        optimiser, schedule = self._optimiser(module, steps)
        for rows in islice(batches(len(inputs), self.batch_size), steps):
            loss = self._loss(module.trunk(inputs[rows]), target[rows])
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            schedule.step()

    def _loss(self, scores: Tensor, target: Tensor) -> Tensor:
        smoothing = self.settings["label_smoothing"]
        return functional.cross_entropy(scores, target, label_smoothing=smoothing)


class Tried(NamedTuple):
    """A candidate: its error on each recording (n,), and processor time to train a fold once."""

    value: Any
    wrong: np.ndarray
    train_s: float


def inner_rows(store: Shard, target: str, groups: str = "grasp_id", seed: int = 0) -> TaskData:
    """The training part of the first outer fold, as the workflow's evaluation makes it."""
    rows = task_data(store, target, "classification", groups)
    train, _ = grouped_folds(rows.value, rows.group, "classification", 5, seed)[0]
    return rows.where(np.isin(np.arange(len(rows.value)), train))


def tried(rows: TaskData, model: Callable[[int], Any], value: Any) -> Tried:
    """Out-of-fold errors by the inner folds of `model(seed)`, mean over seeds."""
    wrong, times = np.zeros(len(rows.value)), []
    folds = grouped_folds(rows.value, rows.group, "classification", INNER_FOLDS, seed=1)
    for seed in range(SEEDS):
        for train, test in folds:
            start = time.process_time()
            fitted = model(seed).fit(rows.feature[train], rows.value[train])
            times.append(time.process_time() - start)
            wrong[test] += (fitted.predict(rows.feature[test]) != rows.value[test]) / SEEDS
    return Tried(value, wrong, float(np.median(times)))


def difference(one: Tried, other: Tried, group: np.ndarray) -> tuple[float, float]:
    """How much more often `one` errs than `other`, and the standard error of that over grasps."""
    of_grasp = np.array([(one.wrong - other.wrong)[group == g].mean() for g in np.unique(group)])
    return float(of_grasp.mean()), float(of_grasp.std(ddof=1) / np.sqrt(len(of_grasp)))


def winner(candidates: list[Tried], group: np.ndarray) -> Tried:
    """The cheapest of those that cannot be told from the best."""
    best = min(candidates, key=lambda one: one.wrong.mean())
    near = [(one, *difference(one, best, group)) for one in candidates]
    good = [one for one, worse, error in near if worse <= error]
    limit = CLOSE * min(one.train_s for one in good)
    return min((g for g in good if g.train_s <= limit), key=lambda one: one.wrong.mean())


def told(name: str, one: Tried, chosen: Tried, group: np.ndarray) -> str:
    """A row of the table, as in docs/models.md."""
    worse, error = difference(one, chosen, group)
    against = "chosen" if one is chosen else f"{100 * worse:+.1f} ± {100 * error:.1f}"
    share = f"{100 * one.wrong.mean():.1f}"
    return f"| {name} | {one.value} | {share} | {against} | {one.train_s:.2f} |"


def main(
    store: Annotated[Path, typer.Argument(help="feature store")] = Path("results/features/ycb.nc"),
    target: Annotated[str, typer.Option(help="column of the classes")] = "object",
) -> None:
    """Print every candidate with its inner error and training time, and what is chosen."""
    rows = inner_rows(read_store(store), target)
    settings = {name: values[0] for name, values in CHOICES.items()}
    print("| setting | value | error, % | against the chosen, % | training, s |")
    print("|---|---|---|---|---|")
    with threadpool_limits(limits=1):
        begun = tried(rows, partial(Candidate, settings), "the start")
        for name, values in CHOICES.items():
            made = [tried(rows, partial(Candidate, settings | {name: v}), v) for v in values]
            chosen = winner(made, rows.group)
            settings[name] = chosen.value
            for one in made:
                print(told(name, one, chosen, rows.group), flush=True)
        final = tried(rows, partial(Candidate, settings), "the choice")
        print(told("CNN", begun, final, rows.group))
        print(told("CNN", final, final, rows.group))
        for name in MODELS.own:
            other = tried(rows, partial(make_model, name, "classification"), "")
            print(told(MODELS[name].classification, other, final, rows.group), flush=True)
    print(f"\n{len(rows.value)} recordings of {len(np.unique(rows.group))} grasps: {settings}")


if __name__ == "__main__":
    typer.run(main)
