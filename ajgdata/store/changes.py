"""changes.jsonl of a session: the decisions of people about its recordings, one line per change.

recordings.csv has the cells that were imported or recorded. The labels of a recording are these
cells with its changes. An import writes recordings.csv only, so it cannot replace a decision, and
a change is one line at the end of a file, so a killed process loses no earlier change.

A line is JSON: a part of a line is never valid, in contrast to a part of a line of CSV. People can
read it, and Git shows each change as one added line.
"""

from __future__ import annotations

import json
import os
from collections import defaultdict
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from pydantic import ValidationError

from ajgdata.paths import CHANGES_FILE
from ajgdata.store.files import plain_text
from ajgdata.types import DataError, Recording, describe
from ajgdata.types.change import OBJECT, QUALITY, REJECT, LabelChange

#: Byte-order mark that some editors write at the beginning of a file.
_MARK = b"\xef\xbb\xbf"
_FIX = "correct the line, or delete it"


@dataclass(frozen=True)
class ChangeLog:
    """All changes of a session, the earliest first.

    `torn` is the beginning of a line that a process could not complete, "" without such a line.
    """

    changes: tuple[LabelChange, ...] = ()
    torn: str = ""

    @cached_property
    def by_recording(self) -> Mapping[str, Sequence[LabelChange]]:
        """The changes of each recording, by recording_id."""
        changes: defaultdict[str, list[LabelChange]] = defaultdict(list)
        for change in self.changes:
            changes[change.recording_id].append(change)
        return dict(changes)

    def active(self, recording_id: str, sha256: str) -> list[LabelChange]:
        """Return the changes of a recording that count: for this sound, and not taken back.

        A change of a recording with another sha256 was for another sound. An empty sha256 is of any
        sound, because sessions without checksums have none.
        """
        active: list[LabelChange] = []
        for change in self.by_recording.get(recording_id, ()):
            if "" not in (sha256, change.sha256) and change.sha256 != sha256:
                continue
            if change.action == "undo":
                active = active[:-1]
            else:
                active.append(change)
        return active

    def cells(self, recording_id: str, sha256: str) -> dict[str, str]:
        """Return the cells of a recording that people changed, by column."""
        return changed_cells(self.active(recording_id, sha256))

    def label_lines(self) -> list[str]:
        """Return one text per recording and sound with changed cells, in the order of their names.

        Two logs have equal texts if they give all recordings the same labels. Notes do not count,
        nor do changes that were taken back.
        """
        sounds = sorted({(change.recording_id, change.sha256) for change in self.changes})
        cells = {sound: self.cells(*sound) for sound in sounds}
        return [
            json.dumps([*sound, *sorted(changed.items())])
            for sound, changed in cells.items()
            if changed
        ]


def changed_cells(active: Sequence[LabelChange]) -> dict[str, str]:
    """Return the cells, by column, after changes that count."""
    return {change.column: change.new for change in active if change.is_label}


def is_reviewed(active: Sequence[LabelChange]) -> bool:
    """Return whether a person accepted a recording after all other changes of its labels."""
    decisions = [change.action for change in active if change.action != "note"]
    return bool(decisions) and decisions[-1] == "ok"


def with_changes(recording: Recording, log: ChangeLog) -> Recording:
    """Return a row of recordings.csv with the changes of people."""
    cells = log.cells(recording.recording_id, recording.sha256)
    if not cells:
        return recording
    own = {name: text for name, text in cells.items() if name in (OBJECT, QUALITY)}
    others = {name: text for name, text in cells.items() if name not in own}
    return recording.model_copy(update={**own, "labels": {**recording.labels, **others}})


def read_changes(folder: Path) -> ChangeLog:
    """Return the changes of the session in `folder`.

    Raises DataError, with the line, for a line that is not a change. The last line can be
    incomplete, because a process was killed or is still writing: it is not a change.
    """
    path = folder / CHANGES_FILE
    if not path.is_file():
        return ChangeLog()
    try:
        content = path.read_bytes().removeprefix(_MARK)
    except OSError as error:
        problem = f"cannot be read ({error.strerror})"
        raise DataError(path, problem, "check the file and its permissions") from None
    *lines, last = content.split(b"\n")
    changes = [
        _parsed(path, number, line) for number, line in enumerate(lines, start=1) if line.strip()
    ]
    torn = ""
    if last.strip():
        try:
            changes.append(_parsed(path, len(lines) + 1, last))
        except DataError:
            torn = last.decode(errors="replace")
    return ChangeLog(tuple(changes), torn)


def _parsed(path: Path, number: int, line: bytes) -> LabelChange:
    """Return the change in a line, with plain texts as in recordings.csv (see `plain_text`).

    Raises DataError for any other content.
    """
    where = f"{path}:{number}"
    try:
        change = LabelChange.model_validate(json.loads(line))
    except ValidationError as error:
        invalid = describe(error, where)
        raise DataError(where, invalid.problem, _FIX) from None
    except ValueError:
        raise DataError(where, "not a change (no valid JSON)", _FIX) from None
    texts = {
        "old": change.old,
        "new": change.new,
        "reason": change.reason,
        "author": change.author,
    }
    plain = {name: plain_text(text) for name, text in texts.items()}
    return change if plain == texts else change.model_copy(update=plain)


def log_bytes(changes: Sequence[LabelChange]) -> bytes:
    """Return changes as the content of changes.jsonl."""
    lines = [json.dumps(change.model_dump(), ensure_ascii=False) for change in changes]
    return "".join(f"{line}\n" for line in lines).encode()


def append_change(folder: Path, change: LabelChange) -> None:
    """Write a change at the end of the log of the session in `folder`, and wait for the disk.

    Call this function in the lock of the log (`lock.locked`). An incomplete last line of a killed
    process is removed first; the earlier lines stay as they are. Raises OSError, and leaves no
    part of the line, if the disk is full.
    """
    path = folder / CHANGES_FILE
    is_new = not path.exists()
    content = b"" if is_new else path.read_bytes()
    complete = len(content)
    line = log_bytes([change])
    if content and not content.endswith(b"\n"):
        if read_changes(folder).torn:
            complete = content.rfind(b"\n") + 1
        else:
            line = b"\n" + line
    with path.open("ab", buffering=0) as stream:
        stream.truncate(complete)
        try:
            written = stream.write(line)
            if written < len(line):
                stream.write(line[written:])
            os.fsync(stream.fileno())
        except OSError:
            stream.truncate(complete)
            raise
    if is_new:
        _sync_folder(folder)


def _sync_folder(folder: Path) -> None:
    """Wait until the name of a new file is on the disk; Windows cannot open a folder."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def count_by_hand(log: ChangeLog, recordings: Sequence[Recording]) -> tuple[int, int]:
    """Return the numbers of recordings with a label that people changed, and that people rejected.

    `recordings` are rows of recordings.csv.
    """
    labelled = 0
    rejected = 0
    for row in recordings:
        cells = log.cells(row.recording_id, row.sha256)
        is_rejected = cells.get("quality") == REJECT
        rejected += is_rejected
        labelled += not is_rejected and bool(set(cells) - {"quality"})
    return labelled, rejected
