"""`ajgdata fetch`: register a published data set, from a folder or the web, in this project.

A published data set is untrusted input: hashes and names are checked before anything is written
into the project, nothing of it is run, and settings that could start a program are not taken over.
It is registered completely or not at all. Spectra are not fetched: the next run computes them.
"""

from __future__ import annotations

import shutil
import zipfile
import zlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any
from zipfile import ZipFile

from ajgdata.paths import EXCITATION_FILE, SESSION_FILE, Paths, Tree
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
from ajgdata.store.publishing.archive import (
    DISTRUST,
    download,
    is_web,
    open_archive,
    read_checksums,
)
from ajgdata.store.sessions import (
    list_datasets,
    read_recordings,
    read_session,
    write_dataset,
    write_session,
)
from ajgdata.store.sources import bring, list_sources, read_source
from ajgdata.types import NAME, DataError, DatasetSpec, Session, checked_name

#: Stored with the recordings, because the licence may require it.
KEPT = (Tree.README, Tree.LICENCE, Tree.SUMS)
#: Keys of dataset.yaml that are not taken over: they can start a program or name other files.
NOT_TAKEN_OVER = ("recipe", "protocol", "imports")
#: What to do about a published data set with an error.
AGAIN = "publish the data set again"

Each = Callable[[list[str]], Iterable[str]]


@dataclass(frozen=True)
class Fetched:
    """The data set that was registered.

    `dropped` are data sets that its tasks are tested on and that this project does not have;
    `removed` are keys of its dataset.yaml that were not taken over.
    """

    name: str
    sums_sha256: str
    recordings: int
    sessions: int
    dropped: tuple[str, ...]
    removed: tuple[str, ...]


def fetch_source(
    paths: Paths,
    dataset: str,
    *,
    each: Each = iter,
    started: Started = lambda total: lambda: None,
) -> Imported:
    """Download the public recordings of `dataset` and import them by the rules of its dataset.yaml.

    They stay in a cache outside the project. `each` iterates over the parts, `started` is that of
    `import_folder`. Raises DataError, and imports nothing, unless every byte is the right one.
    """
    folder = bring(dataset, read_source(paths, dataset), each)
    return import_folder(paths, dataset, folder, settings=None, copy=False, started=started)[1]


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
    if not is_web(source):
        return _register(paths, Tree(Path(source)), name, sha256)
    address = source.removesuffix(Tree.SUMS)
    tree = Tree(paths.fetched / sha256_of(source.encode())[:16])
    with alone(tree.root, f"fetching {source}"):
        download(address, tree.root, {Tree.SUMS: sha256})
        hashes = _required(tree)
        download(address, tree.root, {Tree.DECLARATION: hashes[Tree.DECLARATION]})
        _check_free(paths, name or _config(tree)[0].name, tree)
        download(address, tree.root, hashes, each=each)
        result = _register(paths, tree, name, sha256)
        shutil.rmtree(tree.root, ignore_errors=True)
    return result


def _register(paths: Paths, tree: Tree, name: str, sha256: str) -> Fetched:
    """Check the published data set in a folder and write it into the project."""
    if not (tree / tree.SUMS).is_file():
        known = ", ".join(list_sources(paths)) or "none"
        fix = f"name the folder or the web address of one, or public recordings ({known})"
        raise DataError(tree.root, f"has no {tree.SUMS}: not a published data set", fix)
    digest = file_sha256(tree / tree.SUMS)
    if sha256 not in ("", digest):
        raise DataError(tree / tree.SUMS, "is not the one with this --sha256", DISTRUST)
    hashes = _required(tree)
    for file, expected in hashes.items():
        if file_sha256(tree / file) != expected:
            problem = f"its bytes are not those of {tree.SUMS} (sha256 differs)"
            raise DataError(tree / file, problem, "fetch or copy it again")
    spec, removed = _config(tree)
    spec, dropped = _without_absent(spec, list_datasets(paths))
    spec = spec.model_copy(update={"name": name or spec.name})
    with alone(paths.recordings(spec.name), BRINGING):
        _check_free(paths, spec.name, tree)
        with replacing_folder(paths.recordings(spec.name)) as folder:
            counts = _write_sessions(tree, read_checksums(tree / tree.SUMS), folder / "sessions")
            for kept in KEPT:
                write_bytes(folder / "published" / kept, (tree / kept).read_bytes())
        write_dataset(paths, spec)  # the last step: a data set without it is not registered
    return Fetched(spec.name, digest, sum(counts), len(counts), dropped, removed)


def _required(tree: Tree) -> dict[str, str]:
    """Return the hashes of the files to fetch, by name; the archive contains the recordings."""
    hashes = read_checksums(tree / tree.SUMS)
    required = {Tree.DECLARATION, Tree.ARCHIVE, *KEPT} - {Tree.SUMS}
    if missing := sorted(required - set(hashes)):
        raise DataError(tree / tree.SUMS, f"does not name {missing[0]}", AGAIN)
    return {
        name: digest
        for name, digest in hashes.items()
        if name in required or name.startswith("sessions/")
    }


def _config(tree: Tree) -> tuple[DatasetSpec, tuple[str, ...]]:
    """Return the published data set config, and its keys that are not taken over."""
    path = tree / tree.DECLARATION
    content = read_yaml(path)
    if "from" in content:
        raise DataError(path, "is derived from another one", DISTRUST)
    removed = tuple(key for key in NOT_TAKEN_OVER if content.pop(key, None))
    return read_model(path, DatasetSpec, content), removed


def _without_absent(
    spec: DatasetSpec, present: Iterable[str]
) -> tuple[DatasetSpec, tuple[str, ...]]:
    """Return a data set config without tests on data sets that are not `present`, and these."""
    absent = {name for task in spec.tasks.values() for name in task.test_on} - set(present)
    tasks = {}
    for name, task in spec.tasks.items():
        update: dict[str, Any] = {
            "test_on": tuple(other for other in task.test_on if other not in absent)
        }
        if isinstance(paper := task.paper, dict):
            update["paper"] = {part: row for part, row in paper.items() if part not in absent}
        tasks[name] = task.model_copy(update=update)
    return spec.model_copy(update={"tasks": tasks}), tuple(sorted(absent))


def _check_free(paths: Paths, name: str, tree: Tree) -> None:
    """Raise DataError if the name exists, unless an interrupted `fetch` of the same left it."""
    recordings, sums = paths.recordings(name), paths.fetched_sums(name)
    if paths.dataset(name).exists():
        raise DataError(paths.dataset(name), "there is a data set of this name", "give --name")
    is_same = sums.is_file() and sums.read_bytes() == (tree / tree.SUMS).read_bytes()
    if recordings.exists() and not is_same:
        raise DataError(recordings, "there are recordings of this name", "give --name")


def _write_sessions(tree: Tree, hashes: Mapping[str, str], folder: Path) -> list[int]:
    """Write all sessions below `folder`; return the number of recordings of each."""
    files = [PurePosixPath(name) for name in hashes if name.startswith("sessions/")]
    names = [file.parts[1] for file in files if file.parts[2:] == (SESSION_FILE,)]
    try:
        with open_archive(tree / tree.ARCHIVE) as packed:
            return [_write_session(tree, hashes, packed, folder / name) for name in names]
    except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, LookupError) as error:
        problem = f"is damaged or lacks a recording ({error})"
        raise DataError(tree / tree.ARCHIVE, problem, AGAIN) from None


def _write_session(tree: Tree, hashes: Mapping[str, str], packed: ZipFile, folder: Path) -> int:
    """Write one session; return the number of its recordings. Raises DataError for a name, file or
    hash that is not one of the data set."""
    name, source = folder.name, (tree / tree.session(folder.name)).parent
    if not NAME.fullmatch(name):
        raise DataError(source, f"no session can be named {name!r}", DISTRUST)
    session = read_session(source)
    if session.audio_root is not None:
        raise DataError(tree / tree.session(name), "audio_root leaves the folder", DISTRUST)
    recordings, issues = read_recordings(source)
    if issues:
        raise DataError(source, issues[0].problem, AGAIN)
    for recording in recordings:
        file = PurePosixPath(recording.file)
        published = tree.audio(name, file.name)
        if recording.file != f"audio/{file.name}" or hashes.get(published) != recording.sha256:
            raise DataError(source, f"{recording.file!r} is not one of its recordings", DISTRUST)
        content = packed.read(published)
        if sha256_of(content) != recording.sha256:
            problem = f"its {published} is not the one of {tree.SUMS} (sha256 differs)"
            raise DataError(tree / tree.ARCHIVE, problem, AGAIN)
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_bytes(content)
    write_session(folder, _with_sound(tree, hashes, session, folder), recordings)
    return len(recordings)


def _with_sound(tree: Tree, hashes: Mapping[str, str], session: Session, folder: Path) -> Session:
    """Copy the played sound of a session; return the session with its new name."""
    if (played := session.excitation) is None:
        return session
    file = f"sessions/{folder.name}/{played.file}"
    if hashes.get(file) != played.sha256:
        problem = f"{played.file!r} is not its excitation"
        raise DataError(tree / tree.session(folder.name), problem, DISTRUST)
    target = PurePosixPath(EXCITATION_FILE).with_suffix(PurePosixPath(file).suffix).name
    write_bytes(folder / target, (tree / file).read_bytes())
    changed = played.model_copy(update={"file": target})
    return session.model_copy(update={"excitation": changed})
