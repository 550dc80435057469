"""Models on public recordings: grouped and random folds, several seeds, and what tuning is worth.

    python benchmarks/recordings.py FOLDER [--seeds 5] [--model knn]

FOLDER holds one folder for each data set that docs/real-recordings.md describes; those that are
absent are left out. Everything is imported by reference into a temporary project.
"""

import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Self

import numpy as np
import typer
from dataset_features import extract_sessions, merge_sessions
from rich.console import Console
from rich.progress import track
from rich.table import Table

from ajgdata.evaluate.crossval import CrossValidation, Scores, cross_validate
from ajgdata.evaluate.resampling import corrected_interval
from ajgdata.evaluate.task_data import task_data
from ajgdata.models import make_model
from ajgdata.paths import Paths
from ajgdata.pipeline.importing import import_folder
from ajgdata.store.features import Shard, read_store
from ajgdata.store.sessions import list_sessions, read_dataset, write_dataset
from ajgdata.types import MODELS, Kind

DECLARED = Paths(Path(__file__).resolve().parents[1])
FOLDERS = {
    "knock_material": "knock_material/processed",
    "esc10": "esc10",
    "stone_impact": "stone_impact",
    "active_rp": "active_rp",
}
TUNED = [name for name in MODELS.own if MODELS[name].plain]


def features_of(project: Paths, name: str, folder: Path) -> Shard:
    """Import a folder and make the store of its features."""
    spec = read_dataset(DECLARED, name)
    write_dataset(project, spec)
    import_folder(project, name, folder, settings=None, copy=False)
    sessions = list_sessions(project, name)
    extract_sessions(project, spec, sessions, threads=2)
    merge_sessions(project, spec, sessions)
    return read_store(project.features(name))


def main(
    folder: Annotated[Path, typer.Argument(help="folder that holds the data sets' folders")],
    seeds: Annotated[int, typer.Option(help="seeds of splits and models")] = 5,
    model: Annotated[list[str] | None, typer.Option(help="these models alone")] = None,
) -> None:
    """Print two tables: models on grouped and random folds; and what tuning was worth, each model
    on the same grouped folds in three ways."""
    console = Console(width=170)
    every = Table("data set", "task", "model", "split", "folds", "n", "groups", "error or accuracy",
                  "95 % interval, all seeds", "chance", "means by seed")  # fmt: skip
    tuning = Table("data set", "task", "model", "variant", "mean over seeds", "training, ratio",
                   "means by seed")  # fmt: skip
    present = {n: folder / f for n, f in FOLDERS.items() if (folder / f).is_dir()}
    with tempfile.TemporaryDirectory() as temporary:
        project = Paths(Path(temporary))
        for name, source in track(present.items(), "data sets", console=console):
            store = features_of(project, name, source)
            spec = read_dataset(project, name)
            for task in spec.tasks:
                settings = spec.task_settings(task)
                for row in evaluated(store, settings, model or spec.tasks[task].models, seeds):
                    every.add_row(name, task, *row)
                tuned = [one for one in model or TUNED if MODELS[one].plain]
                for row in compared(store, settings, tuned, seeds):
                    tuning.add_row(name, task, *row)
    console.print(every)
    console.print(tuning)


class Data(NamedTuple):
    """Recordings of a task, and how they are split and scored."""

    X: np.ndarray
    y: np.ndarray
    groups: np.ndarray
    kind: Kind
    folds: int
    metric: str

    @classmethod
    def of(cls, store: Shard, task: dict) -> Self:
        kind = task["kind"]
        X, y, groups, _ = task_data(store, task["target"], kind, task["groups"])
        folds = min(task["folds"], len(np.unique(groups)))
        return cls(X, y, groups, kind, folds, "rmse" if kind == "regression" else "accuracy")

    def each_seed(self, model: Any, seeds: int, *, grouped: bool = True) -> list[CrossValidation]:
        """Return the cross-validation of each seed; `model` is a name or makes one of a seed."""
        groups = self.groups if grouped else None
        return [
            cross_validate(
                self.X, self.y, groups, kind=self.kind, folds=self.folds, seed=seed,
                model=model if isinstance(model, str) else model(seed),
            )
            for seed in range(seeds)
        ]  # fmt: skip


def _interval(scores: Sequence[Scores], metric: str) -> str:
    """Return the interval of the mean over all folds of all seeds, corrected for their overlap."""
    values = [value for one in scores for value in one.per_fold[metric]]
    low, high = corrected_interval(values, scores[0].folds, metric)
    return f"{low:.3f} to {high:.3f}"


def evaluated(store: Shard, task: dict, models: Sequence[str], seeds: int) -> list[list[str]]:
    """Return the rows of the first table for one task."""
    data, rows = Data.of(store, task), []
    for model in models:
        for split in ("grouped", "random"):
            scores = [f.scores for f in data.each_seed(model, seeds, grouped=split == "grouped")]
            first = scores[0]
            rows.append(
                [
                    model,
                    split,
                    str(data.folds),
                    str(first.recordings),
                    str(first.groups),
                    f"{first.mean[data.metric]:.3f} ± {first.sd[data.metric]:.3f}",
                    _interval(scores, data.metric),
                    f"{first.chance[data.metric]:.3f}",
                    " ".join(f"{s.mean[data.metric]:.3f}" for s in scores),
                ]
            )
    return rows


def compared(store: Shard, task: dict, models: Sequence[str], seeds: int) -> list[list[str]]:
    """Return the rows of the second table: plain, as before there was a choice, and tuned.

    Choices are made on inner folds of each training part alone; times are of training, those of
    the plain one being 1.
    """
    data, rows = Data.of(store, task), []
    for model in models:
        variants = {
            "plain": MODELS[model].plain,
            "before": partial(_before, model, data.kind),
            "tuned": model,
        }
        fastest = 0.0
        for variant, made in variants.items():
            found = data.each_seed(made, seeds)
            means = [one.scores.mean[data.metric] for one in found]
            train_s = sum(one.cost.train_cpu_s for one in found)
            fastest = fastest or train_s
            rows.append(
                [
                    model,
                    variant,
                    f"{np.mean(means):.3f}",
                    f"{train_s / fastest:.1f}",
                    " ".join(f"{mean:.3f}" for mean in means),
                ]
            )
    return rows


def _before(model: str, kind: Kind, seed: int) -> Any:
    """Return the one setting that the model had for all tasks: the first of its candidates."""
    tuned: Any = make_model(model, kind, seed)
    return tuned.candidates[0][1]


if __name__ == "__main__":
    typer.run(main)
