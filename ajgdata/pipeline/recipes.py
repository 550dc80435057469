"""Simulated recordings of recipes, and simulations of other sounds and grasps in their scenes."""

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
from ajgdata.store.responses import ResponseStore
from ajgdata.store.sessions import check_one_source, list_sessions, read_dataset
from ajgdata.types import DataError, NotPossibleError

if TYPE_CHECKING:
    from ajgdata.experiments.base import Render

_NOT_SIMULATED = "it needs a virtual data set: {} was not simulated by a recipe"


def acquire_virtual(paths: Paths, dataset: str, session: str) -> Acquired:
    """Record the missing recordings of one session of a recipe, and print the outcome.

    Raises DataError for an invalid recipe, before anything is recorded.
    """
    spec = read_dataset(paths, dataset)
    path = paths.dataset(dataset)
    check_one_source(paths, spec, list_sessions(paths, dataset))
    recipe = recipe_of(path, spec)
    if session not in session_names(recipe):
        problem = f"the recipe of {dataset} has no such session"
        raise DataError(session, problem, f"use one of {', '.join(session_names(recipe))}")
    (grasps,) = planned_grasps(path, spec, [session])
    solver = ResponseStore(paths.responses)
    source = VirtualGripper(grasps[0].setup, solver, recipe.signal, spec.excitation, paths.root)
    acquired = acquire_session(paths.session(dataset, session), source, grasps)
    counts = f"{acquired.recorded} recorded, {acquired.unchanged} already there"
    print(f"{counts}, {acquired.solved} scenes solved")
    simulated = [g for g in grasps if g.object and g.grasp_id not in acquired.skipped]
    if acquired.solved and simulated:
        _show_savings(f"{dataset}/{session}", simulated[0])
    for grasp, reason in acquired.skipped.items():
        print(f"skipped {grasp}: {reason}")
    return acquired


def _show_savings(session: str, grasp: RecipeGrasp) -> None:
    """Print the omitted physics of a grasp's scene, the time that this saves, and its error."""
    from ajgdata.pipeline.savings import measured_savings  # experiments need no simulation

    savings = measured_savings(gripper.Scene.model_validate(grasp.setup))
    if savings is not None:
        tell(f"          {session}: {savings} (measured on {grasp.grasp_id})")


def renderer(paths: Paths, dataset: str) -> Render:
    """Return a function that plays sounds in the scenes of simulated recordings (see `Render`).

    It uses the same responses, signal chain and seeds of noise as the recordings. The sound with
    which a recording was made therefore gives the same samples.
    """
    spec = read_dataset(paths, dataset)
    recipe = spec.recipe
    samples_of: dict[str, tuple[RecipeGrasp, int]] = {}
    if recipe is not None:
        sessions = session_names(recipe)
        planned = planned_grasps(paths.dataset(dataset), spec, sessions)
        for session, grasps in zip(sessions, planned, strict=True):
            for grasp in grasps:
                for sample in range(grasp.samples):
                    samples_of[f"{session}/{grasp.recording_id(sample)}"] = grasp, sample
    solver = ResponseStore(paths.responses)

    def render(names: Sequence[str], sounds: Sequence[np.ndarray]) -> Iterator[list[np.ndarray]]:
        """Yield the samples (n,) of each named recording with each sound."""
        if recipe is None:
            raise NotPossibleError(_NOT_SIMULATED.format(dataset))
        for name in names:
            if name not in samples_of:
                raise NotPossibleError(_NOT_SIMULATED.format(f"recording {name!r}"))
        source = VirtualGripper(samples_of[names[0]][0].setup, solver, recipe.signal)
        for name in names:
            yield [take.samples for take in source.record(*samples_of[name], sounds)]

    return render


def grasp_simulator(paths: Paths, dataset: str) -> GraspSimulator | None:
    """Return the simulator of the grasps of a data set; None for a data set without a recipe."""
    spec = read_dataset(paths, dataset)
    if spec.recipe is None:
        return None
    return GraspSimulator(dataset, spec.recipe, spec.excitation, paths.responses, paths.root)
