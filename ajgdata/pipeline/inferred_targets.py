"""Decide whether a column of texts is a target of numbers or of classes."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from ajgdata.store.labels import number
from ajgdata.types import Kind, Target

#: A column with fewer distinct numbers is a class.
MIN_NUMBERS = 11
#: Share of the present cells that must be numbers in a column of numbers. A fifth leaves room for
#: typing errors and words for missing values that `MISSING` does not list. Names of classes are
#: hardly ever numbers in four of five recordings and words in the others.
MIN_SHARE = 0.8
#: A class with this share of numbers, and MIN_NUMBERS distinct ones, is probably a column of
#: numbers with many errors.
DOUBTFUL_SHARE = 0.5
_MISSING_OF_PROGRAMS = {"nan", "-nan", "+nan", "n/a", "#n/a", "<na>", "null", "1.#ind", "1.#qnan"}
_MISSING_OF_PEOPLE = {"na", "n.a.", "-", "--", "---", "\u2013", "\u2014", "?", "."}
_ERRORS_OF_SPREADSHEETS = {"#div/0!", "#value!", "#ref!", "#name?", "#num!", "#null!"}
_INFINITE = {"inf", "-inf", "+inf", "infinity", "-infinity"}
#: How programs, people and spreadsheets write a missing value.
MISSING = _MISSING_OF_PROGRAMS | _MISSING_OF_PEOPLE | _ERRORS_OF_SPREADSHEETS | _INFINITE
#: Words that are missing among numbers, but common classes, e.g. of an empty gripper.
NO_NUMBER = {"none", "nil", "no"}
#: 17,5 and 1.234,5.
DECIMAL_COMMA = re.compile(r"[+-]?(?:\d{1,3}(?:\.\d{3})+|\d+),\d+")


@dataclass(frozen=True)
class Doubt:
    """Texts of a column that are probably wrong; `problem` is a clause with their count."""

    texts: tuple[str, ...]
    problem: str
    fix: str


@dataclass(frozen=True)
class InferredTarget:
    """How a column is declared, the reason, and what is probably wrong with its cells."""

    target: Target
    reason: str
    doubts: tuple[Doubt, ...] = ()


def inferred_target(cells: Mapping[str, int]) -> InferredTarget:
    """Return how a column is declared; `cells` are the numbers of recordings with each text.

    It is a column of numbers if it has at least MIN_NUMBERS distinct numbers, and if at least
    MIN_SHARE of the cells that are neither empty nor missing are numbers. Otherwise it is a column
    of classes. Texts in MISSING are missing in a column of numbers, and also among classes if
    MIN_SHARE of all cells are numbers and there is no other text.

    >>> inferred = inferred_target({"NA": 2, "17,5": 1} | {str(n): 1 for n in range(20)})
    >>> inferred.target.kind, inferred.target.missing, inferred.doubts[0].problem
    ('regression', ('NA',), '1 of 21 cells is not a number')
    >>> inferred_target({"cube": 3, "NA": 2}).target.missing
    ()
    """
    present = {text: count for text, count in cells.items() if text}
    missing = {text: count for text, count in present.items() if text.lower() in MISSING}
    no_number = {text: count for text, count in present.items() if text.lower() in NO_NUMBER}
    numbers, words = _split({text: n for text, n in present.items() if text not in missing})
    values = {number(text) for text in numbers}
    number_count = sum(numbers.values())
    count = sum(present.values()) - sum(missing.values())
    typed_count = count - sum(no_number.values())
    if len(values) >= MIN_NUMBERS and number_count >= MIN_SHARE * typed_count:
        reason = f"a number ({len(values)} distinct numbers, {min(values):g} to {max(values):g})"
        wrong = {text: n for text, n in words.items() if text not in no_number}
        doubts = [_not_numbers(wrong, typed_count)]
        return _declared("regression", missing | no_number, reason, doubts)
    all_count = sum(present.values())
    if missing and not words and number_count >= MIN_SHARE * all_count:
        reason = f"a class ({len(numbers)} distinct texts)"
        return _declared("classification", missing, reason, [])
    doubts = [_commas(words, numbers, count), _like_missing(missing, all_count)]
    if doubts[0] is None and len(values) >= MIN_NUMBERS and number_count >= DOUBTFUL_SHARE * count:
        doubts.append(_many_numbers(words, count))
    return _declared("classification", {}, f"a class ({len(present)} distinct texts)", doubts)


def _declared(
    kind: Kind, missing: Collection[str], reason: str, doubts: Collection[Doubt | None]
) -> InferredTarget:
    """Return a target with the texts that stand for a missing value, and with its doubts."""
    if missing:
        reason += f"; declared missing: {', '.join(sorted(missing))}"
    target = Target.model_validate({"kind": kind, "missing": tuple(sorted(missing))})
    return InferredTarget(target, reason, tuple(doubt for doubt in doubts if doubt))


def _split(cells: Mapping[str, int]) -> tuple[dict[str, int], dict[str, int]]:
    """Return the cells that are finite numbers, and the cells that are not."""
    numbers: dict[str, int] = {}
    words: dict[str, int] = {}
    for text, count in sorted(cells.items()):
        try:
            number(text)
        except ValueError:
            words[text] = count
        else:
            numbers[text] = count
    return numbers, words


def _counted(texts: Mapping[str, int], count: int) -> str:
    """Return the number of cells with these texts, for example `2 of 24 cells are`."""
    own = sum(texts.values())
    return f"{own} of {count} cells {'is' if own == 1 else 'are'}"


def _not_numbers(words: Mapping[str, int], count: int) -> Doubt | None:
    """Return the doubt about words in a column of numbers."""
    if not words:
        return None
    noun = "a number" if sum(words.values()) == 1 else "numbers"
    fix = "correct the cells (a decimal point, no unit), or list the texts under `missing`"
    return Doubt(tuple(words), f"{_counted(words, count)} not {noun}", fix)


def _commas(words: Mapping[str, int], numbers: Mapping[str, int], count: int) -> Doubt | None:
    """Return the doubt about a column that would be numbers if commas were points."""
    commas = {text: own for text, own in words.items() if DECIMAL_COMMA.fullmatch(text)}
    share = sum({**numbers, **commas}.values()) / count if count else 0.0
    if not commas or len(numbers) + len(commas) < MIN_NUMBERS or share < MIN_SHARE:
        return None
    problem = f"{_counted(commas, count)} written with a decimal comma, so the column is a class"
    fix = "export the table with decimal points, and import it into a new data set"
    return Doubt(tuple(commas), problem, fix)


def _many_numbers(words: Mapping[str, int], count: int) -> Doubt:
    """Return the doubt about a column of classes that are mostly numbers."""
    problem = f"only {_counted(words, count)} not numbers, but the column is declared as a class"
    fix = "for a column of numbers, correct the cells, and import into a new data set"
    return Doubt(tuple(words), problem, fix)


def _like_missing(missing: Mapping[str, int], count: int) -> Doubt | None:
    """Return the doubt about classes whose names usually stand for a missing value."""
    if not missing:
        return None
    problem = f"{_counted(missing, count)} probably missing, but a class of its own"
    if len(missing) > 1:
        problem = f"{_counted(missing, count)} probably missing, but classes of their own"
    fix = "if the values are missing, list the texts under `missing` of the target in dataset.yaml"
    return Doubt(tuple(missing), problem, fix)
