"""Digests of the inputs of the features of a data set, and changes since the features.

The content of files decides, not their times: backups, copies and clocks can give a file any time.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError

from ajgdata.paths import CHANGES_FILE, RECORDINGS_FILE, SESSION_FILE, Paths
from ajgdata.store.changes import read_changes
from ajgdata.store.code_hash import features_code
from ajgdata.store.files import json_bytes, read_csv, read_json, read_yaml, sha256_of, write_bytes
from ajgdata.store.provenance import settings_digest
from ajgdata.store.sessions import (
    count_recordings,
    dropped_sessions,
    incomplete_sessions,
    list_sessions,
    read_recordings,
    read_session,
)
from ajgdata.types import (
    AudioSettings,
    DataError,
    DatasetSpec,
    FeatureKind,
    Strict,
    Target,
)
from ajgdata.types.extras import FFMPEG, FFMPEG_SUFFIXES, installed_version
from ajgdata.types.formats import FORMAT_KEY, SESSION_FORMAT


class FeatureHashes(Strict):
    """Hashes of a feature file, of its quarantine, and of all their inputs."""

    #: Digest of the tables of each session, see `tables_digest`.
    tables: dict[str, str]
    #: The same digest without the changes of people, which change no sound.
    imported_tables: dict[str, str] = Field(default_factory=dict)
    #: Parameter of the job that computed the features, see `run_tables`.
    parameter: tuple[str, ...] = ()
    #: Version of the package that contains FFmpeg; "" if it is not installed.
    decoder: str = ""
    #: Digest of each key of dataset.yaml, see `feature_settings`.
    settings: dict[str, str]
    code: str
    features: str
    quarantine: str


def read_hashes(path: Path) -> FeatureHashes | None:
    """Return the hashes of a feature file; None without a file, or if it cannot be read."""
    if not path.is_file():
        return None
    try:
        return FeatureHashes.model_validate(read_json(path))
    except (DataError, ValidationError):
        return None


def write_hashes(path: Path, hashes: FeatureHashes) -> None:
    """Write the hashes of a feature file, atomically."""
    write_bytes(path, json_bytes(hashes.model_dump(mode="json")))


def feature_settings(
    audio: AudioSettings, features: FeatureKind, targets: Mapping[str, Target]
) -> dict[str, str]:
    """Return the digest of each key of dataset.yaml on which a feature file depends."""
    plain_targets = {
        name: target.model_dump(mode="json", exclude={"columns"})
        for name, target in targets.items()
    }
    return {
        "audio": settings_digest(audio),
        "features": settings_digest(features),
        "targets": sha256_of(json.dumps(plain_targets, sort_keys=True).encode())[:16],
    }


def tables_digest(folder: Path) -> str:
    """Return the digest of the tables of a session and of the labels that people changed.

    It is the digest of `imported_digest` if no label is changed: notes do not count, nor do changes
    that were taken back. Raises DataError for a file that cannot be read.
    """
    tables = imported_digest(folder)
    changes = _content(folder / CHANGES_FILE, lambda _: read_changes(folder).label_lines())
    if changes in ("", "[]"):
        return tables
    return sha256_of(f"{tables}\n{changes}".encode())


def imported_digest(folder: Path) -> str:
    """Return the digest of session.yaml and recordings.csv of a session; "" if it has neither.

    The digest depends on the values, but not on quotes, line ends, comments or the order of
    columns. It depends on the column `sha256`, because an accepted hash means other samples. For a
    file that is not valid YAML or CSV, it depends on the bytes. If FFmpeg decodes a recording, it
    depends on the version of FFmpeg. Raises DataError for a file that cannot be read.
    """
    contents = [
        _content(folder / SESSION_FILE, _session_values),
        _content(folder / RECORDINGS_FILE, _recordings_values),
    ]
    return sha256_of("\n".join(contents).encode()) if any(contents) else ""


def _session_values(path: Path) -> dict[str, Any]:
    """Return the values of session.yaml. A file that states version 1 of its format has the same
    values as a file that states no version."""
    values = read_yaml(path)
    if values.get(FORMAT_KEY) == SESSION_FORMAT.unstated:
        del values[FORMAT_KEY]
    return values


def _recordings_values(path: Path) -> Any:
    """Return the rows of recordings.csv, with the version of FFmpeg if it decodes a recording."""
    rows = read_csv(path)[1]
    if any(row.get("file", "").lower().endswith(FFMPEG_SUFFIXES) for row in rows):
        return {"rows": rows, "decoder": installed_version(FFMPEG)}
    return rows


def _content(path: Path, parse: Callable[[Path], Any]) -> str:
    """Return the values of a file as JSON, or the hash of its bytes if it cannot be parsed."""
    if not path.exists():
        return ""
    try:
        content = path.read_bytes()
    except OSError as error:
        problem = f"cannot be read ({error.strerror})"
        raise DataError(path, problem, "check the file and its permissions") from None
    try:
        return json.dumps(parse(path), sort_keys=True, default=str)
    except (DataError, TypeError):  # TypeError: keys of several types
        return sha256_of(content)


def count_changed(paths: Paths, dataset: str, sessions: Iterable[str]) -> int:
    """Return the number of recordings in sessions whose tables changed since the features."""
    hashes = read_hashes(paths.session_hashes(dataset))
    known = hashes.tables if hashes is not None else {}
    counts = {name: count_recordings(paths.recordings_file(dataset, name)) for name in sessions}
    return sum(
        count
        for name, count in counts.items()
        if count and known.get(name) != tables_digest(paths.session(dataset, name))
    )


def features_key(sources: Iterable[str], spec: DatasetSpec) -> str:
    """Return the digest of all inputs of the features of a data set.

    `sources` are the digests of its tables (see `run_tables`) and of its recipe.
    """
    settings = feature_settings(spec.audio, spec.features, spec.label_targets)
    lines = [*sources, *settings.values(), features_code(spec.features)]
    return sha256_of("\n".join(lines).encode())[:16]


def table_digests(paths: Paths, dataset: str, virtual: Collection[str]) -> dict[str, str]:
    """Return the digest of the tables of each session that a run uses now, by session.

    `virtual` are the sessions of the recipe. Raises DataError for a table that cannot be read.
    """
    dropped = dropped_sessions(paths, dataset, virtual)
    names = {*virtual, *list_sessions(paths, dataset)} - dropped
    return {name: tables_digest(paths.session(dataset, name)) for name in sorted(names)}


def run_tables(
    paths: Paths, dataset: str, sessions: Iterable[str], virtual: Collection[str]
) -> list[str]:
    """Return one text per session: a run computes the features again if a text changes.

    The text of a recorded session has the digest of its tables. The sessions of a recipe
    (`virtual`) can be recorded later in the same run, after Snakemake has evaluated parameters.
    Their texts therefore have a digest only if the time of a file hides a change (see
    `_is_hidden`), and as long as the features were computed with this text. Otherwise, Snakemake
    compares times and checksums of their tables.
    """
    hashes = read_hashes(paths.session_hashes(dataset))
    texts = []
    for name in sessions:
        digest = tables_digest(paths.session(dataset, name))
        text = f"{name} {digest}"
        is_stated = hashes is not None and text in hashes.parameter
        if name in virtual and not is_stated:
            is_hidden = hashes is not None and _is_hidden(paths, dataset, name, digest, hashes)
            text = f"{name} {digest if is_hidden else ''}"
        texts.append(text)
    return texts


def _is_hidden(
    paths: Paths, dataset: str, session: str, digest: str, hashes: FeatureHashes
) -> bool:
    """Return True if the time of changed tables of a session is earlier than that of the features.

    `digest` is that of the present tables, and `hashes` are those of the features.
    """
    features = paths.features(dataset)
    if not features.is_file() or digest in ("", hashes.tables.get(session)):
        return False
    tables = (paths.session_file(dataset, session), paths.recordings_file(dataset, session))
    newest = max(path.stat().st_mtime for path in tables if path.exists())
    return newest <= features.stat().st_mtime


def table_changes(before: Mapping[str, str], now: Mapping[str, str]) -> list[str]:
    """Return a clause for each session with different digests, e.g. `session day1 changed`."""
    clauses = []
    for name in sorted({*before, *now}):
        old = before.get(name, "")
        new = now.get(name, "")
        if old == new:
            continue
        if not old:
            clauses.append(f"session {name} is new")
        elif not new:
            clauses.append(f"session {name} was removed")
        else:
            clauses.append(f"session {name} changed")
    return clauses


def changes_since_features(
    paths: Paths, spec: DatasetSpec, virtual: Collection[str] = ()
) -> list[str]:
    """Return the changes since the features of a data set were computed; none if up to date.

    Each change is a clause about a session whose tables changed, a key of dataset.yaml, or the
    code. `status`, `publish`, `load_features` and `load_recordings` call this function; the rule
    `features` of the workflow compares the same digests. `virtual` are the sessions of the recipe.
    There are no changes if there are no features, or if no session is on this machine. Raises
    DataError for a table that cannot be read.
    """
    name = spec.name
    if not paths.features(name).is_file() or not list_sessions(paths, name):
        return []
    hashes = read_hashes(paths.session_hashes(name))
    if hashes is None:
        return ["the record of what they were computed from is missing"]
    changes = table_changes(hashes.tables, table_digests(paths, name, virtual))
    settings = feature_settings(spec.audio, spec.features, spec.label_targets)
    changes += [
        f"`{key}` of dataset.yaml changed"
        for key, digest in settings.items()
        if hashes.settings.get(key) != digest
    ]
    if hashes.code != features_code(spec.features):
        changes.append("the code that computes features, or a library, changed")
    return changes


def check_computed(paths: Paths, dataset: str, features: Path | None = None) -> None:
    """Raise DataError if a data set has no feature file, or no table of its issues.

    The feature file is `features` (default: that of `load_features`).
    """
    for path in (features or paths.features(dataset), paths.quarantine(dataset)):
        if not path.is_file():
            raise DataError(path, "does not exist yet", f"run `ajgdata run {dataset}` first")


def check_up_to_date(paths: Paths, spec: DatasetSpec, virtual: Collection[str] = ()) -> None:
    """Raise DataError if the features of a data set are outdated, see `changes_since_features`."""
    changes = changes_since_features(paths, spec, virtual)
    if changes:
        problem = f"the features are outdated: {', '.join(changes)}"
        fix = f"run `ajgdata run {spec.name}` first"
        raise DataError(paths.features(spec.name), problem, fix)


def table_problems(paths: Paths, dataset: str, virtual: Collection[str] = ()) -> list[DataError]:
    """Return an error for each session whose session.yaml or recordings.csv cannot be used.

    Sessions of the recipe (`virtual`) that are not recorded yet are excluded.
    """
    problems = []
    unrecorded = incomplete_sessions(paths, dataset, virtual)
    for name in list_sessions(paths, dataset):
        if name in unrecorded:
            continue
        folder = paths.session(dataset, name)
        try:
            read_session(folder)
            read_recordings(folder)
        except DataError as error:
            problems.append(error)
    return problems
