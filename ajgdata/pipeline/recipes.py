"""Recipes of data sets: the grasps that they plan, and the lines of their errors.

Called while Snakemake parses: light imports only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from pydantic import ValidationError

from ajgdata import gripper
from ajgdata.acquire.recipe import plan_session, session_names, yaml_place
from ajgdata.acquire.source import Grasp
from ajgdata.gripper.variation import Variation
from ajgdata.paths import Paths
from ajgdata.store.files import line_of
from ajgdata.store.provenance import layer_hash
from ajgdata.store.sessions import list_datasets, read_dataset
from ajgdata.types import SOURCES, DataError, DatasetSpec, Recipe, describe, location


def with_recipe(paths: Paths, source: str = "") -> list[str]:
    """Return the names of the data sets that have a recipe, of `source` if one is given."""
    recipes = {name: read_dataset(paths, name).recipe for name in list_datasets(paths)}
    return [name for name, one in recipes.items() if one and source in ("", one.source)]


def recipe_of(path: Path, spec: DatasetSpec) -> Recipe:
    """Return the recipe of the declaration at `path`. Raises DataError if it has none."""
    if spec.recipe is None:
        other = "import recordings instead"
        if spec.protocol:
            other = "record its protocol with --source soundcard"
        raise DataError(path, "has no recipe", f"add one, or {other}")
    return spec.recipe


def recipe_sessions(paths: Paths, dataset: str, source: str = "") -> list[str]:
    """Return the names of the sessions that the recipe of `dataset` makes.

    Raises DataError if that names another source than `source`.
    """
    recipe = recipe_of(paths.dataset(dataset), read_dataset(paths, dataset))
    if source not in ("", recipe.source):
        fix = f"--source {recipe.source}, or none"
        raise DataError(paths.dataset(dataset), f"its recipe is for {recipe.source!r}", fix)
    return session_names(recipe)


def planned_grasps(path: Path, spec: DatasetSpec, sessions: Sequence[str]) -> list[list[Grasp]]:
    """Return the grasps of each session of the recipe of `spec`, which stands in the file `path`.

    The setups of another source than the virtual gripper are its own to check. Raises
    DataError with file, line, key and fix for a scene or a signal chain that cannot be.
    """
    recipe = recipe_of(path, spec)
    _check_variation(path, recipe)
    code = SOURCES.origin(recipe.source) or layer_hash("gripper")
    planned = [
        plan_session(recipe, spec.name, session, code, spec.excitation) for session in sessions
    ]
    if recipe.source == "virtual":
        _check_scenes(path, recipe, dict(zip(sessions, planned, strict=True)))
    return planned


def _check_variation(path: Path, recipe: Recipe) -> None:
    """Raise DataError for a variation that cannot be."""
    try:
        Variation.model_validate(recipe.variation or {})
    except ValidationError as error:
        line = line_of(path, ("recipe", "variation", *location(error)))
        raise describe(error, f"{path}:{line}: recipe, variation") from None


def _check_scenes(path: Path, recipe: Recipe, planned: Mapping[str, Sequence[Grasp]]) -> None:
    """Raise DataError for the first signal chain or scene that the virtual gripper refuses."""
    try:
        gripper.SignalChain.model_validate(recipe.signal)
    except ValidationError as error:
        line = line_of(path, ("recipe", "signal", *location(error)))
        raise describe(error, f"{path}:{line}: recipe, signal") from None
    for session, grasps in planned.items():
        for grasp in grasps:
            try:
                gripper.Scene.model_validate(grasp.setup)
            except ValidationError as error:
                where = yaml_place(recipe, session, grasp.object, location(error))
                problem = f"{path}:{line_of(path, where)}: recipe, {grasp.object}"
                raise describe(error, problem) from None
