"""Files of data sets and sessions: dataset.yaml, session.yaml and recordings.csv."""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Collection, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ajgdata.paths import RECORDINGS_FILE, SESSION_FILE, Paths
from ajgdata.store.changes import read_changes, with_changes
from ajgdata.store.files import (
    check_yaml_format,
    csv_bytes,
    line_of,
    numbered_rows,
    plain_text,
    read_model,
    read_yaml,
    sha256_of,
    write_if_changed,
    yaml_bytes,
)
from ajgdata.store.variants import with_variants
from ajgdata.types import (
    NAME_PATTERN,
    RECORDING_COLUMNS,
    SEGMENT_COLUMNS,
    TABLE_ROW,
    WHOLE_FILE,
    DataError,
    DatasetSpec,
    Finding,
    Recording,
    Session,
    SoundFile,
    checked_name,
    describe,
    is_reserved,
)
from ajgdata.types.base import overridden
from ajgdata.types.formats import DATASET_FORMAT, FORMAT_KEY, SESSION_FORMAT

#: First line of dataset.yaml: an editor completes and explains its keys with this schema.
SCHEMA_LINE = "# yaml-language-server: $schema=../dataset.schema.json"
#: Keys that a data set with `from` does not take over from the other data set.
NOT_INHERITED = ("tasks", "embeddings", "level", "doi")
#: Columns whose text is compared, as labels are.
_TEXTS = ("grasp_id", "placement_id", "object", "quality")


def list_datasets(paths: Paths) -> list[str]:
    """Return the names of the declared data sets, sorted."""
    return sorted(file.parent.name for file in paths.datasets.glob("*/dataset.yaml"))


def check_declared(paths: Paths, dataset: str) -> None:
    """Raise DataError if there is no data set of this name; the fix has the most similar names."""
    path = paths.dataset(checked_name(dataset))
    if path.is_file():
        return
    by_lower = {name.lower(): name for name in list_datasets(paths)}
    if not by_lower:
        fix = "add a data set with `ajgdata import FOLDER`, or run `ajgdata` in another folder"
        raise DataError(path, "no such data set", fix)
    close = difflib.get_close_matches(dataset.lower(), by_lower)
    proposed = [by_lower[name] for name in close] or list(by_lower.values())
    raise DataError(path, "no such data set", f"use one of {', '.join(proposed)}")


def how_to_get_sessions(paths: Paths, dataset: str) -> str:
    """Return the fix for a data set without recordings: the commands that add some."""
    if paths.source(dataset).is_file():
        return f"get some with `ajgdata fetch {dataset}`"
    return (
        f"get some with `ajgdata import FOLDER --dataset {dataset}` or `ajgdata record {dataset}`"
    )


def read_dataset(paths: Paths, dataset: str) -> DatasetSpec:
    """Return the declaration of a data set. Raises DataError with file, key, value and fix."""
    check_declared(paths, dataset)
    path = paths.dataset(dataset)
    spec = read_declaration(path)
    if spec.name != dataset:
        where = f"{path}:{line_of(path, ['name'])}"
        raise DataError(where, f"name = {spec.name!r}", f"use its folder's name, {dataset!r}")
    return with_variants(paths, _with_checksum_of_sound(paths, spec))


def _with_checksum_of_sound(paths: Paths, spec: DatasetSpec) -> DatasetSpec:
    """Return a declaration in which the file of the played sound has its checksum.

    A published data set has the checksum, but the file itself may be missing.
    """
    sound = spec.excitation
    if not isinstance(sound, SoundFile) or sound.sha256:
        return spec
    path = inside(paths.root, sound.file)
    if not path.is_file():
        return spec
    present = sound.model_copy(update={"sha256": sha256_of(path.read_bytes())})
    return spec.model_copy(update={"excitation": present})


def require_waveforms(spec: DatasetSpec, where: object) -> None:
    """Raise DataError, for the command or function `where`, if recordings have no waveform."""
    if not spec.features.needs_waveform:
        problem = f"{spec.name} is a table of features, and has no recordings of sound"
        raise DataError(where, problem, "name a data set with recordings")


def read_declaration(path: Path) -> DatasetSpec:
    """Return a declaration from any file. Raises DataError with file, line, key, value and fix.

    A declaration with the key `from` is derived from another one, see `_derived`.
    """
    content = read_yaml(path)
    check_yaml_format(path, content, DATASET_FORMAT)
    if "from" in content:
        content = _derived(path, content)
    return read_model(path, DatasetSpec, content)


def _derived(path: Path, content: dict[str, Any]) -> dict[str, Any]:
    """Return the declaration that `from` names, with the keys of `content` in it.

    The purpose of a derived data set is to test models of the other one. It does not inherit tasks
    and embeddings, and its recipe has the same grasps.
    """
    origin = content["from"]
    where = f"{path}:{line_of(path, ['from'])}"
    file = path.parent.parent / str(origin) / path.name
    if not isinstance(origin, str) or not NAME_PATTERN.fullmatch(origin) or not file.is_file():
        raise DataError(where, f"from = {origin!r}: there is no {file}", "name a data set")
    base = read_yaml(file)
    check_yaml_format(file, base, DATASET_FORMAT)
    if "from" in base:
        raise DataError(where, f"from = {origin!r} is itself derived", f"name {base['from']}")
    recipe = {"recipe": {"grasps_of": origin}} if "recipe" in base else {}
    inherited = {key: value for key, value in base.items() if key not in NOT_INHERITED}
    differences = {key: value for key, value in content.items() if key != "from"}
    return overridden(overridden(inherited, recipe), differences)


def write_dataset(paths: Paths, spec: DatasetSpec) -> Path:
    """Write a declaration: the address of its schema, the version of its format, and all keys that
    differ from the defaults."""
    path = paths.dataset(spec.name)
    content = spec.model_dump(mode="json", exclude_defaults=True)
    settings = yaml_bytes({FORMAT_KEY: DATASET_FORMAT.version, **content})
    write_if_changed(path, f"{SCHEMA_LINE}\n".encode() + settings)
    return path


def list_sessions(paths: Paths, dataset: str) -> list[str]:
    """Return the names of the session folders of a data set, complete or not; not hidden folders.

    Raises DataError for a folder whose name is not valid for a session.
    """
    folder = paths.sessions(dataset)
    if not folder.is_dir():
        return []
    names = sorted(p.name for p in folder.iterdir() if p.is_dir() and p.name[0] != ".")
    for name in names:
        if not NAME_PATTERN.fullmatch(name):
            fix = "rename it (letters, digits, _ and -) or move it elsewhere"
            raise DataError(folder / name, "a session cannot have this name", fix)
    return names


def incomplete_sessions(paths: Paths, dataset: str, virtual: Collection[str]) -> set[str]:
    """Return the sessions of a recipe (`virtual`) that are not recorded yet."""
    return {s for s in virtual if not (paths.session(dataset, s) / SESSION_FILE).is_file()}


def dropped_sessions(paths: Paths, dataset: str, virtual: Collection[str]) -> set[str]:
    """Return the simulated sessions on disk that are not in the recipe (`virtual`).

    They remain on disk, and no run uses them. A data set without a recipe has none of them.
    """
    if not virtual:
        return set()
    dropped = set()
    for name in set(list_sessions(paths, dataset)) - set(virtual):
        try:
            session = read_session(paths.session(dataset, name))
        except DataError:
            continue  # reported as a finding, like any broken session
        if session.source == "virtual":
            dropped.add(name)
    return dropped


def check_one_source(
    paths: Paths, spec: DatasetSpec, sessions: Collection[str], adding: bool | None = None
) -> None:
    """Raise DataError if some sessions of a data set are simulated and others recorded.

    Figures state one source for all sessions. Sessions of the recipe are simulated, also before
    they exist. `adding` is whether a session to be added is simulated; None without a session.
    Sessions that cannot be read are ignored here, and reported by the checks.
    """
    sources = {True: "its recipe"} if spec.recipe else {}
    for name in sorted(sessions):
        with suppress(DataError):
            is_simulated = read_session(paths.session(spec.name, name)).is_simulated
            sources.setdefault(is_simulated, f"session {name}")
    if adding is not None:
        sources.setdefault(adding, "what is to be added")
    if len(sources) > 1:
        problem = (
            f"{sources[True]} is simulated, {sources[False]} is recorded: both in one data set"
        )
        if adding is None:
            fix = f"move {sources[False].removeprefix('session ')} below a data set of its own"
        else:
            fix = "choose another data set for it"
        raise DataError(paths.sessions(spec.name), problem, fix)


def whole_sessions(paths: Paths, dataset: str, virtual: Collection[str]) -> list[str]:
    """Return the sessions on disk that are complete and that a run uses."""
    incomplete = incomplete_sessions(paths, dataset, virtual)
    dropped = dropped_sessions(paths, dataset, virtual)
    return sorted(set(list_sessions(paths, dataset)) - incomplete - dropped)


def read_session(folder: Path) -> Session:
    """Return session.yaml of a session folder. Raises DataError with file, line and fix."""
    path = folder / SESSION_FILE
    if not path.is_file():
        raise DataError(path, "there is no such file", "finish the import or acquisition")
    content = read_yaml(path)
    check_yaml_format(path, content, SESSION_FORMAT)
    session = read_model(path, Session, content)
    if session.session_id != folder.name:
        problem = f"session_id = {session.session_id!r}"
        raise DataError(path, problem, f"use its folder's, {folder.name!r}")
    return session


def check_session_format(folder: Path) -> None:
    """Raise FormatError if another version of ajgdata wrote the session in `folder`.

    Call this function before files of the session are replaced. A session.yaml that does not exist,
    or is not valid YAML, states no version.
    """
    path = folder / SESSION_FILE
    try:
        content = read_yaml(path)
    except DataError:
        return
    check_yaml_format(path, content, SESSION_FORMAT)


def count_recordings(table: Path) -> int:
    """Return the number of lines below the header of a recordings.csv; 0 if it does not exist."""
    if not table.is_file():
        return 0
    return max(0, len(table.read_bytes().splitlines()) - 1)


def read_recordings(folder: Path) -> tuple[list[Recording], list[Finding]]:
    """Return the recordings of a session with the changes of people, and errors of unusable rows.

    They are the rows of `read_table` with the changes of changes.jsonl. Raises DataError if one of
    both files cannot be read.
    """
    recordings, findings = read_table(folder)
    log = read_changes(folder)
    if log.changes:
        recordings = [with_changes(recording, log) for recording in recordings]
    return recordings, findings


def read_table(folder: Path, only: str = "") -> tuple[list[Recording], list[Finding]]:
    """Return rows of recordings.csv, sorted by recording_id, and an error for each unusable row.

    The rows are those to write again: they have no changes of people. With `only`, they are the
    rows with this recording_id. Labels are converted to plain text (see `plain_text`). Raises
    DataError if the table itself cannot be read: the file or a column is missing, or the name of a
    column is reserved.
    """
    path = folder / RECORDINGS_FILE
    header, rows = numbered_rows(path, ("recording_id", "file", "grasp_id"))
    extra = [column for column in header if column not in RECORDING_COLUMNS]
    for column in extra:
        if is_reserved(column) or not NAME_PATTERN.fullmatch(column):
            fix = "rename it (letters, digits, _ and -; not the name of a standard column)"
            raise DataError(path, f"no label can have the name {column!r}", fix)
    recordings = []
    findings = []
    texts = [column for column in header if column in _TEXTS or column in extra]
    for line, cells in rows:
        if only and cells["recording_id"] != only:
            continue
        row = {**cells, **{column: plain_text(cells[column]) for column in texts}}
        known = {
            column: row[column]
            for column in RECORDING_COLUMNS
            if column in row and (row[column] or column == "sha256")
        }
        try:
            labels = {column: row[column] for column in extra}
            recordings.append(Recording.model_validate({**known, "labels": labels}))
        except ValidationError as error:
            invalid = describe(error, f"row {line}")
            problem = f"{RECORDINGS_FILE} row {line}: {invalid.problem}"
            names = (folder.name, row["recording_id"] or f"row {line}", row["file"])
            findings.append(Finding(*names, "error", "bad_row", problem, invalid.fix))
    counts = Counter(recording.recording_id for recording in recordings)
    unique = []
    for recording in recordings:
        count = counts[recording.recording_id]
        if count == 1:
            unique.append(recording)
            continue
        problem = f"{count} rows share this recording_id"
        fix = "give each row its own"
        names = (folder.name, recording.recording_id, recording.file)
        findings.append(Finding(*names, "error", "duplicate_id", problem, fix))
    return sorted(unique, key=lambda recording: recording.recording_id), findings


def write_recordings(folder: Path, recordings: Sequence[Recording]) -> None:
    """Write recordings.csv if its content changed.

    A session whose placements are unknown has no column for them, a session without segments has no
    columns for times, and a session without an imported table has no column for its rows.
    """
    absent = set()
    if not any(recording.placement_id for recording in recordings):
        absent.add("placement_id")
    if all(recording.segment == WHOLE_FILE for recording in recordings):
        absent.update(SEGMENT_COLUMNS)
    if all(recording.table_row is None for recording in recordings):
        absent.add(TABLE_ROW)
    standard = [name for name in RECORDING_COLUMNS if name not in absent]
    labels = sorted({column for recording in recordings for column in recording.labels})
    rows = (
        {**recording.model_dump(exclude={"labels", *absent}), **recording.labels}
        for recording in recordings
    )
    write_if_changed(folder / RECORDINGS_FILE, csv_bytes([*standard, *labels], rows))


def write_session(folder: Path, session: Session, recordings: Sequence[Recording]) -> None:
    """Write recordings.csv, then session.yaml: a folder without session.yaml is incomplete.

    A session.yaml that only lacks the version of its format is not written again, because a new
    time of the file would make Snakemake compute results again.
    """
    write_recordings(folder, recordings)
    path = folder / SESSION_FILE
    content = session.model_dump(mode="json", exclude_none=True)
    unstated = {key: value for key, value in content.items() if key != FORMAT_KEY}
    if not path.is_file() or path.read_bytes() != yaml_bytes(unstated):
        write_if_changed(path, yaml_bytes(content))


def audio_path(folder: Path, session: Session, recording: Recording) -> Path:
    """Return the file of a recording. Raises DataError for a name that leads out of its folder."""
    base = folder if session.audio_root is None else Path(session.audio_root)
    return inside(base, recording.file)


def inside(base: Path, file: str) -> Path:
    """Return `base / file`. Raises DataError if `..` or a symbolic link leads out of `base`."""
    path = base / file
    parts = Path(file).parts
    # Only these can lead out of it. To resolve each path would take longer than to hash the file.
    steps = [base.joinpath(*parts[:count]) for count in range(1, len(parts) + 1)]
    is_linked = any(step.is_symlink() for step in steps)
    leaves = is_linked and not path.resolve().is_relative_to(base.resolve())
    # On Windows, "/a" and "C:a" have an anchor, although they are not absolute.
    if leaves or ".." in parts or Path(file).anchor:
        raise DataError(file, f"leaves its folder {base}", "put the file inside and correct `file`")
    return path
