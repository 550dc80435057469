"""Data sets of a run of the workflow, with their sessions, tasks and models, and what is wrong with
their declarations that only other files can tell.

Called while Snakemake parses, in every one of its processes: light imports only, and nothing is
written.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from ajgdata.acquire.recipe import session_names, shares_scenes
from ajgdata.experiments import all_asked
from ajgdata.features.maker import RATE, differing_axes
from ajgdata.paths import Paths
from ajgdata.pipeline.recipes import planned_grasps
from ajgdata.report.paper import parse_paper
from ajgdata.store.report_files import read_paper
from ajgdata.store.sessions import (
    check_one_kind,
    dropped_sessions,
    incomplete_sessions,
    list_datasets,
    list_sessions,
    read_dataset,
    table_columns,
    whole_sessions,
)
from ajgdata.store.trouble import machine_trouble
from ajgdata.types import RECORDING_COLUMNS, SESSION_COLUMNS, DataError, DatasetSpec

#: Columns that every store has.
ALWAYS = {*RECORDING_COLUMNS, *SESSION_COLUMNS, "session_id"}
#: What the features of a store follow from.
AXES = {"audio", "features"}


@dataclass(frozen=True)
class DatasetPlan:
    """One data set of a run.

    `virtual` are the sessions that its recipe makes.
    """

    spec: DatasetSpec
    virtual: tuple[str, ...]
    sessions: tuple[str, ...]


def plan(
    paths: Paths, only: Sequence[str] | None = None, *, check: bool = False
) -> dict[str, DatasetPlan]:
    """Return data sets by name: those of `only`, else every one that has sessions or a recipe.

    With `check` every scene is planned of sessions that are not recorded yet. Data sets that a task
    is tested on come with it. Raises DataError for a declaration that cannot be used (with `check`:
    also for a scene that the gripper does not know, and for what only other files tell, see
    `declaration_problems`) and if there is nothing to run.
    """
    names = list(only) if only is not None else list_datasets(paths)
    plans = {}
    for name in names:  # which grows
        spec = read_dataset(paths, name)
        virtual = tuple(session_names(spec.recipe)) if spec.recipe else ()
        if check:
            _check_declaration(paths, spec, virtual)
        names += sorted(_others(spec) - set(names))
        _check_paper(paths, spec)
        list(all_asked(spec, paths.dataset(name)))
        to_record = incomplete_sessions(paths, name, virtual)
        if check and to_record:
            planned_grasps(paths.dataset(name), spec, sorted(to_record))
        recorded = set(list_sessions(paths, name)) - dropped_sessions(paths, name, virtual)
        if check:
            check_one_kind(paths, spec, recorded)
        if sessions := sorted({*virtual, *recorded}):
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


class Declared(dict[Any, Any]):
    """What the data sets of a run declare, by key; another key ends the run with one line.

    Snakemake ignores other errors if the file exists, and reports that nothing is to be done.
    """

    def __missing__(self, key: str | tuple[str, ...]) -> None:
        name = key if isinstance(key, str) else " ".join(key)
        raise SystemExit(
            f"{name}: not declared in the data sets of this run; remove its results, or declare it"
        )


@contextmanager
def errors_stop_snakemake(where: str) -> Iterator[None]:
    """Turn any error into a SystemExit with one line.

    Snakemake ignores exceptions of an input function if the outputs exist, and then reports that
    nothing is to be done. It does not ignore SystemExit.
    """
    try:
        yield
    except Exception as error:
        known = error if isinstance(error, DataError) else machine_trouble(error)
        problem = f"cannot determine what is out of date ({type(error).__name__}: {error})"
        fix = "correct this error, then run again"
        raise SystemExit(str(known or DataError(where, problem, fix))) from error


def solved_by(plans: Mapping[str, DatasetPlan], dataset: str, session: str) -> str | None:
    """Return the data set whose session of this name is to be recorded before that of `dataset`.

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


def published(plans: Collection[str], wanted: Sequence[str] | None) -> list[str]:
    """Return the data sets of a run that are published: those of `wanted`, else all."""
    if unknown := sorted(set(wanted or ()) - set(plans)):
        problem = f"publish: {unknown[0]!r} is no data set of this run"
        raise DataError("config", problem, f"there are {', '.join(plans)}")
    return [name for name in plans if wanted is None or name in wanted]


def _others(spec: DatasetSpec) -> set[str]:
    """Return the data sets that tasks of `spec` are tested on."""
    return {other for task in spec.tasks.values() for other in task.others}


def _check_paper(paths: Paths, spec: DatasetSpec) -> None:
    """Raise DataError for an unknown figure of the paper: the report would fail after the work."""
    if not (named := {name for task in spec.tasks.values() for name in task.papers.values()}):
        return
    known = parse_paper(read_paper(paths))
    if unknown := sorted(named - set(known)):
        problem = f"tasks: the paper has no figure {unknown[0]!r}"
        raise DataError(paths.dataset(spec.name), problem, f"it has {', '.join(known)}")


def _how_to_import(name: str) -> str:
    return f"get some with `ajgdata import FOLDER --dataset {name}`"


def _check_declaration(paths: Paths, spec: DatasetSpec, virtual: Collection[str]) -> None:
    """Raise DataError for the first of `declaration_problems`, with their number."""
    if problems := list(declaration_problems(paths, spec, virtual)):
        problem, fix = problems[0]
        more = f" (and {len(problems) - 1} more)" if problems[1:] else ""
        raise DataError(paths.dataset(spec.name), problem + more, fix)


def declaration_problems(
    paths: Paths, spec: DatasetSpec, virtual: Collection[str]
) -> Iterator[tuple[str, str]]:
    """Yield problems, each with its fix: other data sets that are not there, or whose features or
    targets do not compare; columns that no table has; a pattern that is none.

    `virtual` are the sessions that the recipe makes. Tables are looked at only when all are there.
    """
    for name, task in spec.tasks.items():
        for other in task.others:
            where = f"task {name}: tested on {other!r}"
            yield from _other_problems(paths, spec, where, other, task.target)
    yield from _column_problems(paths, spec, virtual)
    try:
        pattern = re.compile(spec.imports.pattern)
    except re.error as error:
        yield f"imports.pattern: not a regular expression ({error})", "correct it"
        return
    if spec.imports.pattern not in ("", "starter-kit") and not pattern.groupindex:
        yield "imports.pattern has no named group", r"name the label: (?P<label>[^/]+)"


def _other_problems(
    paths: Paths, spec: DatasetSpec, where: str, other: str, target: str
) -> Iterator[tuple[str, str]]:
    if other == spec.name or other not in (known := list_datasets(paths)):
        which = "which is this data set itself" if other == spec.name else "no such data set"
        there = "" if other == spec.name else f"; declared here: {', '.join(known)}"
        yield f"{where}, {which}", f"correct the name{there}"
        return
    theirs = read_dataset(paths, other)
    if theirs.targets.get(target) != spec.targets[target]:
        yield f"{where}, which has no target {target!r} like this", "declare it there, or drop it"
    own, its = (one.model_dump(mode="json", include=AXES) for one in (spec, theirs))
    for name, here, there in differing_axes(own, its):
        convert = f" ({other}: other_rate: resample converts)" if name == RATE else ""
        problem = f"{where}, whose {name} is {there}, not {here}: their spectra do not compare"
        yield problem, f"give both the same in their dataset.yaml{convert}"


def _column_problems(
    paths: Paths, spec: DatasetSpec, virtual: Collection[str]
) -> Iterator[tuple[str, str]]:
    sessions = whole_sessions(paths, spec.name, virtual)
    columns = table_columns(paths, spec.name, sessions)
    if not columns or set(virtual) - set(sessions):
        return
    for name, task in spec.tasks.items():
        if not task.optional:
            yield from _absent(f"task {name}", columns, target=task.target, groups=task.groups)
    for name, one in spec.embeddings.items():
        if not one.optional:
            named = {"instance": one.instance, "groups": one.groups, "target": one.target}
            yield from _absent(f"embedding {name}", columns, **named, category=one.category)


def _absent(where: str, columns: set[str], **named: str) -> Iterator[tuple[str, str]]:
    for key, column in named.items():
        if column and column not in columns | ALWAYS:
            fix = "add it to recordings.csv, or correct the name"
            yield f"{where}: {key}: no session has a column {column!r}", fix
