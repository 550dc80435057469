"""Recipe -> sessions recorded by the source that it names."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path

from ajgdata.acquire.recipe import session_names
from ajgdata.acquire.source import Source
from ajgdata.acquire.writer import Acquired, acquire_session
from ajgdata.paths import Paths
from ajgdata.pipeline.progress import Started, progress_lines
from ajgdata.pipeline.recipes import planned_grasps, recipe_of
from ajgdata.store.sessions import check_one_kind, list_sessions, read_dataset
from ajgdata.types import SOURCES, DataError
from ajgdata.types.registry import resolve


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
    wanted: Sequence[tuple[str, str]],
    started: Started = lambda total: lambda: None,
) -> Iterator[tuple[str, str, Acquired]]:
    """Record what is missing of the sessions `wanted`, pairs of data set and session.

    Each session is yielded when it is on disk. Raises
    DataError, before anything is recorded, for what a recipe gets wrong.
    """
    specs = {dataset: read_dataset(paths, dataset) for dataset in {name for name, _ in wanted}}
    for name, spec in specs.items():
        check_one_kind(paths, spec, list_sessions(paths, name))
    plans = []
    for dataset, session in wanted:
        recipe = recipe_of(paths.dataset(dataset), specs[dataset])
        if session not in session_names(recipe):
            known = ", ".join(session_names(recipe))
            raise DataError(
                session, f"the recipe of {dataset} has no such session", f"it has {known}"
            )
        (grasps,) = planned_grasps(paths.dataset(dataset), specs[dataset], [session])
        plans.append((dataset, session, recipe, grasps))
    advance = started(sum(grasp.samples for *_, grasps in plans for grasp in grasps))
    with ExitStack() as stack:
        makers = {
            name: stack.enter_context(_opened(name, paths.responses))
            for name in dict.fromkeys(recipe.source for _, _, recipe, _ in plans)
        }
        for dataset, session, recipe, grasps in plans:
            played = specs[dataset].excitation
            source = makers[recipe.source](grasps[0].setup, recipe.signal, played)
            folder = paths.session(dataset, session)
            acquired = acquire_session(folder, source, grasps, progress=advance)
            yield dataset, session, acquired


def _opened(name: str, folder: Path) -> AbstractContextManager[Callable[..., Source]]:
    """Return what opens a source by its name. Raises DataError if it cannot be imported."""
    try:
        return resolve(SOURCES[name].open)(folder)
    except ValueError as error:
        raise DataError("recipe.source", str(error), "the recipe may name another") from None
