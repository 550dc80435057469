"""`ajgdata import`: turn a folder into sessions of a data set, which is declared if it is new."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from pydantic import ValidationError

from ajgdata.paths import Paths
from ajgdata.pipeline.label_counts import CLASSES_NEEDED
from ajgdata.pipeline.label_kinds import (
    Verdict,
    no_numbers,
    odd_labels,
    played_as_class,
    verdict,
    with_decimal_points,
)
from ajgdata.pipeline.progress import Started
from ajgdata.store.audio import AudioInfo, inspect_audio
from ajgdata.store.import_fields import session_name
from ajgdata.store.importing import How, Imported, import_scan
from ajgdata.store.locks import BRINGING, alone, remove_stale
from ajgdata.store.scan import Scan, scan, target_column
from ajgdata.store.sessions import (
    check_one_kind,
    list_sessions,
    read_dataset,
    read_recordings,
    write_dataset,
)
from ajgdata.types import (
    AudioSettings,
    DataError,
    DatasetSpec,
    ImportSettings,
    Task,
    checked_name,
    describe,
)

FOLDS = 5


def import_folder(
    paths: Paths,
    dataset: str,
    folder: str | Path,
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
    the scan say how targets were understood. Nothing
    is written when the folder cannot be understood, nor while another process brings recordings
    into this data set.
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
        spec, told = declared, list[str]()
    else:
        spec, told = declare(dataset, folder, found, chosen, targets)
    found = _understood(found, spec, told)
    labels = {"replace_labels": replace_labels, "prune": prune}
    how = How(copy=copy, replace=replace, **labels)
    advance = started(len(found.files))
    with alone(paths.recordings(dataset), BRINGING):
        if _declared(paths, dataset) != declared:
            problem = f"was declared anew while {folder} was read"
            raise DataError(paths.dataset(dataset), problem, "import again")
        try:
            result = import_scan(paths, dataset, folder, found, how, progress=advance)
        finally:
            if declared is None and list_sessions(paths, dataset):
                spec = _with_audio(paths, spec) if convert else spec
                write_dataset(paths, spec)
        remove_stale(paths.recordings(dataset))
    return spec, found, result


def _declared(paths: Paths, dataset: str) -> DatasetSpec | None:
    return read_dataset(paths, dataset) if paths.dataset(dataset).is_file() else None


def _check_declared(paths: Paths, spec: DatasetSpec, targets: Sequence[str]) -> None:
    """Raise DataError for a target that a declared data set does not have."""
    if extra := sorted(set(map(target_column, targets)) - set(spec.targets)):
        problem = f"{spec.name} is declared already, without {extra[0]!r}"
        raise DataError("--target", problem, f"add it to {paths.dataset(spec.name)}")


def _understood(scanned: Scan, spec: DatasetSpec, told: Sequence[str]) -> Scan:
    """Return what was scanned with cells as the targets want them, and notes on what is odd."""
    numbers = [name for name, target in spec.targets.items() if target.kind == "regression"]
    found, points = with_decimal_points(scanned, numbers)
    cells = {name: [file.cell(name) for file in found.files] for name in spec.targets}
    odd = [] if told else no_numbers(cells, spec.targets)
    found.notes += [*told, *points, *odd, *odd_labels(cells, spec.targets)]
    found.notes += played_as_class(found, spec.targets)
    columns = dict.fromkeys(column for file in found.files for column in file.labels)
    if free := [column for column in columns if column not in spec.targets]:
        found.notes.append(f"stored, but not a target: {', '.join(free)}")
    return found


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


def declare(
    name: str, folder: Path, scanned: Scan, settings: ImportSettings, targets: Sequence[str]
) -> tuple[DatasetSpec, list[str]]:
    """Return a first dataset.yaml for what an import found, and in words why targets are numbers or
    classes; people are meant to complete it.

    The commonest rate is declared; several channels are averaged only if no recording is mono. What
    a column holds is judged by `label_kinds.verdict`. `targets` are the label columns to learn
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
    verdicts = {column: verdict(found) for column, found in cells.items()}
    possible = [c for c, judged in verdicts.items() if _can_be_learnt(judged, cells[c])]
    # If no column has two classes, every column gets a task: more recordings may follow.
    tasks = {column: Task(target=column, folds=FOLDS) for column in possible or verdicts}
    try:
        spec = DatasetSpec(
            name=name,
            title=name,
            description=f"Imported from a folder named {folder.name!r}. Complete this declaration.",
            audio=common_audio(folder / file.path for file in scanned.files),
            targets={column: judged.target for column, judged in verdicts.items()},
            tasks=tasks,
            imports=settings,
        )
    except ValidationError as error:
        raise describe(error, f"data set {name!r}") from None
    return spec, [f"target {column}: {judged.why}" for column, judged in verdicts.items()]


def _can_be_learnt(judged: Verdict, cells: Sequence[str]) -> bool:
    classes = set(cells) - {"", *judged.target.missing}
    return judged.target.kind == "regression" or len(classes) >= CLASSES_NEEDED


def common_audio(files: Iterable[Path]) -> AudioSettings:
    """Return the commonest rate of the readable files; channels are averaged if no file is mono."""
    infos: list[AudioInfo] = []
    for file in files:
        try:
            infos.append(inspect_audio(file))
        except DataError:
            continue  # imported as it is, and named by `validate`
    if not infos:
        return AudioSettings()
    rate = Counter(info.sample_rate_hz for info in infos).most_common(1)[0][0]
    stereo = all(info.channels > 1 for info in infos)
    return AudioSettings(sample_rate_hz=rate, channel="mean" if stereo else "mono")
