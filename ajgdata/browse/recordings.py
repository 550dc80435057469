"""The recordings of a data set with their labels and issues, before or after a run."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ajgdata.paths import CHANGES_FILE, RECORDINGS_FILE, SESSION_FILE, Paths
from ajgdata.pipeline.validate import validate_dataset
from ajgdata.store.changes import ChangeLog, read_changes
from ajgdata.store.findings import read_findings
from ajgdata.store.labels import placement_name
from ajgdata.store.session_audio import label_rows
from ajgdata.store.sessions import (
    audio_path,
    inside,
    list_sessions,
    read_recordings,
    read_session,
)
from ajgdata.types import (
    ISSUE_LEVELS,
    WHOLE,
    WHOLE_FILE,
    DataError,
    DatasetSpec,
    Finding,
    Segment,
    Session,
    is_of_recording,
)

#: Largest number of recordings that are checked if no run has listed their issues.
MAX_CHECKED = 2_000
_NO_WAVEFORM = "the data set is a table of features without recordings"
_CHANGED_TABLES = "tables changed after the check; start the command again to check them"
#: Files of a session whose change is seen at the next look at the page.
_TABLES = (RECORDINGS_FILE, SESSION_FILE, CHANGES_FILE)


@dataclass(frozen=True)
class AudioPart:
    """The file of a recording and the part that is the recording; `path` is None without a usable
    file, for the reason `without`."""

    path: Path | None
    segment: Segment = WHOLE_FILE
    without: str = "its row in the table is not usable"


@dataclass(frozen=True)
class Decision:
    """What people decided about a recording: `state` is ok, reject or label, and "" without a
    decision that counts; `note` are all notes."""

    state: str = ""
    note: str = ""


@dataclass(frozen=True)
class SessionRows:
    """The recordings of one session: labels, sounds and decisions of each, and all issues."""

    folder: Path
    about: Session | None
    rows: tuple[dict[str, str], ...]
    sounds: tuple[AudioPart, ...]
    decisions: tuple[Decision, ...]
    issues: tuple[Finding, ...]

    @property
    def played(self) -> Path | None:
        """The file of the played sound, if the session has one."""
        if self.about is None or self.about.excitation is None:
            return None
        return inside(self.folder, self.about.excitation.file)


@dataclass(frozen=True)
class RecordingTable:
    """All recordings of a data set, in the order of sessions and names.

    `rows` have the columns of `label_rows`, with session_id; a row of a table that cannot be read
    has only names. `issues` are those of each recording by name, and `general` are all others.
    """

    spec: DatasetSpec
    sessions: Mapping[str, SessionRows]
    names: tuple[str, ...]
    rows: tuple[Mapping[str, str], ...]
    sounds: tuple[AudioPart, ...]
    decisions: tuple[Decision, ...]
    issues: Mapping[str, Sequence[Finding]]
    general: Sequence[Finding]
    #: Why there are no issues of sounds; "" if there are.
    without_issues: str = ""
    number: Mapping[str, int] = field(default_factory=dict)  #: row by name

    def texts(self, column: str) -> list[str]:
        """Return the cells (n,) of a label; "" for rows that lack it."""
        return [row.get(column, "") for row in self.rows]

    def grasps(self) -> list[str]:
        """Return the grasp (n,) of each recording, unique in the data set."""
        return [f"{row['session_id']}/{row.get('grasp_id', name)}" for name, row in self._pairs()]

    def placements(self) -> list[str]:
        """Return the placement (n,) of each recording, unique in the data set; "" if unknown."""
        return [placement_name(row) for row in self.rows]

    def _pairs(self) -> zip[tuple[str, Mapping[str, str]]]:
        return zip(self.names, self.rows, strict=True)


class TableReader:
    """Reads the recordings of a data set, and reads tables again only if they changed."""

    def __init__(self, paths: Paths, spec: DatasetSpec, *, check: bool = False) -> None:
        self._paths = paths
        self._spec = spec
        self._is_checked = check
        self._sessions: dict[str, tuple[object, SessionRows]] = {}
        self._checked_tables: object = None
        self._checked: list[Finding] = []

    def state(self) -> object:
        """Return a value that differs after a change of a table or of the issues."""
        sessions = list_sessions(self._paths, self._spec.name)
        own = [_state(self._folder(name), _TABLES) for name in sessions]
        quarantine = self._paths.quarantine(self._spec.name)
        return tuple(sessions), tuple(own), _state(quarantine.parent, (quarantine.name,))

    def read(self) -> RecordingTable:
        """Return the recordings. Raises DataError for a table of issues of another version."""
        sessions = {}
        for name in list_sessions(self._paths, self._spec.name):
            state = _state(self._folder(name), _TABLES)
            known = self._sessions.get(name)
            if known is None or known[0] != state:
                known = (state, read_session_rows(self._folder(name)))
                self._sessions[name] = known
            sessions[name] = known[1]
        count = sum(len(session.rows) for session in sessions.values())
        issues, without_issues = self._issues(sessions, count)
        return merged(self._spec, sessions, issues, without_issues)

    def _folder(self, session: str) -> Path:
        return self._paths.session(self._spec.name, session)

    def _issues(self, sessions: Mapping[str, SessionRows], count: int) -> tuple[list[Finding], str]:
        """Return the issues of the last run, else those of a check, and why there are none.

        A check is repeated after a change of a table, but not after a decision, because it takes
        long. Without run and check, a missing file is the only issue of a sound.
        """
        quarantine = self._paths.quarantine(self._spec.name)
        own = [issue for session in sessions.values() for issue in session.issues]
        if not self._is_checked and quarantine.is_file():
            return [*own, *read_findings(quarantine)], ""
        if self._is_checked or count <= MAX_CHECKED:
            files = (RECORDINGS_FILE, SESSION_FILE)
            tables = {name: _state(self._folder(name), files) for name in sessions}
            is_first = self._checked_tables is None
            if is_first or (self._checked_tables != tables and count <= MAX_CHECKED):
                _, self._checked = validate_dataset(self._paths, self._spec.name)
                self._checked_tables = tables
            changed = "" if self._checked_tables == tables else _CHANGED_TABLES
            checked = {(i.session_id, i.recording_id, i.code) for i in self._checked}
            later = [i for i in own if (i.session_id, i.recording_id, i.code) not in checked]
            return [*later, *self._checked], changed
        missing = [
            Finding(
                name,
                row["recording_id"],
                "",
                "error",
                "missing",
                "no such file",
                "restore the file",
            )
            for name, session in sessions.items()
            for row, sound in zip(session.rows, session.sounds, strict=True)
            if sound.path is not None and not sound.path.is_file()
        ]
        hint = f"not checked: `ajgdata browse {self._spec.name} --check` checks all sounds first"
        return [*own, *missing], hint


def _state(folder: Path, files: Sequence[str]) -> object:
    """Return times of change and sizes of files; None for files that do not exist."""
    states: list[tuple[int, int] | None] = []
    for file in files:
        try:
            stat = (folder / file).stat()
            states.append((stat.st_mtime_ns, stat.st_size))
        except OSError:
            states.append(None)
    return tuple(states)


def read_session_rows(folder: Path) -> SessionRows:
    """Return the recordings of a session. A session that cannot be read has one issue, no rows."""
    name = folder.name
    try:
        session = read_session(folder)
        recordings, issues = read_recordings(folder)
        log = read_changes(folder)
    except DataError as error:
        issue = Finding(name, WHOLE, "", "error", "bad_session", error.problem, error.fix)
        return SessionRows(folder, None, (), (), (), (issue,))
    rows = [row | {"session_id": name} for row in label_rows(session, recordings)]
    sounds = []
    for recording in recordings:
        if recording.table_row is not None:
            sounds.append(AudioPart(None, without=_NO_WAVEFORM))
            continue
        try:
            sounds.append(AudioPart(audio_path(folder, session, recording), recording.segment))
        except DataError as error:
            sounds.append(AudioPart(None))
            names = (name, recording.recording_id, recording.file)
            issues.append(Finding(*names, "error", "escapes", error.problem, error.fix))
    decisions = tuple(decision(log, row.recording_id, row.sha256) for row in recordings)
    return SessionRows(folder, session, tuple(rows), tuple(sounds), decisions, tuple(issues))


def decision(log: ChangeLog, recording_id: str, sha256: str) -> Decision:
    """Return the decision about a recording from the log of its session."""
    active = log.active(recording_id, sha256)
    states = [change.action for change in active if change.action != "note"]
    notes = [change.new for change in active if change.action == "note"]
    return Decision(states[-1] if states else "", "; ".join(notes))


def merged(
    spec: DatasetSpec,
    sessions: Mapping[str, SessionRows],
    issues: Sequence[Finding],
    without_issues: str = "",
) -> RecordingTable:
    """Return the recordings of sessions, each with its issues, the worst first.

    A recording with issues that no table has, because its row is wrong, gets a row.
    """
    names: list[str] = []
    rows: list[Mapping[str, str]] = []
    sounds: list[AudioPart] = []
    decisions: list[Decision] = []
    for session in sessions.values():
        names += [f"{session.folder.name}/{row['recording_id']}" for row in session.rows]
        rows += session.rows
        sounds += session.sounds
        decisions += session.decisions
    known = set(names)
    by_name: defaultdict[str, list[Finding]] = defaultdict(list)
    general = []
    for issue in sorted(set(issues), key=lambda issue: ISSUE_LEVELS.index(issue.level)):
        name = f"{issue.session_id}/{issue.recording_id}"
        if not is_of_recording(issue):
            general.append(issue)
            continue
        by_name[name].append(issue)
        if name not in known and issue.session_id in sessions:
            known.add(name)
            names.append(name)
            row = {"recording_id": issue.recording_id, "session_id": issue.session_id}
            rows.append(row | {"quality": ""})
            sounds.append(AudioPart(None))
            decisions.append(Decision())
    number = {name: row for row, name in enumerate(names)}
    return RecordingTable(
        spec,
        sessions,
        tuple(names),
        tuple(rows),
        tuple(sounds),
        tuple(decisions),
        dict(by_name),
        general,
        without_issues,
        number,
    )
