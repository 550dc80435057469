"""`ajgdata publish`: write a data set as a folder that other people can use."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from zipfile import ZipFile

from ajgdata.acquire.recipe import session_names
from ajgdata.paths import Paths, Tree
from ajgdata.pipeline.dataset_summary import summary
from ajgdata.pipeline.progress import tracked
from ajgdata.pipeline.published_tables import (
    TABLE_FILE,
    PublishedTables,
    published_tables,
    with_published_rows,
)
from ajgdata.pipeline.published_version import check_version
from ajgdata.pipeline.session_differences import check_equal, read_session_tables
from ajgdata.report import card
from ajgdata.store.audio import FileHashes, file_sha256, segment_bytes
from ajgdata.store.changes import count_by_hand, log_bytes, read_changes
from ajgdata.store.code_hash import code_hash
from ajgdata.store.features import FeatureRows, read_store, text_column, write_store
from ajgdata.store.files import copy, json_bytes, replacing_folder, sha256_of, yaml_bytes
from ajgdata.store.findings import read_findings
from ajgdata.store.freshness import check_computed, check_up_to_date
from ajgdata.store.lock import locked
from ajgdata.store.provenance import commit_date, settings_digest, software
from ajgdata.store.publishing import archive
from ajgdata.store.publishing.about import About, described_files
from ajgdata.store.publishing.citation import citation_bytes
from ajgdata.store.publishing.croissant import croissant
from ajgdata.store.publishing.datapackage import datapackage
from ajgdata.store.publishing.table import FILE_NAME, PublishedTable, file_name, table_of
from ajgdata.store.publishing.typed_table import parquet_bytes
from ajgdata.store.sessions import audio_path, inside, read_dataset, read_table, write_session
from ajgdata.types import WHOLE_FILE, DataError, DatasetSpec, Recording, Session, many
from ajgdata.types.change import LabelChange
from ajgdata.types.formats import DATASET_FORMAT, FORMAT_KEY


@dataclass(frozen=True)
class Published:
    """Facts about a published data set."""

    folder: Path
    recordings: int
    bytes: int
    left_out: int
    is_unlicensed: bool


@dataclass(frozen=True)
class _Contents:
    """Content of a published data set: features, sessions by name, and recordings.

    `recordings` has each recording with its file, by `<session>/<recording_id>`, in the order of
    the feature file. `tables` are the tables of a data set without sound, and None for sound.
    """

    store: FeatureRows
    sessions: Mapping[str, Session]
    recordings: Mapping[str, tuple[Recording, Path]]
    tables: PublishedTables | None = None


def publish(
    paths: Paths,
    dataset: str,
    out: str | Path,
    *,
    store: Path | None = None,
    models: Mapping[str, bytes] | None = None,
) -> Published:
    """Write the data set `dataset` with its features into the folder `out`, all or nothing.

    A segment of a long file becomes a file with the same samples, and the used rows of an imported
    table become a table of their session. The folder contains the recordings of the feature file
    `store` (default: that of `load_features`). `models` are files of final models by name (see
    `pipeline.published_models`).
    Raises DataError, and keeps the old folder, if features are missing or differ from the
    recordings of the sessions, if the folder has the same version with other content, or if another
    process publishes there.

    >>> from pathlib import Path
    >>> from ajgdata.paths import find_project
    >>> from ajgdata.pipeline.publish import publish
    >>> publish(find_project(), "size", Path("tree/size")).recordings
    16
    >>> sorted(path.name for path in Path("tree/size").iterdir())[:3]
    ['CITATION.cff', 'LICENSE', 'README.md']
    """
    out = Path(out)
    _check_target(out)
    spec = read_dataset(paths, dataset)
    features = store or paths.features(dataset)
    check_computed(paths, dataset, features)
    features_sha256 = file_sha256(features)
    contents = _contents(paths, spec, features)
    check_up_to_date(paths, spec, session_names(spec.recipe))
    with locked(out, "publishing into it"), replacing_folder(out) as folder:
        tree = Tree(folder)
        copy(features, tree / tree.FEATURES)
        if file_sha256(tree / tree.FEATURES) != features_sha256:
            fix = "wait for the run that computes it, then publish again"
            raise DataError(features, "changed while it was read", fix)
        if any(recording.segment != WHOLE_FILE for recording, _ in contents.recordings.values()):
            contents = _with_segment_files(tree, contents)
            write_store(tree / tree.FEATURES, contents.store)
        if contents.tables is not None:
            write_store(tree / tree.FEATURES, contents.store)
            suffixes = None
        else:
            suffixes = [_suffix(*recording) for recording in contents.recordings.values()]
        table = table_of(contents.store, suffixes, features)
        _write(tree, tree.METADATA, table.encoded())
        _write(tree, tree.TYPED_METADATA, parquet_bytes(table))
        _write(tree, tree.DECLARATION, declaration_bytes(spec))
        _write_sessions(tree, paths, dataset, table, contents)
        for name, content in (models or {}).items():
            _write(tree, name, content)
        check_version(paths, spec, published=Tree(out), new=tree)
        if contents.tables is None:
            _write_audio(tree, table, contents)
        left_out, is_unlicensed = _describe(tree, paths, spec, table, contents)
        _write(tree, tree.SUMS, archive.checksums_bytes(folder))
        size = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
    return Published(out, len(table.rows), size, left_out, is_unlicensed)


def _check_target(out: Path) -> None:
    """Raise DataError unless the folder `out` is free, or a published data set, complete or not."""
    is_empty = not out.exists() or (out.is_dir() and not any(out.iterdir()))
    if not is_empty and not (out / Tree.CROISSANT).is_file():
        raise DataError(out, "is not a published data set", "name another folder")


def declaration_bytes(spec: DatasetSpec) -> bytes:
    """Return dataset.yaml with everything that the data set config takes over from another one."""
    # Settings of a robot are the laboratory's own: hosts, tokens.
    private = {"protocol": {"robot"}}
    content = spec.model_dump(mode="json", exclude_defaults=True, exclude=private)
    return yaml_bytes({FORMAT_KEY: DATASET_FORMAT.version, **content})


def _contents(paths: Paths, spec: DatasetSpec, features: Path) -> _Contents:
    """Return the sessions and recordings of a feature file.

    Raises DataError if it has no recordings, or differs from the tables of the sessions.
    """
    store = read_store(features)
    tables = read_session_tables(paths, spec)
    check_equal(features, spec, store, read_findings(paths.quarantine(spec.name)), tables)
    names = store.columns["recording"].values.tolist()
    if not names:
        fix = f"see the reasons in {paths.quarantine(spec.name)}"
        raise DataError(features, "has no usable recording", fix)
    used = sorted(set(store.columns["session_id"].values.tolist()))
    sessions = {name: tables.sessions[name] for name in used}
    recordings = {}
    for name in names:
        session = sessions[name.partition("/")[0]]
        folder = paths.session(spec.name, session.session_id)
        recording = tables.recordings[name]
        recordings[name] = recording, audio_path(folder, session, recording)
    contents = _Contents(store, sessions, recordings)
    if spec.features.needs_waveform:
        return contents
    published = published_tables(recordings, sessions, spec.features.table_columns)
    store = replace(store, columns=with_published_rows(store, published))
    return replace(contents, store=store, tables=published)


def _write(tree: Tree, name: str, content: bytes) -> None:
    """Write a file of a published data set, and its folder if it is new."""
    path = tree / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)


def _suffix(recording: Recording, path: Path) -> str:
    """Return the suffix of the published file of a recording."""
    return path.suffix.lower() if recording.segment == WHOLE_FILE else ".wav"


def _with_segment_files(tree: Tree, contents: _Contents) -> _Contents:
    """Write each segment into a file, and return the content with the sha256 of the new files.

    Raises DataError if the file of a segment changed since its features were computed.
    """
    store = contents.store
    hashes = dict(zip(contents.recordings, store.columns["sha256"].values.tolist(), strict=True))
    present = FileHashes()
    for name, (recording, path) in contents.recordings.items():
        if recording.segment == WHOLE_FILE:
            continue
        if present[path] != hashes[name]:
            raise _changed(contents, path)
        content = segment_bytes(path, recording.segment)
        hashes[name] = sha256_of(content)
        _write(tree, file_name(name, hashes[name], _suffix(recording, path)), content)
    attrs = store.columns["sha256"].attrs
    columns = {**store.columns, "sha256": text_column([*hashes.values()], **attrs)}
    return replace(contents, store=replace(store, columns=columns))


def _changed(contents: _Contents, path: Path) -> DataError:
    """Return the error of a file that changed since its features were computed."""
    dataset = contents.store.attrs["data_set"]
    problem = "its bytes changed since its features were computed"
    fix = f"restore it, or use `ajgdata check {dataset} --accept` and run again"
    return DataError(path, problem, fix)


def _write_audio(tree: Tree, table: PublishedTable, contents: _Contents) -> None:
    """Write every recording into a file, unless it is a written segment, and into the archive."""
    names = tracked(list(contents.recordings), "copying")
    with ZipFile(tree / tree.ARCHIVE, "w") as packed:
        for row, name in zip(table.rows, names, strict=True):
            recording, path = contents.recordings[name]
            is_segment = recording.segment != WHOLE_FILE
            source = tree / row[FILE_NAME] if is_segment else path
            try:
                content = source.read_bytes()
            except OSError as error:
                fix = "restore it, or compute its features again"
                raise DataError(source, f"cannot be read ({error.strerror})", fix) from None
            if sha256_of(content) != row["sha256"]:
                raise _changed(contents, source)
            if not is_segment:
                _write(tree, row[FILE_NAME], content)
            archive.add(packed, row[FILE_NAME], content)


def _write_sessions(
    tree: Tree, paths: Paths, dataset: str, table: PublishedTable, contents: _Contents
) -> None:
    """Write session.yaml, recordings.csv, the played sound and the changes of each session.

    recordings.csv has the labels with the changes of people. changes.jsonl has the changes of the
    published recordings, without the names of the people.
    `file` in recordings.csv is `audio/<name>` of the file that is published as
    `audio/<session>/<name>`, or the table of the session.
    """
    for name, session in contents.sessions.items():
        changed: dict[str, Any] = {"audio_root": None}
        played = session.excitation
        if played:
            source = inside(paths.session(dataset, name), played.file)
            target = Tree.excitation(name, source.suffix.lower())
            if file_sha256(source) != played.sha256:
                problem = f"is not the sound that session {name} names"
                fix = "restore it, or correct its sha256 in session.yaml"
                raise DataError(source, problem, fix)
            _write(tree, target, source.read_bytes())
            changed["excitation"] = played.model_copy(update={"file": Path(target).name})
        recordings = []
        changes: list[LabelChange] = []
        log = read_changes(paths.session(dataset, name))
        for row in table.rows:
            if row["session_id"] == name:
                recording, _ = contents.recordings[row["recording"]]
                update: dict[str, Any] = {"sha256": row["sha256"], "start_s": None, "end_s": None}
                if contents.tables is None:
                    update["file"] = row[FILE_NAME].replace(f"/{name}/", "/", 1)
                else:
                    update["file"] = TABLE_FILE
                    update["table_row"] = contents.tables.rows[row["recording"]]
                recordings.append(recording.model_copy(update=update))
                own = log.by_recording.get(recording.recording_id, ())
                changes += [_published_change(c, recording, row["sha256"]) for c in own]
        folder = (tree / tree.session(name)).parent
        if contents.tables is not None:
            _write(Tree(folder), TABLE_FILE, contents.tables.contents[name])
        write_session(folder, session.model_copy(update=changed), recordings)
        if changes:
            _write(tree, Tree.changes(name), log_bytes(changes))


def _published_change(change: LabelChange, recording: Recording, sha256: str) -> LabelChange:
    """Return a change of a recording for its published file, whose hash is `sha256`.

    The user name of a person is private; authors are named in dataset.yaml.
    """
    is_of_sound = change.sha256 == recording.sha256
    return change.model_copy(
        update={"author": "", "sha256": sha256 if is_of_sound else change.sha256}
    )


def _describe(
    tree: Tree, paths: Paths, spec: DatasetSpec, table: PublishedTable, contents: _Contents
) -> tuple[int, bool]:
    """Write description, metadata and figure; return `left_out` and `is_unlicensed`."""
    from ajgdata.report.canvas import draw, encode
    from ajgdata.report.figures import spectra_figure

    about_data = summary(paths, spec, contents.store)
    grippers = sorted({session.gripper for session in contents.sessions.values()})
    about = About(spec, about_data.source, commit_date(), grippers != ["unknown"])
    if about_data.spectra:
        figure = draw(spectra_figure(about_data, about_data.spectra))
        _write(tree, tree.SPECTRA, encode(figure, "png"))
    described = [tree.TYPED_METADATA, *described_files(spec)]
    sizes = {name: (tree / name).stat().st_size for name in described}
    hashes = {name: file_sha256(tree / name) for name in described}
    _write(tree, tree.CROISSANT, json_bytes(croissant(about, table, hashes, sizes)))
    _write(tree, tree.DATAPACKAGE, json_bytes(datapackage(about, table, hashes, sizes)))
    _write(tree, tree.CITATION, citation_bytes(about))
    _write(tree, tree.LICENCE, card.licence_text(about).encode())
    facts = _provenance(spec, contents.store.attrs, grippers)
    by_hand = _changed_by_hand(paths, spec.name, contents.sessions)
    if by_hand:
        facts["labels changed by hand"] = by_hand
    models = tree.root.glob(Tree.model("*", "*", Tree.README))
    names = sorted(file.relative_to(tree.root).parent.as_posix() for file in models)
    text = card.render_card(about, about_data, table, sizes, facts, paths, names)
    _write(tree, tree.README, text.encode())
    return about_data.n_left_out, about.is_unlicensed


def _provenance(
    spec: DatasetSpec, attrs: Mapping[str, Any], grippers: Sequence[str]
) -> dict[str, str]:
    """Return the software, settings and grippers of a published data set, by topic.

    `attrs` are the attributes of its feature file.
    """
    facts = {
        "simulated or recorded": attrs["source"],
        "gripper": ", ".join(grippers),
        "published by": _program(software()),
        "features computed by": _program(attrs),
        "digest of dataset.yaml": settings_digest(spec),
        "digest of the feature settings": attrs["settings_digest"],
        "digest of the recordings": attrs["inputs_sha256"],
    }
    for file, sha256 in spec.features.files.items():
        facts["file of the feature"] = f"{file}, sha256 {sha256}; not part of this data set"
    if spec.recipe:
        facts["digest of the code of the virtual gripper"] = code_hash("gripper")
    return {topic: str(text) for topic, text in facts.items()}


def _changed_by_hand(paths: Paths, dataset: str, sessions: Iterable[str]) -> str:
    """Return the numbers of recordings that people labelled again or rejected; "" for none."""
    labelled = 0
    rejected = 0
    for name in sessions:
        folder = paths.session(dataset, name)
        counts = count_by_hand(read_changes(folder), read_table(folder)[0])
        labelled += counts[0]
        rejected += counts[1]
    if not labelled and not rejected:
        return ""
    return f"{many(labelled, 'recording')}; {many(rejected, 'further recording')} rejected"


def _program(about: Mapping[str, Any]) -> str:
    """Return version and commit of ajgdata in a provenance."""
    return f"ajgdata {about['ajgdata_version']}, commit {about['git_commit'] or '–'}"
