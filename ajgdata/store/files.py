"""Text files and atomic replacement. Readers raise DataError with file and fix."""

from __future__ import annotations

import csv
import glob
import hashlib
import io
import json
import os
import re
import shutil
import tempfile
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import deepcopy
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError
from yaml.composer import Composer

from ajgdata.types import DataError, describe, location
from ajgdata.types.formats import FORMAT_KEY, FileFormat, FormatError

ModelType = TypeVar("ModelType", bound=BaseModel)
#: End of the names of temporary folders.
TEMPORARY = ".tmp"
#: Largest text that is read. A table of a million recordings has 200 MB, and reading it requires
#: twice this memory.
MAX_TEXT_BYTES = 256 * 2**20
#: Largest YAML file that is read. Its nodes require about a hundred times its size as memory.
MAX_YAML_BYTES = 8 * 2**20


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary file that replaces `path` if the block succeeds.

    If the process is killed at any time, `path` is either the old file or the complete new file.
    """
    with _own_folder(path) as folder:
        temporary = folder / path.name
        yield temporary
        with temporary.open("rb+") as stream:
            os.fsync(stream.fileno())
        temporary.replace(path)


@contextmanager
def replacing_folder(path: Path) -> Iterator[Path]:
    """Yield an empty folder that replaces the folder `path` if the block succeeds.

    Only one process may do this at a time (see `lock.locked`), because the temporary folders of a
    killed process are removed.
    """
    finish_interrupted(path)
    with _own_folder(path) as temporary:
        new = temporary / "new"
        new.mkdir()
        yield new
        if path.exists():
            path.rename(temporary / "old")
        new.rename(path)


def finish_interrupted(path: Path) -> None:
    """Remove the temporary folders of a killed `replacing_folder(path)`.

    The old folder returns if it was moved away and the new folder did not replace it.
    """
    prefix = _temporary_prefix(path)
    for temporary in path.parent.glob(f"{glob.escape(prefix)}*{TEMPORARY}"):
        old = temporary / "old"
        if old.is_dir() and not path.exists():
            old.rename(path)
        shutil.rmtree(temporary)


@contextmanager
def _own_folder(path: Path) -> Iterator[Path]:
    """Yield an empty temporary folder next to `path`, which is removed at the end."""
    path.parent.mkdir(parents=True, exist_ok=True)
    prefix = _temporary_prefix(path)
    with tempfile.TemporaryDirectory(TEMPORARY, prefix, path.parent, True) as folder:
        yield Path(folder)


def _temporary_prefix(path: Path) -> str:
    """Return the beginning of the names of temporary folders of `path`.

    It is short enough for the file system, and differs for names with the same beginning.
    """
    return f".{path.name[:40]}-{sha256_of(path.name.encode())[:8]}."


def copy(source: Path, target: Path) -> None:
    """Copy the content of `source` to `target` atomically, without its times."""
    with replacing(target) as temporary:
        shutil.copyfile(source, temporary)


def copy_new(sources: Mapping[Path, Path], fix: str) -> list[Path]:
    """Copy each source to its target; return the targets that did not exist, in their order.

    `sources` are by target. Raises DataError with `fix`, and copies nothing, if a target exists
    with other content.
    """
    for target, source in sources.items():
        if target.exists() and target.read_bytes() != source.read_bytes():
            raise DataError(target, "exists with other content", fix)
    new = [target for target in sources if not target.exists()]
    for target in new:
        copy(sources[target], target)
    return new


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file atomically."""
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def write_if_changed(path: Path, content: bytes) -> bool:
    """Write a file if its bytes differ, so that its time is that of the last change; return whether
    it was written."""
    if path.is_file() and path.read_bytes() == content:
        return False
    write_bytes(path, content)
    return True


def sha256_of(content: bytes) -> str:
    """Return the hexadecimal SHA-256 of bytes."""
    return hashlib.sha256(content).hexdigest()


def read_text(path: Path, max_bytes: int = MAX_TEXT_BYTES) -> str:
    """Return the text of a UTF-8 file, without a byte-order mark.

    Raises DataError for a file that is missing, unreadable or larger than `max_bytes`.
    """
    try:
        size = path.stat().st_size
        if size > max_bytes:
            problem = f"has {size / 1e6:,.0f} MB, more than the limit of {max_bytes / 1e6:,.0f} MB"
            raise DataError(path, problem, "check that this is the right file")
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise DataError(path, "there is no such file", "create it or correct the name") from None
    except UnicodeDecodeError as error:
        raise DataError(path, f"not UTF-8 text at byte {error.start}", "save it as UTF-8") from None
    except OSError as error:
        problem = f"cannot be read ({error.strerror})"
        raise DataError(path, problem, "check the file and its permissions") from None
    if "\0" in text:  # UTF-16 without a byte-order mark, or not a text
        raise DataError(path, "holds NUL characters", "save it as UTF-8")
    return text


def plain_text(text: str) -> str:
    """Return text in Unicode form NFC, with single spaces and without invisible characters.

    A minus sign (U+2212) before a number becomes a hyphen, so that -30 has one spelling.
    """
    words = " ".join(unicodedata.normalize("NFC", text).split())
    words = re.sub(r"(?<!\w)\u2212(?=\d)", "-", words)
    visible = (c for c in words if unicodedata.category(c) not in ("Cf", "Cc"))
    return words if words.isprintable() else "".join(visible).strip()


class _Loader(Composer, yaml.CSafeLoader):
    """The safe loader of YAML; a repeated key is an error.

    C parses, and Python composes, because the composer in C crashes on deep nesting.
    """

    def __init__(self, stream: str) -> None:
        yaml.CSafeLoader.__init__(self, stream)
        Composer.__init__(self)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Return a mapping. Raises an error of YAML for a repeated key."""
        keys = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode):
                if key.value in keys:
                    problem = f"key {key.value!r} stands twice"
                    raise yaml.MarkedYAMLError(problem=problem, problem_mark=key.start_mark)
                keys.add(key.value)
        return super().construct_mapping(node, deep=deep)


@lru_cache(maxsize=1024)
def _parsed(text: str) -> Any:
    """Return the content of a YAML text; cached, because a workflow reads each file many times."""
    return yaml.load(text, _Loader)  # noqa: S506 (a safe loader)


def read_yaml(path: Path) -> dict[str, Any]:
    """Return a YAML mapping. Raises DataError, with the line, for an invalid file."""
    try:
        content = deepcopy(_parsed(read_text(path, MAX_YAML_BYTES)))
    # ValueError: a date such as 2024-13-45; RecursionError: a thousand nested lists
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        reason = " ".join(str(getattr(error, "problem", None) or error).split())
        place = f"{path}:{mark.line + 1}" if mark else path
        problem = f"not valid YAML ({reason})"
        raise DataError(place, problem, "correct the indentation or quoting") from None
    if not isinstance(content, dict):
        raise DataError(path, "holds no keys", "write it as `key: value` lines")
    return content


def check_yaml_format(path: Path, content: Mapping[str, Any], file_format: FileFormat) -> None:
    """Raise FormatError, with the line, if the YAML file `path` states another version.

    Call this function before the content is validated: another version can have other keys.
    """
    try:
        file_format.check(path, content.get(FORMAT_KEY))
    except FormatError as error:
        where = f"{path}:{line_of(path, [FORMAT_KEY])}"
        raise FormatError(where, error.problem, error.fix) from None


def read_model(
    path: Path, model: type[ModelType], content: Mapping[str, Any] | None = None
) -> ModelType:
    """Return a YAML file, or its changed `content`, as a model.

    Raises DataError with file, line, key, value and fix.
    """
    try:
        return model.model_validate(read_yaml(path) if content is None else content)
    except ValidationError as error:
        line = line_of(path, location(error))
        raise describe(error, f"{path}:{line}") from None


def line_of(path: Path, place: Iterable[int | str]) -> int:
    """Return the line of a YAML file on which `place` (keys and numbers of elements) begins.

    If a step of `place` does not exist (a missing key, the name of an alternative), the line is
    that of the last step that exists.
    """
    node = yaml.compose(read_text(path, MAX_YAML_BYTES), _Loader)
    line = 1
    for step in place:
        if isinstance(node, yaml.MappingNode):
            pairs = [pair for pair in node.value if pair[0].value == str(step)]
        elif isinstance(node, yaml.SequenceNode) and isinstance(step, int):
            pairs = [(element, element) for element in node.value[step : step + 1]]
        else:
            break
        if pairs:
            key, node = pairs[0]
            line = key.start_mark.line + 1
    return line


def yaml_bytes(content: Mapping[str, Any]) -> bytes:
    """Return content as YAML, in the order of its keys."""
    return yaml.safe_dump(dict(content), sort_keys=False, allow_unicode=True).encode()


def read_json(path: Path, max_bytes: int = MAX_TEXT_BYTES) -> Any:
    """Return a JSON document. Raises DataError as `read_text` does, and for invalid JSON."""
    try:
        return json.loads(read_text(path, max_bytes))
    except (json.JSONDecodeError, RecursionError) as error:  # RecursionError: a thousand lists
        where = f"{path}:{getattr(error, 'lineno', 1)}"
        raise DataError(where, "not valid JSON", "delete it and run again") from None


def json_bytes(content: Any) -> bytes:
    """Return content as JSON with sorted keys. Raises ValueError for NaN, which JSON lacks."""
    return (json.dumps(content, indent=1, sort_keys=True, allow_nan=False) + "\n").encode()


def read_csv(
    path: Path, required: Iterable[str] = (), delimiter: str = ","
) -> tuple[list[str], list[dict[str, str]]]:
    """Return the header and the rows of a CSV file, by column and without blanks at the ends.

    Raises DataError for a missing, nameless or doubled column and for a row of another length.
    """
    header, rows = numbered_rows(path, required, delimiter)
    return header, [row for _, row in rows]


def numbered_rows(
    path: Path, required: Iterable[str] = (), delimiter: str = ","
) -> tuple[list[str], list[tuple[int, dict[str, str]]]]:
    """Return the header and rows as `read_csv` does, each row with the line on which it ends.

    Empty lines are skipped.
    """
    reader = csv.reader(io.StringIO(read_text(path), newline=""), delimiter=delimiter, strict=True)
    try:
        lines = [(reader.line_num, [cell.strip() for cell in cells]) for cells in reader]
    except csv.Error as error:
        where = f"{path}:{reader.line_num}"
        raise DataError(where, f"not valid CSV ({error})", "correct the quotes") from None
    header = lines[0][1] if lines else []
    missing = [column for column in required if column not in header]
    if not header or missing or "" in header or len(set(header)) < len(header):
        problem = f"needs {', '.join(missing) or 'one name per column'}; its header is {header}"
        raise DataError(path, problem, "correct the header, with commas between the cells")
    rows = [(line, cells) for line, cells in lines[1:] if any(cells)]
    for line, cells in rows:
        if len(cells) != len(header):
            problem = f"{len(cells)} cells, the header has {len(header)}"
            raise DataError(f"{path}:{line}", problem, "quote cells that contain commas")
    return header, [(line, dict(zip(header, cells, strict=True))) for line, cells in rows]


def csv_bytes(header: Sequence[str], rows: Iterable[Mapping[str, object]]) -> bytes:
    """Return rows as CSV with Unix line ends. Raises ValueError for cells of other columns."""
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, header, lineterminator="\n", extrasaction="raise")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode()
