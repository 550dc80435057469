"""`ajgdata publish`: write a data set as a folder that others can use."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import ZipFile

from ajgdata.paths import Paths, Tree
from ajgdata.store.audio import file_sha256
from ajgdata.store.features import Shard, read_labels, spectra_blocks
from ajgdata.store.files import (
    alone,
    copy,
    json_bytes,
    replacing_folder,
    sha256_of,
    yaml_bytes,
)
from ajgdata.store.provenance import commit_date, layer_hash, settings_digest, software
from ajgdata.store.publishing import archive
from ajgdata.store.publishing.about import About
from ajgdata.store.publishing.archive import checksums_bytes
from ajgdata.store.publishing.documents import croissant, datapackage
from ajgdata.store.publishing.table import FILE_NAME, Table, table_of
from ajgdata.store.sessions import audio_path, inside, read_dataset, read_recordings, read_session
from ajgdata.types import DataError, DatasetSpec, Session

if TYPE_CHECKING:
    from ajgdata.report.report_data import DatasetSummary

#: Nobody of a recorded data set was named: the people who can be asked are whoever hands it on.
UNNAMED = {"simulated": "The ajgdata developers", "recorded": "Authors not named"}


@dataclass(frozen=True)
class Published:
    """Facts about a published data set."""

    folder: Path
    recordings: int
    bytes: int
    left_out: int
    unsealed: int
    is_unlicensed: bool


@dataclass(frozen=True)
class Source:
    """A recording's file, and whether its hash was written down when it was recorded."""

    path: Path
    sha256: str
    is_sealed: bool


def publish(
    paths: Paths,
    dataset: str,
    out: str | Path,
    *,
    store: Path | None = None,
    each: Callable[[Sequence[Source]], Any] = iter,
) -> Published:
    """Write the data set `dataset` with its features into the folder `out`, all or nothing.

    Its version is that of dataset.yaml, its date the day of the commit. `store` are its features
    (default: those that `ajgdata.load_features` gives); what they hold is what is published. `each`
    goes through the recordings, and may show how far it is. Raises DataError, and leaves what was
    there, when the features are missing or not of the recordings as they are now, and while another
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
    for needed in (features, paths.quarantine(dataset)):
        if not needed.is_file():
            raise DataError(needed, "does not exist yet", f"run `ajgdata run {dataset}` first")
    content = read_labels(features)
    for _ in spectra_blocks(features):  # damage is found before anything is written
        pass
    sessions = _sessions(paths, dataset, content)
    sources = _sources(paths, dataset, sessions, content)
    table = table_of(content, [s.path.suffix.lower() for s in sources], features)
    with alone(out, "publishing into it"), replacing_folder(out) as folder:
        tree = Tree(folder)
        _write_audio(tree, table, sources, each)
        _write(tree, tree.METADATA, table.encoded())
        copy(features, tree / tree.FEATURES)
        _write(tree, tree.DECLARATION, declaration_bytes(spec))
        _write_sessions(tree, paths, dataset, sessions)
        unsealed = sum(not source.is_sealed for source in sources)
        made = _describe(tree, paths, spec, content, table, sessions, unsealed)
        (tree / tree.SUMS).write_bytes(checksums_bytes(folder))
        size = sum(p.stat().st_size for p in folder.rglob("*") if p.is_file())
    return Published(out, len(table.rows), size, *made)


def declaration_bytes(spec: DatasetSpec) -> bytes:
    """Return dataset.yaml with everything that the declaration takes over from another one."""
    # Settings of a robot are the laboratory's own: hosts, tokens.
    private = {"protocol": {"robot_settings"}}
    return yaml_bytes(spec.model_dump(mode="json", exclude_defaults=True, exclude=private))


def _check_target(out: Path) -> None:
    """Raise DataError unless `out` is free or holds a published data set, whole or not."""
    if out.is_dir() and any(out.iterdir()) and not (out / Tree.CROISSANT).is_file():
        raise DataError(out, "is a folder that holds something else", "name another folder")
    if out.exists() and not out.is_dir():
        raise DataError(out, "is a file", "name a folder")


def _sessions(paths: Paths, dataset: str, store: Shard) -> dict[str, Session]:
    names = sorted({str(name) for name in store.columns["session_id"].values})
    return {name: read_session(paths.session(dataset, name)) for name in names}


def _sources(
    paths: Paths, dataset: str, sessions: Mapping[str, Session], store: Shard
) -> list[Source]:
    """Return the file of each row of the store, in its order."""
    known: dict[str, tuple[Path, bool]] = {}
    for name, session in sessions.items():
        folder = paths.session(dataset, name)
        for one in read_recordings(folder)[0]:
            path = audio_path(folder, session, one)
            known[f"{name}/{one.recording_id}"] = path, bool(one.sha256)
    sources = []
    columns = (store.columns["recording"].values, store.columns["sha256"].values)
    for recording, digest in zip(*(map(str, column) for column in columns), strict=True):
        if recording not in known:
            raise DataError(recording, "has features but is no recording", "run `snakemake` again")
        path, is_sealed = known[recording]
        sources.append(Source(path, digest, is_sealed))
    return sources


def _write(tree: Tree, name: str, content: bytes) -> None:
    path = tree / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)


def _write_audio(
    tree: Tree, table: Table, sources: Sequence[Source], each: Callable[[Sequence[Source]], Any]
) -> None:
    """Copy every recording, once as a file and once into the archive, in one reading."""
    with ZipFile(tree / tree.ARCHIVE, "w") as packed:
        for row, source in zip(table.rows, each(sources), strict=True):
            try:
                content = source.path.read_bytes()
            except OSError as error:
                fix = "restore it, or run `snakemake` again"
                raise DataError(source.path, f"cannot be read ({error.strerror})", fix) from None
            if sha256_of(content) != source.sha256:
                problem = "its bytes changed since its features were made"
                raise DataError(source.path, problem, "run `snakemake` again")
            _write(tree, row[FILE_NAME], content)
            archive.add(packed, row[FILE_NAME], content)


def _write_sessions(
    tree: Tree, paths: Paths, dataset: str, sessions: Mapping[str, Session]
) -> None:
    """Return the sessions' descriptions, without the places of their files on this machine."""
    for name, session in sessions.items():
        changed: dict[str, Any] = {"audio_root": None}
        if played := session.excitation:
            source = inside(paths.session(dataset, name), played.file)
            target = Tree.excitation(name, source.suffix.lower())
            if file_sha256(source) != played.sha256:
                problem = f"is not the sound that session {name} names"
                raise DataError(source, problem, "restore it, or `ajgdata seal`")
            _write(tree, target, source.read_bytes())
            changed["excitation"] = played.model_copy(update={"file": Path(target).name})
        content = session.model_copy(update=changed).model_dump(mode="json", exclude_none=True)
        _write(tree, tree.session(name), yaml_bytes(content))


def _describe(
    tree: Tree,
    paths: Paths,
    spec: DatasetSpec,
    store: Shard,
    table: Table,
    sessions: Mapping[str, Session],
    unsealed: int,
) -> tuple[int, int, bool]:
    """Write the description, metadata and figures; return the last fields of `Published`."""
    from ajgdata.pipeline.dataset_summary import summary
    from ajgdata.report import card
    from ajgdata.report.canvas import encode
    from ajgdata.report.spectra import spectra_figure

    about_data = summary(paths, spec, tree / tree.FEATURES)
    about = About(
        name=spec.name,
        title=about_data.title,
        description=spec.description,
        licence=spec.licence,
        authors=spec.authors or (UNNAMED[about_data.source],),
        citation=spec.citation,
        url=spec.url,
        version=spec.version,
        date=commit_date(),
        source=about_data.source,
        task_kinds=frozenset(spec.targets[task.target].kind for task in spec.tasks.values()),
        has_gripper=card.has_gripper(list(sessions.values())),
    )
    if about_data.spectra:
        _write(tree, tree.SPECTRA, encode(spectra_figure(about_data), "png"))
    held = (tree.METADATA, tree.FEATURES, tree.ARCHIVE)
    sizes = {name: (tree / name).stat().st_size for name in held}
    hashes = {name: file_sha256(tree / name) for name in held}
    documents = (about, table, hashes, sizes)
    _write(tree, tree.CROISSANT, json_bytes(croissant(*documents)))
    _write(tree, tree.DATAPACKAGE, json_bytes(datapackage(*documents)))
    _write(tree, tree.CITATION, yaml_bytes(card.citation(about)))
    _write(tree, tree.LICENCE, card.licence_text(about).encode())
    front = yaml_bytes(card.front_matter(about, len(table.rows))).decode()
    facts = _provenance(spec, about_data, store, sessions)
    groups = sorted({task.groups for task in spec.tasks.values()})
    text = card.render_card(about, about_data, table, groups, unsealed, sizes, facts, front, paths)
    _write(tree, tree.README, text.encode())
    return about_data.n_left_out, unsealed, about.is_unlicensed


def _provenance(
    spec: DatasetSpec,
    summary: DatasetSummary,
    store: Shard,
    sessions: Mapping[str, Session],
) -> dict[str, str]:
    """Return the software, settings and gripper that made it, by topic."""
    made = software()
    facts = {
        "simulated or recorded": summary.source,
        "gripper": ", ".join(sorted({s.gripper for s in sessions.values()})),
        "version of the data set": spec.version,
        "published by": f"ajgdata {made['ajgdata_version']}, commit {made['git_commit'] or '–'}",
        "features made by": f"ajgdata {summary.provenance.version}, "
        f"commit {summary.provenance.commit or '–'}",
        "digest of the declaration": settings_digest(spec),
        "digest of the feature settings": str(store.attrs["settings_digest"]),
        "digest of the recordings": summary.provenance.inputs_hash,
    }
    if summary.source == "simulated":
        facts["digest of the code of the virtual gripper"] = layer_hash("gripper")
    return facts
