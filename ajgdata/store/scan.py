"""Folder of recordings -> rows: which file is which recording, by pattern or by table.

This is the only place where labels are read out of file names.
"""

from __future__ import annotations

import re
import string
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ajgdata.store.files import read_csv
from ajgdata.types import RECORDING_COLUMNS, DataError, ImportSettings

AUDIO_SUFFIXES = {".wav", ".wave", ".ogg", ".flac", ".aif", ".aiff", ".au", ".mp3"}
UNREADABLE_SUFFIXES = {".m4a", ".aac", ".wma", ".opus", ".webm"}
STARTER_KIT = r"(?:.*/)?(?P<n>\d+)_(?P<label>[^/]+)\.[^./]+"
#: Named groups that say what a recording is; every other named group is a label.
ROLES = ("session", "grasp", "object", "sample")


@dataclass(frozen=True)
class Found:
    """One recording in the folder: path relative to it, its roles and labels."""

    path: Path
    session: str
    grasp: str
    object: str
    sample: int
    labels: Mapping[str, str]


@dataclass
class Scan:
    """What a folder holds. `skipped` says for each file left out why."""

    found: list[Found] = field(default_factory=list)
    excitations: dict[str, Path] = field(default_factory=dict)
    skipped: list[tuple[str, str]] = field(default_factory=list)


def scan(folder: Path, settings: ImportSettings, name: str) -> Scan:
    """Every recording below `folder` (sorted by path), by `settings.pattern` or `.table`.

    `name` is the session of recordings whose session nothing tells. Raises DataError when the
    folder, the pattern or the table cannot be used, or when nothing in the folder matches.
    """
    if not folder.is_dir():
        raise DataError(folder, "is not a folder", "name the folder that holds the recordings")
    result = (
        _by_table(folder, settings, name) if settings.table else _by_name(folder, settings, name)
    )
    if not result.found:
        example = f", for instance {result.skipped[0][0]!r}" if result.skipped else ""
        raise DataError(
            folder,
            f"none of {len(result.skipped)} audio files matches{example}",
            "correct --pattern (it must match the whole path inside the folder)",
        )
    return result


def slug(text: str) -> str:
    """`text` with everything but letters, digits and - made _ (the charset of names)."""
    return re.sub(r"[^A-Za-z0-9-]+", "_", text).strip("_") or "x"


def _audio_files(folder: Path, result: Scan) -> list[Path]:
    files = []
    for path in sorted(p.relative_to(folder) for p in folder.rglob("*") if p.is_file()):
        suffix = path.suffix.lower()
        if suffix in AUDIO_SUFFIXES:
            files.append(path)
        elif suffix in UNREADABLE_SUFFIXES:
            reason = f"{suffix} cannot be read: convert it (ffmpeg -i in{suffix} out.wav)"
            result.skipped.append((str(path), reason))
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
            result.excitations[session] = path
            continue
        result.found.append(_found(path, fields, settings, session))
    return result


def _by_table(folder: Path, settings: ImportSettings, name: str) -> Scan:
    table = folder / settings.table
    header, rows = read_csv(table)
    wanted = [key for _, key, _, _ in string.Formatter().parse(settings.file) if key]
    if missing := [key for key in wanted if key not in header]:
        raise DataError(table, f"--file names column {missing[0]!r}", f"the table has {header}")
    result = Scan()
    audio = set(_audio_files(folder, result))
    for row in rows:
        path = Path(settings.file.format_map(row))
        if path.is_absolute() or ".." in path.parts:
            raise DataError(table, f"{path} leaves the folder", "use paths inside the folder")
        if path in audio:
            result.found.append(_found(path, row, settings, name))
            audio.discard(path)
        elif any(found.path == path for found in result.found):
            raise DataError(table, f"{path} stands in two rows", "keep one of them")
        else:
            result.skipped.append((str(path), f"in {settings.table} but not in the folder"))
    result.skipped += [(str(path), f"no row in {settings.table}") for path in sorted(audio)]
    return result


def _found(path: Path, fields: Mapping[str, str], settings: ImportSettings, session: str) -> Found:
    def role(key: str, template: str, default: str) -> str:
        try:
            return template.format_map(fields) if template else fields.get(key) or default
        except KeyError as error:
            raise DataError(
                f"--{key}", f"names {error}, which {path} does not have", f"use {sorted(fields)}"
            ) from None

    label = fields.get("label", "")
    sample = fields.get("sample", "")
    return Found(
        path,
        slug(role("session", settings.session, session)),
        role("grasp", settings.grasp, path.with_suffix("").as_posix()),
        role("object", settings.object, label),
        int(sample) if sample.isdecimal() else 0,
        {k: v for k, v in fields.items() if k not in (*ROLES, *RECORDING_COLUMNS)},
    )
