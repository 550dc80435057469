"""Folder of recordings -> rows: which file is which recording, by pattern or by table.

This is the only place where labels are read out of file names.
"""

from __future__ import annotations

import os
import re
import signal
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
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


#: Time limit for matching one path with the pattern.
LONGEST_MATCH_S = 2.0
_DOUBLE = "an AppleDouble file of macOS, without sound"
_OWN = "recordings or results of a project: not searched"


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
    """Recordings found in a folder.

    `wanting` says of what belongs to them by name or table why it is left out, `skipped` so of all
    other files, `missing` of names whose content is not there; `notes` are what else a person
    should know.
    """

    files: list[ScannedFile] = field(default_factory=list)
    excitations: dict[str, Path] = field(default_factory=dict)
    skipped: list[tuple[str, str]] = field(default_factory=list)
    wanting: list[tuple[str, str]] = field(default_factory=list)
    missing: list[tuple[str, str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def scan(folder: Path, settings: ImportSettings, name: str, *, convert: bool = False) -> Scan:
    """Return every recording below `folder` (sorted by path), by `settings.pattern` or `.table`.

    `name` is the session of recordings whose session nothing tells. With `convert` files that are
    not read as they are count, too. Raises DataError when the folder, the pattern or the table
    cannot be used, or when nothing in the folder matches.
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
        raise DataError(
            folder,
            "holds no audio files",
            f"name a folder with {', '.join(sorted(AUDIO_SUFFIXES))}",
        )
    example = ": {!r} {}".format(*left_out[0]) if left_out else ""
    raise DataError(
        folder,
        f"none of its audio files can be imported{example}",
        "correct --file (a path inside the folder)"
        if settings.table
        else "correct --pattern (it must match the whole path inside the folder)",
    )


def target_column(text: str) -> str:
    """Return the column of a target called `text`: `object` is one that every recording has."""
    return "object" if text.lower() == "object" else slug(text)


def audio_files(folder: Path) -> list[Path]:
    """Return what looks like audio by its name below `folder`, sorted, relative to it.

    The list includes broken links and pipes, but no folders and no hidden files.
    """
    return search(folder).audio


@dataclass
class Search:
    """Audio files below a folder, and what was not searched, with the reasons."""

    audio: list[Path] = field(default_factory=list)
    hidden: list[Path] = field(default_factory=list)
    closed: list[tuple[str, str]] = field(default_factory=list)
    own: list[tuple[str, str]] = field(default_factory=list)

    @property
    def skipped(self) -> list[tuple[str, str]]:
        """Return files and folders that do not matter, with the reasons."""
        return self.own + [(p.as_posix(), _DOUBLE) for p in self.hidden if _is_double(p)]

    @property
    def concealed(self) -> dict[Path, str]:
        """Return hidden audio files, with what to do."""
        reason = "hidden: rename the file or its folder"
        return {path: reason for path in self.hidden if not _is_double(path)}


def search(folder: Path) -> Search:
    """Search a folder for audio. Hidden files are listed separately; the recordings and results of
    a project are not searched."""
    suffixes = {*AUDIO_SUFFIXES, *UNREADABLE_SUFFIXES}
    result = Search()

    def refused(error: OSError) -> None:
        where = os.path.relpath(error.filename, folder)
        result.closed.append((where, f"{error.strerror}: not searched"))

    for root, folders, names in os.walk(folder, onerror=refused):
        here = Path(root).relative_to(folder)
        tools = {name for name in folders if _is_of_tools(Path(root, name))}
        folders[:] = sorted(set(folders) - tools)
        own = {name for name in folders if _belongs_to_project(Path(root), name)}
        result.own += [((here / name).as_posix(), _OWN) for name in sorted(own)]
        folders[:] = sorted(set(folders) - own)
        for name in (name for name in folders if Path(root, name).is_symlink()):
            reason = "a link to a folder, not searched: name that folder"
            result.closed.append(((here / name).as_posix(), reason))
        for path in (here / name for name in names):
            if path.suffix.lower() in suffixes:
                is_hidden = any(part.startswith(".") for part in path.parts)
                (result.hidden if is_hidden else result.audio).append(path)
    result.audio.sort()
    result.hidden.sort()
    return result


def _is_of_tools(folder: Path) -> bool:
    """Return True for the history of git and for a virtual environment."""
    return folder.name == ".git" or (folder / "pyvenv.cfg").is_file()


def _is_double(path: Path) -> bool:
    """Return True for an AppleDouble file, which macOS writes next to a file on other disks."""
    return path.name.startswith("._")


def _belongs_to_project(parent: Path, name: str) -> bool:
    """Return True for a session of a data set, and for folders that a project writes."""
    paths = Paths(parent)
    written = {one.name for one in (paths.data, paths.results, paths.cache)} | {".snakemake"}
    if name in written and any(paths.datasets.glob(f"*/{DATASET_FILE}")):
        return True
    return (parent / name / SESSION_FILE).is_file()


def _audio_files(
    folder: Path, result: Scan, *, convert: bool
) -> tuple[dict[Path, bool], dict[Path, str]]:
    """Return audio files that can be imported, True for one that has to be decoded, and files that
    are not imported although their names may match, with reasons. All other files go to
    `result`."""
    files: dict[Path, bool] = {}
    walk = search(folder)
    refused = walk.concealed
    result.missing += sorted(walk.closed)
    result.skipped += walk.skipped
    readable = {p.with_suffix("") for p in walk.audio if p.suffix.lower() in AUDIO_SUFFIXES}
    for path in walk.audio:
        name, decode = path.as_posix(), path.suffix.lower() in UNREADABLE_SUFFIXES
        if name != name.strip() or _NO_TEXT.search(name):
            result.wanting.append(
                (_NO_TEXT.sub("?", name), "its name is not plain text: rename it")
            )
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
    """Return True for audio that is not what its name says, and has to be decoded."""
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
    for path, reason in refused.items():
        matches = _match(pattern, path)
        entry = (path.as_posix(), reason if matches else "does not match the pattern")
        (result.wanting if matches else result.skipped).append(entry)
    for path, decode in audio.items():
        match = _match(pattern, path)
        if not match:
            result.skipped.append((path.as_posix(), "does not match the pattern"))
            continue
        fields = cleaner({key: value or "" for key, value in match.groupdict().items()})
        session = session_name(path.parent.as_posix()) if starter_kit and path.parent.name else name
        if starter_kit and int(fields["n"]) == 0:
            played = path if decode else result.excitations.setdefault(session, path)
            if decode:
                result.wanting.append((path.as_posix(), "the played sound has to be a WAV"))
            elif played != path:
                result.skipped.append((path.as_posix(), f"the played sound is {played} already"))
            continue
        result.files.append(_scanned(path, fields, groups, settings, session, decode=decode))
    result.notes += [*groups.notes, *cleaner.notes()]


@contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    """Raise TimeoutError after `seconds`. Other threads than the main one have no limit."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(*_: object) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def _match(pattern: re.Pattern[str], path: Path) -> re.Match[str] | None:
    """Return the match of a whole path. Raises DataError for a pattern with exponential cost."""
    try:
        with _time_limit(LONGEST_MATCH_S):
            return pattern.fullmatch(path.as_posix())
    except TimeoutError:
        problem = f"takes more than {LONGEST_MATCH_S} s for {path.as_posix()!r}"
        fix = "avoid nested repetitions such as (a+)+"
        raise DataError("--pattern", problem, fix) from None


def _by_table(
    folder: Path,
    audio: Mapping[Path, bool],
    refused: Mapping[Path, str],
    settings: ImportSettings,
    name: str,
    result: Scan,
) -> None:
    table = folder / settings.table
    header, rows, notes = joined(folder, *read_label_table(table), settings.join)
    result.notes += notes
    columns = fields_of(header, settings, table, "column")
    cleaner = Cleaner()
    taken: set[Path] = set()
    named = {name for name, _ in (*result.missing, *result.wanting, *result.skipped)}
    for row in rows:
        path = Path(_filled("file", settings.file, row))
        if path.is_absolute() or ".." in path.parts:
            raise DataError(table, f"{path} leaves the folder", "use paths inside the folder")
        if path in taken:
            raise DataError(table, f"{path} stands in two rows", "keep one of them")
        if path in audio:
            fields = cleaner(row)
            result.files.append(_scanned(path, fields, columns, settings, name, decode=audio[path]))
            taken.add(path)
        elif path in refused:
            result.wanting.append((str(path), refused[path]))
            taken.add(path)
        elif str(path) not in named:
            result.wanting.append((str(path), f"in {settings.table} but not in the folder"))
    left = sorted({*audio, *refused} - taken)
    result.skipped += [(str(path), f"no row in {settings.table}") for path in left]
    result.files.sort(key=lambda one: one.path)
    result.notes += [*columns.notes, *cleaner.notes()]


def _filled(option: str, template: str, fields: Mapping[str, str]) -> str:
    """Return a template such as '{stone}' with its fields put in; a brace is written twice.

    A field may have any name that a column can have, such as 'Grasp no.'.
    """
    filled = []
    for piece in re.findall(r"\{\{|\}\}|\{[^{}]*\}|[^{}]+|[{}]", template):
        if piece in ("{", "}"):
            problem = f"{template!r} is no template (a {piece} stands alone)"
            raise DataError(f"--{option}", problem, "write it as '{name}'")
        key = piece[1:-1]
        if piece in ("{{", "}}"):
            filled.append(piece[0])
        elif not piece.startswith("{"):
            filled.append(piece)
        elif key in fields:
            filled.append(fields[key])
        else:
            raise DataError(f"--{option}", f"names {key!r}", f"there are {sorted(fields)}")
    return "".join(filled)


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
