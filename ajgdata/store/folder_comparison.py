"""Comparison of a folder with a session: is it the folder from which the session was imported?"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class StoredFile:
    """A recording of the session: its path in the imported folder, and its sha256 ("" if the table
    has none)."""

    path: Path
    sha256: str


@dataclass(frozen=True)
class FolderComparison:
    """Comparison of the files of a folder with the recordings of a session.

    `known` recordings are in the folder. `edited` paths have other bytes there. `gone` recordings
    have no file there. `new` files have a path and bytes that the session does not have.
    """

    known: tuple[Path, ...]
    edited: tuple[Path, ...]
    gone: tuple[Path, ...]
    new: tuple[Path, ...]

    @property
    def is_other_folder(self) -> bool:
        """True if the folder has other files, and lacks more recordings than it has.

        Two days can share a few files, e.g. the recording of an empty gripper.
        """
        missing = len(self.edited) + len(self.gone)
        return bool(self.new or self.edited) and missing > len(self.known)

    @property
    def has_mostly_other_files(self) -> bool:
        """True if more files of the folder are other files than recordings of the session.

        A session of several folders lacks many recordings in each of its folders.
        """
        return len(self.new) + len(self.edited) > len(self.known)


def compare_folder(
    stored: Collection[StoredFile],
    files: Mapping[Path, str],
    paths: Collection[Path],
    digests: Collection[str],
) -> FolderComparison:
    """Return how a folder differs from the recordings of a session.

    `files` are the sha256 of the files that are imported into the session, by path. `paths` and
    `digests` are those of all audio files of the folder. A recording without a sha256 is known if
    its path is in the folder, because its bytes cannot be compared.
    """
    known: list[Path] = []
    edited: list[Path] = []
    gone: list[Path] = []
    for recording in stored:
        if recording.sha256 in digests:
            known.append(recording.path)
        elif recording.path not in paths:
            gone.append(recording.path)
        elif recording.sha256:
            edited.append(recording.path)
        else:
            known.append(recording.path)
    stored_paths = {recording.path for recording in stored}
    stored_digests = {recording.sha256 for recording in stored}
    new = [
        path
        for path, digest in files.items()
        if path not in stored_paths and digest not in stored_digests
    ]
    return FolderComparison(
        tuple(sorted(known)), tuple(sorted(edited)), tuple(sorted(gone)), tuple(sorted(new))
    )
