"""Check the files of a published data set: hashes, names, links, archive and sessions.

`readers` checks what other libraries read from them.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from ajgdata.paths import AUDIO_FOLDER, SESSION_FILE, Tree
from ajgdata.store.audio import file_sha256
from ajgdata.store.files import has_aliases, read_text
from ajgdata.store.publishing import archive
from ajgdata.store.publishing.archive import DISTRUST
from ajgdata.store.publishing.checksums import files_of, read_checksums
from ajgdata.store.publishing.table import FILE_NAME, read_table
from ajgdata.store.sessions import read_declaration, read_session
from ajgdata.types import DataError

AGAIN = "publish it again, or fetch it again"
REQUIRED = (
    *(Tree.README, Tree.LICENCE, Tree.CITATION, Tree.CROISSANT, Tree.DATAPACKAGE, Tree.METADATA),
    *(Tree.FEATURES, Tree.ARCHIVE, Tree.DECLARATION),
)


@dataclass(frozen=True, order=True)
class Defect:
    """One thing wrong with one file of a published data set. `is_unsafe`: other readers are not
    asked."""

    file: str
    problem: str
    fix: str = AGAIN
    is_unsafe: bool = False

    def __str__(self) -> str:
        return f"{self.file}: {self.problem}; {self.fix}"


def defects(tree: Tree) -> list[Defect]:
    """Return everything wrong with the files and with how they agree, each thing once.

    Raises DataError when the folder is no published data set.
    """
    if not (tree / tree.SUMS).is_file():
        problem = f"has no {tree.SUMS}: not a published data set"
        raise DataError(tree.root, problem, "name a folder that `ajgdata publish` made")
    hashes = read_checksums(tree / tree.SUMS)
    defects_found = list(_files(tree, hashes))
    if any(defect.is_unsafe for defect in defects_found):
        return defects_found
    for check in (_table, _archive, _declaration):
        defects_found += _defects_of(check, tree, hashes)
    return sorted(set(defects_found))


def _defects_of(
    check: Callable[[Tree, Mapping[str, str]], Iterator[Defect]],
    tree: Tree,
    hashes: Mapping[str, str],
) -> list[Defect]:
    """Return the defects that a check finds; a file that cannot be read at all is one, too."""
    defects_found = []
    try:
        for defect in check(tree, hashes):
            defects_found.append(defect)
    except DataError as error:
        where = error.where.removeprefix(f"{tree.root}/")
        defects_found.append(Defect(where, error.problem, error.fix, is_unsafe=True))
    return defects_found


def _files(tree: Tree, hashes: Mapping[str, str]) -> Iterator[Defect]:
    """Yield a line for each file that is missing, changed, a link, or too many."""
    there = files_of(tree.root)
    for name in sorted({*hashes, *REQUIRED} - set(there)):
        yield Defect(name, "is missing")
    for name in sorted(set(there) - set(hashes)):
        yield Defect(name, f"is not in {tree.SUMS}", "remove it, or publish again")
    for name in there:
        path = tree / name
        if path.is_symlink() or not path.is_file():
            what = "a link, not a file" if path.is_symlink() else "no plain file"
            yield Defect(name, f"is {what}", f"remove it; then {AGAIN}", is_unsafe=True)
        elif name.endswith(".yaml") and has_aliases(read_text(path)):
            yield Defect(name, "repeats itself by YAML aliases", DISTRUST, is_unsafe=True)
        elif name in hashes and file_sha256(path) != hashes[name]:
            yield Defect(name, f"its bytes are not those of {tree.SUMS} (sha256 differs)")


def _table(tree: Tree, hashes: Mapping[str, str]) -> Iterator[Defect]:
    """Yield a line wherever metadata.csv and audio/ do not name each other, once."""
    _, rows = read_table(tree)
    recordings = Counter(row["recording"] for _, row in rows)
    files = Counter(row[FILE_NAME].lower() for _, row in rows)
    for line, row in rows:
        where, name = f"{tree.METADATA}:{line}", row[FILE_NAME]
        if problem := archive.bad_name(name):
            yield Defect(where, f"{FILE_NAME} {name!r} {problem}", DISTRUST, is_unsafe=True)
        elif not name.startswith(f"{AUDIO_FOLDER}/") or name not in hashes:
            yield Defect(where, f"{name!r} is no recording of this data set")
        elif row["sha256"] != hashes[name]:
            yield Defect(where, f"sha256 is not that of {name}")
        if recordings[row["recording"]] > 1 or files[name.lower()] > 1:
            yield Defect(where, f"{row['recording']!r} or its file stands in two rows")
    named = {row[FILE_NAME] for _, row in rows}
    for name in sorted(hashes):
        if name.startswith(f"{AUDIO_FOLDER}/") and name not in named:
            yield Defect(name, f"has no row in {tree.METADATA}")


def _archive(tree: Tree, hashes: Mapping[str, str]) -> Iterator[Defect]:
    """Yield a line wherever audio.zip does not hold what audio/ does."""
    wanted = {n for n in hashes if n.startswith(f"{AUDIO_FOLDER}/")}
    with archive.reading(tree / tree.ARCHIVE) as held:
        unsafe = dict(archive.problems(held, AUDIO_FOLDER))
        for name, problem in unsafe.items():
            yield Defect(tree.ARCHIVE, f"{name!r} {problem}", "do not unpack it", is_unsafe=True)
        if unsafe:
            return
        names = set(held.namelist())
        for name in sorted(wanted ^ names):
            where = "lacks" if name in wanted else "holds, beside the recordings,"
            yield Defect(tree.ARCHIVE, f"{where} {name}")
        for name in sorted(wanted & names):
            if hashlib.sha256(archive.content_of(held, name)).hexdigest() != hashes[name]:
                yield Defect(tree.ARCHIVE, f"its {name} differs from the one in {AUDIO_FOLDER}/")


def _declaration(tree: Tree, hashes: Mapping[str, str]) -> Iterator[Defect]:
    """Yield a line for each played sound that is not the one of its session. Raises DataError if
    dataset.yaml or a session cannot be read."""
    read_declaration(tree / tree.DECLARATION)
    for session in sorted({row["session_id"] for _, row in read_table(tree)[1]}):
        played = read_session((tree / tree.session(session)).parent).excitation
        name = f"sessions/{session}/{played.file}" if played else tree.session(session)
        if name not in hashes or (played and hashes[name] != played.sha256):
            yield Defect(name, f"is not the sound that {SESSION_FILE} names")
