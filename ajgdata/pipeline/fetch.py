"""`ajgdata fetch`: download a published data set, or public recordings by name, into this project.

A published data set is not trusted. Hashes and names are checked before anything is written into
the project, no part of it is run, and settings that could start a program are not taken over. It is
registered completely or not at all. Spectra are not downloaded, because the next run computes them.
"""

from __future__ import annotations

import shutil
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import IO

from ajgdata.paths import (
    AUDIO_FOLDER,
    CHANGES_FILE,
    MODELS_FOLDER,
    RECORDINGS_FILE,
    SESSION_FILE,
    Paths,
    Tree,
)
from ajgdata.pipeline.importing import import_folder
from ajgdata.pipeline.progress import tracked
from ajgdata.pipeline.published_tables import TABLE_FILE
from ajgdata.pipeline.schemas import dataset_schema, register_dataset, schema_bytes
from ajgdata.store.addresses import without_credentials
from ajgdata.store.audio import file_sha256
from ajgdata.store.files import (
    check_yaml_format,
    copy,
    read_model,
    read_yaml,
    replacing_folder,
    sha256_of,
)
from ajgdata.store.importing import Imported
from ajgdata.store.lock import ADDING_RECORDINGS, locked
from ajgdata.store.publishing.archive import (
    DISTRUST,
    open_archive,
    read_checksums,
)
from ajgdata.store.publishing.format_version import check_published_format
from ajgdata.store.remote.origins import Origin, origin_of
from ajgdata.store.session_audio import check_session
from ajgdata.store.sessions import inside, read_session
from ajgdata.store.sources import bring, list_sources, read_source
from ajgdata.types import DataError, DatasetSpec, checked_name
from ajgdata.types.formats import DATASET_FORMAT
from ajgdata.types.replaced_keys import microphone_of

#: Files that are stored with the recordings, because the licence may require it.
STORED_FILES = (Tree.README, Tree.LICENCE, Tree.SUMS)
#: Other files that are stored if the data set has them: older versions of ajgdata wrote none.
OPTIONAL_FILES = (Tree.CITATION,)
#: Keys of dataset.yaml that are not taken over: they can start a program or name other files.
NOT_TAKEN_OVER = ("recipe", "protocol", "imports")
#: Files of a published session, with any suffix.
SESSION_FILES = (
    Path(SESSION_FILE).stem,
    Path(RECORDINGS_FILE).stem,
    Path(CHANGES_FILE).stem,
    "excitation",
)
#: What to do about a published data set with an error.
PUBLISH_AGAIN = "publish the data set again"


@dataclass(frozen=True)
class Fetched:
    """A registered data set, with its numbers of recordings and sessions.

    `removed` are keys of its dataset.yaml that were not taken over. `converted` are lines of an
    older version with their replacements. `files` are files of its feature, which it lacks, with
    their sha256.
    """

    name: str
    recordings: int
    sessions: int
    removed: tuple[str, ...]
    converted: tuple[str, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)


def fetch_source(paths: Paths, dataset: str) -> Imported:
    """Download the public recordings of `dataset` and import them by the rules of its dataset.yaml.

    The recordings stay in a cache outside the project. Raises DataError, and imports nothing, if
    the sha256 of a file differs.
    """
    folder = bring(dataset, read_source(paths, dataset))
    return import_folder(paths, dataset, folder, settings=None, copy=False)[1]


def fetch(paths: Paths, source: str, *, name: str = "", with_models: bool = False) -> Fetched:
    """Register the published data set at `source`, a folder or an address (see `origin_of`).

    It gets the `name`, by default its own name. With `with_models`, its final models are stored in
    the folder of its licence, for `ajgdata.load_model`. The same call resumes an interrupted
    download.
    Raises DataError, and changes nothing in the project, for a data set with an error, for a name
    that exists, and while another process fetches the same data set.
    """
    if name:
        checked_name(name)
    origin = origin_of(source)
    if origin is None:
        return _register(paths, Tree(Path(source)), name, with_models)
    tree = Tree(paths.fetched / sha256_of(source.encode())[:16])
    with locked(tree.root, f"fetching {without_credentials(source)}"):
        origin.download(tree.root, Tree.SUMS)
        _download_package(origin, tree)
        check_published_format(tree)
        hashes = _required(tree, with_models)
        origin.download(tree.root, Tree.DECLARATION, hashes[Tree.DECLARATION])
        _check_free(paths, name or _config(tree)[0].name)
        for file in tracked(list(hashes), "fetching"):
            origin.download(tree.root, file, hashes[file])
        result = _register(paths, tree, name, with_models)
        shutil.rmtree(tree.root, ignore_errors=True)
    return result


def _download_package(origin: Origin, tree: Tree) -> None:
    """Download datapackage.json, which states the version of the format; old folders lack it."""
    digest = read_checksums(tree / tree.SUMS).get(Tree.DATAPACKAGE)
    if digest:
        origin.download(tree.root, Tree.DATAPACKAGE, digest)


def _register(paths: Paths, tree: Tree, name: str, with_models: bool) -> Fetched:
    """Check the published data set in a folder and write it into the project."""
    if not (tree / tree.SUMS).is_file():
        known = ", ".join(list_sources(paths)) or "none"
        fix = f"name the folder or the web address of one, or public recordings ({known})"
        raise DataError(tree.root, f"has no {tree.SUMS}: not a published data set", fix)
    check_published_format(tree)
    hashes = _required(tree, with_models)
    for file, expected in hashes.items():
        if file_sha256(tree / file) != expected:
            problem = f"its bytes are not those of {tree.SUMS} (sha256 differs)"
            raise DataError(tree / file, problem, "fetch or copy it again")
    spec, removed, converted = _config(tree)
    spec = spec.model_copy(update={"name": name or spec.name})
    schema = schema_bytes(dataset_schema())
    with locked(paths.recordings(spec.name), ADDING_RECORDINGS):
        _check_free(paths, spec.name)
        with replacing_folder(paths.recordings(spec.name)) as folder:
            _unpack(tree, folder / "sessions")
            counts = [_check(session) for session in sorted((folder / "sessions").iterdir())]
            models = [file for file in hashes if file.startswith(f"{MODELS_FOLDER}/")]
            for file in (*STORED_FILES, *OPTIONAL_FILES, *models):
                if file in hashes or file == Tree.SUMS:
                    copy(tree / file, folder / "published" / file)
        # The last step: a data set without dataset.yaml is not registered.
        register_dataset(paths, spec, schema)
    files = spec.features.files
    return Fetched(spec.name, sum(counts), len(counts), removed, converted, files)


def _required(tree: Tree, with_models: bool) -> dict[str, str]:
    """Return the hashes of the files to fetch, by name; the archive contains the recordings.

    A data set of tables has no archive. Raises DataError if a file is missing, or if there is no
    model `with_models`.
    """
    hashes = read_checksums(tree / tree.SUMS)
    required = {Tree.DECLARATION, *STORED_FILES} - {Tree.SUMS}
    if not any(_is_table(name) for name in hashes):
        required.add(Tree.ARCHIVE)
    missing = sorted(required - set(hashes))
    if missing:
        raise DataError(tree / tree.SUMS, f"does not name {missing[0]}", PUBLISH_AGAIN)
    folders: tuple[str, ...] = ("sessions/",)
    if with_models:
        folders = (*folders, f"{MODELS_FOLDER}/")
        if not any(name.startswith(folders[-1]) for name in hashes):
            raise DataError(tree / tree.SUMS, "names no model", "fetch without --with-models")
    return {
        name: digest
        for name, digest in hashes.items()
        if name in required or name in OPTIONAL_FILES or name.startswith(folders)
    }


def _is_table(name: str) -> bool:
    """Return whether a file of a published data set is the table of features of a session."""
    folder, _, file = name.partition("/")
    return folder == "sessions" and file.partition("/")[2] == TABLE_FILE


def _config(tree: Tree) -> tuple[DatasetSpec, tuple[str, ...], tuple[str, ...]]:
    """Return the data set config of a published data set, without tests on other data sets.

    Also return its keys that are not taken over, and its lines that were converted to this version.
    """
    path = tree / tree.DECLARATION
    content = read_yaml(path)
    check_yaml_format(path, content, DATASET_FORMAT)
    if "from" in content:
        raise DataError(path, "is derived from another data set", DISTRUST)
    converted = _converted(content)
    removed = [key for key in NOT_TAKEN_OVER if content.pop(key, None)]
    spec = read_model(path, DatasetSpec, content)
    tasks = {}
    for name, task in spec.tasks.items():
        paper = task.paper
        if isinstance(paper, Mapping):
            paper = {part: row for part, row in paper.items() if part not in task.test_on}
        if task.test_on:
            removed.append(f"test_on of {name}")
        tasks[name] = task.model_copy(update={"test_on": (), "paper": paper})
    return spec.model_copy(update={"tasks": tasks}), tuple(removed), converted


def _converted(content: dict[str, object]) -> tuple[str, ...]:
    """Replace keys of older versions in the content of dataset.yaml; return a line for each.

    The published file is not changed, because its hash is in SHA256SUMS. A value that the old key
    did not have stays, and is refused with the content.
    """
    audio = content.get("audio")
    if not isinstance(audio, dict) or "channel" not in audio or "microphone" in audio:
        return ()
    channel = audio["channel"]
    try:
        microphone = microphone_of(channel)
    except ValueError:
        return ()
    old = {key: value for key, value in audio.items() if key != "channel"}
    content["audio"] = old if microphone is None else {**old, "microphone": microphone}
    new = "no microphone (files have one channel)" if microphone is None else microphone
    return (f"audio.channel: {channel} -> audio.microphone: {new}",)


def _check_free(paths: Paths, name: str) -> None:
    """Raise DataError if the project has a data set, or recordings, of this name."""
    if paths.dataset(name).exists():
        raise DataError(paths.dataset(name), "already exists", "choose another name with --name")
    if paths.recordings(name).exists():
        fix = "choose another name with --name, or remove them"
        raise DataError(paths.recordings(name), "already has recordings", fix)


def _unpack(tree: Tree, folder: Path) -> None:
    """Write the files of all sessions below `folder`.

    Raises DataError for a file whose hash is not that of SHA256SUMS, and for a damaged archive.
    """
    hashes = read_checksums(tree / tree.SUMS)
    folder.mkdir()
    for name in hashes:
        top, _, path = name.partition("/")
        session, _, file = path.partition("/")
        if top == "sessions" and (_is_table(name) or PurePosixPath(file).stem in SESSION_FILES):
            with (tree / name).open("rb") as source:
                _write(source, folder / checked_name(session, "session") / file, tree, name, hashes)
    if Tree.ARCHIVE not in hashes:
        return
    try:
        with open_archive(tree / tree.ARCHIVE) as packed:
            for name in hashes:
                top, _, path = name.partition("/")
                session, _, file = path.partition("/")
                if top == AUDIO_FOLDER:
                    target = folder / checked_name(session, "session") / AUDIO_FOLDER / file
                    with packed.open(name) as source:
                        _write(source, target, tree, name, hashes)
    except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, LookupError) as error:
        problem = f"is damaged or lacks a recording ({error})"
        raise DataError(tree / tree.ARCHIVE, problem, PUBLISH_AGAIN) from None


def _write(
    source: IO[bytes], target: Path, tree: Tree, name: str, hashes: Mapping[str, str]
) -> None:
    """Write a file of a session in blocks, for files of any size.

    Raises DataError if its hash is not that of SHA256SUMS for `name`.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    with target.open("wb") as stream:
        shutil.copyfileobj(source, stream)
    if file_sha256(target) != hashes[name]:
        problem = f"its {name} is not the one of {tree.SUMS} (sha256 differs)"
        raise DataError(tree / tree.ARCHIVE, problem, PUBLISH_AGAIN)


def _check(folder: Path) -> int:
    """Return the number of recordings of a session.

    Raises DataError for a table or a file with an error, and for a path that leaves the folder.
    """
    session = read_session(folder)
    if session.audio_root is not None:
        raise DataError(f"session {folder.name}", "audio_root leaves the folder", DISTRUST)
    played = session.excitation
    if played:
        path = inside(folder, played.file)
        if not path.is_file() or file_sha256(path) != played.sha256:
            raise DataError(f"session {folder.name}", "lacks its excitation", PUBLISH_AGAIN)
    checked = check_session(folder)
    errors = [issue for issue in checked.findings if issue.level == "error"]
    if errors:
        raise DataError(f"session {folder.name}", errors[0].problem, DISTRUST)
    return len(checked.files)
