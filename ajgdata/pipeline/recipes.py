"""Recipes of data sets: their grasps and recordings, errors in their scenes, and other sounds.

Called while Snakemake parses: light imports only.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from pydantic import ValidationError

from ajgdata import gripper
from ajgdata.acquire.changed_grasps import GraspSimulator
from ajgdata.acquire.recipe import RecipeGrasp, plan_session, session_names
from ajgdata.acquire.virtual import VirtualGripper
from ajgdata.acquire.writer import Acquired, acquire_session
from ajgdata.gripper.variation import Variation
from ajgdata.paths import Paths
from ajgdata.pipeline.progress import tell
from ajgdata.store.code_hash import code_hash
from ajgdata.store.files import line_of
from ajgdata.store.responses import ResponseStore
from ajgdata.store.sessions import check_one_source, list_sessions, read_dataset
from ajgdata.types import DataError, DatasetSpec, NotPossibleError, Recipe, describe, location
from ajgdata.types.recipe import EMPTY

if TYPE_CHECKING:
    from ajgdata.experiments.base import Render


def recipe_of(path: Path, spec: DatasetSpec) -> Recipe:
    """Return the recipe of the declaration at `path`. Raises DataError if it has none."""
    if spec.recipe is None:
        raise DataError(path, "has no recipe", "add one, or import recordings instead")
    return spec.recipe


def planned_grasps(
    path: Path, spec: DatasetSpec, sessions: Sequence[str]
) -> list[list[RecipeGrasp]]:
    """Return the grasps of each session of the recipe of `spec`, which is in the file `path`.

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
    """Raise DataError for a variation that cannot be."""
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
    for grasp in chain.from_iterable(planned):
        try:
            gripper.Scene.model_validate(grasp.setup)
        except ValidationError as error:
            raise describe(error, f"{path}: recipe, {grasp.object or EMPTY}") from None


def acquire_virtual(paths: Paths, dataset: str, session: str) -> Acquired:
    """Record the missing recordings of one session of a recipe, and print the outcome.

    Raises DataError for an invalid recipe, before anything is recorded.
    """
    spec, path = read_dataset(paths, dataset), paths.dataset(dataset)
    check_one_source(paths, spec, list_sessions(paths, dataset))
    recipe = recipe_of(path, spec)
    if session not in session_names(recipe):
        problem = f"the recipe of {dataset} has no such session"
        raise DataError(session, problem, f"use one of {', '.join(session_names(recipe))}")
    (grasps,) = planned_grasps(path, spec, [session])
    solver = ResponseStore(paths.responses)
    source = VirtualGripper(grasps[0].setup, solver, recipe.signal, spec.excitation)
    done = acquire_session(paths.session(dataset, session), source, grasps)
    counts = f"{done.recorded} recorded, {done.unchanged} already there"
    print(f"{counts}, {done.solved} scenes solved")
    held = [grasp for grasp in grasps if grasp.object and grasp.grasp_id not in done.skipped]
    if done.solved and held:
        show_savings(f"{dataset}/{session}", held[0])
    for grasp, reason in done.skipped.items():
        print(f"skipped {grasp}: {reason}")
    return done


def show_savings(session: str, grasp: RecipeGrasp) -> None:
    """Print what the plan of a grasp leaves out, the time that this saves, and its error."""
    # The solver, which Snakemake does not need while it parses.
    from ajgdata.pipeline.savings import measured_savings

    savings = measured_savings(gripper.Scene.model_validate(grasp.setup))
    if savings is not None:
        tell(f"          {session}: {savings} (measured on {grasp.grasp_id})")


def renderer(paths: Paths, dataset: str) -> Render:
    """Return a function that plays sounds in the scenes of simulated recordings (see `Render`).

    It uses their stored responses, signal chain and seeds of noise, so that the sound with which
    they were recorded gives the same samples.
    """
    spec = read_dataset(paths, dataset)
    recipe, samples_of = spec.recipe, dict[str, tuple[RecipeGrasp, int]]()
    if recipe is not None:
        sessions = session_names(recipe)
        planned = planned_grasps(paths.dataset(dataset), spec, sessions)
        for session, grasps in zip(sessions, planned, strict=True):
            for grasp in grasps:
                for sample in range(grasp.samples):
                    samples_of[f"{session}/{grasp.recording_id(sample)}"] = grasp, sample
    solver = ResponseStore(paths.responses)

    def render(names: Sequence[str], sounds: Sequence[np.ndarray]) -> Iterator[list[np.ndarray]]:
        if recipe is None or (unknown := [name for name in names if name not in samples_of]):
            which = f"recording {unknown[0]!r}" if recipe and unknown else dataset
            raise NotPossibleError(
                f"it needs a virtual data set: {which} was not simulated by a recipe"
            )
        source = VirtualGripper(samples_of[names[0]][0].setup, solver, recipe.signal)
        for name in names:
            yield [take.samples for take in source.record(*samples_of[name], sounds)]

    return render


def grasp_simulator(paths: Paths, dataset: str) -> GraspSimulator | None:
    """Return the simulator of the grasps of a data set; None for a data set without recipe."""
    spec = read_dataset(paths, dataset)
    if spec.recipe is None:
        return None
    return GraspSimulator(dataset, spec.recipe, spec.excitation, paths.responses)
