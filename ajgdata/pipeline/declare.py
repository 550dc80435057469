"""First declaration of a data set from a folder of recordings, as far as it can be told."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from pydantic import ValidationError

from ajgdata.pipeline.label_counts import CLASSES_NEEDED
from ajgdata.pipeline.label_kinds import verdict
from ajgdata.store.audio import AudioInfo, inspect_audio
from ajgdata.store.scan import Scan, target_column
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
    possible = [c for c, (target, _) in verdicts.items() if _can_be_learnt(target, cells[c])]
    # If no column has two classes, every column gets a task: more recordings may follow.
    tasks = {column: Task(target=column, folds=FOLDS) for column in possible or verdicts}
    try:
        spec = DatasetSpec(
            name=name,
            title=name,
            description=f"Imported from a folder named {folder.name!r}. Complete this declaration.",
            audio=common_audio(folder / file.path for file in scanned.files),
            targets={column: target for column, (target, _) in verdicts.items()},
            tasks=tasks,
            imports=settings,
        )
    except ValidationError as error:
        raise describe(error, f"data set {name!r}") from None
    return spec, [f"target {column}: {why}" for column, (_, why) in verdicts.items()]


def _can_be_learnt(target: Target, cells: Sequence[str]) -> bool:
    classes = set(cells) - {"", *target.missing}
    return target.kind == "regression" or len(classes) >= CLASSES_NEEDED


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
