"""A simulated session on disk, recorded from the grasps of a recipe. It resumes after a stop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import NamedTuple

from ajgdata.acquire.recipe import RecipeGrasp
from ajgdata.acquire.virtual import GraspError, VirtualGripper
from ajgdata.paths import AUDIO_FOLDER, EXCITATION_FILE, RECORDINGS_FILE, SESSION_FILE
from ajgdata.store.audio import SIMULATED, file_sha256, write_pcm24
from ajgdata.store.lock import locked
from ajgdata.store.provenance import software
from ajgdata.store.sessions import (
    check_session_format,
    read_table,
    write_recordings,
    write_session,
)
from ajgdata.types import Excitation, Recording, Session

#: Column with the hash of a recording's setup; a changed setup is recorded again.
SETUP_COLUMN = "setup_sha256"


class Acquired(NamedTuple):
    """Numbers of a simulated session: new and unchanged recordings, and simulated scenes.

    `skipped` are grasps that cannot be simulated, with the reason.
    """

    recorded: int
    unchanged: int
    skipped: Mapping[str, str]
    solved: int = 0


def recording_alone(folder: Path) -> AbstractContextManager[None]:
    """Return the lock of a session. It raises DataError if another process records into it."""
    fix = "wait for that one, or record into another session"
    return locked(folder, "recording into this session", fix)


def acquire_session(
    folder: Path, source: VirtualGripper, grasps: Sequence[RecipeGrasp]
) -> Acquired:
    """Write the session at `folder` so that it contains exactly `grasps`.

    Existing recordings of the same setup stay. The table is written after each grasp, so a killed
    acquisition resumes. session.yaml is written last: a folder without it is incomplete. An
    impossible grasp is skipped and named in session.yaml. Raises DataError while another process
    records into the session, and for a session of another version of ajgdata.
    """
    with recording_alone(folder):
        check_session_format(folder)
        known = _known(folder)
        planned = [(grasp, _rows(folder, grasp, known)) for grasp in grasps]
        if not all(row.sha256 for _, rows in planned for row in rows):
            (folder / SESSION_FILE).unlink(missing_ok=True)  # incomplete until the end
        complete: list[Recording] = []
        skipped: dict[str, str] = {}
        recorded = 0
        for grasp, rows in planned:
            for row in rows:
                known.pop(row.recording_id, None)
            written, reason = _record_missing(folder, source, grasp, rows)
            complete += written
            if reason:
                skipped[grasp.grasp_id] = reason
            new_count = len(written) - len([row for row in rows if row.sha256])
            if new_count:
                recorded += new_count
                write_recordings(folder, [*complete, *known.values()])
        write_session(folder, _session(folder, source, skipped), complete)
        files = {folder / row.file for row in complete}
        for path in folder.glob(f"{AUDIO_FOLDER}/*.wav"):
            if path not in files:  # the recipe no longer has this recording
                path.unlink()
    return Acquired(recorded, len(complete) - recorded, skipped, source.solved)


def _rows(folder: Path, grasp: RecipeGrasp, known: Mapping[str, Recording]) -> list[Recording]:
    """Return a row for each sample of `grasp`; rows that need no recording have their sha256."""
    rows = []
    for sample in range(grasp.samples):
        row = _row(grasp, sample)
        old = known.get(row.recording_id)
        if old and _is_current(folder / row.file, old, row.labels[SETUP_COLUMN]):
            row = row.model_copy(update={"sha256": old.sha256, "quality": old.quality})
        rows.append(row)
    return rows


def _is_current(path: Path, row: Recording, setup: str) -> bool:
    """Return whether `path` is the unchanged recording of a row that has this setup."""
    has_setup = row.labels.get(SETUP_COLUMN) == setup
    return has_setup and path.is_file() and file_sha256(path) == row.sha256


def _record_missing(
    folder: Path, source: VirtualGripper, grasp: RecipeGrasp, rows: Sequence[Recording]
) -> tuple[list[Recording], str]:
    """Record the rows without sha256; return the rows with a file, and an error of the grasp.

    After an error, the remaining rows are not recorded.
    """
    complete = [row for row in rows if row.sha256]
    reason = ""
    for row in rows:
        if not row.sha256 and not reason:
            try:
                complete.append(_record(folder, source, grasp, row))
            except GraspError as error:
                reason = f"{error.problem}; {error.fix}"
    return sorted(complete, key=lambda row: row.sample), reason


def _record(folder: Path, source: VirtualGripper, grasp: RecipeGrasp, row: Recording) -> Recording:
    """Write the recording of a row; return the row with its hash and quality."""
    take = source.take(grasp, row.sample)
    write_pcm24(folder / row.file, take.samples, source.sample_rate_hz, SIMULATED)
    quality = "clipped" if take.clipped_count else "ok"
    digest = file_sha256(folder / row.file)
    return row.model_copy(update={"sha256": digest, "quality": quality})


def _session(folder: Path, source: VirtualGripper, skipped: dict[str, str]) -> Session:
    """Return the description of a session, and write its excitation."""
    about = dict(source.describe())
    settings = about.pop("excitation", {})
    sound = source.excitation()
    path = folder / EXCITATION_FILE
    played = None
    if sound is None:
        path.unlink(missing_ok=True)
    else:
        write_pcm24(path, sound, source.sample_rate_hz)
        played = Excitation(file=EXCITATION_FILE, sha256=file_sha256(path), **settings)
    return Session(
        session_id=folder.name,
        source="virtual",
        sample_rate_hz=source.sample_rate_hz,
        excitation=played,
        software=f"ajgdata {software()['ajgdata_version']}",
        skipped=skipped,
        **about,
    )


def _row(grasp: RecipeGrasp, sample: int) -> Recording:
    """Return the row of one sample of a grasp, without a hash."""
    name = grasp.recording_id(sample)
    targets = {key: str(value) for key, value in grasp.targets.items()}
    return Recording(
        recording_id=name,
        file=f"{AUDIO_FOLDER}/{name}.wav",
        grasp_id=grasp.grasp_id,
        placement_id=grasp.placement_id,
        sample=sample,
        object=grasp.object,
        labels={**targets, SETUP_COLUMN: grasp.digest},
    )


def _known(folder: Path) -> dict[str, Recording]:
    """Return the existing rows of the table by recording id."""
    if not (folder / RECORDINGS_FILE).is_file():
        return {}
    return {row.recording_id: row for row in read_table(folder)[0]}
