"""The stages of `benchmarks/scale.py`: by name the work that is measured, ready to run.

What a stage needs beforehand, imports included, is not part of its work.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from scale_recordings import EMBEDDING, NAME

from ajgdata.paths import Paths

ASKED = 1_000  # recordings that a model predicts


def stage_import(project: Paths, folder: Path) -> Callable[[], object]:
    from ajgdata.pipeline.importing import import_folder

    return lambda: import_folder(project, NAME, folder, settings=None, copy=False)


def stage_validate(project: Paths, folder: Path) -> Callable[[], object]:
    from ajgdata.pipeline.validate import validate_dataset

    return lambda: validate_dataset(project, NAME, lambda total: lambda: None)


def stage_features(project: Paths, folder: Path) -> Callable[[], object]:
    from dataset_features import extract_sessions

    from ajgdata.store.sessions import list_sessions, read_dataset

    spec = read_dataset(project, NAME)
    return lambda: extract_sessions(project, spec, list_sessions(project, NAME))


def stage_merge(project: Paths, folder: Path) -> Callable[[], object]:
    from dataset_features import merge_sessions

    from ajgdata.store.sessions import list_sessions, read_dataset

    spec, sessions = read_dataset(project, NAME), list_sessions(project, NAME)
    return lambda: merge_sessions(project, spec, sessions)


def stage_load(project: Paths, folder: Path) -> Callable[[], object]:
    import ajgdata
    import ajgdata.store.features

    def load() -> None:
        with ajgdata.load_features(NAME, project.root) as features:
            features.load()

    return load


def stage_publish(project: Paths, folder: Path) -> Callable[[], object]:
    from ajgdata.pipeline.publish import publish

    return lambda: publish(project, NAME, project.published(NAME), date="2000-01-01")


def stage_fetch(project: Paths, folder: Path) -> Callable[[], object]:
    from ajgdata.pipeline.fetch import fetch

    return lambda: fetch(project, str(project.published(NAME)), name="fetched")


def stage_embedding(project: Paths, folder: Path) -> Callable[[], object]:
    from ajgdata.embed import contrastive  # noqa: F401
    from ajgdata.pipeline.embed import train_embedding
    from ajgdata.types import Embedding

    return lambda: train_embedding(
        project.features(NAME),
        settings=Embedding.model_validate(EMBEDDING),
        seed=0,
        latents=folder.parent / "latents.nc",
        cost=folder.parent / "cost.json",
    )


def stage_model(project: Paths, folder: Path, name: str) -> Callable[[], object]:
    """A model learns which object, from all recordings or as many as it may, and is asked."""
    from threadpoolctl import threadpool_limits

    from ajgdata.evaluate.task_data import task_data
    from ajgdata.models import fit_model, make_model
    from ajgdata.store.features import read_store

    unfitted = make_model(name, "classification")

    def learn() -> None:
        data = task_data(read_store(project.features(NAME)), "object", "classification", "grasp_id")
        with threadpool_limits(limits=1):
            fitted = fit_model(unfitted, data.feature, data.value, data.group)
            fitted.predict(data.feature[:ASKED])

    return learn


def work_of(name: str, project: Paths, folder: Path) -> Callable[[], object]:
    """Return the work of a stage, or of `model: NAME`."""
    kind, _, model = name.partition(": ")
    if model:
        return stage_model(project, folder, model)
    made: Callable[[Paths, Path], Callable[[], object]] = globals()[f"stage_{kind}"]
    return made(project, folder)
