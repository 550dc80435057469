"""`ajgdata import`: turn a folder into sessions of a data set, which is declared if it is new."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from pydantic import ValidationError

from ajgdata.paths import Paths
from ajgdata.pipeline.label_counts import CLASSES_NEEDED
from ajgdata.pipeline.progress import Started
from ajgdata.store.audio import AudioInfo, inspect_audio
from ajgdata.store.files import BRINGING, alone, remove_stale
from ajgdata.store.importing import Imported, import_scan
from ajgdata.store.labels import number
from ajgdata.store.scan import Scan, scan, session_name, target_column
from ajgdata.store.sessions import (
    check_one_kind,
    list_sessions,
    read_dataset,
    write_dataset,
)
from ajgdata.types import (
    AudioSettings,
    DataError,
    DatasetSpec,
    ImportSettings,
    OnChange,
    Target,
    Task,
    checked_name,
    describe,
)

FOLDS = 5
#: A column with fewer distinct numbers is a class.
MIN_NUMBERS = 11
#: Smallest share of numbers among the distinct cells of a column of numbers.
MIN_SHARE_OF_NUMBERS = 0.8
#: How programs write a missing value; as a class, some of these words may be meant.
MISSING_NUMBERS = {"nan", "na", "n/a", "#n/a", "<na>", "none", "null", "-", "--", "?"}
MISSING_CLASSES = {"nan", "n/a", "#n/a", "<na>", "null"}


def import_folder(
    paths: Paths,
    dataset: str,
    folder: str | Path,
    *,
    settings: ImportSettings | None,
    targets: Sequence[str] = (),
    copy: bool = True,
    on_change: OnChange = OnChange.KEEP,
    started: Started = lambda total: lambda: None,
) -> tuple[DatasetSpec, Scan, Imported]:
    """Import `folder` into `dataset`.

    `settings` describe how file names or a table are read; the default is `imports` of
    dataset.yaml, else the starter kit's convention. `started(total)` returns a function that is
    called once per recording. The notes of the scan describe how targets were understood. Nothing
    is written if the folder cannot be understood, nor while another process imports into it.
    """
    folder, declared = Path(folder), _declared(paths, checked_name(dataset))
    if declared:
        check_one_kind(paths, declared, list_sessions(paths, dataset), adding=False)
    chosen = _chosen(settings, declared)
    found = scan(folder, chosen, name=session_name(folder.resolve().name))
    if declared:
        _check_declared(paths, declared, targets)
        spec = declared
    else:
        spec, notes = declare(dataset, folder, found, chosen, targets)
        found.notes += notes
    columns = dict.fromkeys(column for file in found.files for column in file.labels)
    if free := [column for column in columns if column not in spec.targets]:
        found.notes.append(f"stored, but not a target: {', '.join(free)}")
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
                write_dataset(paths, spec)
        remove_stale(paths.recordings(dataset))  # by imports that were killed
    return spec, found, result


def _declared(paths: Paths, dataset: str) -> DatasetSpec | None:
    return read_dataset(paths, dataset) if paths.dataset(dataset).is_file() else None


def _check_declared(paths: Paths, spec: DatasetSpec, targets: Sequence[str]) -> None:
    """Raise DataError for a target that a declared data set does not have."""
    if extra := sorted(set(map(target_column, targets)) - set(spec.targets)):
        problem = f"{spec.name} is declared already, without {extra[0]!r}"
        raise DataError("--target", problem, f"add it to {paths.dataset(spec.name)}")


def _chosen(given: ImportSettings | None, declared: DatasetSpec | None) -> ImportSettings:
    """Return the given settings, completed by dataset.yaml; else the starter kit's convention."""
    before = declared.imports if declared else ImportSettings(pattern="starter-kit")
    if given is None:
        return before
    if given.pattern or given.table:  # another way to read the folder: nothing else holds
        return given
    return before.model_copy(update=given.model_dump(exclude_defaults=True))


def declare(
    name: str, folder: Path, scanned: Scan, settings: ImportSettings, targets: Sequence[str]
) -> tuple[DatasetSpec, list[str]]:
    """Return a first dataset.yaml for what an import found, and in words why targets are numbers or
    classes; people are meant to complete it.

    The commonest rate is declared; several channels are averaged only if no recording is mono. What
    a column contains is decided by `infer_target`. `targets` are the label columns to learn
    (default: all of a pattern's; a table's must be named), `object` among them.
    """
    columns = sorted({column for file in scanned.files for column in file.labels})
    named = list(dict.fromkeys(target_column(target) for target in targets))
    wanted = named or [c for c in columns if c not in ("n", "fold", "take", "clip")]
    if any(file.object for file in scanned.files):
        columns.append("object")
        wanted = wanted or ["object"]
    if unknown := [target for target in wanted if target not in columns]:
        raise DataError("--target", f"there is no column {unknown[0]!r}", f"there are {columns}")
    if settings.table and not targets:
        raise DataError("--target", "a table has many columns", f"name labels among {columns}")
    cells = {column: [file.cell(column) for file in scanned.files] for column in wanted}
    inferred = {column: infer_target(texts) for column, texts in cells.items()}
    possible = [c for c, (target, _) in inferred.items() if _can_be_learnt(target, cells[c])]
    # If no column has two classes, every column gets a task: more recordings may follow.
    tasks = {column: Task(target=column, folds=FOLDS) for column in possible or inferred}
    try:
        spec = DatasetSpec(
            name=name,
            title=name,
            description=f"Imported from a folder named {folder.name!r}. Complete this declaration.",
            audio=common_audio(folder / file.path for file in scanned.files),
            targets={column: target for column, (target, _) in inferred.items()},
            tasks=tasks,
            imports=settings,
        )
    except ValidationError as error:
        raise describe(error, f"data set {name!r}") from None
    return spec, [f"target {column}: {why}" for column, (_, why) in inferred.items()]


def _can_be_learnt(target: Target, cells: Sequence[str]) -> bool:
    classes = set(cells) - {"", *target.missing}
    return target.kind == "regression" or len(classes) >= CLASSES_NEEDED


def infer_target(cells: Sequence[str]) -> tuple[Target, str]:
    """Return how a column with these cells is declared, and why.

    A column with at least MIN_NUMBERS distinct numbers and few other texts is a number, any other
    column is a class. Words for a missing value are declared missing.
    """
    distinct = set(cells) - {""}
    missing = {cell for cell in distinct if cell.lower() in MISSING_NUMBERS}
    values = [v for cell in distinct - missing if (v := _number(cell)) is not None]
    is_number = len(values) >= max(MIN_NUMBERS, MIN_SHARE_OF_NUMBERS * len(distinct - missing))
    if is_number:
        reason = f"{len(values)} distinct numbers, {min(values):g} to {max(values):g}"
    else:
        missing = {cell for cell in missing if cell.lower() in MISSING_CLASSES}
        reason = f"{len(distinct - missing)} distinct texts"
    if missing:
        reason += f"; declared missing: {', '.join(map(repr, sorted(missing)))}"
    kind = "regression" if is_number else "classification"
    target = Target(kind=kind, missing=tuple(sorted(missing)))
    return target, f"a {'number' if is_number else 'class'} ({reason})"


def _number(cell: str) -> float | None:
    try:
        return number(cell)
    except ValueError:
        return None


def common_audio(files: Iterable[Path]) -> AudioSettings:
    """Return the commonest rate of the readable files; channels are averaged if no file is mono.

    Raises DataError for the first file if no file is a sound.
    """
    infos: list[AudioInfo] = []
    unreadable: list[DataError] = []
    for file in files:
        try:
            infos.append(inspect_audio(file))
        except DataError as error:
            unreadable.append(error)  # imported unchanged, and listed by `validate`
    if unreadable and not infos:
        raise unreadable[0]
    if not infos:
        return AudioSettings()
    rate = Counter(info.sample_rate_hz for info in infos).most_common(1)[0][0]
    stereo = all(info.channels > 1 for info in infos)
    return AudioSettings(sample_rate_hz=rate, channel="mean" if stereo else "mono")
