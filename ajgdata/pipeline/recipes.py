"""Recordings of the recipes of data sets, and other sounds in their scenes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ajgdata import gripper
from ajgdata.acquire.changed_grasps import GraspSimulator
from ajgdata.acquire.recipe import RecipeGrasp, session_names
from ajgdata.acquire.virtual import VirtualGripper
from ajgdata.acquire.writer import Acquired, acquire_session
from ajgdata.paths import Paths
from ajgdata.pipeline.planned_grasps import planned_grasps, recipe_of
from ajgdata.pipeline.progress import tell
from ajgdata.pipeline.savings import measured_savings
from ajgdata.store.responses import ResponseStore
from ajgdata.store.sessions import check_one_source, list_sessions, read_dataset
from ajgdata.types import DataError, NotPossibleError

if TYPE_CHECKING:
    from ajgdata.experiments.base import Render


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
