"""Recipe -> sessions recorded with the virtual gripper, and their manifests."""

from __future__ import annotations

from collections.abc import Callable

from ajgdata.acquire.recipe import plan_session, session_names
from ajgdata.acquire.virtual import VirtualGripper
from ajgdata.acquire.writer import acquire_session
from ajgdata.paths import Paths
from ajgdata.store import manifest
from ajgdata.store.provenance import code_digest
from ajgdata.store.sessions import list_datasets, read_dataset
from ajgdata.types import DataError, Recipe


def with_recipe(paths: Paths) -> list[str]:
    """Names of the data sets that have a recipe."""
    return [name for name in list_datasets(paths) if read_dataset(paths, name).recipe]


def recipe_sessions(paths: Paths, dataset: str) -> list[str]:
    """Names of the sessions that the recipe of `dataset` makes."""
    return session_names(_recipe(paths, dataset))


def acquire_virtual(
    paths: Paths,
    dataset: str,
    session: str,
    started: Callable[[int], Callable[[], object]] = lambda total: lambda: None,
) -> tuple[int, int]:
    """Record what is missing of one session; returns (recorded, kept) counts.

    `started(total)` returns what is called once a recording.
    """
    recipe = _recipe(paths, dataset)
    if session not in session_names(recipe):
        raise DataError(session, "is not a session of the recipe", f"{session_names(recipe)}")
    grasps = plan_session(recipe, dataset, session, code_digest("gripper"))
    source = VirtualGripper(grasps[0].setup)
    counts = acquire_session(
        paths.session(dataset, session),
        source,
        grasps,
        progress=started(sum(grasp.samples for grasp in grasps)),
    )
    manifest.write(paths, dataset, session)
    return counts


def _recipe(paths: Paths, dataset: str) -> Recipe:
    recipe = read_dataset(paths, dataset).recipe
    if recipe is None:
        raise DataError(
            paths.dataset(dataset), "has no recipe", "add one, or import recordings instead"
        )
    return recipe
