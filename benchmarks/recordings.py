"""Models on public recordings: grouped and random folds, several seeds, in one run.

    python benchmarks/recordings.py FOLDER [--seeds 5]

FOLDER holds one folder for each data set that docs/real-recordings.md describes; those that are
absent are left out. Everything is imported by reference into a temporary project.
"""

import tempfile
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.progress import track
from rich.table import Table

from ajgdata.evaluate.crossval import cross_validate
from ajgdata.evaluate.task_data import task_data
from ajgdata.paths import Paths
from ajgdata.pipeline.extract_features import extract_features
from ajgdata.pipeline.importing import import_folder
from ajgdata.pipeline.merge import merge
from ajgdata.store import manifest
from ajgdata.store.features import Shard, read_store
from ajgdata.store.sessions import read_dataset, write_dataset

DECLARED = Paths(Path(__file__).resolve().parents[1])
FOLDERS = {
    "knock_material": "knock_material/processed",
    "esc10": "esc10",
    "stone_impact": "stone_impact",
    "active_rp": "active_rp",
}


def features_of(project: Paths, name: str, folder: Path) -> Shard:
    """Import a folder and make the store of its features."""
    spec = read_dataset(DECLARED, name)
    write_dataset(project, spec)
    import_folder(project, name, folder, settings=None, copy=False)
    sessions = manifest.refresh(project, name)
    for session in sessions:
        extract_features(
            root=project.root,
            manifest=project.audio_manifest(name, session),
            audio=spec.audio,
            features=spec.features,
            code="",
            shard=project.shard(name, session),
            findings=project.shard_findings(name, session),
            cache=project.shard_cache(name, session),
            threads=2,
        )
    merge(
        dataset=name,
        shards=[project.shard(name, s) for s in sessions],
        labels=[project.label_manifest(name, s) for s in sessions],
        findings=[project.shard_findings(name, s) for s in sessions],
        targets=spec.targets,
        store=project.merged(name),
        published=project.features(name),
        quarantine=project.quarantine(name),
    )
    return read_store(project.features(name))


def main(
    folder: Annotated[Path, typer.Argument(help="folder that holds the data sets' folders")],
    seeds: Annotated[int, typer.Option(help="seeds of splits and models")] = 5,
) -> None:
    """Print mean ± sd over folds (seed 0), and the mean of each further seed."""
    console = Console(width=160)
    table = Table("data set", "task", "model", "split", "folds", "n", "groups", "error or accuracy",
                  "chance", "means by seed")  # fmt: skip
    present = {n: folder / f for n, f in FOLDERS.items() if (folder / f).is_dir()}
    with tempfile.TemporaryDirectory() as temporary:
        project = Paths(Path(temporary))
        for name, source in track(present.items(), "data sets", console=console):
            store = features_of(project, name, source)
            spec = read_dataset(project, name)
            for task in spec.tasks:
                for row in evaluated(
                    store, spec.task_settings(task), spec.tasks[task].models, seeds
                ):
                    table.add_row(name, task, *row)
    console.print(table)


def evaluated(store: Shard, task: dict, models: tuple[str, ...], seeds: int) -> list[list[str]]:
    """Return the rows of the table for one task."""
    kind = task["kind"]
    X, y, groups, _ = task_data(store, task["target"], kind, task["groups"])
    folds = min(task["folds"], len(np.unique(groups)))
    metric = "rmse" if kind == "regression" else "accuracy"
    rows = []
    for model in models:
        for split, labels in {"grouped": groups, "random": None}.items():
            scores = [
                cross_validate(X, y, labels, kind=kind, model=model, folds=folds, seed=s).scores
                for s in range(seeds)
            ]
            first = scores[0]
            rows.append(
                [
                    model,
                    split,
                    str(folds),
                    str(first.recordings),
                    str(first.groups),
                    f"{first.mean[metric]:.3f} ± {first.sd[metric]:.3f}",
                    f"{first.chance[metric]:.3f}",
                    " ".join(f"{s.mean[metric]:.3f}" for s in scores),
                ]
            )
    return rows


if __name__ == "__main__":
    typer.run(main)
