"""Feature file and quarantine of a data set. Only new and changed recordings are computed."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from ajgdata.features.compute import FeatureComputer
from ajgdata.features.spectrum import settings_text
from ajgdata.paths import Paths
from ajgdata.pipeline.processes import results_of
from ajgdata.pipeline.progress import tell
from ajgdata.pipeline.recordings import examine, finding, no_feature, played_samples
from ajgdata.pipeline.session_levels import level_issues
from ajgdata.pipeline.similar_sounds import without_equal_sounds
from ajgdata.pipeline.table_rows import examine_row, without_equal_rows
from ajgdata.store.audio import file_sha256
from ajgdata.store.features import FeatureRows, read_store, text_column, write_store
from ajgdata.store.files import sha256_of
from ajgdata.store.findings import (
    is_rejected,
    read_findings,
    rejected,
    without_rejected,
    write_findings,
)
from ajgdata.store.freshness import (
    FeatureHashes,
    feature_settings,
    imported_digest,
    read_hashes,
    tables_digest,
    write_hashes,
)
from ajgdata.store.labels import (
    CHANNEL_LEVELS,
    MEANINGS,
    bad_labels,
    label_columns,
    levels_text,
    parse_levels,
    sound_ids,
    without_copies,
)
from ajgdata.store.provenance import settings_digest, software
from ajgdata.store.session_audio import AudioFile, SessionAudio, check_session
from ajgdata.types import (
    AnyFeature,
    AudioSettings,
    DataError,
    FeatureKind,
    Finding,
    Target,
    left_out,
)
from ajgdata.types.extras import FFMPEG, FFMPEG_SUFFIXES, installed_version
from ajgdata.types.session import SIMULATED_SOURCES

SETTINGS_ATTRIBUTE = "settings_digest"


@dataclass(frozen=True)
class RecordingRow:
    """One recording: its feature (...), its issues, and the sha256 of its file.

    The feature is None if the recording cannot be used. `levels_db` are the levels of the channels
    of the file in dB of full scale.
    """

    feature: np.ndarray | None
    issues: tuple[Finding, ...]
    sha256: str
    levels_db: tuple[float, ...] = ()


@dataclass
class Previous:
    """The last feature file.

    `rows` are by session, then by recording_id and sound_id. `tables` has the digest of the tables
    of each session without changes of people, and `decoder` the version of the package that
    contains FFmpeg.
    """

    rows: dict[str, dict[tuple[str, str], RecordingRow]] = field(
        default_factory=lambda: defaultdict(dict)
    )
    tables: dict[str, str] = field(default_factory=dict)
    decoder: str = ""

    def has(self, session: str, file: AudioFile) -> bool:
        """Return whether the file is a row that can be used again.

        Another version of FFmpeg may decode other samples.
        """
        if (file.recording_id, file.sound_id) not in self.rows[session]:
            return False
        is_ffmpeg_file = file.path.suffix.lower() in FFMPEG_SUFFIXES
        return not is_ffmpeg_file or self.decoder == installed_version(FFMPEG)

    def trusted(self, session: str, tables: str) -> dict[str, str]:
        """Return the stored sha256 of the recordings of a session, by recording_id.

        Their files are not read again, also if people changed their labels. There are none if the
        digest of the `tables` has changed.
        """
        if self.tables.get(session) != tables:
            return {}
        return {name: row.sha256 for (name, _), row in self.rows[session].items()}


@dataclass(frozen=True)
class SessionFeatures:
    """The usable recordings of a session with their labels, and the issues of all its recordings.

    `columns` are those of its table. `computed` and `reused` are numbers of recordings.
    """

    rows: list[RecordingRow]
    labels: list[dict[str, str]]
    columns: set[str]
    issues: list[Finding]
    computed: int
    reused: int


def build_feature_file(
    paths: Paths,
    *,
    dataset: str,
    sessions: Sequence[str],
    audio: AudioSettings,
    features: AnyFeature,
    targets: Mapping[str, Target],
    code: str,
    store: Path,
    quarantine: Path,
    hashes: Path,
    tables: Sequence[str] = (),
    threads: int = 1,
) -> tuple[int, int]:
    """Write the feature file `store` of a data set, the issues of its recordings, and `hashes`.

    `tables` are the digests for which Snakemake started the job (see `freshness.run_tables`).
    Many new recordings are computed by up to `threads` processes, with the same results.

    Return the numbers of recordings that were read and of features that were reused. A row of the
    old `store` is reused if recording, sound, settings and `code` are the same. Files of a session
    whose tables did not change are not read again.

    `quarantine` lists all issues. A recording is excluded if it cannot be used, is marked `reject`,
    or has the bytes of another one. A text in a target of numbers is an issue as well, and its
    value is missing. The only issue of a rejected recording is its rejection.
    """
    digest = sha256_of(f"{settings_digest(audio, features)} {code}".encode())[:16]
    previous = _previous(store, quarantine, hashes, digest)
    computer = FeatureComputer(audio, features, paths.dataset(dataset).parent)
    # The digests are read first: a table that changes during this job then differs from its digest.
    digests = {name: tables_digest(paths.session(dataset, name)) for name in sessions}
    imported = {name: imported_digest(paths.session(dataset, name)) for name in sessions}
    # Sums that a library computes with several threads differ in rounding.
    with threadpool_limits(limits=1):
        parts = _parts(paths, dataset, imported, previous, computer, targets, threads)
        joined = _joined(parts, computer, features.kind, targets)
        table, copies = without_copies(joined, [*targets])
        if computer.needs_waveform:
            table, sounds = without_equal_sounds(table, [*targets], features)
        else:
            table, sounds = without_equal_rows(table, [*targets])
    issues = [*copies, *sounds, *(issue for part in parts for issue in part.issues)]
    table = _with_attributes(table, dataset, audio, features, digest)
    # The hashes are only valid for this feature file: they are removed first and written last.
    hashes.unlink(missing_ok=True)
    write_store(store, table)
    write_findings(quarantine, issues)
    content = FeatureHashes(
        tables=digests,
        imported_tables=imported,
        parameter=tuple(tables),
        decoder=installed_version(FFMPEG),
        settings=feature_settings(audio, features, targets),
        code=code,
        features=file_sha256(store),
        quarantine=file_sha256(quarantine),
    )
    write_hashes(hashes, content)
    excluded = left_out(issues)
    if excluded:
        tell(f"left out  {len(excluded)} of {dataset}: {quarantine} says why")
    computed = sum(part.computed for part in parts)
    reused = sum(part.reused for part in parts)
    print(f"{computed} recordings read, {reused} features reused")
    return computed, reused


def _parts(
    paths: Paths,
    dataset: str,
    digests: Mapping[str, str],
    previous: Previous,
    computer: FeatureComputer,
    targets: Mapping[str, Target],
    threads: int,
) -> list[SessionFeatures]:
    """Return the usable recordings of each session of `digests`.

    Several processes compute the features if many recordings are new.
    """
    # Sessions are checked while their new files are computed: `new_files` fills this list.
    checked: list[SessionAudio] = []

    def new_files() -> Iterator[tuple[str, AudioFile]]:
        """Check one session after the other; yield its name with each file to compute."""
        for name, tables in digests.items():
            folder = paths.session(dataset, name)
            if computer.needs_played and previous.tables.get(name) != tables:
                previous.rows.pop(name, None)  # session.yaml may have another played sound
            session = check_session(folder, previous.trusted(name, tables))
            checked.append(session)
            for file in _used_files(session):
                if not previous.has(name, file):
                    yield name, file

    compute = partial(_named_row, computer=computer)
    computed = dict(results_of(compute, new_files(), threads))
    parts = []
    for session in checked:
        name = session.session_id
        rows = {
            file.recording_id: computed.get((name, file.recording_id))
            or previous.rows[name][file.recording_id, file.sound_id]
            for file in _used_files(session)
        }
        count = sum((name, recording_id) in computed for recording_id in rows)
        parts.append(_part(session, rows, count, targets, computer.audio))
    return parts


def _used_files(session: SessionAudio) -> list[AudioFile]:
    """Return the files of a session without those of rejected recordings."""
    rejected_names = {row["recording_id"] for row in session.labels if is_rejected(row)}
    return [file for file in session.files if file.recording_id not in rejected_names]


def _named_row(
    item: tuple[str, AudioFile], computer: FeatureComputer
) -> tuple[tuple[str, str], RecordingRow]:
    """Return the names of session and recording of a file, and its row."""
    session, file = item
    return (session, file.recording_id), _row(session, file, computer)


def _row(session: str, file: AudioFile, computer: FeatureComputer) -> RecordingRow:
    """Read a file of a session and compute its feature."""
    if not computer.needs_waveform:
        return _table_row(session, file, computer)
    if file.table_row is not None:
        problem = "a row of a table has no waveform"
        fix = "use features.kind table in dataset.yaml"
        names = (session, file.recording_id, file.path.name)
        issue = Finding(*names, "error", "no_waveform", problem, fix)
        return RecordingRow(None, (issue,), file.sha256)
    result = examine(
        file.path, computer.audio, computer.least_samples, computer.reaching_hz, file.segment
    )
    issues = tuple(finding(session, file.recording_id, file.path, r) for r in result.remarks)
    if result.samples is None:
        return RecordingRow(None, issues, file.sha256)
    try:
        played = None
        if computer.needs_played:
            played = played_samples(file.played, computer.audio.sample_rate_hz)
        feature = computer(result.samples, played)
    except ValueError as error:  # for example a feature without normalisation, beyond float32
        issue = no_feature(session, file.recording_id, error)
        return RecordingRow(None, (*issues, issue), file.sha256)
    doubts = tuple(
        Finding(session, file.recording_id, file.path.name, "warning", *doubt)
        for doubt in feature.doubts
    )
    return RecordingRow(feature.values, (*issues, *doubts), file.sha256, result.levels_db)


def _table_row(session: str, file: AudioFile, computer: FeatureComputer) -> RecordingRow:
    """Read the feature of a row of an imported table."""
    values, issues = examine_row(session, file, computer)
    return RecordingRow(values, issues, file.sha256)


def _part(
    session: SessionAudio,
    rows: Mapping[str, RecordingRow],
    computed: int,
    targets: Mapping[str, Target],
    audio: AudioSettings,
) -> SessionFeatures:
    """Return the usable recordings of a session."""
    name = session.session_id
    table = {row["recording_id"]: row for row in session.labels}
    usable = {key: row for key, row in rows.items() if row.feature is not None}
    issues = [*session.findings, *(issue for row in rows.values() for issue in row.issues)]
    levels = {key: row.levels_db for key, row in usable.items()}
    issues += level_issues(name, levels, table, targets, audio.microphone)
    issues += [issue for key in usable for issue in bad_labels(name, key, table[key], targets)]
    return SessionFeatures(
        rows=list(usable.values()),
        labels=[{**table[key], "session_id": name} for key in usable],
        columns={column for row in session.labels for column in row},
        issues=without_rejected(issues, list(rejected(name, table).values())),
        computed=computed,
        reused=len(rows) - computed,
    )


def _joined(
    parts: Sequence[SessionFeatures],
    computer: FeatureComputer,
    kind: str,
    targets: Mapping[str, Target],
) -> FeatureRows:
    """Return the recordings of all sessions with their labels; `kind` is that of the feature."""
    rows = [row for part in parts for row in part.rows]
    labels = [row for part in parts for row in part.labels]
    names = set().union(*(part.columns for part in parts))
    flags = [",".join(sorted({issue.code for issue in row.issues})) for row in rows]
    levels = [levels_text(row.levels_db) for row in rows]
    hash_meaning = f"SHA-256 of the {'file' if computer.needs_waveform else 'features'}"
    columns = {
        **label_columns(labels, names, targets),
        "sha256": text_column([row.sha256 for row in rows], long_name=hash_meaning),
        "flags": text_column(flags, long_name="findings"),
        CHANNEL_LEVELS: text_column(levels, long_name=MEANINGS[CHANNEL_LEVELS]),
    }
    feature = np.asarray([row.feature for row in rows], np.float32)
    shape = tuple(len(axis.values) for axis in computer.axes)
    return FeatureRows(feature.reshape(len(rows), *shape), computer.axes, columns, {}, kind)


def _with_attributes(
    table: FeatureRows, dataset: str, audio: AudioSettings, features: FeatureKind, digest: str
) -> FeatureRows:
    """Return the table with attributes: its data set, settings, software and inputs."""
    sources = set(table.columns["source"].values) if "source" in table.columns else set()
    rows = zip(table.columns["recording"].values, sound_ids(table), strict=True)
    inputs = sha256_of("\n".join(f"{name} {sound_id}" for name, sound_id in rows).encode())
    attrs = {
        "settings": settings_text(audio, features),
        SETTINGS_ATTRIBUTE: digest,
        **software(),
        "data_set": dataset,
        "source": "simulated" if sources & SIMULATED_SOURCES else "recorded",
        "inputs_sha256": inputs,
    }
    return replace(table, attrs=attrs)


def _previous(path: Path, quarantine: Path, hashes: Path, digest: str) -> Previous:
    """Return the rows of the last feature file.

    There are none if its settings differ from `digest`, or if it cannot be read.
    """
    previous = Previous()
    recorded = read_hashes(hashes)
    if recorded is None or not (path.is_file() and quarantine.is_file()):
        return previous
    try:
        table = read_store(path)
        issues = read_findings(quarantine)
    except DataError:
        return previous  # an unreadable file is computed again
    if table.attrs.get(SETTINGS_ATTRIBUTE) != digest:
        return previous
    issues_of = defaultdict(list)
    for issue in issues:
        issues_of[f"{issue.session_id}/{issue.recording_id}"].append(issue)
    previous.tables.update(recorded.imported_tables)
    previous.decoder = recorded.decoder
    keys = ("recording", "session_id", "sha256", "flags", CHANNEL_LEVELS)
    texts = zip(*(table.columns[key].values.tolist() for key in keys), strict=True)
    rows = zip(table.feature, sound_ids(table), texts, strict=True)
    for feature, sound_id, (name, session, sha256, flags, levels) in rows:
        codes = set(filter(None, flags.split(",")))
        known = tuple(issue for issue in issues_of[name] if issue.code in codes)
        if {issue.code for issue in known} == codes:  # otherwise the two files are of two runs
            row = name.partition("/")[2]
            previous.rows[session][row, sound_id] = RecordingRow(
                feature, known, sha256, parse_levels(levels)
            )
    return previous
