"""`ajgdata fetch`: make a published data set, in a folder or on the web, one of this project.

Nothing of it is believed: hashes, names, links and sizes are checked before anything is written
into the project, and nothing of it is run. It is registered whole or not at all.
"""

from __future__ import annotations

import shutil
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from zipfile import ZipFile

from pydantic import ValidationError

from ajgdata.paths import AUDIO_FOLDER, EXCITATION_FILE, Paths, Tree
from ajgdata.store.audio import file_sha256
from ajgdata.store.files import (
    copy,
    read_text,
    read_yaml,
    replacing_folder,
    sha256_of,
    write_bytes,
)
from ajgdata.store.locks import BRINGING, alone
from ajgdata.store.publishing import archive
from ajgdata.store.publishing.checks import DISTRUST, feature_defects
from ajgdata.store.publishing.checksums import read_checksums
from ajgdata.store.publishing.download import Download, cache_of, is_web
from ajgdata.store.publishing.table import FILE_NAME, read_table, recordings_of
from ajgdata.store.sessions import (
    list_datasets,
    read_declaration,
    read_session,
    write_dataset,
    write_session,
)
from ajgdata.store.sources import list_sources
from ajgdata.store.yaml_loading import has_aliases
from ajgdata.types import NAME, DataError, DatasetSpec, Recording, describe

#: What the licence asks to be passed on, kept beside the recordings.
KEPT = (Tree.README, Tree.LICENCE, Tree.CITATION, Tree.SUMS)

Each = Callable[[list[str]], Iterable[str]]


@dataclass(frozen=True)
class Fetched:
    """The data set that was registered.

    `dropped` are data sets that its tasks are tested on and that this project does not have.
    """

    name: str
    sums_sha256: str
    recordings: int
    sessions: int
    dropped: tuple[str, ...]


def fetch(
    paths: Paths,
    source: str,
    *,
    name: str = "",
    sha256: str = "",
    each: Each = iter,
    retries: int = 2,
) -> Fetched:
    """Register the published data set at `source`, a folder or a web address, as `name` (default:
    its own). `sha256` is the hash of its SHA256SUMS, if the reader was told it: without, the files
    are checked against each other only. `each` goes through the files that are fetched.

    Interrupted, it goes on there. Raises DataError, and changes nothing in the project, for
    anything that is wrong, for a name that is taken, and while another process fetches the same.
    """
    if name:
        _check_name(name)
    with ExitStack() as held:
        if is_web(source):
            held.enter_context(alone(cache_of(paths.fetched, source), f"fetching {source}"))
        tree, hashes, cache = _brought(paths, source, name, sha256, each, retries)
        spec, dropped = _declared(paths, tree, name)
        held.enter_context(alone(paths.recordings(spec.name), BRINGING))
        return _registered(paths, tree, hashes, cache, spec, dropped, renamed=bool(name))


def _registered(
    paths: Paths,
    tree: Tree,
    hashes: Mapping[str, str],
    cache: Path | None,
    spec: DatasetSpec,
    dropped: tuple[str, ...],
    *,
    renamed: bool,
) -> Fetched:
    """Make what was brought a data set of the project; its cache is removed when that is done."""
    rows = _rows(tree, hashes)
    for defect in feature_defects(tree, hashes):
        raise DataError(tree / defect.file, defect.problem, DISTRUST)
    _check_free(paths, spec.name, tree, cache)
    sessions: dict[str, list[tuple[str, Recording]]] = defaultdict(list)
    for file, session, recording in rows:
        sessions[session].append((file, recording))
    with (
        archive.reading(tree / tree.ARCHIVE) as packed,
        replacing_folder(paths.recordings(spec.name)) as folder,
    ):
        _check_archive(tree, packed)
        for session, members in sorted(sessions.items()):
            _write_session(tree, hashes, packed, folder / "sessions" / session, members)
        for kept in KEPT:
            write_bytes(folder / "published" / kept, (tree / kept).read_bytes())
    if not renamed:
        copy(tree / tree.FEATURES, paths.features(spec.name))
    write_dataset(paths, spec)  # with it all is there: until then nothing that came is removed
    if cache:
        shutil.rmtree(cache, ignore_errors=True)
    digest = file_sha256(folder_sums(paths, spec.name))
    return Fetched(spec.name, digest, len(rows), len(sessions), dropped)


def folder_sums(paths: Paths, dataset: str) -> Path:
    """Return the path of the SHA256SUMS of a data set that was fetched."""
    return paths.recordings(dataset) / "published" / Tree.SUMS


def _brought(
    paths: Paths, source: str, name: str, sha256: str, each: Each, retries: int
) -> tuple[Tree, dict[str, str], Path | None]:
    """Return the tree with everything that is needed of it, its hashes right; its folder if it is a
    cache. Its declaration comes first: a name that is taken is refused before the rest is brought.
    """
    if is_web(source):
        cache = cache_of(paths.fetched, source)
        download = Download(source, cache, retries)
        hashes = read_checksums(download.sums(sha256))
        needed = _needed(cache / Tree.SUMS, hashes)
        tree = Tree(cache)
        download.files(hashes, [tree.DECLARATION], iter)
        _check_free(paths, name or _declaration(tree).name, tree, cache)
        download.files(hashes, needed, each)
    else:
        tree, cache = Tree(Path(source)), None
        if not (tree / tree.SUMS).is_file():
            problem = f"has no {tree.SUMS}: not a published data set"
            known = ", ".join(list_sources(paths)) or "none"
            fix = f"name the folder or the web address of one, or public recordings ({known})"
            raise DataError(source, problem, fix)
        _check_text(tree, tree.SUMS)
        if sha256 and file_sha256(tree / tree.SUMS) != sha256:
            raise DataError(tree / tree.SUMS, "is not the one with this --sha256", DISTRUST)
        hashes = read_checksums(tree / tree.SUMS)
        needed = _needed(tree / tree.SUMS, hashes)
        _check_file(tree, tree.DECLARATION, hashes[tree.DECLARATION])
        _check_free(paths, name or _declaration(tree).name, tree, cache)
        for file in each(needed):
            _check_file(tree, file, hashes[file])
    for file in needed:
        if file not in (tree.ARCHIVE, tree.FEATURES):
            _check_text(tree, file)
    return tree, hashes, cache


def _declaration(tree: Tree) -> DatasetSpec:
    """Return the declaration as it was published."""
    _check_text(tree, tree.DECLARATION)
    if "from" in read_yaml(tree / tree.DECLARATION):
        raise DataError(tree / tree.DECLARATION, "is derived from another one", DISTRUST)
    return read_declaration(tree / tree.DECLARATION)


def _needed(sums: Path, hashes: Mapping[str, str]) -> list[str]:
    """Return the names of the files to fetch; the recordings come in the archive."""
    needed = {Tree.METADATA, Tree.FEATURES, Tree.ARCHIVE, Tree.DECLARATION, *KEPT} - {Tree.SUMS}
    if missing := sorted(needed - set(hashes)):
        raise DataError(sums, f"does not name {missing[0]}", "publish the data set again")
    return sorted(needed | {name for name in hashes if name.startswith("sessions/")})


def _check_text(tree: Tree, name: str) -> None:
    """Raise DataError for a file that is too large to be read whole, or YAML with aliases."""
    is_yaml = name.endswith(".yaml")
    limit = archive.MAX_YAML_BYTES if is_yaml else archive.MAX_TEXT_BYTES
    if (tree / name).stat().st_size > limit:
        raise DataError(tree / name, "is absurdly large", DISTRUST)
    if is_yaml and has_aliases(read_text(tree / name)):
        raise DataError(tree / name, "repeats itself by YAML aliases", DISTRUST)


def _check_file(tree: Tree, name: str, digest: str) -> None:
    """Raise DataError for a file of a local folder with a link on its way or another hash."""
    steps = [tree / str(step) for step in (PurePosixPath(name), *PurePosixPath(name).parents)]
    if any(step.is_symlink() for step in steps[:-1]):
        raise DataError(tree / name, "is a link", DISTRUST)
    if not (tree / name).is_file():
        raise DataError(tree / name, "is missing, or no plain file", "fetch or copy it again")
    if file_sha256(tree / name) != digest:
        problem = f"its bytes are not those of {tree.SUMS} (sha256 differs)"
        raise DataError(tree / name, problem, "fetch or copy it again")


def _declared(paths: Paths, tree: Tree, name: str) -> tuple[DatasetSpec, tuple[str, ...]]:
    """Return the declaration as it is registered: without recipe, since the recordings are what was
    published, and tested only on data sets that are here."""
    spec = _declaration(tree)
    content = spec.model_dump(mode="json", exclude_defaults=True, exclude={"recipe"})
    content["name"] = name or spec.name
    here, dropped = set(list_datasets(paths)), set()
    for task in content.get("tasks", {}).values():
        absent = set(task.get("test_on", ())) - here
        dropped |= absent
        for key in ("test_on", "paper"):
            if isinstance(value := task.get(key), list):
                task[key] = [other for other in value if other not in absent]
            elif isinstance(value, dict):
                task[key] = {part: row for part, row in value.items() if part not in absent}
    try:
        return DatasetSpec.model_validate(content), tuple(sorted(dropped))
    except ValidationError as error:
        raise describe(error, tree / tree.DECLARATION) from None


def _rows(tree: Tree, hashes: Mapping[str, str]) -> list[tuple[str, str, Recording]]:
    """Return name in the tree, session and recording of each row of metadata.csv."""
    _, lines = read_table(tree)
    found = []
    for line, row in lines:
        where, file = f"{tree / tree.METADATA}:{line}", row[FILE_NAME]
        if problem := archive.bad_name(file):
            raise DataError(where, f"{FILE_NAME} {file!r} {problem}", DISTRUST)
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


def _check_name(name: str) -> None:
    """Raise DataError for what no data set can be named: paths are made of it."""
    try:
        DatasetSpec(name=name)
    except ValidationError as error:
        raise describe(error, "--name") from None


def _check_free(paths: Paths, name: str, tree: Tree, cache: Path | None) -> None:
    """Raise DataError if something is there, unless an interrupted `fetch` of the same left it. The
    cache of one that was registered, but killed before it removed that, is removed."""
    held, sums = paths.recordings(name), folder_sums(paths, name)
    same = sums.is_file() and sums.read_bytes() == (tree / tree.SUMS).read_bytes()
    if paths.dataset(name).exists():
        if same and cache:
            shutil.rmtree(cache, ignore_errors=True)
        raise DataError(paths.dataset(name), "there is a data set of this name", "give --name")
    if held.exists() and not same:
        raise DataError(held, "there are recordings of this name", "give --name")


def _check_archive(tree: Tree, packed: ZipFile) -> None:
    for name, problem in archive.problems(packed, AUDIO_FOLDER):
        raise DataError(tree / tree.ARCHIVE, f"{name!r} {problem}", DISTRUST)


def _write_session(
    tree: Tree,
    hashes: Mapping[str, str],
    packed: ZipFile,
    folder: Path,
    members: Sequence[tuple[str, Recording]],
) -> None:
    said = Tree.session(folder.name)
    if said not in hashes:
        raise DataError(tree / tree.SUMS, f"does not name {said}", "publish the data set again")
    session = read_session((tree / said).parent)
    if session.audio_root is not None:
        raise DataError(tree / said, "audio_root leaves the folder", DISTRUST)
    if played := session.excitation:
        file = f"sessions/{folder.name}/{played.file}"
        if archive.bad_name(file) or hashes.get(file) != played.sha256:
            raise DataError(tree / said, f"{played.file!r} is not its excitation", DISTRUST)
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
