"""Grasps + source -> a session on disk, one recording at a time, resumable at any moment."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ajgdata.acquire.session_setup import recording_alone
from ajgdata.acquire.source import Grasp, GraspError, Source
from ajgdata.paths import AUDIO_FOLDER, EXCITATION_FILE, RECORDINGS_FILE, SESSION_FILE
from ajgdata.store.audio import file_sha256, write_pcm24
from ajgdata.store.files import remove_stale
from ajgdata.store.provenance import software
from ajgdata.store.sessions import read_recordings, write_recordings, write_session
from ajgdata.types import DataError, Excitation, Recording, Session

#: Column that says from which setup a recording was made; a changed setup is recorded again.
SETUP_COLUMN = "setup_sha256"


class Acquired(NamedTuple):
    """An acquisition's outcome: recordings made, recordings that were there already, grasps that
    could not be made, with the reason, and scenes that had to be simulated for it (`solved` of a
    source that has it)."""

    recorded: int
    kept: int
    skipped: Mapping[str, str]
    solved: int = 0


def acquire_session(
    folder: Path,
    source: Source,
    grasps: Sequence[Grasp],
    *,
    notes: str = "",
    progress: Callable[[], object] = lambda: None,
) -> Acquired:
    """Make the session at `folder` hold `grasps`.

    Recordings already made of the same setup are kept. The table is rewritten after each grasp, so
    a killed acquisition goes on where it stopped; session.yaml comes last, so that a folder without
    it is known to be incomplete. `progress` is called once a recording. A grasp that cannot be made
    is left out and named in session.yaml; the rest goes on.

    A virtual session then holds exactly `grasps`. What a real source recorded cannot be made again:
    it is never removed, and DataError is raised when it would have to be replaced; so it is while
    another process records into the session.
    """
    with recording_alone(folder):
        return _acquired(folder, source, grasps, notes, progress)


def _acquired(
    folder: Path,
    source: Source,
    grasps: Sequence[Grasp],
    notes: str,
    progress: Callable[[], object],
) -> Acquired:
    held = _held(folder)
    planned = [(grasp, _rows(folder, source, grasp, held)) for grasp in grasps]
    missing = [grasp for grasp, rows in planned if not all(row.sha256 for row in rows)]
    sound = source.excitation()
    if missing:
        (folder / SESSION_FILE).unlink(missing_ok=True)  # incomplete until all is made
    wanted: list[Recording] = []
    skipped: dict[str, str] = {}
    recorded = kept = 0
    for grasp, rows in planned:
        for row in rows:
            held.pop(row.recording_id, None)
        there, why_not = _complete(folder, source, grasp, rows, progress)
        before = sum(bool(row.sha256) for row in rows)
        kept, recorded = kept + before, recorded + len(there) - before
        wanted += there
        if why_not:
            skipped[grasp.grasp_id] = why_not
        if len(there) > before:
            write_recordings(folder, [*wanted, *held.values()])
    if source.kind != "virtual":
        wanted += held.values()
    write_session(folder, _session(folder, source, sound, notes, skipped), wanted)
    if source.kind == "virtual":
        _remove_others(folder, wanted)
    remove_stale(folder)  # of acquisitions that were killed
    return Acquired(recorded, kept, skipped, getattr(source, "solved", 0))


def _rows(
    folder: Path, source: Source, grasp: Grasp, held: Mapping[str, Recording]
) -> list[Recording]:
    """Return a row for each sample of `grasp`; those that need no recording have their sha256."""
    rows = []
    for row in (_row(grasp, sample) for sample in range(grasp.samples)):
        old = held.get(row.recording_id)
        same = old is not None and _same(folder, old, row)
        if old and not same and source.kind != "virtual" and (folder / row.file).is_file():
            raise DataError(
                folder / row.file,
                "was recorded of another setup, or altered since",
                "record into another session",
            )
        known = {"sha256": old.sha256, "quality": old.quality} if old and same else {}
        rows.append(row.model_copy(update=known))
    return rows


def _complete(
    folder: Path,
    source: Source,
    grasp: Grasp,
    rows: Sequence[Recording],
    progress: Callable[[], object],
) -> tuple[list[Recording], str]:
    """Record those of `rows` that are missing; what there is then, and why not all."""
    there = [row for row in rows if row.sha256]
    why_not = ""
    for row in rows:
        if not row.sha256 and not why_not:
            try:
                there.append(_record(folder, source, grasp, row))
            except GraspError as error:
                why_not = f"{error.problem}; {error.fix}"
        progress()
    return sorted(there, key=lambda row: row.sample), why_not


def _record(folder: Path, source: Source, grasp: Grasp, row: Recording) -> Recording:
    take = source.take(grasp, row.sample)
    write_pcm24(folder / row.file, take.samples, source.sample_rate_hz)
    quality = "clipped" if take.clipped else "ok"
    digest = file_sha256(folder / row.file)
    return row.model_copy(update={"sha256": digest, "quality": quality})


def _session(
    folder: Path, source: Source, sound: np.ndarray | None, notes: str, skipped: dict[str, str]
) -> Session:
    about = dict(source.describe())
    told = about.pop("excitation", {})
    played, path = None, folder / EXCITATION_FILE
    if sound is None:
        path.unlink(missing_ok=True)
    else:
        write_pcm24(path, sound, source.sample_rate_hz)
        played = Excitation(file=EXCITATION_FILE, sha256=file_sha256(path), **told)
    return Session(
        session_id=folder.name,
        source=source.kind,
        sample_rate_hz=source.sample_rate_hz,
        excitation=played,
        software=f"ajgdata {software()['ajgdata_version']}",
        notes=notes,
        skipped=skipped,
        **about,
    )


def _row(grasp: Grasp, sample: int) -> Recording:
    name = grasp.recording_id(sample)
    return Recording(
        recording_id=name,
        file=f"{AUDIO_FOLDER}/{name}.wav",
        grasp_id=grasp.grasp_id,
        sample=sample,
        object=grasp.object,
        labels={
            **{key: str(value) for key, value in grasp.targets.items()},
            SETUP_COLUMN: grasp.digest,
        },
    )


def _held(folder: Path) -> dict[str, Recording]:
    if not (folder / RECORDINGS_FILE).is_file():
        return {}
    return {r.recording_id: r for r in read_recordings(folder)[0]}


def _same(folder: Path, old: Recording, row: Recording) -> bool:
    """Return True if `old` was made from the setup of `row` and its file is what was written
    then."""
    path = folder / row.file
    return (
        old.labels.get(SETUP_COLUMN) == row.labels[SETUP_COLUMN]
        and path.is_file()
        and file_sha256(path) == old.sha256
    )


def _remove_others(folder: Path, wanted: Iterable[Recording]) -> None:
    """Simulated recordings that the recipe no longer asks for can be made again: remove them."""
    names = {Path(r.file).name for r in wanted}
    for path in (folder / AUDIO_FOLDER).glob("*.wav"):
        if path.name not in names:
            path.unlink()
