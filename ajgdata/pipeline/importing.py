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
from ajgdata.pipeline.microphones import (
    RequestedMicrophone,
    check_microphone,
    chosen_microphone,
)
from ajgdata.pipeline.progress import tracked
from ajgdata.pipeline.schemas import dataset_schema, register_dataset, schema_bytes
from ajgdata.store.audio import AudioError, hash_and_inspect
from ajgdata.store.file_names import UNUSED_FIELD
from ajgdata.store.importing import (
    Contents,
    Imported,
    are_simulated,
    import_sessions,
    known_sessions,
)
from ajgdata.store.listing import listed
from ajgdata.store.lock import ADDING_RECORDINGS, locked
from ajgdata.store.publishing.columns import RENAME, unpublishable
from ajgdata.store.scan import Scan, scan, template_columns
from ajgdata.store.session_names import slug
from ajgdata.store.sessions import check_one_source, list_sessions, read_dataset, require_waveforms
from ajgdata.types import (
    AudioSettings,
    DataError,
    DatasetSpec,
    ImportSettings,
    OnChange,
    Strict,
    Task,
    checked,
    checked_name,
    describe,
    many,
)

DECLARED_FOLDS = 5
#: Models of a first run: they train in seconds.
FIRST_MODELS = ("linear", "knn")
#: Groups of a pattern that are counters: they are targets only if `--target` names them.
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
    microphone: RequestedMicrophone = None,
) -> tuple[DatasetSpec, Imported]:
    """Import `folder` into `dataset`.

    `settings` describe how file names or a table are read. The default is `imports` of
    dataset.yaml, or the starter kit's convention for a new data set. `microphone` is
    `audio.microphone` of a new data set, or `all`; for None, see `pipeline.microphones`. Raises
    DataError, before anything is written, if the file names or the table cannot be read, if
    recordings cannot be added to a session, and while another process writes into the data set.
    """
    folder = Path(folder)
    path = paths.dataset(checked_name(dataset))
    declared = read_dataset(paths, dataset) if path.is_file() else None
    if declared and declared.recipe:
        raise DataError(path, "has a recipe, which makes its sessions", "choose another data set")
    if declared:
        require_waveforms(declared, folder)
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
    note_columns(paths, spec, scanned, targets)
    # A template can give the name of an existing session by chance; a written name is intended.
    is_named = bool(settings and settings.session and not template_columns(settings.session))
    with locked(paths.recordings(dataset), ADDING_RECORDINGS):
        try:
            result = import_sessions(
                paths, dataset, scanned, contents, copy, on_change, is_named=is_named
            )
        finally:
            if not path.exists() and list_sessions(paths, dataset):
                register_dataset(paths, spec, schema_bytes(dataset_schema()))
    return spec, result


def _chosen(options: ImportSettings | None, declared: DatasetSpec | None) -> ImportSettings:
    """Return the given settings, completed by dataset.yaml or by the starter kit's convention."""
    if declared:
        before = declared.imports
    elif options is not None and options.segments:
        before = ImportSettings()
    else:
        before = ImportSettings(pattern="starter-kit")
    if options is None:
        return before
    if options.pattern or options.table:  # the stored settings are for another way of reading
        return options.model_copy(update={"join": before.join})
    given = options.model_dump(exclude_defaults=True)
    return before.model_copy(update={name: getattr(options, name) for name in given})


def _read(scanned: Scan) -> Contents:
    """Return sha256 and header of every file that can be read; problems become remarks."""
    contents: Contents = {}
    for path in tracked(list(dict.fromkeys(file.path for file in scanned.files)), "reading"):
        try:
            digest, info = hash_and_inspect(scanned.folder / path)
        except AudioError as error:
            reason = f"{error.problem}; {error.fix}"
            scanned.remarks["failed"].append((path.as_posix(), reason))
            continue
        if isinstance(info, AudioError):
            scanned.remarks["unreadable"].append((path.as_posix(), info.problem))
        contents[path] = digest, None if isinstance(info, AudioError) else info
    return contents


def note_columns(paths: Paths, spec: DatasetSpec, scanned: Scan, targets: Sequence[str]) -> None:
    """Note labels without a target, and labels whose names no published data set can have.

    Raises DataError for a target that `spec` does not have.
    """
    unknown = sorted(set(map(slug, targets)) - set(spec.label_targets))
    if unknown:
        problem = f"{spec.name} is declared already, without {unknown[0]!r}"
        raise DataError("--target", problem, f"add it to {paths.dataset(spec.name)}")
    not_targets = [column for column in scanned.label_columns() if column not in spec.label_targets]
    if not_targets:
        scanned.remarks["note"].append(("stored, but not a target", ", ".join(not_targets)))
    names = unpublishable(scanned.label_columns())
    if names:
        reason = f"{', '.join(names)}; to publish the data set, {RENAME}"
        scanned.remarks["note"].append(("columns that cannot be published", reason))


def declare(
    name: str,
    scanned: Scan,
    contents: Contents,
    settings: ImportSettings,
    targets: Sequence[str],
    microphone: RequestedMicrophone = None,
) -> DatasetSpec:
    """Return a first dataset.yaml of an imported folder, for a person to complete.

    `targets` are label columns or `object`. By default they are all columns of a pattern; columns
    of a table must be named. Notes give the reasons why a target is a number or a class. Each
    target with at least two values gets a task. If there is no such target, each target gets a
    task, because more recordings may follow.
    """
    columns = sorted(scanned.label_columns())
    chosen = list(dict.fromkeys(map(slug, targets))) or list(filter(_is_learnt, columns))
    if any(file.cells["object"] for file in scanned.files):
        columns.append("object")
        chosen = chosen or ["object"]
    unknown = [target for target in chosen if target not in columns]
    if unknown:
        raise DataError("--target", f"there is no column {unknown[0]!r}", f"use one of {columns}")
    if settings.table and not targets:
        raise DataError("--target", "a table has many columns", f"name labels among {columns}")
    spec = declared_dataset(name, scanned, chosen, imports=settings)
    return spec.model_copy(update={"audio": _common_audio(scanned, contents, microphone)})


def declared_dataset(
    name: str, scanned: Scan, targets: Sequence[str], **settings: Strict
) -> DatasetSpec:
    """Return a first dataset.yaml with `targets` and `settings`, for a person to complete.

    Notes give the reasons why a target is a number or a class.
    """
    texts = {column: Counter(file.text(column) for file in scanned.files) for column in targets}
    inferred = {column: inferred_target(texts[column]) for column in targets}
    for column, inference in inferred.items():
        scanned.remarks["note"].append((f"target {column}", inference.reason))
        _note_cells(scanned, column, inference)
    possible = [
        column
        for column, inference in inferred.items()
        if len(set(texts[column]) - {"", *inference.target.missing}) > 1
    ]
    description = (
        f"Imported from a folder named {scanned.folder.name!r}. Complete this declaration."
    )
    try:
        return DatasetSpec.model_validate(
            {
                "name": name,
                "title": name,
                "description": description,
                "targets": {column: inference.target for column, inference in inferred.items()},
                "tasks": {
                    column: Task(target=column, folds=DECLARED_FOLDS, models=FIRST_MODELS)
                    for column in possible or inferred
                },
                **settings,
            }
        )
    except ValidationError as error:
        raise describe(error, f"data set {name!r}") from None


def _is_learnt(column: str) -> bool:
    """Return whether a group of a pattern is a target without `--target`."""
    return column not in COUNTERS and not re.fullmatch(UNUSED_FIELD.format(r"\d+"), column)


def _note_cells(scanned: Scan, column: str, inference: InferredTarget) -> None:
    """Note the recordings whose text stands for a missing value, and warn about doubtful cells."""
    files: dict[str, list[str]] = defaultdict(list)
    for file in scanned.files:
        files[file.text(column)].append(file.path.as_posix())
    for text in inference.target.missing:
        recordings = many(len(files[text]), "recording")
        reason = f"{text!r} is missing in {recordings}: {listed(files[text])}"
        scanned.remarks["note"].append((f"target {column}", reason))
    for doubt in inference.doubts:
        examples = [f"{text!r} ({listed(files[text])})" for text in doubt.texts]
        reason = f"{doubt.problem}: {listed(examples)}; {doubt.fix}"
        scanned.remarks["warning"].append((f"target {column}", reason))


def _common_audio(
    scanned: Scan, contents: Contents, microphone: RequestedMicrophone
) -> AudioSettings:
    """Return the most common rate of the readable files, and the microphone.

    Raises DataError if no file is a sound, and as `chosen_microphone` does.
    """
    infos = [info for _, info in contents.values() if info]
    if not infos:
        (file, problem), *_ = [*scanned.remarks["unreadable"], *scanned.remarks["failed"]]
        raise DataError(scanned.folder / file, problem, "name a folder with sounds")
    rate = Counter(info.sample_rate_hz for info in infos).most_common(1)[0][0]
    chosen = chosen_microphone(scanned, contents, microphone)
    return checked(AudioSettings, "--microphone", {"sample_rate_hz": rate, "microphone": chosen})
