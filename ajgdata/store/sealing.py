"""Accept recordings as they are: their present hashes become those that are written down."""

from __future__ import annotations

from ajgdata.paths import RECORDINGS_FILE, Paths
from ajgdata.store.audio import file_sha256
from ajgdata.store.sessions import audio_path, inside, read_recordings, read_session, write_session
from ajgdata.types import DataError


def seal(paths: Paths, dataset: str, session: str) -> int:
    """Accept the bytes that are there: write the present sha256 of every recording and of the
    played sound.

    Returns how many recordings changed. Missing files keep their row.
    """
    folder = paths.session(dataset, session)
    declared = read_session(folder)
    recordings, findings = read_recordings(folder)
    if findings:
        raise DataError(folder / RECORDINGS_FILE, findings[0].problem, findings[0].fix)
    sealed = []
    for recording in recordings:
        path = audio_path(folder, declared, recording)
        digest = file_sha256(path) if path.is_file() else recording.sha256
        sealed.append(recording.model_copy(update={"sha256": digest}))
    if (played := declared.excitation) and (path := inside(folder, played.file)).is_file():
        played = played.model_copy(update={"sha256": file_sha256(path)})
    write_session(folder, declared.model_copy(update={"excitation": played}), sealed)
    return sum(new != old for new, old in zip(sealed, recordings, strict=True))
