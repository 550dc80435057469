"""Tables of labels, as spreadsheets and programs write them."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

from ajgdata.store.files import plain_text, read_text
from ajgdata.types import DataError

#: First bytes of workbooks: ZIP (.xlsx, .ods) and OLE (.xls).
WORKBOOKS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1")
#: Delimiters, with their description in messages.
DELIMITERS = {
    ",": "commas between the cells",
    ";": "semicolons between the cells",
    "\t": "tabs between the cells",
}
#: Number of lines at the top in which a header is searched.
TOP_LINES = 20
#: Line ends of Windows, of old spreadsheets of macOS, and of other systems.
_LINE_END = re.compile(r"\r\n|\r|\n")


@dataclass(frozen=True)
class LabelTable:
    """Rows of a table, each with the number of its line; cells include the blanks at their ends.

    `notes` are names and reasons of ignored lines and columns.
    """

    rows: list[tuple[int, dict[str, str]]]
    notes: list[tuple[str, str]]


def read_label_table(path: Path, columns: Collection[str]) -> LabelTable:
    """Return the rows of a table whose header has `columns`.

    The function ignores lines at the top that begin with # and lack these columns, empty lines,
    unnamed columns that are empty, and an unnamed column that counts the rows. Raises DataError
    for a workbook, for other text above the header, for an unnamed column with contents, for a
    doubled name and for a row of another length.
    """
    if path.is_file():
        with path.open("rb") as stream:
            if stream.read(8).startswith(WORKBOOKS):
                fix = "export it as CSV (UTF-8), and name that file"
                raise DataError(path, "is a workbook, not a table of text", fix)
    text = read_text(path)
    notes: list[tuple[str, str]] = []
    skipped = 0
    top, following = _first_line(text)
    while _is_comment(top, following, columns):
        notes.append((f"line {skipped + 1}", f"ignored as a comment: {top.strip()!r}"))
        text = following
        top, following = _first_line(text)
        skipped += 1
    _check_top(path, text, columns, skipped)
    delimiter = _delimiter(top, columns)
    header, lines = _cells(path, text, delimiter, skipped)
    unnamed = [place for place, name in enumerate(header) if not name]
    for place in unnamed:
        _check_unnamed(path, place, [(line, cells[place]) for line, cells in lines], notes)
    named = [place for place in range(len(header)) if place not in unnamed]
    names = [header[place] for place in named]
    doubled = [name for name in names if names.count(name) > 1]
    if doubled:
        problem = f"needs one name per column; {doubled.count(doubled[0])} are {doubled[0]!r}"
        raise DataError(path, problem, f"rename all but one, with {DELIMITERS[delimiter]}")
    if not names:
        problem = f"needs one name per column; its header is {header}"
        raise DataError(path, problem, f"correct the header, with {DELIMITERS[delimiter]}")
    rows = [(line, {header[place]: cells[place] for place in named}) for line, cells in lines]
    return LabelTable(rows, notes)


def _first_line(text: str) -> tuple[str, str]:
    """Return the first line of a text, and the text after it."""
    lines = _LINE_END.split(text, maxsplit=1)
    return lines[0], lines[1] if len(lines) > 1 else ""


def _is_comment(line: str, following: str, columns: Collection[str]) -> bool:
    """Return whether a line at the top is a comment: it begins with #, and is not the header.

    Without `columns`, a header has at least as many cells as the first line of the text after it.
    """
    if not line.startswith("#"):
        return False
    if columns:
        return not _has(line, columns)
    next_line, _ = _first_line(following)
    delimiter = _delimiter(next_line, columns)
    is_shorter = len(_header(line, delimiter)) < len(_header(next_line, delimiter))
    return is_shorter or next_line.startswith("#")


def _check_top(path: Path, text: str, columns: Collection[str], skipped: int) -> None:
    """Raise DataError if the header is not the first line, but one of the next lines.

    Spreadsheets write titles and lines such as `sep=;` above the header.
    """
    lines = _LINE_END.split(text, maxsplit=TOP_LINES)[:TOP_LINES]
    if not columns or _has(lines[0], columns):
        return
    for place, line in enumerate(lines):
        if _has(line, columns):
            first = skipped + 1
            problem = f"{lines[0].strip()!r} is not the header, which is line {place + first}"
            fix = f"delete lines {first} to {place + skipped}"
            if place == 1:
                fix = f"delete line {first}"
            raise DataError(f"{path}:{first}", problem, fix)


def _header(line: str, delimiter: str) -> list[str]:
    """Return the cells of a header without blanks at their ends."""
    return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]


def _has(line: str, columns: Collection[str]) -> bool:
    """Return True if a header has all columns, with any of the delimiters."""
    return any(set(columns) <= set(_header(line, delimiter)) for delimiter in DELIMITERS)


def _delimiter(line: str, columns: Collection[str]) -> str:
    """Return the delimiter with which a header has most of the columns and, among equals, most
    cells."""

    def rank(delimiter: str) -> tuple[int, int]:
        names = _header(line, delimiter)
        return len(set(columns) & set(names)), len(names)

    return max(DELIMITERS, key=rank)


def _cells(
    path: Path, text: str, delimiter: str, skipped: int
) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Return the header and the cells of each line that is not empty, all of one length."""
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    try:
        lines = [(reader.line_num + skipped, cells) for cells in reader]
    except csv.Error as error:
        where = f"{path}:{reader.line_num + skipped}"
        raise DataError(where, f"not valid CSV ({error})", "correct the quotes") from None
    header = [cell.strip() for cell in lines[0][1]] if lines else []
    filled = []
    for line, cells in lines[1:]:
        if not any(cell.strip() for cell in cells):
            continue
        surplus = any(cell.strip() for cell in cells[len(header) :])
        if surplus or any(header[len(cells) :]):
            problem = f"{len(cells)} cells, the header has {len(header)}"
            raise DataError(f"{path}:{line}", problem, f"quote cells that contain {delimiter!r}")
        padding = [""] * (len(header) - len(cells))
        filled.append((line, cells[: len(header)] + padding))
    return header, filled


def _check_unnamed(
    path: Path, place: int, cells: Sequence[tuple[int, str]], notes: list[tuple[str, str]]
) -> None:
    """Note that a column without a name counts the rows. Raises DataError for other contents."""
    texts = [text.strip() for _, text in cells]
    if not any(texts):
        return
    count = len(texts)
    if texts in ([str(i) for i in range(count)], [str(i + 1) for i in range(count)]):
        notes.append((f"column {place + 1}", "has no name and counts the rows: ignored"))
        return
    line, text = next((line, text) for line, text in cells if text.strip())
    problem = f"column {place + 1} has no name, but contents: {text!r}"
    raise DataError(f"{path}:{line}", problem, "name it in the header, or delete it")


def visible(text: str) -> str:
    """Return text unchanged if all its characters are visible, else quoted with escapes."""
    return text if text and text == plain_text(text) else ascii(text)
