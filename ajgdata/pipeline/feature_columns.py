"""Decide which columns of an imported table are features, and list unusual values in them."""

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
    *("sample", "session", "timestamp", "trial", "workspace"),
}
#: Name of a column that pandas makes of the numbers of rows.
_UNNAMED = re.compile(r"unnamed: \d.*", re.IGNORECASE)
#: Where a word in the name of a column begins, as in `pointIndex` and `MFCCMean`.
_CAPITAL = re.compile(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")
#: Least number of rows that can be recognised as counted. Six numbers of a feature increase by
#: chance in one of 720 tables.
_COUNTED_ROWS = 6
#: Least value of a time since 1970, of the year 1973 in seconds.
_UNIX_TIME = 1e8
#: Smallest number of names with different digits that messages shorten to the first and last.
_SERIES = 4
#: How all notes on excluded columns end.
_INCLUDE = f"to use them, name all features with {OPTION}"


def choose_columns(
    table: ImportedTable,
    pattern: str,
    targets: Collection[str],
    identifiers: Collection[str],
    remarks: Remarks,
) -> tuple[str, ...]:
    """Return the columns of a table that are features, and note the choice in `remarks`.

    They are the columns whose whole name matches the regular expression `pattern`. By default, they
    are the columns of numbers with at least two values that neither have names of other columns,
    nor count the rows, nor follow from a label. `targets` are further labels, and `identifiers` are
    columns that name sessions, grasps, placements and objects. Raises DataError if there is no such
    column, and for a column with numbers and other texts.
    """
    if pattern:
        chosen = _matching(table, pattern, {*targets, *identifiers})
    else:
        chosen = _columns_of_numbers(table, targets, identifiers, remarks)
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
    table: ImportedTable,
    targets: Collection[str],
    identifiers: Collection[str],
    remarks: Remarks,
) -> list[str]:
    """Return the columns of numbers that are features, and note those that are not features."""
    labels = [
        column
        for column in table.columns
        if column in targets or is_label(column) or _role(column) == "object"
    ]
    chosen = []
    excluded: dict[str, list[str]] = defaultdict(list)
    for column in table.columns:
        if column in targets or column in identifiers or _role(column):
            continue
        if _share_of_numbers(table.texts(column)) < MIN_SHARE:
            continue
        if _is_named(column):
            excluded["their names are those of labels or of other columns"].append(column)
            continue
        _check_numbers(table, column)
        reason = _reason_to_exclude(table, column, labels)
        if reason:
            excluded[reason].append(column)
        else:
            chosen.append(column)
    for reason, columns in excluded.items():
        name = f"not features, because {reason}"
        remarks["note"].append((name, f"{_names(columns)}; {_INCLUDE}"))
    return chosen


def _reason_to_exclude(table: ImportedTable, column: str, labels: Sequence[str]) -> str:
    """Return why the numbers of a column are no feature, as a clause; "" for a feature."""
    cells = [cell_value(text) for text in table.texts(column)]
    values = np.array(cells)
    present = values[np.isfinite(values)]
    if len(set(present.tolist())) < 2:
        return "all rows have one value"
    is_increasing = len(values) >= _COUNTED_ROWS and bool(np.all(np.diff(values) > 0))
    if is_increasing and np.all(values == np.floor(values)):
        return "they count the rows"
    if _words(column)[-1] == "time" and (is_increasing or present.min() >= _UNIX_TIME):
        return "they are times of the rows"
    for label in labels:
        if _follows_from(table.texts(label), cells):
            return f"each {label} has one value"
    return ""


def _follows_from(labels: Sequence[str], values: Sequence[float]) -> bool:
    """Return whether the values (n,) are one number per label, for labels (n,) that repeat."""
    pairs = {
        (label, value)
        for label, value in zip(labels, values, strict=True)
        if label and np.isfinite(value)
    }
    distinct = {label for label, _ in pairs}
    return len(pairs) == len(distinct) and 2 * len(distinct) <= len(labels)


def _role(column: str) -> str:
    """Return the role of a column in recordings.csv; "" for a label."""
    return ROLES.get(column.lower(), "")


def is_label(column: str) -> bool:
    """Return whether a word in the name of a column identifies it as a label."""
    return bool(LABEL_WORDS & {word.rstrip("0123456789") for word in _words(column)})


def _words(column: str) -> list[str]:
    """Return the words of the name of a column, in lower case; `pointIndex` has two."""
    return re.split(r"[^a-z0-9]+", _CAPITAL.sub("_", column).lower())


def _is_named(column: str) -> bool:
    """Return whether the name of a column is that of a label, or of a column that is no feature."""
    words = _words(column)
    is_other = words[-1] in OTHER_WORDS or words == ["time"]
    return is_label(column) or is_other or bool(_UNNAMED.fullmatch(column))


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
    """Return names of columns; of many names that differ in digits, the first and last."""
    series: dict[str, list[str]] = defaultdict(list)
    for column in columns:
        series[re.sub(r"\d+", "0", column)].append(column)
    texts = []
    for names in series.values():
        is_long = len(names) >= _SERIES
        texts += [f"{names[0]} … {names[-1]}"] if is_long else names
    return ", ".join(texts)
