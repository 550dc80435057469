"""`ajgdata validate`: every check on every recording, without changing anything."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from ajgdata.acquire.recipe import session_names
from ajgdata.experiments import all_asked
from ajgdata.paths import AUDIO_FOLDER, DATASET_FILE, Paths
from ajgdata.pipeline.label_counts import label_issues
from ajgdata.pipeline.plan import config_problems
from ajgdata.pipeline.progress import Started
from ajgdata.pipeline.recordings import (
    examine,
    finding,
    in_threads,
    late_or_early,
    read_excitation,
)
from ajgdata.store.audio import Remark
from ajgdata.store.findings import rejected, without_rejected
from ajgdata.store.labels import bad_labels, copies
from ajgdata.store.scan import search
from ajgdata.store.session_audio import WHOLE_SESSION, AudioFile, SessionAudio, check_session
from ajgdata.store.sessions import check_one_kind, list_sessions, read_dataset
from ajgdata.types import AudioSettings, DataError, DatasetSpec, Finding


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
    issues = list(_check_declaration(paths, spec, sessions))
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


def _check_declaration(
    paths: Paths, spec: DatasetSpec, sessions: Sequence[str]
) -> Iterator[Finding]:
    """Yield problems of the declaration, and an error if simulated and recorded sessions meet."""
    virtual = session_names(spec.recipe) if spec.recipe else ()
    for problem, fix in config_problems(paths, spec, virtual):
        yield Finding(DATASET_FILE, "*", "", "error", "declaration", problem, fix)
    try:
        check_one_kind(paths, spec, sessions)
    except DataError as error:
        yield Finding("*", "*", "", "error", "mixed", error.problem, error.fix)


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
