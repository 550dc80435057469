"""`ajgdata validate`: every check on every recording, without changing anything."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ajgdata.acquire.recipe import session_names
from ajgdata.experiments import all_asked
from ajgdata.paths import AUDIO_FOLDER, DATASET_FILE, Paths
from ajgdata.pipeline.declaration import declaration_problems
from ajgdata.pipeline.declare import common_audio
from ajgdata.pipeline.label_counts import label_issues
from ajgdata.pipeline.label_kinds import label_findings
from ajgdata.pipeline.progress import Started
from ajgdata.pipeline.recordings import (
    examine,
    finding,
    in_threads,
    late_or_early,
    read_excitation,
)
from ajgdata.store.audio import Remark, file_sha256
from ajgdata.store.findings import rejected, without_rejected
from ajgdata.store.hashes import HashCache
from ajgdata.store.labels import bad_labels, copies
from ajgdata.store.manifest import WHOLE_SESSION, survey
from ajgdata.store.scan import Search, search
from ajgdata.store.sessions import check_one_kind, list_datasets, list_sessions, read_dataset
from ajgdata.types import AudioSettings, DataError, DatasetSpec, FeatureSettings, Finding

#: What to do about files of a folder that is no data set yet.
_FIXES = {
    "other_rate": "most files here have that rate; after the import the data set can convert it",
    "channels": "most files here have one; after the import the data set can mix or choose them",
    "too_short": "record longer, or remove it",
    "two_labels": "keep the one in the right folder",
    "copy": "remove all but one",
}


def validate_datasets(
    project: Callable[[], Paths], names: Sequence[str], started: Started
) -> tuple[int, list[Finding]]:
    """Return the number of recordings checked, and all findings, of data sets or folders `names`.

    `project` finds the project; it is asked only when a data set is to be checked. A name that is
    no data set but a folder is checked as a plain folder of audio files.
    """
    folders = [Path(n) for n in names if _is_folder(n) and not _is_dataset(project, n)]
    count = 0
    told: list[Finding] = []
    for folder in folders:
        checked, found = validate_folder(folder, started)
        count, told = count + checked, told + found
    chosen = [n for n in names if Path(n) not in folders]
    if chosen or not names:
        paths = project()
        for name in chosen or list_datasets(paths):
            checked, found = validate_dataset(paths, name, started)
            count, told = count + checked, told + found
    return count, told


def validate_dataset(paths: Paths, dataset: str, started: Started) -> tuple[int, list[Finding]]:
    """Check every session of a data set: files, samples, delays, labels, copies.

    Returns the number of recordings and all findings. Raises DataError for a declaration that
    cannot be used.
    """
    spec = read_dataset(paths, dataset)
    list(all_asked(spec, paths.dataset(dataset)))  # raises DataError for what cannot be made
    cache = HashCache(paths.hash_cache, forget=True)  # every byte is read here
    sessions = list_sessions(paths, dataset)
    surveys = [survey(paths, dataset, name, cache) for name in sessions]
    advance = started(sum(len(manifest["recordings"]) for manifest, _ in surveys))
    told = [*_check_declaration(paths, spec), *_mixed(paths, spec, sessions)]
    rows: list[tuple[str, str, tuple[str, ...]]] = []
    for manifest, labels in surveys:
        table = {row["recording_id"]: row for row in labels}
        session = manifest["session_id"]
        found = [Finding(**known) for known in manifest["findings"]]
        found += _check_session(paths.root, manifest, spec.audio, spec.features.window, advance)
        for name, row in table.items():
            found += bad_labels(session, name, row, spec.targets)
        found = without_rejected(found, list(rejected(session, table).values()))
        told += [*found, *_without_row(paths.root, paths.session(dataset, session), manifest)]
        unusable = {f.recording_id for f in found if f.level == "error" or f.code == "rejected"}
        for entry in manifest["recordings"]:
            if (name := entry["recording_id"]) not in unusable:
                label = tuple(table[name].get(target, "") for target in spec.targets)
                rows.append((f"{session}/{name}", entry["sha256"], label))
    told += label_findings([labels for _, labels in surveys], spec.targets)
    told += label_issues({one["session_id"]: labels for one, labels in surveys}, spec)
    if rows:
        told += copies(*zip(*rows, strict=True)).values()
    return sum(len(labels) for _, labels in surveys), sorted(told)


def _check_declaration(paths: Paths, spec: DatasetSpec) -> list[Finding]:
    virtual = session_names(spec.recipe) if spec.recipe else ()
    return [
        Finding(DATASET_FILE, "*", "", "error", "declaration", problem, fix)
        for problem, fix in declaration_problems(paths, spec, virtual)
    ]


def _mixed(paths: Paths, spec: DatasetSpec, sessions: Sequence[str]) -> list[Finding]:
    """Return an error if simulated and recorded sessions meet."""
    try:
        check_one_kind(paths, spec, sessions)
    except DataError as error:
        return [Finding("*", "*", "", "error", "mixed", error.problem, error.fix)]
    return []


def _without_row(root: Path, folder: Path, manifest: dict[str, Any]) -> list[Finding]:
    """Return a note for each audio file of a session that stands in no row of its table.

    Of a session whose table cannot be read nothing is known.
    """
    if any(
        (f["recording_id"], f["level"]) == (WHOLE_SESSION, "error") for f in manifest["findings"]
    ):
        return []
    known = {(root / entry["path"]).absolute() for entry in manifest["recordings"]}
    known |= {(folder / told["file"]).absolute() for told in manifest["findings"]}
    fix = "import its folder again, or remove the file"
    return [
        Finding(folder.name, path.as_posix(), path.name, "note", "no_row", "in no row", fix)
        for path in search(folder / AUDIO_FOLDER).audio
        if (folder / AUDIO_FOLDER / path).absolute() not in known
    ]


def validate_folder(folder: Path, started: Started) -> tuple[int, list[Finding]]:
    """Check every audio file below a plain folder against the commonest sample rate among them.

    Returns the number of files and all findings.
    """
    found = search(folder)
    files = [folder.absolute() / path for path in found.audio]
    name = folder.absolute().name
    entries = [
        {"recording_id": str(p.relative_to(folder.absolute())), "path": str(p)} for p in files
    ]
    manifest = {"session_id": name, "excitation": None, "recordings": entries}
    audio, window = common_audio(files), FeatureSettings().window
    told = _check_session(Path(), manifest, audio, window, started(len(files)))
    told += _not_searched(name, found)
    unusable = {one.recording_id for one in told if one.level == "error"}
    usable = [entry for entry in entries if entry["recording_id"] not in unusable]
    digests = [file_sha256(Path(entry["path"])) for entry in usable]
    labels = [(str(Path(entry["path"]).parent),) for entry in usable]
    names = [f"{name}/{entry['recording_id']}" for entry in usable]
    told += copies(names, digests, labels).values()
    return len(files), sorted(replace(one, fix=_FIXES.get(one.code, one.fix)) for one in told)


def _not_searched(name: str, found: Search) -> list[Finding]:
    """Return warnings for hidden audio files and closed folders, notes for other skipped names."""
    fix = "nothing to do, unless recordings are there"
    return [
        *(Finding(name, p, "", "warning", "not_searched", r, fix) for p, r in found.closed),
        *(Finding(name, p, "", "warning", "not_searched", r, fix) for p, r in found.hidden),
        *(Finding(name, p, "", "note", "not_searched", r, fix) for p, r in found.skipped),
    ]


def _check_session(
    root: Path,
    manifest: dict[str, Any],
    audio: AudioSettings,
    window: int,
    advance: Callable[[], object],
) -> list[Finding]:
    excitation, told = read_excitation(root, manifest, audio)
    session, entries = manifest["session_id"], manifest["recordings"]
    delays: dict[str, int] = {}

    def checked(entry: dict[str, str]) -> tuple[tuple[Remark, ...], int | None]:
        found = examine(root / entry["path"], audio, window, excitation)
        return found.remarks, found.delay  # the samples would wait in memory

    results = in_threads(checked, entries, os.cpu_count() or 1)
    for entry, (remarks, delay) in zip(entries, results, strict=True):
        name = entry["recording_id"]
        told += [finding(session, name, entry["path"], remark) for remark in remarks]
        if delay is not None:
            delays[name] = delay
        advance()
    return told + late_or_early(session, list(delays), list(delays.values()), audio.sample_rate_hz)


def _is_folder(name: str) -> bool:
    try:
        return Path(name).is_dir()
    except OSError:  # a name too long for a file
        return False


def _is_dataset(project: Callable[[], Paths], name: str) -> bool:
    try:
        return name in list_datasets(project())
    except FileNotFoundError:
        return False
