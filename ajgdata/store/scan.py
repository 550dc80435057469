"""Folder of recordings -> rows: which file is which recording, by pattern or by table.

This is the only place where labels are read out of file names.
"""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ajgdata.store.audio import UNREADABLE_SUFFIXES, AudioError, inspect_audio, unsupported
from ajgdata.store.files import why_no_file
from ajgdata.store.label_tables import joined, read_label_table
from ajgdata.types import RECORDING_COLUMNS, DataError, ImportSettings, is_reserved

AUDIO_SUFFIXES = {".wav", ".wave", ".ogg", ".oga", ".flac"}
STARTER_KIT = r"(?:.*/)?(?P<n>\d+)_(?P<label>[^/]+)\.[^./]+"
#: Named groups that say what a recording is; every other named group is a label.
ROLES = ("session", "grasp", "object", "sample", "quality")
#: Control characters, and bytes of a file name that are not UTF-8: a table cannot hold them.
_NO_TEXT = re.compile(r"[\x00-\x1f\x7f\ud800-\udfff]")


@dataclass(frozen=True)
class ScannedFile:
    """One recording in the folder: path relative to it, its roles and labels.

    `quality` is "" where nothing says it. `decode` is True for a file that has to be decoded into
    a new one.
    """

    path: Path
    session: str
    grasp: str
    object: str
    sample: int
    labels: Mapping[str, str]
    quality: str = ""
    decode: bool = False

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


def slug(text: str) -> str:
    """Return `text` with everything but letters, digits and - made _ (the charset of names)."""
    return re.sub(r"[^A-Za-z0-9-]+", "_", text).strip("_-") or "x"


def label_column(text: str) -> str:
    """Return the column that holds the labels called `text`: a name that every reader can take."""
    return slug(text) + ("_" if is_reserved(slug(text)) else "")


def target_column(text: str) -> str:
    """Return the column of a target called `text`: `object` is one that every recording has."""
    return text if text == "object" else label_column(text)


def audio_files(folder: Path) -> list[Path]:
    """Return what looks like audio by its name below `folder`, sorted, relative to it.

    Links that lead nowhere, pipes and the like are among it; folders and what is hidden are not.
    """
    return _walk(folder)[0]


def _walk(folder: Path) -> tuple[list[Path], list[tuple[str, str]]]:
    """Return the audio files below `folder`, and folders that were not looked into, with why."""
    suffixes = {*AUDIO_SUFFIXES, *UNREADABLE_SUFFIXES}
    found: list[Path] = []
    closed: list[tuple[str, str]] = []

    def refused(error: OSError) -> None:
        closed.append((os.path.relpath(error.filename, folder), f"{error.strerror}: not looked at"))

    for root, folders, names in os.walk(folder, onerror=refused):
        here = Path(root).relative_to(folder)
        folders[:] = sorted(one for one in folders if not one.startswith("."))
        for one in (one for one in folders if Path(root, one).is_symlink()):
            reason = "a link to a folder, not looked at: name that folder"
            closed.append(((here / one).as_posix(), reason))
        shown = (here / name for name in names if not name.startswith("."))
        found += [path for path in shown if path.suffix.lower() in suffixes]
    return sorted(found), sorted(closed)


def _audio_files(
    folder: Path, result: Scan, *, convert: bool
) -> tuple[dict[Path, bool], dict[Path, str]]:
    """Return audio files that can be imported, True for one that has to be decoded, and those that
    would have to be, with why they are not. The others go to `result`."""
    files: dict[Path, bool] = {}
    refused: dict[Path, str] = {}
    paths, closed = _walk(folder)
    result.missing += closed
    readable = {path.with_suffix("") for path in paths if path.suffix.lower() in AUDIO_SUFFIXES}
    for path in paths:
        name, decode = path.as_posix(), path.suffix.lower() in UNREADABLE_SUFFIXES
        if name != name.strip() or _NO_TEXT.search(name):
            result.wanting.append((_NO_TEXT.sub("?", name), "its name is no plain text: rename it"))
        elif wrong := why_no_file(folder / path):
            result.missing.append((name, "; ".join(wrong)))
        elif decode and not convert:
            refusal = unsupported(path)
            refused[path] = f"{refusal.problem}; {refusal.fix}"
        elif decode and path.with_suffix("") in readable:
            reason = "left out: of the same name as a recording beside it, whose sound it may hold"
            result.skipped.append((name, reason))
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
    for path, reason in refused.items():
        matches = pattern.fullmatch(path.as_posix())
        told = (path.as_posix(), reason if matches else "does not match the pattern")
        (result.wanting if matches else result.skipped).append(told)
    for path, decode in audio.items():
        match = pattern.fullmatch(path.as_posix())
        if not match:
            result.skipped.append((path.as_posix(), "does not match the pattern"))
            continue
        fields = {key: value or "" for key, value in match.groupdict().items()}
        session = slug(path.parent.as_posix()) if starter_kit and path.parent.name else name
        if starter_kit and int(fields["n"]) == 0:
            played = path if decode else result.excitations.setdefault(session, path)
            if decode:
                result.wanting.append((path.as_posix(), "the played sound has to be a WAV"))
            elif played != path:
                result.skipped.append((path.as_posix(), f"the played sound is {played} already"))
            continue
        result.files.append(_scanned(path, fields, settings, session, decode=decode))


def _by_table(
    folder: Path,
    audio: Mapping[Path, bool],
    refused: Mapping[Path, str],
    settings: ImportSettings,
    name: str,
    result: Scan,
) -> None:
    table = folder / settings.table
    header, rows, lacking = joined(folder, *read_label_table(table), settings.join)
    result.notes += lacking
    columns = Counter(map(label_column, header))
    if doubled := [name for name in header if columns[label_column(name)] > 1]:
        problem = (
            f"columns {doubled[0]!r} and {doubled[1]!r} would both be {label_column(doubled[0])}"
        )
        raise DataError(table, problem, "rename one of them")
    taken: set[Path] = set()
    named = {name for name, _ in (*result.missing, *result.wanting, *result.skipped)}
    for row in rows:
        path = Path(_filled("file", settings.file, row))
        if path.is_absolute() or ".." in path.parts:
            raise DataError(table, f"{path} leaves the folder", "use paths inside the folder")
        if path in taken:
            raise DataError(table, f"{path} stands in two rows", "keep one of them")
        if path in audio:
            result.files.append(_scanned(path, row, settings, name, decode=audio[path]))
            taken.add(path)
        elif path in refused:
            result.wanting.append((str(path), refused[path]))
            taken.add(path)
        elif str(path) not in named:
            result.wanting.append((str(path), f"in {settings.table} but not in the folder"))
    left = sorted({*audio, *refused} - taken)
    result.skipped += [(str(path), f"no row in {settings.table}") for path in left]
    result.files.sort(key=lambda one: one.path)


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
    path: Path, fields: Mapping[str, str], settings: ImportSettings, session: str, *, decode: bool
) -> ScannedFile:
    def role(key: str, template: str, default: str) -> str:
        filled = _filled(key, template, fields) if template else fields.get(key, "")
        return filled.strip() or default

    label = fields.get("label", "")
    return ScannedFile(
        path,
        slug(role("session", settings.session, session)),
        role("grasp", settings.grasp, path.with_suffix("").as_posix()),
        role("object", settings.object, label).strip(),
        _sample(fields.get("sample", "")),
        {
            label_column(k): v.strip()
            for k, v in fields.items()
            if k not in (*ROLES, *RECORDING_COLUMNS)
        },
        fields.get("quality", "").strip(),
        decode,
    )


def _sample(text: str) -> int:
    """Return the number of a repeat as people and spreadsheets write it (`1`, `1.0`, `1,0`); 0
    where it is none."""
    try:
        number = float(text.replace(",", "."))
    except ValueError:
        return 0
    return int(number) if number.is_integer() and number > 0 else 0
