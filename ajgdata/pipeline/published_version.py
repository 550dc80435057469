"""A published version never changes: comparison of a published folder with its replacement."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.paths import MODELS_FOLDER, Paths, Tree
from ajgdata.store.feature_array import same_axes
from ajgdata.store.features import read_store
from ajgdata.store.files import read_csv, read_yaml
from ajgdata.store.publishing.differences import RowsByRecording, counted, differences
from ajgdata.store.publishing.format_version import check_published_format
from ajgdata.store.publishing.table import FILE_NAME
from ajgdata.types import DataError, DatasetSpec
from ajgdata.types.formats import FORMAT_KEY, FormatError

#: Keys that are not content: the version of the format of dataset.yaml and session.yaml, and the
#: program that wrote session.yaml.
_NOT_CONTENT = {FORMAT_KEY, "software"}
#: Version of the format of a published feature file that states none.
_OLDEST = 1


def check_version(paths: Paths, spec: DatasetSpec, published: Tree, new: Tree) -> None:
    """Raise DataError if the folder `published` has the version of `spec` with other content.

    Both folders need dataset.yaml, metadata.csv, features.nc and the sessions. These files are the
    content; the documents that describe them, versions of programs and commits may differ. The
    folder may also not contain another data set. A folder without dataset.yaml is not a complete
    published data set and may be replaced. A folder that states no version of its format is of
    version 1.
    """
    if not (published / Tree.DECLARATION).is_file():
        return
    delete = f"delete {published.root} if nobody has received it"
    renew = f"set a new `version` in {paths.dataset(spec.name)}, or {delete}"
    try:
        old_config = read_yaml(published / Tree.DECLARATION)
        old_name = old_config.get("name")
        is_other_version = _version(old_config) != spec.version
        same_name = old_name == spec.name
        phrases = [] if is_other_version or not same_name else _changes(published, new)
    except DataError as error:
        problem = f"cannot be compared with the data set to publish: {error.where} {error.problem}"
        fix = renew if isinstance(error, FormatError) else f"restore it, or {delete}"
        raise DataError(published.root, problem, fix) from None
    if not same_name:
        problem = f"contains the published data set {old_name!r}, not {spec.name!r}"
        raise DataError(published.root, problem, "choose another folder with --out")
    if phrases:
        problem = f"version {spec.version} is published with other content: {'; '.join(phrases)}"
        raise DataError(published.root, problem, renew)


def _version(config: Mapping[str, Any]) -> str:
    """Return the version in dataset.yaml, which does not contain the default."""
    return str(config.get("version", DatasetSpec.model_fields["version"].default))


def _changes(old: Tree, new: Tree) -> list[str]:
    """Return a phrase for each kind of difference in the content of two published data sets.

    Raises FormatError if the old folder is of another version.
    """
    check_published_format(old)
    phrases = [
        *differences(_rows(old / Tree.METADATA), _rows(new / Tree.METADATA)),
        *_changed_spectra(old / Tree.FEATURES, new / Tree.FEATURES),
        *_changed_keys(old, new, Tree.DECLARATION),
    ]
    models = _changed_models(old, new)
    if models:
        phrases.append(f"files of models, first {models[0]}")
    for session in sorted((new / "sessions").iterdir()):
        file = Tree.session(session.name)
        if (old / file).is_file():  # recordings of a new session are reported as added
            phrases += _changed_keys(old, new, file)
    return phrases


def _changed_models(old: Tree, new: Tree) -> list[str]:
    """Return the files of models that differ, or that only one of the data sets has."""
    names = {
        path.relative_to(tree.root).as_posix()
        for tree in (old, new)
        for path in (tree.root / MODELS_FOLDER).rglob("*")
        if path.is_file() and path.name != Tree.README
    }
    return sorted(name for name in names if _bytes(old / name) != _bytes(new / name))


def _bytes(path: Path) -> bytes | None:
    """Return the content of a file; None if there is no such file."""
    return path.read_bytes() if path.is_file() else None


def _rows(metadata: Path) -> RowsByRecording:
    """Return the cells of a published metadata.csv by recording and column."""
    rows = read_csv(metadata, required=("recording", "sha256"))[1]
    names = (FILE_NAME, "recording")  # they identify the row
    return {
        row["recording"]: {column: cell for column, cell in row.items() if column not in names}
        for row in rows
    }


def _changed_spectra(old_file: Path, new_file: Path) -> list[str]:
    """Return a phrase if the spectra of recordings that both feature files have differ."""
    old = read_store(old_file, unstated=_OLDEST)
    new = read_store(new_file)
    if not same_axes(old.axes, new.axes):
        return ["dimensions of the features"]
    positions = {name: row for row, name in enumerate(old.columns["recording"].values.tolist())}
    changed = [
        name
        for row, name in enumerate(new.columns["recording"].values.tolist())
        if name in positions and not np.array_equal(old.feature[positions[name]], new.feature[row])
    ]
    return [counted("feature", changed, "changed")] if changed else []


def _changed_keys(old: Tree, new: Tree, file: str) -> list[str]:
    """Return a phrase with the keys of a YAML file whose values differ."""
    before = read_yaml(old / file)
    after = read_yaml(new / file)
    keys = sorted(
        key
        for key in before.keys() | after.keys()
        if before.get(key) != after.get(key) and key not in _NOT_CONTENT
    )
    if "doi" in keys and not before.get("doi"):  # a DOI does not change the content
        keys.remove("doi")
    return [f"{', '.join(keys)} in {file}"] if keys else []
