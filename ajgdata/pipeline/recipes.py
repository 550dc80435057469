"""Recipes of data sets: their sessions, their grasps, and errors in their scenes.

Called while Snakemake parses: light imports only.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from pathlib import Path

from pydantic import ValidationError

from ajgdata import gripper
from ajgdata.acquire.recipe import Grasp, plan_session, session_names
from ajgdata.gripper.variation import Variation
from ajgdata.paths import Paths
from ajgdata.store.files import line_of
from ajgdata.store.provenance import layer_hash
from ajgdata.store.sessions import list_datasets, read_dataset
from ajgdata.types import DataError, DatasetSpec, Recipe, describe, location
from ajgdata.types.recipe import EMPTY


def with_recipe(paths: Paths) -> list[str]:
    """Return the names of the data sets that have a recipe."""
    return [name for name in list_datasets(paths) if read_dataset(paths, name).recipe]


def recipe_of(path: Path, spec: DatasetSpec) -> Recipe:
    """Return the recipe of the declaration at `path`. Raises DataError if it has none."""
    if spec.recipe is None:
        other = "import recordings instead"
        if spec.protocol:
            other = "record its protocol with --device"
        raise DataError(path, "has no recipe", f"add one, or {other}")
    return spec.recipe


def recipe_sessions(paths: Paths, dataset: str) -> list[str]:
    """Return the names of the sessions of the recipe of `dataset`. DataError if it has none."""
    return session_names(recipe_of(paths.dataset(dataset), read_dataset(paths, dataset)))


def planned_grasps(path: Path, spec: DatasetSpec, sessions: Sequence[str]) -> list[list[Grasp]]:
    """Return the grasps of each session of the recipe of `spec`, which is in the file `path`.

    Raises DataError with file, object, key and fix for an invalid scene, variation or signal chain.
    """
    recipe = recipe_of(path, spec)
    _check_variation(path, recipe)
    code = layer_hash("gripper")
    planned = [
        plan_session(recipe, spec.name, session, code, spec.excitation) for session in sessions
    ]
    _check_scenes(path, recipe, planned)
    return planned


def _check_variation(path: Path, recipe: Recipe) -> None:
    """Raise DataError for a variation that cannot be."""
    try:
        Variation.model_validate(recipe.variation or {})
    except ValidationError as error:
        line = line_of(path, ("recipe", "variation", *location(error)))
        raise describe(error, f"{path}:{line}: recipe, variation") from None


def _check_scenes(path: Path, recipe: Recipe, planned: Sequence[Sequence[Grasp]]) -> None:
    """Raise DataError for an invalid signal chain, and for the first invalid scene."""
    try:
        gripper.SignalChain.model_validate(recipe.signal)
    except ValidationError as error:
        line = line_of(path, ("recipe", "signal", *location(error)))
        raise describe(error, f"{path}:{line}: recipe, signal") from None
    for grasp in chain.from_iterable(planned):
        try:
            gripper.Scene.model_validate(grasp.setup)
        except ValidationError as error:
            raise describe(error, f"{path}: recipe, {grasp.object or EMPTY}") from None
