"""What a run of the workflow is about: data sets, their sessions, tasks and models.

Called while Snakemake parses, in every one of its processes: light imports only, and nothing is
written unless `refresh` is asked for.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from ajgdata.acquire.recipe import session_names, shares_scenes
from ajgdata.paths import Paths, Tree
from ajgdata.pipeline.progress import when_slow
from ajgdata.pipeline.recipes import planned_grasps
from ajgdata.report.paper import parse_paper
from ajgdata.store import manifest
from ajgdata.store.files import json_bytes, link_or_copy, write_if_changed
from ajgdata.store.report_files import read_paper
from ajgdata.store.sessions import (
    dropped_sessions,
    incomplete_sessions,
    list_datasets,
    list_sessions,
    read_dataset,
    whole_sessions,
)
from ajgdata.types import DataError, DatasetSpec


@dataclass(frozen=True)
class DatasetPlan:
    """One data set of a run. `virtual` are the sessions that its recipe makes."""

    spec: DatasetSpec
    virtual: tuple[str, ...]
    sessions: tuple[str, ...]


def plan(
    paths: Paths, only: Sequence[str] | None = None, *, refresh: bool = False
) -> dict[str, DatasetPlan]:
    """Data sets by name: those of `only`, else every one that has sessions or a recipe.

    With `refresh` the manifests and the scenes of virtual sessions are brought up to date first.
    Data sets that a task is tested on, or an embedding is based on, come with it. Raises DataError
    for a declaration that cannot be used and when there is nothing to run.
    """
    names = list(only) if only is not None else list_datasets(paths)
    plans = {}
    for name in names:  # which grows
        spec = read_dataset(paths, name)
        names += _tested_on(paths, spec, names)
        _check_paper(paths, spec)
        virtual = tuple(session_names(spec.recipe)) if spec.recipe else ()
        if refresh:
            if virtual:
                write_scenes(paths, spec, virtual)
            dropped = dropped_sessions(paths, name, virtual)
            unready = {*incomplete_sessions(paths, name, virtual), *dropped}
            looking = partial(when_slow, what=f"reading new recordings of {name}")
            manifest.refresh(paths, name, incomplete=unready, each=looking)
            _notice_removed(paths, name)
        held = set(list_sessions(paths, name)) - dropped_sessions(paths, name, virtual)
        if sessions := sorted({*virtual, *held}):
            plans[name] = DatasetPlan(spec, virtual, tuple(sessions))
        elif only is not None:
            raise DataError(paths.sessions(name), "holds no sessions", _how_to_import(name))
    for name, one in plans.items():
        for missing in sorted(_others(one.spec) - set(plans)):
            problem = f"needs the data set {missing!r}, which holds no sessions"
            raise DataError(paths.dataset(name), problem, _how_to_import(missing))
    if not plans:
        problem = "no data set here has recordings or a recipe"
        raise DataError(paths.datasets, problem, _how_to_import("NAME"))
    return plans


def recorded_sessions(paths: Paths, spec: DatasetSpec) -> list[str]:
    """Sessions of a data set that are on disk, whole, and asked for."""
    virtual = tuple(session_names(spec.recipe)) if spec.recipe else ()
    return whole_sessions(paths, spec.name, virtual)


def solved_by(plans: Mapping[str, DatasetPlan], dataset: str, session: str) -> str | None:
    """The data set whose session of this name is to be recorded before that of `dataset`.

    Its scenes are the same: side by side both would be solved. It is the data set whose grasps the
    others make again, or the first of those that make them.
    """
    recipe = plans[dataset].spec.recipe
    if recipe is None:
        return None
    same = [
        name
        for name, one in plans.items()
        if session in one.virtual
        and one.spec.recipe
        and shares_scenes(dataset, recipe, name, one.spec.recipe)
    ]
    origin = recipe.grasps_of or dataset
    first = origin if origin in same else same[0]
    return None if dataset == first else first


def _notice_removed(paths: Paths, dataset: str) -> None:
    """What people get is not what Snakemake looks at: see to it that it is there, or made again."""
    if paths.merged(dataset).is_file() and not paths.features(dataset).is_file():
        link_or_copy(paths.merged(dataset), paths.features(dataset))
    if not (paths.published(dataset) / Tree.SUMS).is_file():
        paths.receipt(dataset).unlink(missing_ok=True)


def published(plans: Collection[str], wanted: Sequence[str] | None) -> list[str]:
    """Data sets of a run that are handed on: those of `wanted`, else all."""
    if unknown := sorted(set(wanted or ()) - set(plans)):
        problem = f"publish: {unknown[0]!r} is no data set of this run"
        raise DataError("config", problem, f"there are {', '.join(plans)}")
    return [name for name in plans if wanted is None or name in wanted]


def _others(spec: DatasetSpec) -> set[str]:
    """Data sets that those of `spec` are tested on, or transferred from."""
    tested = {other for task in spec.tasks.values() for other in task.others}
    return tested | {one.base for one in spec.embeddings.values() if one.base}


def _tested_on(paths: Paths, spec: DatasetSpec, known: Sequence[str]) -> list[str]:
    """Further data sets that the tasks of `spec` need; DataError if one lacks a target."""
    for name, task in spec.tasks.items():
        for other in task.others:
            targets = read_dataset(paths, other).targets
            if other == spec.name or targets.get(task.target) != spec.targets[task.target]:
                lacks = f"which has no target {task.target!r} like this"
                problem = f"task {name}: tested on {other!r}, {lacks}"
                raise DataError(paths.dataset(spec.name), problem, "declare it there, or drop it")
    return sorted(_others(spec) - set(known))


def _check_paper(paths: Paths, spec: DatasetSpec) -> None:
    """A report that names an unknown figure of the paper would fail after all the work is done."""
    if not (named := {name for task in spec.tasks.values() for name in task.papers.values()}):
        return
    known = parse_paper(read_paper(paths))
    if unknown := sorted(named - set(known)):
        problem = f"tasks: the paper has no figure {unknown[0]!r}"
        raise DataError(paths.dataset(spec.name), problem, f"it has {', '.join(known)}")


def _how_to_import(name: str) -> str:
    return f"get some with `ajgdata import FOLDER --dataset {name}`"


def write_scenes(paths: Paths, spec: DatasetSpec, virtual: Sequence[str]) -> None:
    """Write what each virtual session shall hold, if that changed. Raises DataError for a recipe
    with a scene that the gripper does not know."""
    planned = planned_grasps(paths.dataset(spec.name), spec, virtual)
    for session, grasps in zip(virtual, planned, strict=True):
        content = [{**vars(grasp), "targets": dict(grasp.targets)} for grasp in grasps]
        write_if_changed(paths.scenes(spec.name, session), json_bytes(content))
