"""Filter and order of recordings, as people write them.

A filter is a list of words, separated by spaces; a recording must match all of them:

- `label=wood`: the cell is this text or number; `label=` matches empty cells
- `label!=wood`: the cell is another one; `notes!=` matches cells that are not empty
- `confidence>0.9`, also `<`, `>=` and `<=`: numbers
- `object~ball`: the cell contains this text
- `ball`: any cell of text contains this text

Upper and lower case are equal. Quotes keep a text or a name with spaces together:
`label="foam brick"`, `"mass g">3`. In quotes, a doubled quote is a quote: `label="5"" disk"`. An
order is the name of a column; `-confidence` is the order from the largest to the smallest.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ajgdata.types import DataError

#: Where errors of a filter and of an order are.
FILTER = "--filter"
SORT = "--sort"
#: A text in quotes. The repetitions do not backtrack, so that the time is linear.
_QUOTED = re.compile(r'"((?:[^"]|"")*+)"')
_WORD = re.compile(rf'(?:{_QUOTED.pattern}|[^\s"])++')
_CONDITION = re.compile(
    rf'(?P<column>(?:{_QUOTED.pattern}|[^\s"!<>=~])++)'
    r"(?P<operator>!=|<=|>=|=|<|>|~)(?P<value>.*)",
    re.S,
)
_COMPARISONS: dict[str, Callable[[np.ndarray, float], np.ndarray]] = {
    "<": np.less,
    "<=": np.less_equal,
    ">": np.greater,
    ">=": np.greater_equal,
}


@dataclass(frozen=True, eq=False)
class TextColumn:
    """Texts of n recordings; "" is missing. A cell of a column with `words` is a list of words,
    and equals each of them."""

    texts: Sequence[str]
    has_words: bool = False

    @cached_property
    def _coded(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the distinct texts in lower case, sorted, and their numbers (n,)."""
        return np.unique([text.casefold() for text in self.texts], return_inverse=True)

    def matches(self, operator: str, value: str) -> np.ndarray:
        """Return which cells (n,) match."""
        distinct, number = self._coded
        wanted = value.casefold()
        if operator == "~":
            matching = [wanted in text for text in distinct.tolist()]
        elif operator in _COMPARISONS:
            fix = "use =, != or ~ for a column of text"
            raise DataError(FILTER, f"{operator}{value} needs a column of numbers", fix)
        elif self.has_words and wanted:
            matching = [wanted in text.split() for text in distinct.tolist()]
        else:
            matching = [wanted == text for text in distinct.tolist()]
        found = np.array(matching, bool)[number]
        return ~found if operator == "!=" else found

    @property
    def keys(self) -> np.ndarray:
        """Numbers (n,) in the order of the texts; NaN for missing texts."""
        distinct, number = self._coded
        is_missing = (distinct == "")[number]
        return np.where(is_missing, np.nan, number)

    def cell(self, row: int) -> str:
        """Return a cell."""
        return self.texts[row]


@dataclass(frozen=True, eq=False)
class NumberColumn:
    """Numbers (n,) of n recordings; NaN is missing."""

    numbers: np.ndarray
    unit: str = ""

    def matches(self, operator: str, value: str) -> np.ndarray:
        """Return which cells (n,) match."""
        if operator == "~":
            raise DataError(FILTER, f"~{value} needs a column of text", "use =, <, > for numbers")
        if value == "":
            found = np.isnan(self.numbers)
        else:
            try:
                wanted = float(value)
            except ValueError:
                problem = f"{operator}{value} is compared with numbers"
                raise DataError(FILTER, problem, "write a number, e.g. confidence>0.9") from None
            if operator in _COMPARISONS:
                return _COMPARISONS[operator](self.numbers, wanted)
            found = np.isclose(self.numbers, wanted, rtol=1e-9, atol=0)
        return ~found if operator == "!=" else found

    @property
    def keys(self) -> np.ndarray:
        """The numbers (n,)."""
        return self.numbers

    def cell(self, row: int) -> float | None:
        """Return a cell; None if it is missing."""
        value = float(self.numbers[row])
        return None if np.isnan(value) else value


Column = TextColumn | NumberColumn


class Condition(NamedTuple):
    """One word of a filter. `column` is "" for a word that any cell can contain."""

    column: str
    operator: str
    value: str


def parse_filter(text: str) -> list[Condition]:
    """Return the words of a filter. Raises DataError for a quote without its end.

    >>> parse_filter("label=wood confidence>0.9 ball")[:2]
    [Condition(column='label', operator='=', value='wood'), Condition(column='confidence', \
operator='>', value='0.9')]
    """
    if text.count('"') % 2:
        fix = 'write texts with spaces as label="foam brick", and a quote in them as ""'
        raise DataError(FILTER, "a quote has no end", fix)
    conditions = []
    for word in _WORD.finditer(text):
        match = _CONDITION.fullmatch(word[0])
        if match is None:
            conditions.append(Condition("", "~", _unquoted(word[0])))
        else:
            column = _unquoted(match["column"])
            conditions.append(Condition(column, match["operator"], _unquoted(match["value"])))
    return conditions


def _unquoted(text: str) -> str:
    """Return a text without the quotes around its parts."""
    return _QUOTED.sub(lambda quoted: quoted[1].replace('""', '"'), text)


def matching(columns: Mapping[str, Column], text: str, count: int) -> np.ndarray:
    """Return which of `count` recordings match a filter, (count,).

    Raises DataError for an unknown column and for a value of the wrong type.
    """
    found = np.ones(count, bool)
    for column, operator, value in parse_filter(text):
        if column:
            found &= known_column(columns, column, FILTER).matches(operator, value)
        else:
            any_cell = np.zeros(count, bool)
            for cells in columns.values():
                if isinstance(cells, TextColumn):
                    any_cell |= cells.matches("~", value)
            found &= any_cell
    return found


def ordered(columns: Mapping[str, Column], rows: np.ndarray, sort: str) -> np.ndarray:
    """Return the numbers `rows` (m,) of recordings in an order; missing cells are last.

    Equal cells keep their order. Raises DataError for an unknown column.
    """
    if not sort:
        return rows
    keys = known_column(columns, sort.removeprefix("-"), SORT).keys[rows]
    if sort.startswith("-"):
        keys = -keys
    return rows[np.argsort(keys, kind="stable")]  # NaN is last


def known_column(columns: Mapping[str, Column], name: str, where: str) -> Column:
    """Return a column by name. Raises DataError for an unknown one."""
    if name not in columns:
        raise DataError(where, f"there is no column {name!r}", f"use one of {', '.join(columns)}")
    return columns[name]
