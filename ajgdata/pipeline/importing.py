"""`ajgdata import`: turn a folder into sessions of a data set, which is declared if it is new."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.declare import common_audio, declare
from ajgdata.pipeline.label_kinds import decimal_points, no_numbers, odd_labels
from ajgdata.pipeline.progress import Started
from ajgdata.store.import_fields import session_name
from ajgdata.store.importing import Imported, import_scan
from ajgdata.store.locks import BRINGING, alone, remove_abandoned
from ajgdata.store.scan import Scan, scan, target_column
from ajgdata.store.sessions import (
    check_one_kind,
    list_sessions,
    read_dataset,
    read_recordings,
    write_dataset,
)
from ajgdata.types import DataError, DatasetSpec, ImportSettings, OnChange, checked_name


def import_folder(
    paths: Paths,
    dataset: str,
    folder: str | Path,
    *,
    settings: ImportSettings | None,
    targets: Sequence[str] = (),
    copy: bool = True,
    on_change: OnChange = OnChange.KEEP,
    convert: bool = False,
    started: Started = lambda total: lambda: None,
) -> tuple[DatasetSpec, Scan, Imported]:
    """Import `folder` into `dataset`.

    `settings` describe how file names or a table are read; the default is `imports` of
    dataset.yaml, else the starter kit's convention. `convert` decodes other audio formats into new
    files. `started(total)` returns a function that is called once per recording. The notes of the
    scan describe how targets were understood. Nothing is written if the folder cannot be
    understood, nor while another process imports into this data set.
    """
    folder, declared = Path(folder), _declared(paths, checked_name(dataset))
    if convert and not copy:
        raise DataError("--convert", "makes new files", "import without --reference")
    if declared:
        check_one_kind(paths, declared, list_sessions(paths, dataset), adding=False)
    chosen = _chosen(settings, declared)
    found = scan(folder, chosen, name=session_name(folder.resolve().name), convert=convert)
    if declared:
        _check_declared(paths, declared, targets)
        spec = declared
    else:
        spec, notes = declare(dataset, folder, found, chosen, targets)
        found.notes += notes
    found = _understood(found, spec)
    with alone(paths.recordings(dataset), BRINGING):
        if _declared(paths, dataset) != declared:
            problem = f"was declared again while {folder} was read"
            raise DataError(paths.dataset(dataset), problem, "import again")
        try:
            result = import_scan(
                paths, dataset, folder, found, copy=copy, on_change=on_change,
                progress=started(len(found.files)),
            )  # fmt: skip
        finally:
            if declared is None and list_sessions(paths, dataset):
                spec = _with_audio(paths, spec) if convert else spec
                write_dataset(paths, spec)
        remove_abandoned(paths.recordings(dataset))  # by imports that were killed
    return spec, found, result


def _declared(paths: Paths, dataset: str) -> DatasetSpec | None:
    return read_dataset(paths, dataset) if paths.dataset(dataset).is_file() else None


def _check_declared(paths: Paths, spec: DatasetSpec, targets: Sequence[str]) -> None:
    """Raise DataError for a target that a declared data set does not have."""
    if extra := sorted(set(map(target_column, targets)) - set(spec.targets)):
        problem = f"{spec.name} is declared already, without {extra[0]!r}"
        raise DataError("--target", problem, f"add it to {paths.dataset(spec.name)}")


def _understood(found: Scan, spec: DatasetSpec) -> Scan:
    """Return the scan with decimal points in the targets that are numbers, and notes on oddities
    and on columns that are not targets."""
    for name in (name for name, target in spec.targets.items() if target.kind == "regression"):
        texts = [file.cell(name) for file in found.files]
        if points := decimal_points(texts):
            count = sum(text in points for text in texts)
            found.notes.append(f"{name}: {count} decimal commas are written as points")
            found.files = [
                replace(file, labels={**file.labels, name: points.get(text, text)})
                for file, text in zip(found.files, texts, strict=True)
            ]
    cells = {name: [file.cell(name) for file in found.files] for name in spec.targets}
    found.notes += [*no_numbers(cells, spec.targets), *odd_labels(cells, spec.targets)]
    columns = dict.fromkeys(column for file in found.files for column in file.labels)
    if free := [column for column in columns if column not in spec.targets]:
        found.notes.append(f"stored, but not a target: {', '.join(free)}")
    return found


def _with_audio(paths: Paths, spec: DatasetSpec) -> DatasetSpec:
    """Return a declaration with the rate and channels of the decoded files."""
    folders = [paths.session(spec.name, name) for name in list_sessions(paths, spec.name)]
    audio = common_audio(
        folder / row.file for folder in folders for row in read_recordings(folder)[0]
    )
    return spec.model_copy(update={"audio": audio})


def _chosen(given: ImportSettings | None, declared: DatasetSpec | None) -> ImportSettings:
    """Return the given settings, completed by dataset.yaml; else the starter kit's convention."""
    before = declared.imports if declared else ImportSettings(pattern="starter-kit")
    if given is None:
        return before
    if given.pattern or given.table:  # another way to read the folder: nothing else holds
        return given
    return before.model_copy(update=given.model_dump(exclude_defaults=True))
