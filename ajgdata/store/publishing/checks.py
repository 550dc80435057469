"""Everything that can be wrong in a published data set and that needs no library of others."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import PurePosixPath
from typing import Any

import yaml

from ajgdata.paths import AUDIO_FOLDER, SESSION_FILE, Tree
from ajgdata.store.audio import file_sha256
from ajgdata.store.features import read_labels
from ajgdata.store.files import has_aliases, read_json, read_text
from ajgdata.store.publishing import archive
from ajgdata.store.publishing.archive import DISTRUST
from ajgdata.store.publishing.checksums import files_of, read_checksums
from ajgdata.store.publishing.croissant import RECORDINGS
from ajgdata.store.publishing.datapackage import LABELS
from ajgdata.store.publishing.examples import examples, fenced
from ajgdata.store.publishing.table import FILE_NAME, Table, read_table, table_of
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
    for check in (_table, feature_defects, _archive, _documents, _card, _declaration):
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


def published_table(tree: Tree) -> Table:
    """Return the table as it follows from features.nc and the names of the files in
    metadata.csv."""
    _, rows = read_table(tree)
    names = {row["recording"]: row[FILE_NAME] for _, row in rows}
    store = read_labels(tree / tree.FEATURES)
    recordings = [str(name) for name in store.columns["recording"].values]
    suffixes = [PurePosixPath(names.get(name, "")).suffix for name in recordings]
    return table_of(store, suffixes, tree / tree.FEATURES)


def feature_defects(tree: Tree, _: Mapping[str, str]) -> Iterator[Defect]:
    """Yield a line wherever metadata.csv and features.nc say different things of a recording."""
    header, rows = read_table(tree)
    table = published_table(tree)
    if header != table.names:
        odd = sorted(set(header) ^ set(table.names)) or ["their order"]
        problem = f"its columns are not those of {tree.FEATURES}: {', '.join(odd)}"
        yield Defect(tree.METADATA, problem)
        return
    if len(rows) != len(table.rows):
        problem = f"holds {len(rows)} recordings, {tree.FEATURES} {len(table.rows)}"
        yield Defect(tree.METADATA, problem)
        return
    odd_cells = [
        (line, name, row[name], text)
        for (line, row), expected in zip(rows, table.rows, strict=True)
        for name, text in expected.items()
        if row[name] != text
    ]
    for line, name, text, expected_text in odd_cells[:1]:
        more = f" ({len(odd_cells) - 1} more cells differ)" if odd_cells[1:] else ""
        problem = f"{name} = {text!r}, in {tree.FEATURES} it is {expected_text!r}{more}"
        yield Defect(f"{tree.METADATA}:{line}", problem)


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


def _documents(tree: Tree, hashes: Mapping[str, str]) -> Iterator[Defect]:
    """Yield a line for each file or column that croissant.json or datapackage.json names
    wrongly."""
    header, _ = read_table(tree)
    try:
        document: Any = read_json(tree / tree.CROISSANT)
        files = [f for f in document["distribution"] if f["@type"] == "cr:FileObject"]
        yield from _hashes(tree.CROISSANT, hashes, {f["contentUrl"]: f["sha256"] for f in files})
        (records,) = [r for r in document["recordSet"] if r["@id"] == RECORDINGS]
        columns = [field["source"]["extract"]["column"] for field in records["field"]]
        yield from _columns(tree.CROISSANT, header, columns)
    except (KeyError, TypeError, ValueError):
        yield Defect(tree.CROISSANT, "is not what `ajgdata publish` writes")
    try:
        document = read_json(tree / tree.DATAPACKAGE)
        listed = document["resources"]
        named = {r["path"]: r["hash"].removeprefix("sha256:") for r in listed}
        yield from _hashes(tree.DATAPACKAGE, hashes, named)
        (labels,) = [r for r in listed if r["name"] == LABELS]
        yield from _columns(
            tree.DATAPACKAGE, header, [field["name"] for field in labels["schema"]["fields"]]
        )
    except (KeyError, TypeError, ValueError, AttributeError):
        yield Defect(tree.DATAPACKAGE, "is not what `ajgdata publish` writes")


def _hashes(document: str, hashes: Mapping[str, str], named: Mapping[str, str]) -> Iterator[Defect]:
    for name in (Tree.METADATA, Tree.FEATURES, Tree.ARCHIVE):
        if name not in named:
            yield Defect(document, f"does not name {name}")
    for name, digest in named.items():
        if name not in hashes:
            yield Defect(document, f"names {name!r}, which is no file of this data set")
        elif digest != hashes[name]:
            yield Defect(document, f"its sha256 of {name} is wrong")


def _columns(document: str, header: list[str], columns: list[str]) -> Iterator[Defect]:
    if odd := sorted(set(header) ^ set(columns)):
        yield Defect(document, f"its columns are not those of {Tree.METADATA}: {', '.join(odd)}")


def _card(tree: Tree, _: Mapping[str, str]) -> Iterator[Defect]:
    """Yield a line if the card does not begin as Hugging Face wants it or its examples are not
    ours."""
    text = read_text(tree / tree.README)
    head = text.split("---\n")[1] if text.startswith("---\n") else ""
    if has_aliases(head):
        yield Defect(tree.README, "repeats itself by YAML aliases", DISTRUST, is_unsafe=True)
        return
    try:
        front = yaml.safe_load(head)
    except (yaml.YAMLError, ValueError, RecursionError):
        front = None
    if not isinstance(front, dict) or not {"license", "configs"} <= set(front):
        yield Defect(tree.README, "its front matter (license, configs) cannot be read")
    ours = list(examples(published_table(tree)).values())
    if (theirs := fenced(text)) != ours:
        number = next(
            (i for i, pair in enumerate(zip_longest(theirs, ours), 1) if pair[0] != pair[1])
        )
        yield Defect(tree.README, f"example {number} is not the one that was published")


def _declaration(tree: Tree, hashes: Mapping[str, str]) -> Iterator[Defect]:
    """Yield a line for a dataset.yaml or session that is not there or not readable."""
    spec = read_declaration(tree / tree.DECLARATION)
    store = read_labels(tree / tree.FEATURES)
    if store.attrs.get("data_set") != spec.name:
        problem = (
            f"is of data set {store.attrs.get('data_set')!r}, {tree.DECLARATION} of {spec.name!r}"
        )
        yield Defect(tree.FEATURES, problem)
    settings = json.loads(str(store.attrs["settings"]))
    if settings["features"] != spec.features.model_dump(mode="json"):
        yield Defect(tree.FEATURES, f"was made with other settings than {tree.DECLARATION} says")
    for session in sorted({str(name) for name in store.columns["session_id"].values}):
        said = read_session((tree / tree.session(session)).parent)
        played = said.excitation
        name = f"sessions/{session}/{played.file}" if played else tree.session(session)
        if name not in hashes or (played and hashes[name] != played.sha256):
            yield Defect(name, f"is not the sound that {SESSION_FILE} names")
