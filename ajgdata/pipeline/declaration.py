"""What is wrong with a declaration that only other files can tell: data sets, tables, patterns."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator

from ajgdata.features.axes import RATE, differing_axes
from ajgdata.paths import Paths
from ajgdata.store.sessions import list_datasets, read_dataset, table_columns, whole_sessions
from ajgdata.types import RECORDING_COLUMNS, SESSION_COLUMNS, DataError, DatasetSpec

#: Columns that every store has.
ALWAYS = {*RECORDING_COLUMNS, *SESSION_COLUMNS, "session_id"}
#: What the features of a store follow from.
AXES = {"audio", "features"}


def check_declaration(paths: Paths, spec: DatasetSpec, virtual: Collection[str]) -> None:
    """Raise DataError for the first of `declaration_problems`, and say how many there are."""
    found = list(declaration_problems(paths, spec, virtual))
    if found:
        problem, fix = found[0]
        more = f" (and {len(found) - 1} more)" if found[1:] else ""
        raise DataError(paths.dataset(spec.name), problem + more, fix)


def declaration_problems(
    paths: Paths, spec: DatasetSpec, virtual: Collection[str]
) -> Iterator[tuple[str, str]]:
    """Yield problems, each with its fix: other data sets that are not there, or whose features or
    targets do not compare; columns that no table has; a pattern that is none.

    `virtual` are the sessions that the recipe makes. Tables are looked at only when all are there.
    """
    for where, other, target in _others(spec):
        yield from _other_problems(paths, spec, where, other, target)
    yield from _column_problems(paths, spec, virtual)
    try:
        pattern = re.compile(spec.imports.pattern)
    except re.error as error:
        yield f"imports.pattern: not a regular expression ({error})", "correct it"
        return
    if spec.imports.pattern not in ("", "starter-kit") and not pattern.groupindex:
        yield "imports.pattern has no named group", r"name the label: (?P<label>[^/]+)"


def _others(spec: DatasetSpec) -> Iterator[tuple[str, str, str]]:
    """Yield what needs which other data set, and the target that it must have, too ("" for
    none)."""
    for name, task in spec.tasks.items():
        yield from ((f"task {name}: tested on {one!r}", one, task.target) for one in task.others)


def _other_problems(
    paths: Paths, spec: DatasetSpec, where: str, other: str, target: str
) -> Iterator[tuple[str, str]]:
    if other == spec.name or other not in (known := list_datasets(paths)):
        which = "which is this data set itself" if other == spec.name else "no such data set"
        there = "" if other == spec.name else f"; declared here: {', '.join(known)}"
        yield f"{where}, {which}", f"correct the name{there}"
        return
    theirs = read_dataset(paths, other)
    if target and theirs.targets.get(target) != spec.targets[target]:
        yield f"{where}, which has no target {target!r} like this", "declare it there, or drop it"
    own, its = (one.model_dump(mode="json", include=AXES) for one in (spec, theirs))
    for name, here, there in differing_axes(own, its):
        yield (
            f"{where}, whose {name} is {there}, not {here}: their spectra do not compare",
            (
                "give both the same in their dataset.yaml"
                + (f" ({other}: other_rate: resample converts)" if name == RATE else "")
            ),
        )


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
