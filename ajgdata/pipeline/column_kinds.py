"""Whether a column of texts is declared as numbers or as classes."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Collection
from dataclasses import dataclass

from ajgdata.store.labels import number
from ajgdata.types import Target

#: A column with fewer distinct numbers is a class.
MIN_NUMBERS = 11
#: Share of the distinct texts that must be numbers in a column of numbers; the others are probably
#: typing errors. Classes with such a share of numbers are not to be expected.
MIN_SHARE = 0.8
#: How programs, people and spreadsheets write a missing value.
MISSING = {
    *("nan", "n/a", "#n/a", "<na>", "null"),
    *("na", "-", "--", "---", "\u2013", "\u2014", "?", "."),
    *("#div/0!", "#value!", "#ref!", "#name?", "#num!", "#null!"),
    *("inf", "-inf", "+inf", "infinity", "-infinity"),
}
#: Words that are missing among numbers, but common classes, e.g. of an empty gripper.
NO_NUMBER = {"none", "nil", "no"}
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+")
#: Texts listed in a remark.
LISTED = 5


@dataclass(frozen=True)
class ColumnKind:
    """How a column is declared, the reason, and what is probably wrong with its cells."""

    target: Target
    reason: str
    warnings: tuple[str, ...] = ()


def column_kind(texts: Collection[str]) -> ColumnKind:
    """Return how a column with these distinct texts is declared.

    It is a column of numbers if it has at least MIN_NUMBERS distinct numbers, and if they are at
    least MIN_SHARE of its texts; otherwise it is a column of classes.
    """
    present = {text for text in texts if text}
    missing = {text for text in present if text.lower() in MISSING}
    missing_numbers = missing | {text for text in present if text.lower() in NO_NUMBER}
    numbers, words = _split(present - missing_numbers)
    is_number = len(numbers) >= MIN_NUMBERS
    if is_number and len(numbers) >= MIN_SHARE * (len(numbers) + len(words)):
        values = [number(text) for text in numbers]
        reason = f"{len(numbers)} distinct numbers, {min(values):g} to {max(values):g}"
        return _declared("regression", missing_numbers, f"a number ({reason})", _no_numbers(words))
    warnings = [*_commas(words), *_like_missing(missing), *_like_each_other(present)]
    return _declared("classification", (), f"a class ({len(present)} distinct texts)", warnings)


def _declared(
    kind: str, missing: Collection[str], reason: str, warnings: Collection[str]
) -> ColumnKind:
    if missing:
        reason += f"; declared missing: {', '.join(sorted(missing))}"
    target = Target.model_validate({"kind": kind, "missing": tuple(sorted(missing))})
    return ColumnKind(target, reason, tuple(warnings))


def _split(texts: Collection[str]) -> tuple[list[str], list[str]]:
    """Return the texts that are finite numbers, and the others."""
    numbers, words = [], []
    for text in sorted(texts):
        try:
            number(text)
        except ValueError:
            words.append(text)
        else:
            numbers.append(text)
    return numbers, words


def _listed(texts: Collection[str]) -> str:
    shown = [repr(text) for text in sorted(texts)]
    return ", ".join(shown[:LISTED]) + (", …" if len(shown) > LISTED else "")


def _no_numbers(words: Collection[str]) -> list[str]:
    if not words:
        return []
    fix = "correct the cells (a decimal point, no unit), or declare the text under `missing`"
    return [f"{_listed(words)} among numbers: no task uses these recordings; {fix}"]


def _commas(words: Collection[str]) -> list[str]:
    commas = [text for text in words if _DECIMAL_COMMA.fullmatch(text)]
    if len(commas) < MIN_NUMBERS:
        return []
    return [f"{_listed(commas)} are numbers with a decimal comma; write a point instead"]


def _like_missing(texts: Collection[str]) -> list[str]:
    if not texts:
        return []
    fix = "if they are missing values, declare them under `missing` of the target"
    return [f"{_listed(texts)} in a column of text stay classes; {fix}"]


def _like_each_other(classes: Collection[str]) -> list[str]:
    """Return a warning for classes that differ only in case or blanks."""
    groups: dict[str, list[str]] = defaultdict(list)
    for text in sorted(classes):
        groups["".join(text.casefold().split())].append(text)
    alike = [text for group in groups.values() if len(group) > 1 for text in group]
    if not alike:
        return []
    names = ", ".join(map(repr, alike))
    return [f"classes differ only in case or blanks: {names}; write each class in one way"]
