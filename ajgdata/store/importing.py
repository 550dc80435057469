"""Bring a folder of recordings in as sessions. Audio is copied or referenced, never altered."""

from __future__ import annotations

import shutil
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ajgdata.paths import AUDIO_FOLDER, EXCITATION_FILE, RECORDINGS_FILE, Paths
from ajgdata.store.audio import file_sha256, inspect_audio
from ajgdata.store.files import replacing
from ajgdata.store.provenance import software
from ajgdata.store.scan import Found, Scan
from ajgdata.store.sessions import read_recordings, read_session, write_session
from ajgdata.types import DataError, Excitation, Recording, Session


@dataclass
class Imported:
    """Counts of one import. `conflicts` are recordings whose bytes differ from those held."""

    sessions: int = 0
    added: int = 0
    relabelled: int = 0
    unchanged: int = 0
    conflicts: list[str] = field(default_factory=list)


def import_scan(
    paths: Paths,
    dataset: str,
    folder: Path,
    found: Scan,
    *,
    copy: bool,
    replace: bool,
    progress: Callable[[], object] = lambda: None,
) -> Imported:
    """Write the sessions of `found` below `folder` into `dataset`.

    Running it again adds what is new, takes over changed labels, and keeps recordings that are no
    longer in the folder. A recording whose bytes differ from those held is left alone and listed
    in `conflicts`, unless `replace`.
    """
    sessions: dict[str, list[Found]] = defaultdict(list)
    for one in found.found:
        sessions[one.session].append(one)
    result = Imported(sessions=len(sessions))
    for name, members in sorted(sessions.items()):
        target = paths.session(dataset, name)
        held = _held(target)
        before = set(held)
        _check_mode(target, copy=copy, folder=folder)
        for one, recording_id in zip(members, _ids(members), strict=True):
            recording = _recording(folder, one, recording_id, copy=copy)
            _take(folder / one.path, target, held, recording, result, copy=copy, replace=replace)
            progress()
        if not before and not held:
            continue
        excitation = _excitation(folder, found.excitations.get(name), target)
        session = Session(
            session_id=name,
            source="import",
            sample_rate_hz=_common_rate(folder, members),
            excitation=excitation,
            audio_root=None if copy else str(folder.absolute()),
            software=f"ajgdata {software()['ajgdata_version']}",
            notes=f"imported from a folder named {folder.name!r}",
        )
        write_session(target, session, sorted(held.values(), key=lambda r: r.recording_id))
    return result


def seal(paths: Paths, dataset: str, session: str) -> int:
    """Accept the bytes that are there: write the present sha256 of every recording.

    Returns how many rows changed. Missing files keep their row.
    """
    folder = paths.session(dataset, session)
    declared = read_session(folder)
    recordings, findings = read_recordings(folder)
    if findings:
        raise DataError(folder / RECORDINGS_FILE, findings[0].problem, findings[0].fix)
    base = Path(declared.audio_root) if declared.audio_root else folder
    sealed = [
        r.model_copy(update={"sha256": file_sha256(base / r.file)})
        if (base / r.file).is_file()
        else r
        for r in recordings
    ]
    write_session(folder, declared, sealed)
    return sum(new != old for new, old in zip(sealed, recordings, strict=True))


def _held(target: Path) -> dict[str, Recording]:
    if not (target / RECORDINGS_FILE).is_file():
        return {}
    recordings, findings = read_recordings(target)
    if findings:
        raise DataError(
            target / RECORDINGS_FILE,
            f"{findings[0].problem}; nothing was imported into this session",
            findings[0].fix,
        )
    return {r.recording_id: r for r in recordings}


def _check_mode(target: Path, *, copy: bool, folder: Path) -> None:
    if not (target / "session.yaml").is_file():
        return
    root = read_session(target).audio_root
    if root != (None if copy else str(folder.absolute())):
        held = f"references {root}" if root else "holds copies"
        raise DataError(
            target, f"this session {held}", "import the same way again, or with another --session"
        )


def _ids(members: Sequence[Found]) -> list[str]:
    """Path inside the folder without suffix; with suffix where two files would share it."""
    stems = [one.path.with_suffix("").as_posix() for one in members]
    counts = Counter(stems)
    return [
        one.path.as_posix() if counts[stem] > 1 else stem
        for one, stem in zip(members, stems, strict=True)
    ]


def _recording(folder: Path, one: Found, recording_id: str, *, copy: bool) -> Recording:
    file = Path(AUDIO_FOLDER, one.path) if copy else one.path
    return Recording(
        recording_id=recording_id,
        file=file.as_posix(),
        sha256=file_sha256(folder / one.path),
        grasp_id=one.grasp,
        sample=one.sample,
        object=one.object,
        labels=dict(one.labels),
    )


def _take(
    source: Path,
    target: Path,
    held: dict[str, Recording],
    recording: Recording,
    result: Imported,
    *,
    copy: bool,
    replace: bool,
) -> None:
    old = held.get(recording.recording_id)
    if old and old.sha256 != recording.sha256 and not replace:
        result.conflicts.append(recording.recording_id)
        return
    destination = target / recording.file
    if copy and not (destination.is_file() and file_sha256(destination) == recording.sha256):
        with replacing(destination) as temporary:
            shutil.copyfile(source, temporary)
    held[recording.recording_id] = recording
    if old is None:
        result.added += 1
    elif old != recording:
        result.relabelled += 1
    else:
        result.unchanged += 1


def _excitation(folder: Path, source: Path | None, target: Path) -> Excitation | None:
    if source is None:
        return None
    played = target / EXCITATION_FILE
    with replacing(played) as temporary:
        shutil.copyfile(folder / source, temporary)
    return Excitation(
        file=EXCITATION_FILE, sha256=file_sha256(played), description=f"imported {source.name}"
    )


def _common_rate(folder: Path, members: Sequence[Found]) -> int | None:
    """The rate that all readable recordings share, else None."""
    rates = set()
    for one in members:
        try:
            rates.add(inspect_audio(folder / one.path).sample_rate_hz)
        except DataError:
            continue  # an unreadable recording is imported as it is, and named by `validate`
    return rates.pop() if len(rates) == 1 else None
