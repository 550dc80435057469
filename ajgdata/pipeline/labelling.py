"""Decisions of people about recordings: ok, reject, another label, a note, and undo.

Decisions are lines of changes.jsonl (see `store.changes`); recordings.csv stays as it is.
"""

from __future__ import annotations

import difflib
import getpass
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from ajgdata.paths import CHANGES_FILE, RECORDINGS_FILE, Paths
from ajgdata.store.audio import file_sha256
from ajgdata.store.changes import (
    ChangeLog,
    append_change,
    changed_cells,
    is_reviewed,
    read_changes,
    with_changes,
)
from ajgdata.store.files import json_bytes, plain_text, sha256_of
from ajgdata.store.imported_table import check_row
from ajgdata.store.labels import parse_label
from ajgdata.store.lock import locked
from ajgdata.store.session_audio import check_unchanged, table_row
from ajgdata.store.sessions import (
    audio_path,
    list_sessions,
    read_dataset,
    read_session,
    read_table,
)
from ajgdata.types import WHOLE, DataError, DatasetSpec, Finding, Recording
from ajgdata.types.change import OBJECT, QUALITY, REJECT, Action, LabelChange, is_changeable

#: Time to wait for another change of the same session; a change takes milliseconds.
WAIT_S = 10.0
#: Largest number of similar names in a message.
MAX_PROPOSED = 3


class ConflictError(DataError):
    """A recording that changed after the user saw it."""


class NothingToChangeError(DataError):
    """A decision about a recording that already is as decided."""


@dataclass(frozen=True)
class RecordingState:
    """Labels and changes of a recording `<session>/<recording_id>`.

    `labels` are its cells with the changes of people, and `changed` the cells of recordings.csv in
    columns that people changed. `history` are all its changes, also those that were taken back or
    are of another sound. `version` differs if a label or the history differs.
    """

    recording: str
    labels: Mapping[str, str]
    changed: Mapping[str, str]
    is_rejected: bool
    is_reviewed: bool
    notes: tuple[str, ...]
    history: tuple[LabelChange, ...]
    version: str


def label_columns_of(spec: DatasetSpec) -> tuple[str, ...]:
    """Return the columns whose cells `label` can change: the targets, and `object`.

    A property of sessions that is a target, e.g. `gripper`, has no cells.
    """
    targets = [name for name in spec.label_targets if is_changeable(name)]
    return tuple(dict.fromkeys((*targets, OBJECT)))


def check_changeable(paths: Paths, dataset: str) -> DatasetSpec:
    """Return the declaration of a data set. Raises DataError for the labels of a simulation."""
    spec = read_dataset(paths, dataset)
    if spec.recipe:
        problem = "has a recipe, so its labels are those of the simulation and read-only"
        raise DataError(paths.dataset(dataset), problem, "change the recipe")
    return spec


def recording_states(paths: Paths, dataset: str) -> dict[str, RecordingState]:
    """Return the state of each recording of a data set, by `<session>/<recording_id>`.

    Raises DataError for a session or a log that cannot be read.
    """
    states = {}
    for name in list_sessions(paths, dataset):
        folder = paths.session(dataset, name)
        log = read_changes(folder)
        for row in read_table(folder)[0]:
            state = _state(name, row, log)
            states[state.recording] = state
    return states


def recording_state(paths: Paths, dataset: str, recording: str) -> RecordingState:
    """Return the state of one recording. Raises DataError if the data set does not have it."""
    folder, recording_id = _place(paths, dataset, recording)
    log = read_changes(folder)
    return _state(folder.name, _row(folder, recording_id, log), log)


def find_recording(paths: Paths, dataset: str, text: str) -> str:
    """Return the `<session>/<recording_id>` that a user means by `text`.

    `text` is this name, or a recording_id or file that only one recording has. Raises DataError
    with similar names for any other text.
    """
    rows = {
        f"{session}/{row.recording_id}": row
        for session in list_sessions(paths, dataset)
        for row in read_table(paths.session(dataset, session))[0]
    }
    if text in rows:
        return text
    named = [
        name
        for name, row in rows.items()
        if text in (row.recording_id, row.file, Path(row.file).name)
    ]
    if len(named) == 1:
        return named[0]
    where = f"recording {text!r}"
    if named:
        examples = ", ".join(named[:MAX_PROPOSED])
        problem = f"{len(named)} recordings of {dataset} have this name: {examples}"
        raise DataError(where, problem, "name the session as well")
    session, _, recording_id = text.partition("/")
    folder = paths.session(dataset, session)
    if folder.is_dir() and recording_id in read_changes(folder).by_recording:
        raise _deleted(where, folder)
    similar = difflib.get_close_matches(text, rows, MAX_PROPOSED, cutoff=0.5)
    fix = f"use a name such as {', '.join(similar or list(rows)[:MAX_PROPOSED])}"
    raise DataError(where, f"{dataset} has no such recording", fix)


def change_recording(
    paths: Paths,
    dataset: str,
    recording: str,
    action: Action,
    *,
    column: str = "",
    value: str = "",
    reason: str = "",
    version: str | None = None,
    author: str = "",
    check_only: bool = False,
) -> LabelChange:
    """Write a decision about a recording `<session>/<recording_id>` and return it.

    `label` gives the cell of `column` the text `value`, and `note` stores the text `value`. `ok`
    accepts the recording, and takes back a rejection. `undo` takes back the last decision that
    counts. `version` is that of the state that the user saw. `author` is by default the user of the
    computer. With `check_only`, nothing is written.

    Raises ConflictError if the recording changed since `version`, NothingToChangeError for a
    decision that changes nothing, and DataError for the labels of a simulation, an unknown
    recording, column or value, and a rejection without a reason. Nothing is written then.
    """
    spec = check_changeable(paths, dataset)
    folder, recording_id = _place(paths, dataset, recording)
    where = f"recording {recording!r}"
    if action == "reject" and not reason.strip():
        raise DataError(where, "a rejection needs a reason", "state it, e.g. `door slammed`")
    if action == "note" and not value.strip():
        raise DataError(where, "the note is empty", "write a text")
    log_file = folder / CHANGES_FILE
    with locked(log_file, "changing labels of this session", wait_s=WAIT_S):
        log = read_changes(folder)
        row = _row(folder, recording_id, log)
        state = _state(folder.name, row, log)
        if version is not None and version != state.version:
            raise _conflict(where, state)
        if action in ("ok", "label"):
            _check_sound(folder, row, dataset)
        if action == "undo":
            column, value = _undone(where, row, log)
        elif action == "note":
            column = ""
        elif action in ("ok", "reject"):
            column = QUALITY
            value = _new_quality(where, state, action)
        else:
            value = plain_text(value)
            _check_label(where, spec, state, column, value)
        change = LabelChange(
            time=datetime.now(UTC).isoformat(timespec="seconds").replace("+00:00", "Z"),
            recording_id=recording_id,
            sha256=row.sha256 if row.table_row is None else "",
            action=action,
            column=column,
            old=state.labels.get(column, ""),
            new=plain_text(value),
            reason=plain_text(reason),
            author=plain_text(author or _user()),
        )
        if not check_only:
            append_change(folder, change)
    return change


def change_issues(paths: Paths, dataset: str) -> list[Finding]:
    """Return the issues of the changes of people in all sessions.

    They are incomplete lines, changes of recordings that do not exist or have another sound, and
    cells of recordings.csv that changed after the decision.
    """
    issues = []
    for session in list_sessions(paths, dataset):
        folder = paths.session(dataset, session)
        try:
            log = read_changes(folder)
            rows = {row.recording_id: row for row in read_table(folder)[0]}
        except DataError:
            continue  # the check of the session reports it
        if log.torn:
            problem = f"the last line is incomplete ({log.torn[:40]!r}), so it is not a change"
            fix = "repeat this decision; the next change removes the line"
            issues.append(
                Finding(session, WHOLE, CHANGES_FILE, "warning", "torn_change", problem, fix)
            )
        for recording_id, changes in log.by_recording.items():
            row = rows.get(recording_id)
            issues += _issues_of_recording(session, recording_id, row, changes, log)
    return issues


def _issues_of_recording(
    session: str,
    recording_id: str,
    row: Recording | None,
    changes: Sequence[LabelChange],
    log: ChangeLog,
) -> list[Finding]:
    """Return the issues of the changes of one recording; `row` is None if it does not exist."""
    names = (session, recording_id, CHANGES_FILE)
    if row is None:
        problem = f"no recording fits {len(changes)} changes of labels, e.g. {changes[-1]}"
        fix = "import the recording again, or delete these lines"
        return [Finding(*names, "warning", "change_without_recording", problem, fix)]
    issues = []
    other = [c for c in changes if "" not in (row.sha256, c.sha256) and c.sha256 != row.sha256]
    if other:
        problem = f"{len(other)} changes are of another sound and do not count, e.g. {other[-1]}"
        fix = "listen to the present file and repeat the decision, or delete these lines"
        issues.append(Finding(*names, "warning", "change_of_other_sound", problem, fix))
    for column, text in log.cells(recording_id, row.sha256).items():
        before = next(
            c.old for c in log.active(recording_id, row.sha256) if c.column == column and c.is_label
        )
        stored = _cell(row, column)
        if stored not in (before, text):
            problem = f"{column} is {stored!r} in recordings.csv now; {text!r}, set by hand, counts"
            fix = f"nothing to do if {text!r} is right; else take the change back with --undo"
            issues.append(Finding(*names, "note", "changed_by_hand", problem, fix))
    return issues


def _cell(row: Recording, column: str) -> str:
    """Return a cell of a recording that people can change."""
    if column in Recording.model_fields:
        return str(getattr(row, column))
    return row.labels.get(column, "")


def _state(session: str, row: Recording, log: ChangeLog) -> RecordingState:
    """Return the state of a row of recordings.csv with the changes of its session."""
    active = log.active(row.recording_id, row.sha256)
    present = with_changes(row, log)
    labels = {OBJECT: present.object, QUALITY: present.quality, **present.labels}
    history = tuple(log.by_recording.get(row.recording_id, ()))
    return RecordingState(
        recording=f"{session}/{row.recording_id}",
        labels=labels,
        changed={column: _cell(row, column) for column in changed_cells(active)},
        is_rejected=present.quality == REJECT,
        is_reviewed=is_reviewed(active),
        notes=tuple(change.new for change in active if change.action == "note"),
        history=history,
        version=sha256_of(json_bytes([labels, row.sha256, len(history)]))[:16],
    )


def _place(paths: Paths, dataset: str, recording: str) -> tuple[Path, str]:
    """Return the folder of the session and the recording_id of a recording.

    Raises DataError for an unknown session.
    """
    session, _, recording_id = recording.partition("/")
    if session not in list_sessions(paths, dataset) or not recording_id:
        problem = f"{dataset} has no session {session!r}"
        raise DataError(f"recording {recording!r}", problem, "name it as <session>/<recording_id>")
    return paths.session(dataset, session), recording_id


def _row(folder: Path, recording_id: str, log: ChangeLog) -> Recording:
    """Return the row of a recording. Raises DataError if it does not exist, or no longer."""
    rows, issues = read_table(folder, recording_id)
    if rows:
        return rows[0]
    if issues:
        raise DataError(folder / RECORDINGS_FILE, issues[0].problem, issues[0].fix)
    where = f"recording {folder.name}/{recording_id}"
    if recording_id in log.by_recording:
        raise _deleted(where, folder)
    raise DataError(where, f"is not in {folder / RECORDINGS_FILE}", "correct the name")


def _deleted(where: str, folder: Path) -> DataError:
    """Return the error of a recording that has changes and is no longer in the table."""
    problem = f"is no longer in {folder / RECORDINGS_FILE}"
    return DataError(where, problem, "import the recording again")


def _conflict(where: str, state: RecordingState) -> ConflictError:
    """Return the error of a recording that changed after the user saw it."""
    last = f"the last change is {state.history[-1]}" if state.history else "its row has new labels"
    return ConflictError(where, f"changed meanwhile: {last}", "look at it again, then decide")


def _check_sound(folder: Path, row: Recording, dataset: str) -> None:
    """Raise DataError unless the file, or the row of a table, has the stored sha256."""
    session = read_session(folder)
    path = audio_path(folder, session, row)
    if not path.is_file():
        raise DataError(path, "there is no such file", "restore it, or reject the recording")
    of_table = table_row(session, path, row)
    if of_table is not None:
        check_row(of_table)
        return
    check_unchanged(path, file_sha256(path), row.sha256, dataset)


def _undone(where: str, row: Recording, log: ChangeLog) -> tuple[str, str]:
    """Return the column and the cell after the last change that counts is taken back.

    Raises DataError if no change counts, or if recordings.csv itself has the changed cell.
    """
    active = log.active(row.recording_id, row.sha256)
    if not active:
        raise DataError(where, "has no change to undo", "look at the list with `ajgdata review`")
    last = active[-1]
    value = changed_cells(active[:-1]).get(last.column, _cell(row, last.column))
    if last.is_label and value == last.new:
        problem = f"recordings.csv itself has {last.column} = {value!r} now"
        raise DataError(where, problem, "give the other label with --label")
    return last.column, value if last.column else ""


def _new_quality(where: str, state: RecordingState, action: str) -> str:
    """Return the quality after `ok` or `reject`. Raises DataError if nothing would change."""
    quality = state.labels[QUALITY]
    if action == "reject":
        if state.is_rejected:
            raise NothingToChangeError(
                where, "is rejected already", "use --note for another reason"
            )
        return REJECT
    if state.is_reviewed:
        raise NothingToChangeError(where, "is accepted already", "nothing is to be done")
    return "ok" if state.is_rejected else quality


def _check_label(
    where: str, spec: DatasetSpec, state: RecordingState, column: str, value: str
) -> None:
    """Raise DataError for an unknown column, a value that is not a number, and the same value."""
    columns = label_columns_of(spec)
    if column not in columns:
        raise DataError(where, f"there is no label {column!r}", f"use one of {', '.join(columns)}")
    target = spec.label_targets.get(column)
    if target:
        try:
            parse_label(value, target)
        except ValueError:
            problem = f"{column} = {value!r} is not a finite number"
            raise DataError(where, problem, "write a number, e.g. 17.5") from None
    if state.labels.get(column, "") == value:
        fix = "use --ok to accept the recording"
        raise NothingToChangeError(where, f"{column} is {value!r} already", fix)


def _user() -> str:
    """Return the name of the user of the computer, or "unknown"."""
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):
        return "unknown"
