"""Decide which columns of an imported table are features, and list what is odd in them."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Collection, Sequence

import numpy as np

from ajgdata.pipeline.inferred_targets import DECIMAL_COMMA, MIN_SHARE
from ajgdata.store.imported_table import INFINITE, NO_VALUE, ImportedTable, cell_value
from ajgdata.store.scan import ROLES, Remarks
from ajgdata.types import DataError, many

OPTION = "--feature-columns"
#: A column is not a feature if one of these words is in its name.
LABEL_WORDS = {"label", "labels", "class", "target"}
#: A column is not a feature if its name ends with one of these words: it names or numbers a row, or
#: the time or place of a recording.
OTHER_WORDS = {
    *("batch", "date", "day", "file", "filename", "fold", "grasp", "group", "id", "index", "name"),
    *("number", "object", "placement", "point", "quality", "recording", "robot", "row", "run"),
    *("sample", "session", "time", "timestamp", "trial", "workspace"),
}
#: Most names that a message lists completely.
_LISTED_NAMES = 6


def choose_columns(
    table: ImportedTable, pattern: str, labels: Collection[str], remarks: Remarks
) -> tuple[str, ...]:
    """Return the columns of a table that are features, and note the choice in `remarks`.

    They are the columns whose whole name matches the regular expression `pattern`. By default, they
    are all columns of numbers with at least two values whose names are not those of labels or other
    columns; `labels` are further columns that are no features. Raises DataError if there is no such
    column, and for a column with numbers and other texts.
    """
    if pattern:
        chosen = _matching(table, pattern, labels)
    else:
        chosen = _columns_of_numbers(table, labels, remarks)
    if not chosen:
        problem = "no column of numbers can be a feature"
        fix = f"name the features with {OPTION}, e.g. {OPTION} 'mfcc_.*'"
        raise DataError(table.path, problem, fix)
    counted = many(len(chosen), "feature")
    remarks["note"].append((counted, f"columns {_names(chosen)}"))
    return tuple(chosen)


def _matching(table: ImportedTable, pattern: str, labels: Collection[str]) -> list[str]:
    """Return the columns whose names match. Raises DataError for a column that is no feature."""
    try:
        names = re.compile(pattern)
    except re.error as error:
        fix = "write a regular expression, e.g. 'mfcc_.*|rms'"
        raise DataError(OPTION, f"{pattern!r} is not valid ({error})", fix) from None
    chosen = [column for column in table.columns if names.fullmatch(column)]
    if not chosen:
        fix = f"correct the pattern; the columns are {_names(table.columns)}"
        raise DataError(OPTION, f"{pattern!r} matches no column of {table.path.name}", fix)
    for column in chosen:
        if column in labels or _role(column):
            problem = f"{pattern!r} matches {column!r}, which is a label or names the rows"
            raise DataError(OPTION, problem, "exclude it from the pattern")
        _check_numbers(table, column)
    return chosen


def _columns_of_numbers(
    table: ImportedTable, labels: Collection[str], remarks: Remarks
) -> list[str]:
    """Return all columns of numbers that are not labels, and note the columns of numbers that are
    not features."""
    chosen = []
    named = []
    constant = []
    for column in table.columns:
        texts = table.texts(column)
        if column in labels or _role(column) or _share_of_numbers(texts) < MIN_SHARE:
            continue
        if _is_named(column):
            named.append(column)
            continue
        _check_numbers(table, column)
        numbers = {cell_value(text) for text in texts if text.lower() not in NO_VALUE | INFINITE}
        if len(numbers) > 1:
            chosen.append(column)
        else:
            constant.append(column)
    if named:
        reason = f"{_names(named)}: their names are those of labels or of other columns; {OPTION} "
        remarks["note"].append(("numbers that are not features", f"{reason}takes them"))
    if constant:
        reason = f"{_names(constant)}; {OPTION} takes them"
        remarks["note"].append(("not features, because all rows have one value", reason))
    return chosen


def _role(column: str) -> str:
    """Return the role of a column in recordings.csv; "" for a label."""
    return ROLES.get(column.lower(), "")


def is_label(column: str) -> bool:
    """Return whether a word in the name of a column says that it is a label."""
    return bool(LABEL_WORDS & set(_words(column)))


def _words(column: str) -> list[str]:
    """Return the words of the name of a column, in lower case."""
    return re.split(r"[^a-z0-9]+", column.lower())


def _is_named(column: str) -> bool:
    """Return whether the name of a column is that of a label, or of a column that is no feature."""
    words = _words(column)
    return is_label(column) or words[-1] in OTHER_WORDS


def _share_of_numbers(texts: Sequence[str]) -> float:
    """Return the share of numbers in the cells with a value; numbers may have a decimal comma."""
    present = [text for text in texts if text.lower() not in NO_VALUE | INFINITE]
    numbers = sum(_is_number(text) or bool(DECIMAL_COMMA.fullmatch(text)) for text in present)
    return numbers / len(present) if present else 0.0


def _is_number(text: str) -> bool:
    """Return whether a cell is a number."""
    try:
        cell_value(text)
    except ValueError:
        return False
    return True


def _check_numbers(table: ImportedTable, column: str) -> None:
    """Raise DataError for a column with other texts than numbers and missing values."""
    texts = table.texts(column)
    wrong = [row for row, text in enumerate(texts) if not _is_number(text)]
    if not wrong:
        return
    place = table.places[wrong[0]]
    text = texts[wrong[0]]
    count = f"{len(wrong)} of {len(texts)} rows"
    if DECIMAL_COMMA.fullmatch(text):
        problem = f"column {column!r} has the decimal comma {text!r} ({count})"
        raise DataError(place, problem, "export the table with decimal points")
    problem = f"column {column!r} has {text!r} among numbers ({count})"
    fix = f"correct the cell, or leave the column out with {OPTION}; --target takes it as a label"
    raise DataError(place, problem, fix)


def note_values(table: ImportedTable, columns: Sequence[str], values: np.ndarray) -> Remarks:
    """Return warnings about `values` (n, columns): missing, constant, and equal in two rows."""
    remarks: Remarks = defaultdict(list)
    is_missing = ~np.isfinite(values)
    for place in np.flatnonzero(is_missing.any(axis=0)).tolist():
        rows = np.flatnonzero(is_missing[:, place])
        verb = "has" if len(rows) == 1 else "have"
        example = f"{table.places[rows[0]]}: {table.rows[rows[0]][columns[place]]!r}"
        reason = (
            f"{len(rows)} of {len(values)} rows {verb} no finite number ({example}), and a run "
            f"leaves them out; correct the cells, or leave the column out with {OPTION}"
        )
        remarks["warning"].append((f"feature {columns[place]}", reason))
    for place in np.flatnonzero(np.ptp(values, axis=0) == 0).tolist():
        reason = f"is {values[0, place]:g} in all {len(values)} rows, so it cannot help a model"
        remarks["warning"].append((f"feature {columns[place]}", reason))
    rows_of: dict[bytes, list[int]] = defaultdict(list)
    for row in np.flatnonzero(~is_missing.any(axis=1)).tolist():
        rows_of[values[row].tobytes()].append(row)
    equal = [rows for rows in rows_of.values() if len(rows) > 1]
    if equal:
        count = sum(len(rows) - 1 for rows in equal)
        example = f"{table.places[equal[0][1]]} repeats {table.places[equal[0][0]]}"
        reason = f"repeat the features of another row ({example}); remove copies from the table"
        remarks["warning"].append((many(count, "row"), reason))
    return remarks


def _names(columns: Sequence[str]) -> str:
    """Return names of columns, without those in the middle of a long list."""
    if len(columns) <= _LISTED_NAMES:
        return ", ".join(columns)
    return f"{', '.join(columns[:3])}, …, {columns[-1]}"
