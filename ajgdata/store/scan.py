"""Folder of recordings -> rows: which file is which recording, by pattern or by table.

This is the only place where labels are read out of file names.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ajgdata.paths import DATASET_FILE, SESSION_FILE, Paths
from ajgdata.store.audio import UNREADABLE_SUFFIXES, AudioError, inspect_audio, unsupported
from ajgdata.store.files import why_no_file
from ajgdata.store.import_fields import (
    Fields,
    check_vocabulary,
    fields_of,
    session_name,
    slug,
    with_numbered_samples,
)
from ajgdata.store.label_tables import joined, read_label_table
from ajgdata.store.plain_text import Cleaner
from ajgdata.types import DataError, ImportSettings

AUDIO_SUFFIXES = {".wav", ".wave", ".ogg", ".oga", ".flac"}
STARTER_KIT = r"(?:.*/)?(?P<n>\d+)_(?P<label>[^/]+)\.[^./]+"
#: Control characters, and bytes of a file name that are not UTF-8: a table cannot hold them.
_NO_TEXT = re.compile(r"[\x00-\x1f\x7f\ud800-\udfff]")
Named = list[tuple[str, str]]


@dataclass(frozen=True)
class ScannedFile:
    """One recording in the folder: path relative to it, its roles and labels.

    `quality`, `recording_id` and `sha256` are "" if the folder does not specify them. `decode` is
    True for a file that has to be decoded into a new one. `sample` is the number of `sample_text`.
    """

    path: Path
    session: str
    grasp: str
    object: str
    sample: int
    labels: Mapping[str, str]
    quality: str = ""
    decode: bool = False
    recording_id: str = ""
    sha256: str = ""
    sample_text: str = ""

    def cell(self, column: str) -> str:
        """Return what stands in a column that can be learnt."""
        return self.object if column == "object" else self.labels.get(column, "")


@dataclass
class Scan:
    """Recordings found in a folder, by name and reason what is left out, and notes.

    `wanting` are files that belong to the recordings by name or table, `skipped` all other files,
    `missing` names whose content is not there.
    """

    files: list[ScannedFile] = field(default_factory=list)
    excitations: dict[str, Path] = field(default_factory=dict)
    skipped: Named = field(default_factory=list)
    wanting: Named = field(default_factory=list)
    missing: Named = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


@dataclass
class Search:
    """Audio files below a folder, sorted and relative to it; by name and reason: hidden audio
    files, folders that cannot be searched, and names that do not matter."""

    audio: list[Path] = field(default_factory=list)
    hidden: Named = field(default_factory=list)
    closed: Named = field(default_factory=list)
    skipped: Named = field(default_factory=list)


def scan(folder: Path, settings: ImportSettings, name: str, *, convert: bool = False) -> Scan:
    """Return every recording below `folder` (sorted by path), by `settings.pattern` or `.table`.

    `name` is the session of recordings without a session. With `convert`, files in other formats
    are included. Raises DataError if the folder, the pattern or the table cannot be used, or if
    nothing in the folder matches.
    """
    if not folder.is_dir():
        raise DataError(folder, "is not a folder", "name the folder that holds the recordings")
    result = Scan()
    audio, refused = _audio_files(folder, result, convert=convert)
    if settings.table:
        _by_table(folder, audio, refused, settings, name, result)
    else:
        _by_name(audio, refused, settings, name, result)
    if result.files:
        check_vocabulary(result.files, folder / settings.table if settings.table else "--pattern")
        result.files, notes = with_numbered_samples(result.files)
        result.notes += notes
        return result
    left_out = [*result.missing, *result.wanting, *result.skipped]
    if not left_out and not result.excitations:
        fix = f"name a folder with {', '.join(sorted(AUDIO_SUFFIXES))}"
        raise DataError(folder, "holds no audio files", fix)
    example = ": {!r} {}".format(*left_out[0]) if left_out else ""
    fix = "correct --pattern (it must match the whole path inside the folder)"
    fix = "correct --file (a path inside the folder)" if settings.table else fix
    raise DataError(folder, f"none of its audio files can be imported{example}", fix)


def target_column(text: str) -> str:
    """Return the column of a target called `text`: `object` is one that every recording has."""
    return "object" if text.lower() == "object" else slug(text)


def search(folder: Path) -> Search:
    """Search a folder for audio by file name. The recordings and results of a project, the history
    of git and virtual environments are not searched."""
    suffixes = {*AUDIO_SUFFIXES, *UNREADABLE_SUFFIXES}
    result = Search()

    def refused(error: OSError) -> None:
        where = os.path.relpath(error.filename, folder)
        result.closed.append((where, f"{error.strerror}: not searched"))

    for root, folders, names in os.walk(folder, onerror=refused):
        here = Path(root).relative_to(folder)
        folders[:] = [name for name in folders if _is_searched(Path(root, name), here, result)]
        for path in (here / name for name in names if Path(name).suffix.lower() in suffixes):
            if path.name.startswith("._"):
                reason = "an AppleDouble file of macOS, without sound"
                result.skipped.append((path.as_posix(), reason))
            elif any(part.startswith(".") for part in path.parts):
                result.hidden.append((path.as_posix(), "hidden: rename the file or its folder"))
            else:
                result.audio.append(path)
    result.audio.sort()
    for found in (result.hidden, result.closed, result.skipped):
        found.sort()
    return result


def _is_searched(folder: Path, here: Path, result: Search) -> bool:
    """Return True for a folder that may contain recordings; others are listed in `result`."""
    where = (here / folder.name).as_posix()
    if folder.name == ".git" or (folder / "pyvenv.cfg").is_file():
        return False
    if _belongs_to_project(folder):
        result.skipped.append((where, "recordings or results of a project: not searched"))
        return False
    if folder.is_symlink():  # os.walk does not follow it
        result.closed.append((where, "a link to a folder, not searched: name that folder"))
    return True


def _belongs_to_project(folder: Path) -> bool:
    """Return True for a session of a data set, and for folders that a project writes."""
    paths = Paths(folder.parent)
    written = {one.name for one in (paths.data, paths.results, paths.cache)} | {".snakemake"}
    if folder.name in written and any(paths.datasets.glob(f"*/{DATASET_FILE}")):
        return True
    return (folder / SESSION_FILE).is_file()


def _audio_files(
    folder: Path, result: Scan, *, convert: bool
) -> tuple[dict[Path, bool], dict[Path, str]]:
    """Return audio files that can be imported, True for one that has to be decoded, and files that
    are not imported although their names may match, with reasons. All other files go to
    `result`."""
    files: dict[Path, bool] = {}
    found = search(folder)
    refused = {Path(name): reason for name, reason in found.hidden}
    result.missing += found.closed
    result.skipped += found.skipped
    readable = {p.with_suffix("") for p in found.audio if p.suffix.lower() in AUDIO_SUFFIXES}
    for path in found.audio:
        name, decode = path.as_posix(), path.suffix.lower() in UNREADABLE_SUFFIXES
        if name != name.strip() or _NO_TEXT.search(name):
            reason = "its name is not plain text: rename it"
            result.wanting.append((_NO_TEXT.sub("?", name), reason))
        elif wrong := why_no_file(folder / path):
            result.missing.append((name, "; ".join(wrong)))
        elif decode and path.with_suffix("") in readable:
            reason = "probably the same sound as the WAV, FLAC or Ogg file with the same name"
            result.skipped.append((name, reason))
        elif decode and not convert:
            refusal = unsupported(path)
            refused[path] = f"{refusal.problem}; {refusal.fix}"
        else:
            files[path] = decode or (convert and _is_other_audio(folder / path))
    return files, refused


def _is_other_audio(path: Path) -> bool:
    """Return True for audio in another format than its name shows, which has to be decoded."""
    try:
        inspect_audio(path)
    except AudioError as error:
        return error.code == "unsupported_format"
    return False


def _by_name(
    audio: Mapping[Path, bool],
    refused: Mapping[Path, str],
    settings: ImportSettings,
    name: str,
    result: Scan,
) -> None:
    starter_kit = settings.pattern in ("", "starter-kit")
    try:
        pattern = re.compile(STARTER_KIT if starter_kit else settings.pattern)
    except re.error as error:
        raise DataError("--pattern", f"not a regular expression ({error})", "correct it") from None
    if not pattern.groupindex:
        raise DataError("--pattern", "has no named group", r"name the label: (?P<label>[^/]+)")
    groups = fields_of(list(pattern.groupindex), settings, "--pattern", "group")
    cleaner = Cleaner()
    for path in [*refused, *audio]:
        match, where = pattern.fullmatch(path.as_posix()), path.as_posix()
        if not match:
            result.skipped.append((where, "does not match the pattern"))
            continue
        if path in refused:
            result.wanting.append((where, refused[path]))
            continue
        fields = cleaner({key: value or "" for key, value in match.groupdict().items()})
        session = session_name(path.parent.as_posix()) if starter_kit and path.parent.name else name
        if starter_kit and int(fields["n"]) == 0:
            _take_played(path, session, result, decode=audio[path])
        else:
            file = _scanned(path, fields, groups, settings, session, decode=audio[path])
            result.files.append(file)
    result.notes += [*groups.notes, *cleaner.notes()]


def _take_played(path: Path, session: str, result: Scan, *, decode: bool) -> None:
    """Take file number 0 of the starter kit's convention as the played sound of its session."""
    if decode:
        result.wanting.append((path.as_posix(), "the played sound has to be a WAV"))
    elif (played := result.excitations.setdefault(session, path)) != path:
        result.skipped.append((path.as_posix(), f"the played sound is {played} already"))


def _by_table(
    folder: Path,
    audio: Mapping[Path, bool],
    refused: Mapping[Path, str],
    settings: ImportSettings,
    name: str,
    result: Scan,
) -> None:
    where = folder / settings.table
    table, notes = joined(folder, read_label_table(where), settings.join)
    columns = fields_of(table.columns.tolist(), settings, where, "column")
    cleaner = Cleaner()
    taken: set[Path] = set()
    named = {name for name, _ in (*result.missing, *result.wanting, *result.skipped)}
    for cells in table.itertuples(index=False):
        row = dict(zip(table.columns, map(str, cells), strict=True))
        path = Path(_filled("file", settings.file, row))
        if path.is_absolute() or ".." in path.parts:
            raise DataError(where, f"{path} leaves the folder", "use paths inside the folder")
        if path in taken:
            raise DataError(where, f"{path} stands in two rows", "keep one of them")
        taken.add(path)
        if path in audio:
            file = _scanned(path, cleaner(row), columns, settings, name, decode=audio[path])
            result.files.append(file)
        elif str(path) not in named:
            reason = refused.get(path, f"in {settings.table} but not in the folder")
            result.wanting.append((str(path), reason))
    left = sorted({*audio, *refused} - taken)
    result.skipped += [(str(path), f"no row in {settings.table}") for path in left]
    result.files.sort(key=lambda one: one.path)
    result.notes += [*notes, *columns.notes, *cleaner.notes()]


def _filled(option: str, template: str, fields: Mapping[str, str]) -> str:
    """Return a template such as '{Grasp no.}' with its fields put in."""

    def text(match: re.Match[str]) -> str:
        if match[1] not in fields:
            raise DataError(f"--{option}", f"names {match[1]!r}", f"there are {sorted(fields)}")
        return fields[match[1]]

    if {"{", "}"} & set(re.sub(r"\{[^{}]*\}", "", template)):
        raise DataError(f"--{option}", f"{template!r} is no template", "write it as '{name}'")
    return re.sub(r"\{([^{}]*)\}", text, template)


def _scanned(
    path: Path,
    texts: Mapping[str, str],
    fields: Fields,
    settings: ImportSettings,
    session: str,
    *,
    decode: bool,
) -> ScannedFile:
    """Return the recording of a file whose columns or groups have these `texts`.

    A number of a grasp counts within its object, `grasp_id` within its session.
    """

    def role(name: str, template: str = "") -> str:
        column = fields.roles.get(name, "")
        return (_filled(name, template, texts) if template else texts.get(column, "")).strip()

    labels = {column: texts[name] for name, column in fields.labels.items()}
    label = next((text for column, text in labels.items() if column.lower() == "label"), "")
    object_name = role("object", settings.object) or label
    grasp = role("grasp", settings.grasp)
    if not settings.grasp:
        grasp = role("grasp_id") or (f"{object_name}/{grasp}" if grasp and object_name else grasp)
    return ScannedFile(
        path=path,
        session=session_name(role("session", settings.session) or session),
        grasp=grasp or path.with_suffix("").as_posix(),
        object=object_name,
        sample=0,
        labels=labels,
        quality=role("quality"),
        decode=decode,
        recording_id=role("recording_id"),
        sha256=role("sha256").lower(),
        sample_text=role("sample"),
    )
