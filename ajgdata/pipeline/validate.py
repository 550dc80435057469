"""`ajgdata validate`: every check on every recording, without changing anything."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from ajgdata.acquire.recipe import session_names
from ajgdata.experiments import all_asked
from ajgdata.paths import AUDIO_FOLDER, DATASET_FILE, Paths
from ajgdata.pipeline.importing import common_audio
from ajgdata.pipeline.label_counts import label_issues
from ajgdata.pipeline.plan import declaration_problems
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
from ajgdata.store.labels import bad_labels, copies
from ajgdata.store.scan import search
from ajgdata.store.session_audio import WHOLE_SESSION, AudioFile, SessionAudio, check_session
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
    issues: list[Finding] = []
    for folder in folders:
        checked, found = validate_folder(folder, started)
        count, issues = count + checked, issues + found
    chosen = [n for n in names if Path(n) not in folders]
    if chosen or not names:
        paths = project()
        for name in chosen or list_datasets(paths):
            checked, found = validate_dataset(paths, name, started)
            count, issues = count + checked, issues + found
    return count, issues


def validate_dataset(paths: Paths, dataset: str, started: Started) -> tuple[int, list[Finding]]:
    """Check every session of a data set: files, samples, delays, labels, copies.

    Returns the number of recordings and all findings. Raises DataError for a declaration that
    cannot be used.
    """
    spec = read_dataset(paths, dataset)
    list(all_asked(spec, paths.dataset(dataset)))  # raises DataError for what cannot be made
    sessions = list_sessions(paths, dataset)
    checked = [check_session(paths.session(dataset, name)) for name in sessions]
    advance = started(sum(len(one.files) for one in checked))
    issues = [*_check_declaration(paths, spec), *_mixed(paths, spec, sessions)]
    rows: list[tuple[str, str, tuple[str, ...]]] = []
    for one in checked:
        table = {row["recording_id"]: row for row in one.labels}
        session = one.session_id
        found = [*one.findings, *_check_samples(one, spec.audio, spec.features.window, advance)]
        for name, row in table.items():
            found += bad_labels(session, name, row, spec.targets)
        found = without_rejected(found, list(rejected(session, table).values()))
        issues += [*found, *_without_row(paths.session(dataset, session), one)]
        unusable = {f.recording_id for f in found if f.level == "error" or f.code == "rejected"}
        for entry in one.files:
            if (name := entry.recording_id) not in unusable:
                label = tuple(table[name].get(target, "") for target in spec.targets)
                rows.append((f"{session}/{name}", entry.sha256, label))
    issues += label_issues({one.session_id: one.labels for one in checked}, spec)
    if rows:
        issues += copies(*zip(*rows, strict=True)).values()
    return sum(len(one.labels) for one in checked), sorted(issues)


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


def _without_row(folder: Path, session: SessionAudio) -> list[Finding]:
    """Return a note for each audio file of a session that stands in no row of its table.

    Of a session whose table cannot be read nothing is known.
    """
    if any((f.recording_id, f.level) == (WHOLE_SESSION, "error") for f in session.findings):
        return []
    known = {entry.path.absolute() for entry in session.files}
    known |= {(folder / found.file).absolute() for found in session.findings}
    fix = "import its folder again, or remove the file"
    return [
        Finding(folder.name, path.as_posix(), path.name, "note", "no_row", "in no row", fix)
        for path in search(folder / AUDIO_FOLDER)[0]
        if (folder / AUDIO_FOLDER / path).absolute() not in known
    ]


def validate_folder(folder: Path, started: Started) -> tuple[int, list[Finding]]:
    """Check every audio file below a plain folder against the commonest sample rate among them.

    Returns the number of files and all findings.
    """
    found, closed, skipped = search(folder)
    files = [folder.absolute() / path for path in found]
    name = folder.absolute().name
    entries = [AudioFile(str(p.relative_to(folder.absolute())), p, "") for p in files]
    audio, window = common_audio(files), FeatureSettings().window
    issues = _check_samples(SessionAudio(name, entries), audio, window, started(len(files)))
    fix = "nothing to do, unless recordings are there"
    issues += [
        Finding(name, path, "", "warning", "not_searched", reason, fix)
        for path, reason in (*closed, *skipped)
    ]
    unusable = {one.recording_id for one in issues if one.level == "error"}
    usable = [entry for entry in entries if entry.recording_id not in unusable]
    digests = [file_sha256(entry.path) for entry in usable]
    labels = [(str(entry.path.parent),) for entry in usable]
    names = [f"{name}/{entry.recording_id}" for entry in usable]
    issues += copies(names, digests, labels).values()
    return len(files), sorted(replace(one, fix=_FIXES.get(one.code, one.fix)) for one in issues)


def _check_samples(
    session: SessionAudio,
    audio: AudioSettings,
    window: int,
    advance: Callable[[], object],
) -> list[Finding]:
    name = session.session_id
    excitation, issues = read_excitation(name, session.played, audio)
    delays: dict[str, int] = {}

    def checked(entry: AudioFile) -> tuple[tuple[Remark, ...], int | None]:
        found = examine(entry.path, audio, window, excitation)
        return found.remarks, found.delay  # the samples would wait in memory

    results = in_threads(checked, session.files, os.cpu_count() or 1)
    for entry, (remarks, delay) in zip(session.files, results, strict=True):
        issues += [finding(name, entry.recording_id, entry.path, remark) for remark in remarks]
        if delay is not None:
            delays[entry.recording_id] = delay
        advance()
    return issues + late_or_early(name, list(delays), list(delays.values()), audio.sample_rate_hz)


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
