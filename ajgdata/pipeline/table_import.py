"""Import a table of features without recordings as sessions of a data set, which may be new."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.feature_columns import (
    LABEL_WORDS,
    choose_columns,
    is_label,
    note_values,
)
from ajgdata.pipeline.importing import declared_dataset, note_columns
from ajgdata.pipeline.schemas import dataset_schema, register_dataset, schema_bytes
from ajgdata.store.audio import file_sha256
from ajgdata.store.file_segments import FilePart
from ajgdata.store.imported_table import ImportedTable, column_values, read_imported_table
from ajgdata.store.importing import Imported, known_sessions
from ajgdata.store.lock import ADDING_RECORDINGS, locked
from ajgdata.store.scan import ROLES, Scan, add_rows, template_columns
from ajgdata.store.session_names import slug
from ajgdata.store.sessions import check_one_source, list_sessions, read_dataset, read_recordings
from ajgdata.store.table_import import TableSource, import_rows, label_cells
from ajgdata.types import (
    DataError,
    DatasetSpec,
    ImportSettings,
    OnChange,
    TableSettings,
    checked_name,
    many,
)

#: Settings of an import of recordings that a table of features cannot have.
FOR_RECORDINGS = ("pattern", "table", "file", "segments", "join")


def import_table(
    paths: Paths,
    dataset: str,
    file: str | Path,
    *,
    settings: ImportSettings | None = None,
    columns: str = "",
    targets: Sequence[str] = (),
    on_change: OnChange = OnChange.KEEP,
) -> tuple[DatasetSpec, Imported]:
    """Import the table `file` (CSV, TSV or Parquet; a row per recording) into `dataset`.

    `settings` has the templates of session, grasp, placement and object; the default are `imports`
    of dataset.yaml. `columns` is a regular expression for the columns that are features of a new
    data set, see `choose_columns`. All other columns are labels. Raises DataError, before anything
    is written, for a table or a data set that cannot be used.
    """
    file = Path(file)
    path = paths.dataset(checked_name(dataset))
    declared = read_dataset(paths, dataset) if path.is_file() else None
    if declared:
        _check_declared(path, declared, columns)
    chosen = declared.imports if declared else ImportSettings()
    if settings:
        _check_settings(settings)
        given = {name: getattr(settings, name) for name in settings.model_fields_set}
        chosen = chosen.model_copy(update=given)
    table = read_imported_table(file)
    scanned = Scan(file.absolute().parent, is_simulated=table.is_simulated)
    scanned.remarks["note"] += table.notes
    if declared:
        features = declared.features.table_columns
        _note_new_columns(paths, table, declared, scanned)
    else:
        named = {column for column in table.columns if slug(column) in set(map(slug, targets))}
        identifiers = _identifiers(chosen)
        features = choose_columns(table, columns, named, identifiers, scanned.remarks)
    values = column_values(table, features)
    for kind, remarks in note_values(table, features, values).items():
        scanned.remarks[kind] += remarks
    rows = {FilePart(row): cells for row, cells in label_cells(table, features).items()}
    try:
        known = known_sessions(paths, dataset)
        add_rows(scanned, rows, chosen, file.stem, known, have_files=False)
    except DataError as error:
        where = file if error.where == "--pattern" else error.where
        raise DataError(where, error.problem, error.fix) from None
    _note_grasps(scanned)
    if declared:
        check_one_source(paths, declared, list_sessions(paths, dataset), table.is_simulated)
        spec = declared
    else:
        spec = _declared(dataset, scanned, features, chosen, targets)
    _warn_of_missing_labels(table, scanned, spec)
    note_columns(paths, spec, scanned, targets)
    is_named = bool(settings and settings.session and not template_columns(settings.session))
    with locked(paths.recordings(dataset), ADDING_RECORDINGS):
        source = TableSource(table, features, file_sha256(file))
        result = import_rows(paths, dataset, scanned, source, on_change, is_named=is_named)
        if not path.exists():
            register_dataset(paths, spec, schema_bytes(dataset_schema()))
    return spec, result


def _check_declared(path: Path, declared: DatasetSpec, columns: str) -> None:
    """Raise DataError if a data set cannot have the rows of a table, or has declared columns."""
    if declared.recipe:
        raise DataError(path, "has a recipe, which makes its sessions", "choose another data set")
    if declared.features.needs_waveform:
        problem = f"features.kind is {declared.features.kind}, which is computed from recordings"
        raise DataError(path, problem, "import the table into another data set")
    if columns:
        problem = f"{declared.name} already exists, with its columns"
        raise DataError("--feature-columns", problem, f"change features.columns in {path}")


def _check_settings(settings: ImportSettings) -> None:
    """Raise DataError for settings that are only for recordings."""
    for name in FOR_RECORDINGS:
        if getattr(settings, name):
            problem = "is for recordings, and a table of features has none"
            raise DataError(f"--{name}", problem, "remove this option")


def _identifiers(settings: ImportSettings) -> set[str]:
    """Return the columns in the templates of sessions, grasps, placements and objects."""
    templates = (settings.session, settings.grasp, settings.placement, settings.object)
    return {column for template in templates for column in template_columns(template)}


def _note_new_columns(
    paths: Paths, table: ImportedTable, declared: DatasetSpec, scanned: Scan
) -> None:
    """Note columns that no table of the data set had before."""
    known = set(declared.features.table_columns)
    for session in list_sessions(paths, declared.name):
        rows, _ = read_recordings(paths.session(declared.name, session))
        known.update(*(row.labels for row in rows))
    new = [
        column
        for column in table.columns
        if column not in known and slug(column) not in known and column.lower() not in ROLES
    ]
    if new:
        reason = f"{', '.join(new)}: to use one as a feature, add it to features.columns"
        scanned.remarks["note"].append(("new columns, which are labels", reason))


def _note_grasps(scanned: Scan) -> None:
    """Note the assumption about grasps if no column names them."""
    if any(row.has_grasp for row in scanned.files):
        return
    reason = (
        "no column names the grasp, so each row is a grasp of its own; if several rows are of one "
        "grasp, add --grasp with the columns that identify it, e.g. --grasp '{point}'"
    )
    scanned.remarks["note"].append((many(len(scanned.files), "grasp"), reason))


def _declared(
    dataset: str,
    scanned: Scan,
    features: tuple[str, ...],
    settings: ImportSettings,
    targets: Sequence[str],
) -> DatasetSpec:
    """Return a first dataset.yaml of a table.

    Without `targets`, the targets are the label columns whose names contain `label`, `class` or
    `target`. Raises DataError without such a column.
    """
    labels = scanned.label_columns()
    chosen = list(dict.fromkeys(map(slug, targets)))
    columns = [*labels, "object"] if any(row.cells["object"] for row in scanned.files) else labels
    unknown = [target for target in chosen if target not in columns]
    if unknown:
        raise DataError("--target", f"there is no column {unknown[0]!r}", f"use one of {columns}")
    chosen = chosen or [column for column in labels if is_label(column)]
    if not chosen:
        words = ", ".join(sorted(LABEL_WORDS))
        problem = f"no name of a column contains {words}, so no label is chosen"
        raise DataError("--target", problem, f"name the labels among {columns}")
    return declared_dataset(
        dataset, scanned, chosen, features=TableSettings(columns=features), imports=settings
    )


def _warn_of_missing_labels(table: ImportedTable, scanned: Scan, spec: DatasetSpec) -> None:
    """Warn about empty cells of targets."""
    stored = scanned.label_columns()
    for name in spec.label_targets:
        if name not in (*stored, "object"):
            reason = f"is not a column of {table.path.name}, so its rows have no value"
            scanned.remarks["warning"].append((f"target {name}", reason))
            continue
        empty = [row for row in scanned.files if not row.text(name)]
        if empty and len(empty) < len(scanned.files):
            place = table.places[int(empty[0].path.name) - 1]
            verb = "has" if len(empty) == 1 else "have"
            counted = f"{len(empty)} of {len(scanned.files)} rows {verb} no value"
            reason = f"{counted} (first: {place}), and no task of it uses them; fill the cells"
            scanned.remarks["warning"].append((f"target {name}", reason))
