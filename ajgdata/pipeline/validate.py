"""`ajgdata check`: every check on every recording of a data set, without any change."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from ajgdata.experiments.requests import Request, all_requests
from ajgdata.features.compute import FeatureComputer
from ajgdata.paths import DATASET_FILE, Paths
from ajgdata.pipeline.label_issues import label_issues, placebo_issues, placement_notes
from ajgdata.pipeline.labelling import change_issues
from ajgdata.pipeline.plan import config_problems
from ajgdata.pipeline.played_sounds import played_sound_issues
from ajgdata.pipeline.progress import tracked
from ajgdata.pipeline.recordings import examine, finding, no_feature, played_samples
from ajgdata.pipeline.session_levels import level_issues
from ajgdata.pipeline.sound_fingerprints import Fingerprints, checked_sounds
from ajgdata.pipeline.table_rows import table_issues
from ajgdata.store.findings import is_rejected, rejected, without_rejected
from ajgdata.store.labels import bad_labels, comparable_labels, copies
from ajgdata.store.session_audio import AudioFile, SessionAudio, check_session
from ajgdata.store.sessions import (
    check_one_source,
    how_to_get_sessions,
    list_datasets,
    list_sessions,
    read_dataset,
)
from ajgdata.types import WHOLE, DataError, DatasetSpec, Finding

#: Name `<session>/<recording_id>`, sound_id and row of labels of a recording.
LabelledFile = tuple[str, str, Mapping[str, str]]


def validate_dataset(paths: Paths, dataset: str) -> tuple[int, list[Finding]]:
    """Check every session of a data set: files, samples, labels, copies.

    Returns the number of recordings and all issues. Raises DataError for a data set config that
    cannot be used.
    """
    spec = read_dataset(paths, dataset)
    requests = list(all_requests(spec, paths.dataset(dataset)))
    names = list_sessions(paths, dataset)
    sessions = [check_session(paths.session(dataset, name)) for name in names]
    issues = [*_check_config(paths, spec, requests, names), *_no_sessions(paths, spec, names)]
    if spec.features.needs_waveform:
        issues += _check_sounds(paths, spec, sessions)
    else:
        computer = FeatureComputer(spec.audio, spec.features)
        issues += table_issues(sessions, spec, computer)
    tables = {session.session_id: session.labels for session in sessions}
    issues += change_issues(paths, dataset)
    issues += label_issues(tables, spec)
    issues += placement_notes(tables, spec)
    issues += placebo_issues(tables, spec)
    return sum(len(session.labels) for session in sessions), sorted(issues)


def _check_sounds(
    paths: Paths, spec: DatasetSpec, sessions: Sequence[SessionAudio]
) -> list[Finding]:
    """Return issues of the files and samples of all sessions, and of copies."""
    issues: list[Finding] = []
    used: list[LabelledFile] = []
    prints = Fingerprints(paths, spec)
    for session in sessions:
        session_issues = _check_session(session, spec, prints)
        prints.finish()
        issues += session_issues
        used += _usable_files(session, session_issues)
    issues += played_sound_issues(paths, spec, [session.session_id for session in sessions])
    return [*issues, *_check_copies(paths, spec, used, prints)]


def _check_config(
    paths: Paths, spec: DatasetSpec, requests: Sequence[Request], names: Sequence[str]
) -> Iterator[Finding]:
    """Yield errors of the data set config, and one if sessions are both simulated and recorded."""
    for problem, fix in config_problems(paths, spec, requests):
        yield Finding(DATASET_FILE, WHOLE, "", "error", "declaration", problem, fix)
    try:
        check_one_source(paths, spec, names)
    except DataError as error:
        yield Finding(WHOLE, WHOLE, "", "error", "mixed", error.problem, error.fix)


def _no_sessions(paths: Paths, spec: DatasetSpec, names: Sequence[str]) -> list[Finding]:
    """Return an error for a data set without sessions. The next run simulates those of a recipe."""
    if names or spec.recipe:
        return []
    fix = how_to_get_sessions(paths, spec.name)
    return [Finding(WHOLE, WHOLE, "", "error", "no_sessions", "there are no sessions", fix)]


def _check_session(session: SessionAudio, spec: DatasetSpec, prints: Fingerprints) -> list[Finding]:
    """Return issues of files, samples and labels of a session; a rejected recording has one note.

    The fingerprints of the recordings are added to `prints`.
    """
    name = session.session_id
    rows = {row["recording_id"]: row for row in session.labels}
    issues = [*session.findings]
    levels: dict[str, tuple[float, ...]] = {}
    rate_hz = spec.audio.sample_rate_hz
    least_samples = spec.features.least_samples(rate_hz)
    lines_hz = spec.features.reaching_hz(rate_hz)
    # One after the other: threads wait for Python's lock, and need twice the CPU time.
    for file in tracked(session.files, f"checking {name}"):
        result = examine(file.path, spec.audio, least_samples, lines_hz, file.segment)
        prints.add(file.sound_id, result.samples)
        issues += [finding(name, file.recording_id, file.path, r) for r in result.remarks]
        if spec.features.needs_played and result.samples is not None:
            issues += _without_played_sound(name, file, rate_hz)
        if result.levels_db and not is_rejected(rows[file.recording_id]):
            levels[file.recording_id] = result.levels_db
    issues += level_issues(name, levels, rows, spec.label_targets, spec.audio.microphone)
    for recording_id, row in rows.items():
        issues += bad_labels(name, recording_id, row, spec.label_targets)
    return without_rejected(issues, list(rejected(name, rows).values()))


def _without_played_sound(session: str, file: AudioFile, rate_hz: int) -> list[Finding]:
    """Return an error if a feature of the played sound lacks this sound."""
    try:
        played_samples(file.played, rate_hz)
    except ValueError as error:
        return [no_feature(session, file.recording_id, error)]
    return []


def _usable_files(session: SessionAudio, issues: Sequence[Finding]) -> list[LabelledFile]:
    """Return the files of a session, except those of recordings with an error or a rejection."""
    unusable = {
        issue.recording_id for issue in issues if issue.level == "error" or issue.code == "rejected"
    }
    labels = {row["recording_id"]: row for row in session.labels}
    return [
        (f"{session.session_id}/{file.recording_id}", file.sound_id, labels[file.recording_id])
        for file in session.files
        if file.recording_id not in unusable
    ]


def _check_copies(
    paths: Paths, spec: DatasetSpec, used: Sequence[LabelledFile], prints: Fingerprints
) -> list[Finding]:
    """Return issues of equal bytes, and of equal or similar sounds."""
    names = [name for name, _, _ in used]
    ids = [sound_id for _, sound_id, _ in used]
    labels = [comparable_labels(row, spec.label_targets) for _, _, row in used]
    copied = copies(names, ids, labels)
    distinct = [recording for number, recording in enumerate(used) if number not in copied]
    sounds = prints.sounds(distinct, spec.label_targets)
    return [*copied.values(), *checked_sounds(paths, spec, sounds)]


def not_fetched(paths: Paths) -> list[str]:
    """Return the data sets of public recordings (`source.yaml`) without sessions."""
    public = [name for name in list_datasets(paths) if paths.source(name).is_file()]
    return [name for name in public if not list_sessions(paths, name)]
