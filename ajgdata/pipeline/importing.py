"""`ajgdata import`: turn a folder into sessions of a data set, which is declared if it is new."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.declare import declare
from ajgdata.pipeline.progress import Started
from ajgdata.store.importing import Imported, import_scan
from ajgdata.store.scan import Scan, label_column, scan, slug
from ajgdata.store.sessions import read_dataset, write_dataset
from ajgdata.types import DataError, DatasetSpec, ImportSettings


def import_folder(
    paths: Paths,
    dataset: str,
    folder: Path,
    *,
    settings: ImportSettings | None,
    targets: Sequence[str] = (),
    copy: bool = True,
    replace: bool = False,
    started: Started = lambda total: lambda: None,
) -> tuple[DatasetSpec, Scan, Imported]:
    """Import `folder` into `dataset`.

    `settings` say how file names or a table are read (what they leave open: as dataset.yaml says
    under `imports`, else by the starter kit's convention). `started(total)` returns what is called
    once a recording. Nothing is written when the folder cannot be understood.
    """
    declared = read_dataset(paths, dataset) if paths.dataset(dataset).is_file() else None
    chosen = _chosen(settings, declared)
    if declared and (extra := {label_column(name) for name in targets} - set(declared.targets)):
        raise DataError(
            "--target",
            f"{dataset} is declared already, without {sorted(extra)[0]!r}",
            f"add it to {paths.dataset(dataset)}",
        )
    found = scan(folder, chosen, name=slug(folder.resolve().name))
    spec = declared or declare(dataset, folder, found, chosen, targets)
    advance = started(len(found.files))
    result = import_scan(
        paths, dataset, folder, found, copy=copy, replace=replace, progress=advance
    )
    if declared is None:
        write_dataset(paths, spec)
    return spec, found, result


def _chosen(given: ImportSettings | None, declared: DatasetSpec | None) -> ImportSettings:
    """Return the given settings, completed by dataset.yaml; else the starter kit's convention."""
    before = declared.imports if declared else ImportSettings(pattern="starter-kit")
    if given is None:
        return before
    if given.pattern or given.table:  # another way to read the folder: nothing else holds
        return given
    return before.model_copy(update=given.model_dump(exclude_defaults=True))
