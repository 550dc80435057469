"""Import a folder of recordings as sessions of a data set, which is declared if it is new."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Sequence
from pathlib import Path

from pydantic import ValidationError

from ajgdata.paths import Paths
from ajgdata.pipeline.added_channels import check_added_channels
from ajgdata.pipeline.inferred_targets import InferredTarget, inferred_target
from ajgdata.pipeline.microphones import check_microphone, chosen_microphone
from ajgdata.pipeline.progress import tracked
from ajgdata.pipeline.schemas import register_dataset
from ajgdata.store.audio import AudioError, hash_and_inspect
from ajgdata.store.file_names import UNUSED_FIELD
from ajgdata.store.files import BRINGING, alone
from ajgdata.store.importing import (
    Contents,
    Imported,
    are_simulated,
    import_sessions,
    known_sessions,
)
from ajgdata.store.listing import listed
from ajgdata.store.publishing.columns import RENAME, unpublishable
from ajgdata.store.scan import Scan, scan, template_columns
from ajgdata.store.session_names import slug
from ajgdata.store.sessions import check_one_source, list_sessions, read_dataset
from ajgdata.types import (
    AudioSettings,
    DataError,
    DatasetSpec,
    ImportSettings,
    OnChange,
    Task,
    checked,
    checked_name,
    describe,
)

DECLARED_FOLDS = 5
#: Models of a first run: they train in seconds.
FIRST_MODELS = ("linear", "knn")
#: Groups of a pattern that count, and are not learnt unless named.
COUNTERS = ("n", "fold", "take", "clip")


def import_folder(
    paths: Paths,
    dataset: str,
    folder: str | Path,
    *,
    settings: ImportSettings | None,
    targets: Sequence[str] = (),
    copy: bool = True,
    on_change: OnChange = OnChange.KEEP,
    microphone: int | str | None = None,
) -> tuple[DatasetSpec, Imported]:
    """Import `folder` into `dataset`.

    `settings` describe how file names or a table are read; the default is `imports` of
    dataset.yaml, else the starter kit's convention. `microphone` is `audio.microphone` of a new
    data set; None: see `pipeline.microphones`. Raises DataError, before anything is written,
    if the folder cannot be understood, for a session that cannot be added to, and while another
    process writes into the data set.
    """
    folder, path = Path(folder), paths.dataset(checked_name(dataset))
    declared = read_dataset(paths, dataset) if path.is_file() else None
    if declared and declared.recipe:
        raise DataError(path, "has a recipe, which makes its sessions", "choose another data set")
    if declared:
        check_microphone(path, declared.audio, microphone)
    chosen = _chosen(settings, declared)
    scanned = scan(folder, chosen, folder.resolve().name, known_sessions(paths, dataset))
    contents = _read(scanned)
    scanned.is_simulated = are_simulated(scanned, contents)
    if declared:
        check_one_source(paths, declared, list_sessions(paths, dataset), scanned.is_simulated)
        used = declared.audio.microphone
        is_requested = microphone is not None
        check_added_channels(paths, dataset, scanned, contents, used, is_requested=is_requested)
    spec = declared or declare(dataset, scanned, contents, chosen, targets, microphone)
    _note_columns(paths, spec, scanned, targets)
    # a template can name sessions of another folder by chance, a name is meant
    is_named = bool(settings and settings.session and not template_columns(settings.session))
    with alone(paths.recordings(dataset), BRINGING):
        try:
            result = import_sessions(
                paths, dataset, scanned, contents, copy, on_change, is_named=is_named
            )
        finally:
            if not path.exists() and list_sessions(paths, dataset):
                register_dataset(paths, spec)
    return spec, result


def _chosen(options: ImportSettings | None, declared: DatasetSpec | None) -> ImportSettings:
    """Return the given settings, completed by dataset.yaml; else the starter kit's convention."""
    before = declared.imports if declared else ImportSettings(pattern="starter-kit")
    if options is None:
        return before
    if options.pattern or options.table:  # another way to read the folder: nothing else holds
        return options
    return before.model_copy(update=options.model_dump(exclude_defaults=True))


def _read(scanned: Scan) -> Contents:
    """Return sha256 and header of every file that can be read; problems become remarks."""
    contents: Contents = {}
    for file in tracked(scanned.files, "reading"):
        try:
            digest, info = hash_and_inspect(scanned.folder / file.path)
        except AudioError as error:
            reason = f"{error.problem}; {error.fix}"
            scanned.remarks["failed"].append((file.path.as_posix(), reason))
            continue
        if isinstance(info, AudioError):
            scanned.remarks["unreadable"].append((file.path.as_posix(), info.problem))
        contents[file.path] = digest, None if isinstance(info, AudioError) else info
    return contents


def _note_columns(paths: Paths, spec: DatasetSpec, scanned: Scan, targets: Sequence[str]) -> None:
    """Note labels without a target, and labels whose names no published data set can have.

    Raises DataError for a target that `spec` does not have.
    """
    if unknown := sorted(set(map(slug, targets)) - set(spec.targets)):
        problem = f"{spec.name} is declared already, without {unknown[0]!r}"
        raise DataError("--target", problem, f"add it to {paths.dataset(spec.name)}")
    if free := [column for column in scanned.label_columns() if column not in spec.targets]:
        scanned.remarks["note"].append(("stored, but not a target", ", ".join(free)))
    if names := unpublishable(scanned.label_columns()):
        reason = f"{', '.join(names)}; to publish the data set, {RENAME}"
        scanned.remarks["note"].append(("columns that cannot be published", reason))


def declare(
    name: str,
    scanned: Scan,
    contents: Contents,
    settings: ImportSettings,
    targets: Sequence[str],
    microphone: int | str | None = None,
) -> DatasetSpec:
    """Return a first dataset.yaml for what an import found; people are meant to complete it.

    `targets` are the label columns to learn (default: all of a pattern's; a table's must be named),
    `object` among them. Why they are numbers or classes is noted. A task is declared for each
    target that has two classes; if none has, for all, because more recordings may follow.
    """
    columns = sorted(scanned.label_columns())
    chosen = list(dict.fromkeys(map(slug, targets))) or list(filter(_is_learnt, columns))
    if any(file.cells["object"] for file in scanned.files):
        columns.append("object")
        chosen = chosen or ["object"]
    if unknown := [target for target in chosen if target not in columns]:
        raise DataError("--target", f"there is no column {unknown[0]!r}", f"use one of {columns}")
    if settings.table and not targets:
        raise DataError("--target", "a table has many columns", f"name labels among {columns}")
    texts = {column: Counter(file.text(column) for file in scanned.files) for column in chosen}
    inferred = {column: inferred_target(texts[column]) for column in chosen}
    for column, inference in inferred.items():
        scanned.remarks["note"].append((f"target {column}", inference.reason))
        _note_cells(scanned, column, inference)
    possible = [
        column
        for column, inference in inferred.items()
        if len(set(texts[column]) - {"", *inference.target.missing}) > 1
    ]
    folder = scanned.folder.name
    try:
        return DatasetSpec(
            name=name,
            title=name,
            description=f"Imported from a folder named {folder!r}. Complete this declaration.",
            audio=_common_audio(scanned, contents, microphone),
            targets={column: inference.target for column, inference in inferred.items()},
            tasks={
                column: Task(target=column, folds=DECLARED_FOLDS, models=FIRST_MODELS)
                for column in possible or inferred
            },
            imports=settings,
        )
    except ValidationError as error:
        raise describe(error, f"data set {name!r}") from None


def _is_learnt(column: str) -> bool:
    """Return True for a group of a pattern that is a target although `--target` is not given."""
    return column not in COUNTERS and not re.fullmatch(UNUSED_FIELD.format(r"\d+"), column)


def _note_cells(scanned: Scan, column: str, inference: InferredTarget) -> None:
    """Note the recordings whose cell is missing by its text, and warn about doubtful cells."""
    files: dict[str, list[str]] = defaultdict(list)
    for file in scanned.files:
        files[file.text(column)].append(file.path.as_posix())
    for text in inference.target.missing:
        noun = "recording" if len(files[text]) == 1 else "recordings"
        reason = f"{text!r} is missing in {len(files[text])} {noun}: {listed(files[text])}"
        scanned.remarks["note"].append((f"target {column}", reason))
    for doubt in inference.doubts:
        examples = [f"{text!r} ({listed(files[text])})" for text in doubt.texts]
        reason = f"{doubt.problem}: {listed(examples)}; {doubt.fix}"
        scanned.remarks["warning"].append((f"target {column}", reason))


def _common_audio(scanned: Scan, contents: Contents, microphone: int | str | None) -> AudioSettings:
    """Return the commonest rate of the readable files, and the microphone that is used.

    Raises DataError if no file is a sound, and as `chosen_microphone` does.
    """
    infos = [info for _, info in contents.values() if info]
    if not infos:
        (file, problem), *_ = [*scanned.remarks["unreadable"], *scanned.remarks["failed"]]
        raise DataError(scanned.folder / file, problem, "name a folder with sounds")
    rate = Counter(info.sample_rate_hz for info in infos).most_common(1)[0][0]
    chosen = chosen_microphone(scanned, contents, microphone)
    return checked(AudioSettings, "--microphone", {"sample_rate_hz": rate, "microphone": chosen})
