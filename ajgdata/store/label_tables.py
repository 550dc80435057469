"""Tables of labels as people have them: commas, semicolons or tabs, and several joined by a key."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from ajgdata.store.files import read_text
from ajgdata.store.plain_text import listed
from ajgdata.types import DataError

_DELIMITERS = ",;\t"
#: First line by which a spreadsheet names the delimiter.
_HINT = re.compile(r'"?sep=(.)"?;*,*', re.IGNORECASE)


def read_label_table(path: Path) -> pd.DataFrame:
    """Return a table with commas, semicolons or tabs; every cell is stripped text.

    The delimiter is that of a first line `sep=;`, or else the most frequent one of the header.
    Empty rows and columns are dropped. Raises DataError for an empty table, a column without a name
    or with the name of another, and a row with more cells than the header.
    """
    text = read_text(path)
    first, _, rest = text.partition("\n")
    if hint := _HINT.fullmatch(first.strip()):
        mark, text = hint[1], rest
    else:
        mark = max(_DELIMITERS, key=first.count)
    options = {"header": None, "dtype": str, "keep_default_na": False, "skipinitialspace": True}
    try:
        cells = pd.read_csv(io.StringIO(text), sep=mark, **options)  # type: ignore[call-overload]
    except pd.errors.EmptyDataError:
        cells = pd.DataFrame()
    except pd.errors.ParserError as error:
        reason = str(error).removeprefix("Error tokenizing data. C error: ").strip()
        problem = f"is not a valid table ({reason})"
        raise DataError(path, problem, "correct the quotes and the number of cells") from None
    cells = cells.apply(lambda column: column.str.strip())
    cells = cells.loc[(cells != "").any(axis=1), (cells != "").any(axis=0)]
    if len(cells) < 2:
        problem = "is empty" if cells.empty else "has column names but no rows"
        raise DataError(path, problem, "write a line with column names and a line per file")
    header = cells.iloc[0].tolist()
    if "" in header:
        problem = f"column {header.index('') + 1} has no name"
        raise DataError(path, problem, "name it")
    if twice := [name for name in header if header.count(name) > 1]:
        raise DataError(path, f"column {twice[0]!r} occurs twice", "rename it")
    return cells.iloc[1:].set_axis(header, axis=1)


def joined(
    folder: Path, table: pd.DataFrame, tables: Mapping[str, str]
) -> tuple[pd.DataFrame, list[str]]:
    """Return a table with the columns of further `tables` (file in `folder`: key column) added.

    Each row gets the cells of the row with the same key; its own cells stay. Also returns notes on
    keys that a table lacks (their cells are empty), and on columns that are not used because the
    first table has a column of that name. Raises DataError for a key that is not a column of both
    tables, or that occurs twice in a joined table.
    """
    notes = []
    for file, key in tables.items():
        other = read_label_table(folder / file)
        for where, columns in ((folder / file, other.columns), ("--join", table.columns)):
            if key not in columns:
                raise DataError(where, f"has no column {key!r}", f"there are {list(columns)}")
        if twice := other[key][other[key].duplicated()].tolist():
            raise DataError(folder / file, f"{key} {twice[0]!r} occurs twice", "keep one row")
        unused = [column for column in other.columns if column in table.columns and column != key]
        if unused:
            notes.append(f"{file}: not used, because a table before has it: {', '.join(unused)}")
        if absent := table[key][~table[key].isin(other[key])].unique().tolist():
            notes.append(f"{file} has no row for {key} {listed(absent)}")
        table = table.merge(other.drop(columns=unused), on=key, how="left").fillna("")
    return table, notes
