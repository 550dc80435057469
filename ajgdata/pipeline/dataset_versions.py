"""Versions of a data set that `ajgdata diff` compares: in a project, in a folder, or published."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from ajgdata.acquire.recipe import session_names
from ajgdata.paths import Paths, Tree, find_project
from ajgdata.store.audio import file_sha256, segment_bytes
from ajgdata.store.files import read_csv, sha256_of
from ajgdata.store.findings import is_rejected, read_findings
from ajgdata.store.labels import CHANNEL_LEVELS, label_columns
from ajgdata.store.publishing.archive import read_checksums
from ajgdata.store.publishing.format_version import check_published_format
from ajgdata.store.publishing.table import FILE_NAME, cell_texts
from ajgdata.store.remote.origins import origin_of
from ajgdata.store.session_audio import label_rows
from ajgdata.store.sessions import (
    audio_path,
    dropped_sessions,
    list_sessions,
    read_dataset,
    read_recordings,
    read_session,
)
from ajgdata.types import NAME_PATTERN, WHOLE_FILE, DataError, Recording, Session, Target, left_out

#: Columns that are not compared as labels: names, sounds, and what checks and programs wrote.
NOT_COMPARED = {
    FILE_NAME,
    "recording",
    "session_id",
    "sample",
    "start_s",
    "end_s",
    "source",
    "flags",
    "sha256",
    "setup_sha256",
    CHANNEL_LEVELS,
}
#: Columns whose values begin with the name of the session.
_IN_SESSION = ("grasp_id", "placement_id")


class VersionRow(NamedTuple):
    """One recording of a version: sha256 of its sound ("": unknown), and labels by column."""

    sha256: str
    labels: Mapping[str, str]


#: The recordings of a version of a data set, by `<session>/<recording_id>`.
VersionRows = Mapping[str, VersionRow]


def read_version(text: str) -> VersionRows:
    """Return the recordings of the version of a data set that a user names.

    `text` is a name in the present project, `PROJECT:NAME`, a published folder, or an address as
    for `ajgdata fetch`. Raises DataError for any other text, and for a version that cannot be read.
    """
    if NAME_PATTERN.fullmatch(text):
        return _of_project(find_project(), text)
    origin = origin_of(text)
    if origin is not None:
        with TemporaryDirectory() as folder:
            tree = Tree(Path(folder) / "tree")
            origin.download(tree.root, tree.SUMS)
            hashes = read_checksums(tree / tree.SUMS)
            for name in {tree.DATAPACKAGE, tree.METADATA} & set(hashes):
                origin.download(tree.root, name, hashes[name])
            return _of_published(tree)
    root, colon, name = text.rpartition(":")
    if colon and (Path(root) / "datasets").is_dir():
        return _of_project(Paths(Path(root)), name)
    tree = Tree(Path(text))
    if (tree / tree.SUMS).is_file():
        return _of_published(tree)
    fix = "use NAME, PROJECT_FOLDER:NAME, a published folder, or an address as for `ajgdata fetch`"
    raise DataError(text, "is not a version of a data set", fix)


def _of_published(tree: Tree) -> VersionRows:
    """Return the version in a published folder, of which only two files are needed."""
    check_published_format(tree)
    file = tree / tree.METADATA
    if not file.is_file() or file_sha256(file) != read_checksums(tree / tree.SUMS).get(file.name):
        problem = f"its bytes are not those of {tree.SUMS} (sha256 differs)"
        raise DataError(file, problem, "fetch or copy it again")
    _, rows = read_csv(file, required=("recording", "sha256"))
    return {row["recording"]: VersionRow(row["sha256"], _compared(row)) for row in rows}


def _of_project(paths: Paths, dataset: str) -> VersionRows:
    """Return the recordings of a data set of a project that are neither rejected nor quarantined.

    A recording without sha256 in its table, and a segment, has that of its present sound. The
    present `quality` decides whether it is rejected, because a person can accept it after the run.
    """
    spec = read_dataset(paths, dataset)
    quarantine = paths.quarantine(dataset)
    issues_of_run = read_findings(quarantine) if quarantine.is_file() else []
    excluded = left_out(issue for issue in issues_of_run if issue.code != "rejected")
    dropped = dropped_sessions(paths, dataset, session_names(spec.recipe))
    labels: list[dict[str, str]] = []
    hashes: list[str] = []
    for name in list_sessions(paths, dataset):
        if name in dropped:
            continue
        folder = paths.session(dataset, name)
        session = read_session(folder)
        recordings, issues = read_recordings(folder)
        if issues:
            raise DataError(folder, issues[0].problem, issues[0].fix)
        texts = label_rows(session, recordings)
        for recording, row in zip(recordings, texts, strict=True):
            is_excluded = (name, recording.recording_id) in excluded
            if not is_excluded and not is_rejected(row):
                labels.append({**row, "session_id": name})
                hashes.append(_sha256(folder, session, recording))
    rows = _cells(labels, spec.label_targets)
    return {
        row["recording"]: VersionRow(sha256, _compared(row))
        for row, sha256 in zip(rows, hashes, strict=True)
    }


def _cells(
    labels: Sequence[Mapping[str, str]], targets: Mapping[str, Target]
) -> list[dict[str, str]]:
    """Return rows of labels with the cells that a published table has."""
    names = {column for row in labels for column in row}
    columns = label_columns(labels, names, targets)
    cells = {name: cell_texts(column.values) for name, column in columns.items()}
    return [{name: texts[row] for name, texts in cells.items()} for row in range(len(labels))]


def _sha256(folder: Path, session: Session, recording: Recording) -> str:
    """Return the sha256 with which a recording is published; "" if its file is missing."""
    if recording.sha256 and recording.segment == WHOLE_FILE:
        return recording.sha256
    path = audio_path(folder, session, recording)
    if not path.is_file():
        return ""
    if recording.segment == WHOLE_FILE:
        return file_sha256(path)
    return sha256_of(segment_bytes(path, recording.segment))


def _compared(row: Mapping[str, str]) -> dict[str, str]:
    """Return the labels of a row. Grasps and placements are without the name of the session."""
    labels = {column: cell for column, cell in row.items() if column not in NOT_COMPARED}
    session = row["recording"].partition("/")[0]
    for column in _IN_SESSION:
        if column in labels:
            labels[column] = labels[column].removeprefix(f"{session}/")
    return labels
