"""Measure error and training time of the CNN on inner folds, with one changed setting at a time.

    python benchmarks/cnn_settings.py results/features/ycb.nc [--target object] [--model cnn]
        [--base dropout=0.2] [--values epochs=5,20]

The inner folds are four folds by grasp of the training part of the first outer fold, so no row of
the test part is used. Each setting is trained from three initial weights. The error is the share of
wrong classes, and its standard deviation is over the twelve fits. The reference has the defaults
and `--base`. The difference from the reference is paired, with a standard error over grasps.
"""

import ast
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from sklearn.base import clone
from threadpoolctl import threadpool_limits

from ajgdata.evaluate.splits import grouped_folds
from ajgdata.evaluate.task_data import TaskData, task_data
from ajgdata.models import make_model
from ajgdata.store.features import read_store

OUTER_FOLDS = 5
INNER_FOLDS = 4
SEEDS = (0, 1, 2)
#: Tested values of each setting, in addition to the default.
VALUES: dict[str, Sequence[Any]] = {
    "dropout": (0.0, 0.2, 0.7),
    "weight_decay": (0.0, 0.01, 0.03, 0.3, 1.0),
    "max_learning_rate": (3e-4, 1e-3, 1e-2),
    "epochs": (5, 20, 40),
    "batch_size": (4, 16, 32),
    "kernel": (5, 17, 31),
    "stride": (2,),
    "channels": ((16, 16, 16), (64, 64, 64)),
}


@dataclass(frozen=True)
class InnerResult:
    """Errors of one setting, and the CPU time of one fit."""

    fits: np.ndarray  #: error of each fit (folds * seeds,)
    grasps: np.ndarray  #: error of each grasp (grasps,), mean over seeds
    train_s: float

    def row(self, reference: "InnerResult") -> str:
        """Return error, deviation, difference from a reference and time, separated by tabs."""
        difference = self.grasps - reference.grasps
        standard_error = difference.std(ddof=1) / np.sqrt(len(difference))
        return (
            f"{self.grasps.mean():.1%}\t{self.fits.std(ddof=1):.1%}\t"
            f"{difference.mean():+.1%} ± {standard_error:.1%}\t{self.train_s:.2f}"
        )


def training_part(store: Path, target: str) -> TaskData:
    """Return the training recordings of the first outer fold of a classification task."""
    data = task_data(read_store(store), target, "classification", "grasp_id")
    outer = grouped_folds(data.value, data.group, "classification", OUTER_FOLDS, seed=0)
    train, _ = outer[0]
    return data.where(train)


def inner_result(data: TaskData, model: str, settings: dict[str, Any]) -> InnerResult:
    """Train a model with changed settings on the inner folds of `data`."""
    folds = grouped_folds(data.value, data.group, "classification", INNER_FOLDS, seed=0)
    wrong = np.zeros((len(SEEDS), len(data.value)))
    fits = []
    start = time.process_time()
    for number, seed in enumerate(SEEDS):
        unfitted = make_model(model, "classification", seed).set_params(**settings)
        for train, test in folds:
            fitted = clone(unfitted).fit(data.feature[train], data.value[train])
            wrong[number, test] = fitted.predict(data.feature[test]) != data.value[test]
            fits.append(wrong[number, test].mean())
    total_s = time.process_time() - start
    by_recording = wrong.mean(axis=0)
    grasps = [by_recording[data.group == grasp].mean() for grasp in np.unique(data.group)]
    return InnerResult(np.array(fits), np.array(grasps), total_s / len(fits))


def changes(values: Sequence[str]) -> Iterator[tuple[str, Any]]:
    """Yield each setting with each value of texts `setting=value,value`; of `VALUES` for no text.

    >>> list(changes(["epochs=5,20"]))
    [('epochs', 5), ('epochs', 20)]
    """
    if not values:
        for setting, candidates in VALUES.items():
            for value in candidates:
                yield setting, value
    for text in values:
        setting, _, listed = text.partition("=")
        for value in ast.literal_eval(f"[{listed}]"):
            yield setting, value


def main(
    store: Annotated[Path, typer.Argument(help="features of a data set")],
    target: str = "object",
    model: str = "cnn",
    base: Annotated[list[str] | None, typer.Option(help="setting=value of all rows")] = None,
    values: Annotated[list[str] | None, typer.Option(help="setting=value,value")] = None,
) -> None:
    """Print one row per setting and value, separated by tabs."""
    data = training_part(store, target)
    with threadpool_limits(limits=1):
        common = dict(changes(base)) if base else {}
        reference = inner_result(data, model, common)
        print(f"reference\t{common}\t{reference.row(reference)}", flush=True)
        for setting, value in changes(values or []):
            changed = inner_result(data, model, common | {setting: value})
            print(f"{setting}\t{value}\t{changed.row(reference)}", flush=True)


if __name__ == "__main__":
    typer.run(main)
