"""Folder of recordings -> rows: which file is which recording, by pattern or by table.

This is the only place where labels are read out of file names.
"""

from __future__ import annotations

import re
import string
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ajgdata.store.files import read_csv
from ajgdata.types import RECORDING_COLUMNS, DataError, ImportSettings, is_reserved

AUDIO_SUFFIXES = {".wav", ".wave", ".ogg", ".oga", ".flac"}
UNREADABLE_SUFFIXES = {
    *(".aac", ".aif", ".aiff", ".au", ".caf", ".m4a", ".mp3", ".mp4"),
    *(".opus", ".w64", ".webm", ".wma"),
}
STARTER_KIT = r"(?:.*/)?(?P<n>\d+)_(?P<label>[^/]+)\.[^./]+"
#: Named groups that say what a recording is; every other named group is a label.
ROLES = ("session", "grasp", "object", "sample")
#: Control characters, and bytes of a file name that are not UTF-8: a table cannot hold them.
_NO_TEXT = re.compile(r"[\x00-\x1f\x7f\ud800-\udfff]")


@dataclass(frozen=True)
class ScannedFile:
    """One recording in the folder: path relative to it, its roles and labels."""

    path: Path
    session: str
    grasp: str
    object: str
    sample: int
    labels: Mapping[str, str]


@dataclass
class Scan:
    """Recordings found in a folder. `skipped` says for each file left out why."""

    files: list[ScannedFile] = field(default_factory=list)
    excitations: dict[str, Path] = field(default_factory=dict)
    skipped: list[tuple[str, str]] = field(default_factory=list)


def scan(folder: Path, settings: ImportSettings, name: str) -> Scan:
    """Return every recording below `folder` (sorted by path), by `settings.pattern` or `.table`.

    `name` is the session of recordings whose session nothing tells. Raises DataError when the
    folder, the pattern or the table cannot be used, or when nothing in the folder matches.
    """
    if not folder.is_dir():
        raise DataError(folder, "is not a folder", "name the folder that holds the recordings")
    result = (
        _by_table(folder, settings, name) if settings.table else _by_name(folder, settings, name)
    )
    if result.files:
        return result
    if not result.skipped and not result.excitations:
        raise DataError(
            folder,
            "holds no audio files",
            f"name a folder with {', '.join(sorted(AUDIO_SUFFIXES))}",
        )
    example = ": {!r} {}".format(*result.skipped[0]) if result.skipped else ""
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


def audio_files(folder: Path) -> list[Path]:
    """Return files below `folder` that look like audio, sorted, relative to it; hidden ones are
    none."""
    suffixes = AUDIO_SUFFIXES | UNREADABLE_SUFFIXES
    inside = (p.relative_to(folder) for p in folder.rglob("*") if p.suffix.lower() in suffixes)
    shown = (p for p in inside if not any(part.startswith(".") for part in p.parts))
    return sorted(p for p in shown if (folder / p).is_file())


def _audio_files(folder: Path, result: Scan) -> list[Path]:
    """Return audio files that can be imported; the others go to `result.skipped`."""
    files = []
    for path in audio_files(folder):
        name, suffix = path.as_posix(), path.suffix.lower()
        if suffix in UNREADABLE_SUFFIXES:
            reason = f"{suffix} cannot be read: convert it (ffmpeg -i in{suffix} out.wav)"
            result.skipped.append((name, reason))
        elif name != name.strip() or _NO_TEXT.search(name):
            result.skipped.append((_NO_TEXT.sub("?", name), "its name is no plain text: rename it"))
        else:
            files.append(path)
    return files


def _by_name(folder: Path, settings: ImportSettings, name: str) -> Scan:
    starter_kit = settings.pattern in ("", "starter-kit")
    try:
        pattern = re.compile(STARTER_KIT if starter_kit else settings.pattern)
    except re.error as error:
        raise DataError("--pattern", f"not a regular expression ({error})", "correct it") from None
    if not pattern.groupindex:
        raise DataError("--pattern", "has no named group", r"name the label: (?P<label>[^/]+)")
    result = Scan()
    for path in _audio_files(folder, result):
        match = pattern.fullmatch(path.as_posix())
        if not match:
            result.skipped.append((path.as_posix(), "does not match the pattern"))
            continue
        fields = {key: value or "" for key, value in match.groupdict().items()}
        session = slug(path.parent.as_posix()) if starter_kit and path.parent.name else name
        if starter_kit and int(fields["n"]) == 0:
            played = result.excitations.setdefault(session, path)
            if played != path:
                result.skipped.append((path.as_posix(), f"the played sound is {played} already"))
            continue
        result.files.append(_scanned(path, fields, settings, session))
    return result


def _by_table(folder: Path, settings: ImportSettings, name: str) -> Scan:
    table = folder / settings.table
    header, rows = read_csv(table)
    columns = Counter(map(label_column, header))
    if doubled := [name for name in header if columns[label_column(name)] > 1]:
        problem = (
            f"columns {doubled[0]!r} and {doubled[1]!r} would both be {label_column(doubled[0])}"
        )
        raise DataError(table, problem, "rename one of them")
    result = Scan()
    audio, taken = set(_audio_files(folder, result)), set()
    for row in rows:
        path = Path(_filled("file", settings.file, row))
        if path.is_absolute() or ".." in path.parts:
            raise DataError(table, f"{path} leaves the folder", "use paths inside the folder")
        if path in taken:
            raise DataError(table, f"{path} stands in two rows", "keep one of them")
        if path in audio:
            result.files.append(_scanned(path, row, settings, name))
            taken.add(path)
        else:
            result.skipped.append((str(path), f"in {settings.table} but not in the folder"))
    left = sorted(audio - taken)
    result.skipped += [(str(path), f"no row in {settings.table}") for path in left]
    result.files.sort(key=lambda one: one.path)
    return result


def _filled(option: str, template: str, fields: Mapping[str, str]) -> str:
    """Return a template such as '{stone}' with its fields put in."""
    try:
        keys = [key for _, key, _, _ in string.Formatter().parse(template) if key is not None]
        if unknown := [key for key in keys if key not in fields]:
            raise DataError(f"--{option}", f"names {unknown[0]!r}", f"there are {sorted(fields)}")
        return template.format_map(fields)
    except ValueError as error:
        raise DataError(
            f"--{option}", f"{template!r} is no template ({error})", "write it as '{name}'"
        ) from None


def _scanned(
    path: Path, fields: Mapping[str, str], settings: ImportSettings, session: str
) -> ScannedFile:
    def role(key: str, template: str, default: str) -> str:
        filled = _filled(key, template, fields) if template else fields.get(key, "")
        return filled.strip() or default

    label = fields.get("label", "")
    sample = fields.get("sample", "")
    return ScannedFile(
        path,
        slug(role("session", settings.session, session)),
        role("grasp", settings.grasp, path.with_suffix("").as_posix()),
        role("object", settings.object, label),
        int(sample) if sample.isdecimal() else 0,
        {
            label_column(k): v.strip()
            for k, v in fields.items()
            if k not in (*ROLES, *RECORDING_COLUMNS)
        },
    )
