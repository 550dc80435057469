"""`ajgdata import`: turn a folder into sessions of a data set, which is declared if it is new."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.declare import common_audio, declare
from ajgdata.pipeline.label_kinds import odd_labels, with_decimal_points
from ajgdata.pipeline.progress import Started
from ajgdata.store.importing import How, Imported, import_scan
from ajgdata.store.scan import Scan, scan, slug, target_column
from ajgdata.store.sessions import (
    list_sessions,
    read_dataset,
    read_recordings,
    read_session,
    write_dataset,
)
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
    replace_labels: bool = False,
    prune: bool = False,
    convert: bool = False,
    started: Started = lambda total: lambda: None,
) -> tuple[DatasetSpec, Scan, Imported]:
    """Import `folder` into `dataset`.

    `settings` say how file names or a table are read (what they leave open: as dataset.yaml says
    under `imports`, else by the starter kit's convention); `convert` decodes audio that is not read
    as it is into new files. `started(total)` returns what is called once a recording. The notes of
    the scan say how targets were understood. Nothing is written when the folder cannot be
    understood.
    """
    declared = read_dataset(paths, dataset) if paths.dataset(dataset).is_file() else None
    if convert and not copy:
        raise DataError("--convert", "makes new files", "import without --reference")
    if declared:
        _check_recorded(paths, declared)
    chosen = _chosen(settings, declared)
    if declared and (extra := set(map(target_column, targets)) - set(declared.targets)):
        raise DataError(
            "--target",
            f"{dataset} is declared already, without {sorted(extra)[0]!r}",
            f"add it to {paths.dataset(dataset)}",
        )
    found = scan(folder, chosen, name=slug(folder.resolve().name), convert=convert)
    spec, told = (declared, []) if declared else declare(dataset, folder, found, chosen, targets)
    numbers = [name for name, target in spec.targets.items() if target.kind == "regression"]
    found, more = with_decimal_points(found, numbers)
    cells = {name: [file.cell(name) for file in found.files] for name in spec.targets}
    found.notes += [*told, *more, *odd_labels(cells, spec.targets)]
    how = How(copy=copy, replace=replace, replace_labels=replace_labels, prune=prune)
    advance = started(len(found.files))
    try:
        result = import_scan(paths, dataset, folder, found, how, progress=advance)
    finally:
        if declared is None and list_sessions(paths, dataset):
            spec = _with_audio(paths, spec) if convert else spec
            write_dataset(paths, spec)
    return spec, found, result


def _check_recorded(paths: Paths, spec: DatasetSpec) -> None:
    """Raise DataError for a data set that is simulated: a mixture would be neither."""
    problem = "has a recipe" if spec.recipe else ""
    for name in list_sessions(paths, spec.name) if not problem else ():
        try:
            if read_session(paths.session(spec.name, name)).source == "virtual":
                problem = f"holds the simulated session {name}"
        except DataError:
            continue  # named by `validate`
    if problem:
        fix = "recordings go into one of their own: choose another --dataset"
        raise DataError(paths.dataset(spec.name), f"{problem}: it is simulated", fix)


def _with_audio(paths: Paths, spec: DatasetSpec) -> DatasetSpec:
    """Return a declaration with the rate and channels of what was decoded."""
    folders = [paths.session(spec.name, name) for name in list_sessions(paths, spec.name)]
    held = ((folder, *read_recordings(folder)) for folder in folders)
    audio = common_audio(folder / row.file for folder, rows, _ in held for row in rows)
    return spec.model_copy(update={"audio": audio})


def _chosen(given: ImportSettings | None, declared: DatasetSpec | None) -> ImportSettings:
    """Return the given settings, completed by dataset.yaml; else the starter kit's convention."""
    before = declared.imports if declared else ImportSettings(pattern="starter-kit")
    if given is None:
        return before
    if given.pattern or given.table:  # another way to read the folder: nothing else holds
        return given
    return before.model_copy(update=given.model_dump(exclude_defaults=True))
