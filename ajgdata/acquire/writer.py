"""Grasps + source -> a session on disk, one recording at a time, resumable at any moment."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from ajgdata.acquire.source import Grasp, Source
from ajgdata.paths import AUDIO_FOLDER, EXCITATION_FILE, RECORDINGS_FILE, SESSION_FILE
from ajgdata.store.audio import file_sha256, write_pcm24
from ajgdata.store.provenance import software
from ajgdata.store.sessions import read_recordings, write_recordings, write_session
from ajgdata.types import DataError, Excitation, Recording, Session

#: Column that says from which setup a recording was made; a changed setup is recorded again.
SETUP_COLUMN = "setup_sha256"


def acquire_session(
    folder: Path,
    source: Source,
    grasps: Sequence[Grasp],
    *,
    notes: str = "",
    progress: Callable[[], object] = lambda: None,
) -> tuple[int, int]:
    """Make the session at `folder` hold `grasps`; returns (recorded, kept) counts.

    Recordings already made of the same setup are kept. The table is rewritten after each grasp, so
    a killed acquisition goes on where it stopped; session.yaml comes last, so that a folder without
    it is known to be incomplete. `progress` is called once a recording.

    A virtual session then holds exactly `grasps`. What a real source recorded cannot be made again:
    it is never removed, and DataError is raised when it would have to be replaced.
    """
    held = _held(folder)
    wanted: list[Recording] = []
    recorded = kept = 0
    sound = source.excitation()
    for grasp in grasps:
        before = recorded
        for row in (_row(grasp, sample) for sample in range(grasp.samples)):
            old = held.pop(row.recording_id, None)
            if old and _same(folder, old, row):
                wanted.append(row.model_copy(update={"sha256": old.sha256, "quality": old.quality}))
                kept += 1
            else:
                if old and source.kind != "virtual" and (folder / row.file).is_file():
                    raise DataError(
                        folder / row.file,
                        "was recorded of another setup, or altered since",
                        "record into another session",
                    )
                (folder / SESSION_FILE).unlink(missing_ok=True)  # incomplete until all is made
                take = source.take(grasp, row.sample)
                write_pcm24(folder / row.file, take.samples, source.sample_rate_hz)
                quality = "clipped" if take.clipped else "ok"
                digest = file_sha256(folder / row.file)
                wanted.append(row.model_copy(update={"sha256": digest, "quality": quality}))
                recorded += 1
            progress()
        if recorded > before:
            write_recordings(folder, [*wanted, *held.values()])
    if source.kind != "virtual":
        wanted += held.values()
    write_session(folder, _session(folder, source, sound, notes), wanted)
    if source.kind == "virtual":
        _remove_others(folder, wanted)
    return recorded, kept


def _session(folder: Path, source: Source, sound: np.ndarray, notes: str) -> Session:
    path = folder / EXCITATION_FILE
    write_pcm24(path, sound, source.sample_rate_hz)
    return Session(
        session_id=folder.name,
        source=source.kind,
        sample_rate_hz=source.sample_rate_hz,
        excitation=Excitation(
            file=EXCITATION_FILE, sha256=file_sha256(path), description="logarithmic sweep"
        ),
        software=f"ajgdata {software()['ajgdata_version']}",
        notes=notes,
        **source.describe(),
    )


def _row(grasp: Grasp, sample: int) -> Recording:
    name = f"{grasp.grasp_id}_{sample + 1}"
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
    """Whether `old` was made from the setup of `row` and its file is what was written then."""
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
