"""Play other sounds in the scenes of simulated recordings, for experiments."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ajgdata.acquire.recipe import Grasp, session_names
from ajgdata.acquire.virtual import VirtualGripper
from ajgdata.experiments.base import Render
from ajgdata.paths import Paths
from ajgdata.pipeline.recipes import planned_grasps
from ajgdata.store.responses import ResponseStore
from ajgdata.store.sessions import read_dataset
from ajgdata.types import NotPossibleError


def renderer(paths: Paths, dataset: str) -> Render:
    """Return what plays sounds in the scenes of a data set's recordings (see `Render`).

    Of the recordings that its recipe makes with the virtual gripper: their kept responses, signal
    chain and seeds of noise, so that the sound they were recorded with gives the same samples.
    """
    spec = read_dataset(paths, dataset)
    recipe, planned = spec.recipe, dict[str, tuple[Grasp, int]]()
    if recipe is not None:
        sessions = session_names(recipe)
        made = planned_grasps(paths.dataset(dataset), spec, sessions)
        for session, grasps in zip(sessions, made, strict=True):
            for grasp in grasps:
                for sample in range(grasp.samples):
                    planned[f"{session}/{grasp.recording_id(sample)}"] = grasp, sample
    solver = ResponseStore(paths.responses)

    def render(names: Sequence[str], sounds: Sequence[np.ndarray]) -> Iterator[list[np.ndarray]]:
        if recipe is None or (others := [name for name in names if name not in planned]):
            which = f"recording {others[0]!r}" if recipe and others else dataset
            raise NotPossibleError(
                f"it needs a virtual data set: {which} was not simulated by a recipe"
            )
        source = VirtualGripper(planned[names[0]][0].setup, solver, recipe.signal)
        for name in names:
            yield [take.samples for take in source.record(*planned[name], sounds)]

    return render
