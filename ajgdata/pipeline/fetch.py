"""`ajgdata fetch`: register a published data set, from a folder or the web, in this project.

A published data set is untrusted input: hashes and names are checked before anything is written
into the project, nothing of it is run, and whatever would start a program is removed.
It is registered completely or not at all. Spectra are not fetched: the next run computes them.
"""

from __future__ import annotations

import json
import shutil
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any
from zipfile import ZipFile

from pydantic import ValidationError

from ajgdata.paths import AUDIO_FOLDER, EXCITATION_FILE, Paths, Tree
from ajgdata.pipeline.importing import import_folder
from ajgdata.pipeline.progress import Started
from ajgdata.store.audio import file_sha256
from ajgdata.store.files import (
    BRINGING,
    alone,
    read_model,
    read_yaml,
    replacing_folder,
    sha256_of,
    write_bytes,
)
from ajgdata.store.importing import Imported
from ajgdata.store.publishing import archive
from ajgdata.store.publishing.archive import DISTRUST, download, is_web, read_checksums
from ajgdata.store.publishing.table import FILE_NAME, read_table, recordings_of
from ajgdata.store.scan import Scan
from ajgdata.store.sessions import (
    list_datasets,
    read_session,
    write_dataset,
    write_session,
)
from ajgdata.store.sources import bring, list_sources, read_source
from ajgdata.types import NAME, DataError, DatasetSpec, Recording, checked_name, describe

#: Stored with the recordings, because the licence may require it.
KEPT = (Tree.README, Tree.LICENCE, Tree.CITATION, Tree.SUMS)
#: Longest text of a removed setting that is shown.
_SHOWN = 200

Each = Callable[[list[str]], Iterable[str]]


@dataclass(frozen=True)
class Fetched:
    """The data set that was registered.

    `dropped` are data sets that its tasks are tested on and that this project does not have;
    `removed` are settings that were not taken over, one line each.
    """

    name: str
    sums_sha256: str
    recordings: int
    sessions: int
    dropped: tuple[str, ...]
    removed: tuple[str, ...]


def fetch(
    paths: Paths, source: str, *, name: str = "", sha256: str = "", each: Each = iter
) -> Fetched:
    """Register the published data set at `source`, a folder or a web address, as `name` (default:
    its own). `sha256` is the hash of its SHA256SUMS, if it is known; without it, the files are only
    checked against each other. `each` iterates over the files and may show progress.

    After an interruption, the same call resumes. Raises DataError, and changes nothing in the
    project, for anything that is wrong, for a name that exists, and while another process fetches
    the same data set.
    """
    if name:
        checked_name(name)
    tree = Tree(Path(source))
    with ExitStack() as locks:
        if is_web(source):
            tree = Tree(paths.fetched / sha256_of(source.encode())[:16])
            locks.enter_context(alone(tree.root, f"fetching {source}"))
            hashes = _downloaded(paths, source.removesuffix(Tree.SUMS), tree, name, sha256, each)
        else:
            hashes = _checked(paths, tree, sha256)
        spec, dropped, removed = _declared(paths, tree, name)
        locks.enter_context(alone(paths.recordings(spec.name), BRINGING))
        rows = _registered(paths, tree, hashes, spec)
    if is_web(source):
        shutil.rmtree(tree.root, ignore_errors=True)
    digest = file_sha256(paths.fetched_sums(spec.name))
    sessions = len({session for _, session, _ in rows})
    return Fetched(spec.name, digest, len(rows), sessions, dropped, removed)


def _registered(
    paths: Paths, tree: Tree, hashes: Mapping[str, str], spec: DatasetSpec
) -> list[tuple[str, str, Recording]]:
    """Write a fetched data set into the project; return its rows."""
    rows = _rows(tree, hashes)
    _check_free(paths, spec.name, tree)
    sessions: dict[str, list[tuple[str, Recording]]] = defaultdict(list)
    for file, session, recording in rows:
        sessions[session].append((file, recording))
    with (
        archive.reading(tree / tree.ARCHIVE) as packed,
        replacing_folder(paths.recordings(spec.name)) as folder,
    ):
        for session, members in sorted(sessions.items()):
            _write_session(tree, hashes, packed, folder / "sessions" / session, members)
        for kept in KEPT:
            write_bytes(folder / "published" / kept, (tree / kept).read_bytes())
    write_dataset(paths, spec)  # the last step: a data set without it is not registered
    return rows


def fetch_source(
    paths: Paths,
    dataset: str,
    *,
    mirror: str = "",
    copy: bool = False,
    each: Each = iter,
    started: Started = lambda total: lambda: None,
) -> tuple[Scan, Imported]:
    """Download the public recordings of `dataset` and import them by the rules of its dataset.yaml.

    They stay in a cache outside the project, unless `copy`. `mirror` replaces the source's host.
    `each` iterates over the files, `started` is that of `import_folder`. Raises DataError, and
    imports nothing, unless every byte is the right one.
    """
    folder = bring(dataset, read_source(paths, dataset), mirror=mirror, each=each)
    _, found, result = import_folder(
        paths, dataset, folder, settings=None, copy=copy, started=started
    )
    return found, result


def _downloaded(
    paths: Paths, address: str, tree: Tree, name: str, sha256: str, each: Each
) -> dict[str, str]:
    """Download the required files of a published data set, checked by pooch; return all hashes.

    Raises DataError for a name that exists before the recordings are downloaded.
    """
    download(address, tree.root, {Tree.SUMS: sha256})
    hashes = read_checksums(tree / tree.SUMS)
    required = {file: hashes[file] for file in _required(tree / tree.SUMS, hashes)}
    download(address, tree.root, {tree.DECLARATION: hashes[tree.DECLARATION]})
    _check_free(paths, name or _declaration(tree)[0].name, tree)
    download(address, tree.root, required, each=each)
    return hashes


def _checked(paths: Paths, tree: Tree, sha256: str) -> dict[str, str]:
    """Check every required file of a folder; return all hashes."""
    if not (tree / tree.SUMS).is_file():
        known = ", ".join(list_sources(paths)) or "none"
        fix = f"name the folder or the web address of one, or public recordings ({known})"
        raise DataError(tree.root, f"has no {tree.SUMS}: not a published data set", fix)
    if sha256 and file_sha256(tree / tree.SUMS) != sha256:
        raise DataError(tree / tree.SUMS, "is not the one with this --sha256", DISTRUST)
    hashes = read_checksums(tree / tree.SUMS)
    for name in _required(tree / tree.SUMS, hashes):
        if file_sha256(tree / name) != hashes[name]:
            problem = f"its bytes are not those of {tree.SUMS} (sha256 differs)"
            raise DataError(tree / name, problem, "fetch or copy it again")
    return hashes


def _declaration(tree: Tree) -> tuple[DatasetSpec, tuple[str, ...]]:
    """Return the published declaration and `removed` of `Fetched`.

    Settings are removed before the check, which knows only the robots that are installed here.
    """
    path = tree / tree.DECLARATION
    content = read_yaml(path)
    if "from" in content:
        raise DataError(path, "is derived from another one", DISTRUST)
    removed = tuple(_removed(content))
    return read_model(path, DatasetSpec, content), removed


def _removed(content: dict[str, Any]) -> Iterator[str]:
    """Remove from the declaration `content` whatever starts a program, names a device or leaves the
    folder, and the recipe; yield one line per removed setting."""
    if content.pop("recipe", None):
        yield "recipe (the published recordings take its place)"
    protocol = content.get("protocol")
    if isinstance(protocol, dict):
        for key, harmless in (("robot", "manual"), ("robot_settings", {})):
            if (value := protocol.pop(key, harmless)) != harmless:
                text = json.dumps(value, default=str)[:_SHOWN]
                yield f"protocol.{key}: {text} (may start a program or use a device)"
    imports = content.get("imports")
    if isinstance(imports, dict):
        join = imports.get("join")
        tables = list(join) if isinstance(join, dict) else []
        for file in map(str, filter(None, (imports.get("table"), imports.get("file"), *tables))):
            if problem := archive.bad_name(file):
                content.pop("imports", None)
                yield f"imports (its file {file[:_SHOWN]!r} {problem})"


def _required(sums: Path, hashes: Mapping[str, str]) -> list[str]:
    """Return the names of the files to fetch; the archive contains the recordings."""
    required = {Tree.METADATA, Tree.ARCHIVE, Tree.DECLARATION, *KEPT} - {Tree.SUMS}
    if missing := sorted(required - set(hashes)):
        raise DataError(sums, f"does not name {missing[0]}", "publish the data set again")
    return sorted(required | {name for name in hashes if name.startswith("sessions/")})


def _declared(
    paths: Paths, tree: Tree, name: str
) -> tuple[DatasetSpec, tuple[str, ...], tuple[str, ...]]:
    """Return the declaration as it is registered, and `dropped` and `removed` of `Fetched`."""
    spec, removed = _declaration(tree)
    content = spec.model_dump(mode="json", exclude_defaults=True)
    content["name"] = name or spec.name
    present, dropped = set(list_datasets(paths)), set()
    for task in content.get("tasks", {}).values():
        absent = set(task.get("test_on", ())) - present
        dropped |= absent
        for key in ("test_on", "paper"):
            if isinstance(value := task.get(key), list):
                task[key] = [other for other in value if other not in absent]
            elif isinstance(value, dict):
                task[key] = {part: row for part, row in value.items() if part not in absent}
    try:
        return DatasetSpec.model_validate(content), tuple(sorted(dropped)), removed
    except ValidationError as error:
        raise describe(error, tree / tree.DECLARATION) from None


def _rows(tree: Tree, hashes: Mapping[str, str]) -> list[tuple[str, str, Recording]]:
    """Return name in the tree, session and recording of each row of metadata.csv."""
    _, lines = read_table(tree)
    found = []
    for line, row in lines:
        where, file = f"{tree / tree.METADATA}:{line}", row[FILE_NAME]
        if not file.startswith(f"{AUDIO_FOLDER}/") or file not in hashes:
            raise DataError(where, f"{file!r} is no recording of this data set", DISTRUST)
        if row["sha256"] != hashes[file]:
            raise DataError(where, f"sha256 is not that of {file}", "publish the data set again")
        if not NAME.fullmatch(row["session_id"]):
            raise DataError(where, f"no session can be named {row['session_id']!r}", DISTRUST)
        try:
            ((session, recording),) = recordings_of([row])
        except ValidationError as error:
            raise describe(error, where) from None
        except ValueError as error:
            raise DataError(where, str(error), "publish the data set again") from None
        found.append((file, session, recording))
    for what, names in (
        ("recording", [f"{session}/{one.recording_id}" for _, session, one in found]),
        ("file", [file.lower() for file, _, _ in found]),
        ("file", [f"{session}/{PurePosixPath(file).name.lower()}" for file, session, _ in found]),
    ):
        if doubled := [name for name, count in Counter(names).items() if count > 1]:
            problem = f"{what} {doubled[0]!r} stands in two rows"
            raise DataError(tree / tree.METADATA, problem, "publish the data set again")
    return found


def _check_free(paths: Paths, name: str, tree: Tree) -> None:
    """Raise DataError if something is there, unless an interrupted `fetch` of the same left it."""
    recordings, sums = paths.recordings(name), paths.fetched_sums(name)
    if paths.dataset(name).exists():
        raise DataError(paths.dataset(name), "there is a data set of this name", "give --name")
    is_same = sums.is_file() and sums.read_bytes() == (tree / tree.SUMS).read_bytes()
    if recordings.exists() and not is_same:
        raise DataError(recordings, "there are recordings of this name", "give --name")


def _write_session(
    tree: Tree,
    hashes: Mapping[str, str],
    packed: ZipFile,
    folder: Path,
    members: Sequence[tuple[str, Recording]],
) -> None:
    session_file = Tree.session(folder.name)
    if session_file not in hashes:
        raise DataError(
            tree / tree.SUMS, f"does not name {session_file}", "publish the data set again"
        )
    session = read_session((tree / session_file).parent)
    if session.audio_root is not None:
        raise DataError(tree / session_file, "audio_root leaves the folder", DISTRUST)
    if played := session.excitation:
        file = f"sessions/{folder.name}/{played.file}"
        if hashes.get(file) != played.sha256:
            raise DataError(tree / session_file, f"{played.file!r} is not its excitation", DISTRUST)
        suffix = PurePosixPath(played.file).suffix
        target = str(PurePosixPath(EXCITATION_FILE).with_suffix(suffix))
        write_bytes(folder / target, (tree / file).read_bytes())
        session = session.model_copy(
            update={"excitation": played.model_copy(update={"file": target})}
        )
    recordings = []
    for file, recording in members:
        content = archive.content_of(packed, file)
        if sha256_of(content) != hashes[file]:
            problem = f"its {file} is not the one of {tree.SUMS} (sha256 differs)"
            raise DataError(tree / tree.ARCHIVE, problem, "publish the data set again")
        own = f"{AUDIO_FOLDER}/{PurePosixPath(file).name}"
        (folder / own).parent.mkdir(parents=True, exist_ok=True)
        (folder / own).write_bytes(content)
        recordings.append(recording.model_copy(update={"file": own}))
    write_session(folder, session, sorted(recordings, key=lambda r: r.recording_id))
