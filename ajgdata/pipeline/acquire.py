"""Recipe -> sessions recorded by the virtual gripper."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ajgdata.acquire.recipe import session_names
from ajgdata.acquire.virtual import VirtualGripper
from ajgdata.acquire.writer import Acquired, acquire_session
from ajgdata.paths import Paths
from ajgdata.pipeline.progress import Started, progress_lines
from ajgdata.pipeline.recipes import planned_grasps, recipe_of
from ajgdata.store.responses import ResponseStore
from ajgdata.store.sessions import check_one_kind, list_sessions, read_dataset
from ajgdata.types import DataError


def acquire_virtual(paths: Paths, dataset: str, session: str) -> Acquired:
    """Record the missing recordings of one session in this process, and print the outcome.

    Prints ten lines of progress on the terminal: jobs run side by side, so that bars would
    overwrite each other.
    """
    started = progress_lines(f"recording {dataset}/{session}")
    ((_, _, acquired),) = acquire_all(paths, [(dataset, session)], started)
    counts = f"{acquired.recorded} recorded, {acquired.kept} already there"
    print(f"{counts}, {acquired.solved} scenes solved")
    for grasp, reason in acquired.skipped.items():
        print(f"skipped {grasp}: {reason}")
    return acquired


def acquire_all(
    paths: Paths,
    sessions: Sequence[tuple[str, str]],
    started: Started = lambda total: lambda: None,
) -> Iterator[tuple[str, str, Acquired]]:
    """Record what is missing of `sessions`, pairs of data set and session.

    Each session is yielded when it is on disk. Raises
    DataError, before anything is recorded, for what a recipe gets wrong.
    """
    specs = {dataset: read_dataset(paths, dataset) for dataset in {name for name, _ in sessions}}
    for name, spec in specs.items():
        check_one_kind(paths, spec, list_sessions(paths, name))
    plans = []
    for dataset, session in sessions:
        recipe = recipe_of(paths.dataset(dataset), specs[dataset])
        if session not in session_names(recipe):
            problem = f"the recipe of {dataset} has no such session"
            raise DataError(session, problem, f"it has {', '.join(session_names(recipe))}")
        (grasps,) = planned_grasps(paths.dataset(dataset), specs[dataset], [session])
        plans.append((dataset, session, recipe, grasps))
    advance = started(sum(grasp.samples for *_, grasps in plans for grasp in grasps))
    solver = ResponseStore(paths.responses)
    for dataset, session, recipe, grasps in plans:
        played = specs[dataset].excitation
        source = VirtualGripper(grasps[0].setup, solver, recipe.signal, played)
        folder = paths.session(dataset, session)
        yield dataset, session, acquire_session(folder, source, grasps, progress=advance)
