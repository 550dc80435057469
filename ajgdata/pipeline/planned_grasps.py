"""Grasps of the recipes of data sets, with checks. Light: Snakemake imports this."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pydantic import ValidationError

from ajgdata import gripper
from ajgdata.acquire.recipe import RecipeGrasp, plan_session
from ajgdata.gripper.variation import Variation
from ajgdata.store.code_hash import code_hash
from ajgdata.store.files import line_of
from ajgdata.types import DataError, DatasetSpec, Recipe, describe, location
from ajgdata.types.recipe import EMPTY


def recipe_of(path: Path, spec: DatasetSpec) -> Recipe:
    """Return the recipe of the data set config at `path`. Raises DataError if it has none."""
    if spec.recipe is None:
        raise DataError(path, "has no recipe", "add one, or import recordings instead")
    return spec.recipe


def planned_grasps(
    path: Path, spec: DatasetSpec, sessions: Sequence[str]
) -> list[list[RecipeGrasp]]:
    """Return the grasps of each session of a recipe. `spec` is the data set config at `path`.

    Raises DataError with file, object, key and fix for an invalid scene, variation or signal chain.
    """
    recipe = recipe_of(path, spec)
    _check_variation(path, recipe)
    code = code_hash("gripper")
    planned = [
        plan_session(recipe, spec.name, session, code, spec.excitation) for session in sessions
    ]
    _check_scenes(path, recipe, planned)
    return planned


def _check_variation(path: Path, recipe: Recipe) -> None:
    """Raise DataError for an invalid variation."""
    try:
        Variation.model_validate(recipe.variation or {})
    except ValidationError as error:
        line = line_of(path, ("recipe", "variation", *location(error)))
        raise describe(error, f"{path}:{line}: recipe, variation") from None


def _check_scenes(path: Path, recipe: Recipe, planned: Sequence[Sequence[RecipeGrasp]]) -> None:
    """Raise DataError for an invalid signal chain, and for the first invalid scene."""
    try:
        gripper.SignalChain.model_validate(recipe.signal)
    except ValidationError as error:
        line = line_of(path, ("recipe", "signal", *location(error)))
        raise describe(error, f"{path}:{line}: recipe, signal") from None
    for grasps in planned:
        for grasp in grasps:
            try:
                gripper.Scene.model_validate(grasp.setup)
            except ValidationError as error:
                raise describe(error, f"{path}: recipe, {grasp.object or EMPTY}") from None
