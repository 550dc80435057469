"""First declaration of a data set from a folder of recordings, as far as it can be told."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from pydantic import ValidationError

from ajgdata.store.audio import AudioInfo, inspect_audio
from ajgdata.store.labels import number
from ajgdata.store.scan import Scan, label_column
from ajgdata.types import (
    AudioSettings,
    DataError,
    DatasetSpec,
    ImportSettings,
    Target,
    Task,
    describe,
)

FOLDS = 5
CLASSES_NEEDED = 2
#: How programs write that a number is not there.
NOT_MEASURED = {"nan", "na", "n/a", "none", "null"}


def declare(
    name: str, folder: Path, scanned: Scan, settings: ImportSettings, targets: Sequence[str]
) -> DatasetSpec:
    """Return a first dataset.yaml for what an import found; people are meant to complete it.

    The commonest rate is declared; several channels are averaged only if no recording is mono. A
    column is a regression target when every cell is a number and there are more distinct ones than
    folds can hold as classes; a class otherwise. `targets` are the label columns to learn (default:
    all of a pattern's; a table's must be named).
    """
    columns = sorted({column for file in scanned.files for column in file.labels})
    named = [label_column(target) for target in targets]
    wanted = named or [c for c in columns if c not in ("n", "fold", "take", "clip")]
    if unknown := [target for target in wanted if target not in columns]:
        raise DataError("--target", f"there is no column {unknown[0]!r}", f"there are {columns}")
    if settings.table and not targets:
        raise DataError("--target", "a table has many columns", f"name labels among {columns}")
    declared = {
        column: _target([file.labels[column] for file in scanned.files]) for column in wanted
    }
    tasks = {
        column: Task(target=column, folds=FOLDS)
        for column, target in declared.items()
        if target.kind == "regression" or _classes(scanned, column) >= CLASSES_NEEDED
    }
    try:
        return DatasetSpec(
            name=name,
            title=name,
            description=f"Imported from a folder named {folder.name!r}. Complete this declaration.",
            audio=common_audio(folder / file.path for file in scanned.files),
            targets=declared,
            tasks=tasks,
            imports=settings,
        )
    except ValidationError as error:
        raise describe(error, f"data set {name!r}") from None


def _target(cells: Sequence[str]) -> Target:
    distinct = {cell for cell in cells if cell}
    missing = {cell for cell in distinct if cell.lower() in NOT_MEASURED}
    numbers = distinct - missing
    if len(numbers) > 2 * FOLDS and all(map(_is_number, numbers)):
        return Target(kind="regression", missing=tuple(sorted(missing)))
    return Target(kind="classification")


def _is_number(cell: str) -> bool:
    try:
        number(cell)
    except ValueError:
        return False
    return True


def _classes(scanned: Scan, column: str) -> int:
    return len({file.labels[column] for file in scanned.files} - {""})


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
