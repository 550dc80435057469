"""What the cells of a label column are: numbers or classes, and what is odd about them."""

from __future__ import annotations

import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise

from ajgdata.store.findings import is_rejected
from ajgdata.store.labels import number
from ajgdata.store.plain_text import listed
from ajgdata.types import Finding, Target

#: Numbers in a column below which they are taken for classes.
FEWEST_NUMBERS = 11
#: Smallest share of numbers among the distinct cells of a column of numbers.
_SHARE_OF_NUMBERS = 0.8
#: How programs write a missing number, and those of them that cannot be a class.
_NOT_MEASURED = {"nan", "na", "n/a", "#n/a", "<na>", "none", "null", "-", "--", "?"}
_NO_CLASS = {"nan", "n/a", "#n/a", "<na>", "null"}
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")
_THOUSANDS = re.compile(r"[+-]?\d{1,3}(?:,\d{3})+")
#: Zeros are apart if the next number is farther away than so many usual steps.
_APART = 2


def verdict(cells: Sequence[str]) -> tuple[Target, str]:
    """Return how a column with these cells is declared, and why.

    It holds numbers if at least eleven distinct cells are numbers and few are anything else, and
    classes otherwise. Words for "not measured", and zeros that are apart from all other numbers,
    are declared missing.
    """
    points = decimal_points(cells)
    cells = [points.get(cell, cell) for cell in cells]
    distinct = set(cells) - {""}
    words = {cell for cell in distinct if cell.lower() in _NOT_MEASURED}
    numbers = {cell for cell in distinct - words if _number(cell) is not None}
    is_number = _are_numbers(len(numbers), len(distinct - words))
    if is_number:
        zeros = zeros_apart(cells)
        values = {_number(cell) or 0.0 for cell in numbers - {*zeros}}
        notes = [f"{len(values)} distinct numbers, {min(values):g} to {max(values):g}"]
        missing = words | {*zeros}
    else:
        missing = {cell for cell in words if cell.lower() in _NO_CLASS}
        notes = _class_notes(distinct - missing, numbers, words - missing)
    if missing:
        notes.append(f"declared missing, remove what was measured: {_named(missing)}")
    target = Target(
        kind="regression" if is_number else "classification", missing=tuple(sorted(missing))
    )
    return target, f"a {'number' if is_number else 'class'} ({'; '.join(notes)})"


def _are_numbers(numbers: int, distinct: int) -> bool:
    return numbers >= max(FEWEST_NUMBERS, _SHARE_OF_NUMBERS * distinct)


def _class_notes(distinct: set[str], numbers: set[str], words: set[str]) -> list[str]:
    """Return notes on a column of classes; `words` may mean that a class was not determined."""
    others = distinct - numbers - words
    if numbers and not others:
        head = f"only {len(numbers)} distinct numbers; {FEWEST_NUMBERS} would make it a number"
    else:
        head = f"{len(distinct)} distinct texts"
    notes = [head]
    nearly = {cell for cell in others if cell[:1].isdigit()}
    if nearly and _are_numbers(len(numbers | nearly), len(distinct)):
        fix = "remove units and thousands separators"
        notes.append(f"{_named(nearly)} look like numbers: {fix}")
    if words:
        notes.append(f"add to `missing` if it means not measured: {_named(words)}")
    return notes


def decimal_points(cells: Collection[str]) -> dict[str, str]:
    """Return cells such as `1,5` with a decimal point; none if the commas separate thousands, which
    is so if each has three digits after every comma, as `1,234`."""
    commas = {cell for cell in cells if "," in cell}
    if all(_THOUSANDS.fullmatch(cell) for cell in commas):
        return {}
    return {cell: cell.replace(",", ".") for cell in commas if _DECIMAL_COMMA.fullmatch(cell)}


def zeros_apart(cells: Sequence[str]) -> list[str]:
    """Return the texts of zeros that occur several times, apart from all other numbers.

    Apart: the nearest number is farther away than two usual steps between neighbours.
    """
    values = {cell: value for cell in cells if (value := _number(cell)) is not None}
    zeros = sorted(cell for cell, value in values.items() if value == 0)
    others = sorted(set(values.values()) - {0.0})
    if sum(cell in zeros for cell in cells) < 2 or len(others) < FEWEST_NUMBERS:
        return []
    if others[0] < 0 < others[-1]:
        return []
    sizes = sorted(abs(value) for value in others)
    steps = sorted(high - low for low, high in pairwise(sizes))
    return zeros if sizes[0] > _APART * steps[len(steps) // 2] else []


def near_labels(cells: Collection[str]) -> list[list[str]]:
    """Return classes that differ only in case, spaces, _ or -, each with its near ones."""
    alike: dict[str, set[str]] = defaultdict(set)
    for cell in cells:
        plain = unicodedata.normalize("NFKC", cell).casefold()
        alike[re.sub(r"(?<=\w)[\s_-]+(?=\w)", " ", plain)].add(cell)
    return [sorted(found) for found in alike.values() if len(found) > 1]


def odd_labels(cells: Mapping[str, Sequence[str]], targets: Mapping[str, Target]) -> list[str]:
    """Return a line for each oddity in the cells of targets, by the column's name."""
    told = []
    for name, target in targets.items():
        texts = [cell for cell in cells.get(name, ()) if cell not in target.missing]
        counts = Counter(cell for cell in texts if cell)
        if target.kind == "classification":
            for near in near_labels(counts):
                named = ", ".join(f"{cell!r} ({counts[cell]})" for cell in near)
                told.append(f"{name}: {named} look like one class")
        elif zeros := zeros_apart(texts):
            count = sum(counts[cell] for cell in zeros)
            told.append(f"{name}: {count} cells {_named(zeros)} are apart from other numbers")
        if (empty := texts.count("")) and counts:
            told.append(f"{name}: {empty} recordings have no label")
    return told


def no_numbers(cells: Mapping[str, Sequence[str]], targets: Mapping[str, Target]) -> list[str]:
    """Return a line for each target that is a number, on its cells that are not."""
    told = []
    for name in (name for name, target in targets.items() if target.kind == "regression"):
        known = {"", *targets[name].missing}
        if others := {cell for cell in cells[name] if cell not in known and _number(cell) is None}:
            fix = "correct it, or add it to `missing`"
            told.append(f"{name}: no number: {_named(others)}; {fix}")
    return told


def label_findings(
    tables: Sequence[Sequence[Mapping[str, str]]], targets: Mapping[str, Target]
) -> list[Finding]:
    """Return a note on each oddity in the label rows of all sessions."""
    rows = [row for table in tables for row in table if not is_rejected(row)]
    cells = {name: [row.get(name, "") for row in rows] for name in targets}
    fix = "correct recordings.csv, or declare the text under `missing` of the target"
    told = odd_labels(cells, targets)
    return [Finding("*", "*", "", "note", "odd_labels", one, fix) for one in told]


def _number(cell: str) -> float | None:
    try:
        return number(cell)
    except ValueError:
        return None


def _named(cells: Collection[str]) -> str:
    return listed([repr(cell) for cell in sorted(cells)])
