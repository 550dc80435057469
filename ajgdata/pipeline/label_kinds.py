"""What the cells of a label column are: numbers or classes, and what is odd about them."""

from __future__ import annotations

import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from ajgdata.store.labels import number
from ajgdata.store.scan import Scan
from ajgdata.types import Finding, Target

#: Numbers in a column below which they are taken for classes.
FEWEST_NUMBERS = 11
#: How often a column of numbers holds numbers, at least, among its distinct cells.
_SHARE_OF_NUMBERS = 0.8
#: How programs write that a number is not there.
_NOT_MEASURED = {"nan", "na", "n/a", "#n/a", "<na>", "none", "null", "-", "--", "?"}
#: Those of them that no class is called.
_NO_CLASS = {"nan", "n/a", "#n/a", "<na>", "null"}
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")
_THOUSANDS = re.compile(r"[+-]?\d{1,3}(?:,\d{3})+")
#: A number with a thousands separator, or with a unit after it.
_NEARLY_NUMBER = re.compile(r"[+-]?\d[\d,.' ]*\s*[^\W\d_]{0,3}[%°]?")
#: Zeros stand apart if the next number is farther away than so many usual steps.
_APART = 2
_NAMED = 5
#: File names of played sounds: number 0 as in the starter kit, or a word for one.
_PLAYED = re.compile(
    r"0+[_ -].*|(?:.*[^a-z])?(?:sweep|chirp|excitation|stimulus)(?:[^a-z].*)?", re.IGNORECASE
)


@dataclass(frozen=True)
class Verdict:
    """How a column is declared, and in words why, with the cells that speak against it."""

    target: Target
    why: str


def verdict(cells: Sequence[str]) -> Verdict:
    """Return how a column with these cells is declared.

    It holds numbers when more than ten distinct cells are numbers and few are anything else; a
    class otherwise. Words for "not measured", and zeros that stand apart from all other numbers,
    are declared missing.
    """
    distinct = {cell for cell in cells if cell}
    words = {cell for cell in distinct if cell.lower() in _NOT_MEASURED}
    points = decimal_points(cells)
    numbers = {cell for cell in distinct - words if _number(points.get(cell, cell)) is not None}
    against = distinct - words - numbers
    share = len(numbers) / max(1, len(numbers) + len(against))
    if len(numbers) >= FEWEST_NUMBERS and share >= _SHARE_OF_NUMBERS:
        return _numbers([points.get(cell, cell) for cell in cells], words, against)
    said = f"{len(distinct)} distinct texts"
    if numbers and not against:
        said = f"only {len(numbers)} distinct numbers, {FEWEST_NUMBERS} would make it a number"
    elif numbers:
        said += f", {len(numbers)} of them numbers; not a number: {_named(against)}"
    nearly = {cell for cell in against if _NEARLY_NUMBER.fullmatch(cell)}
    likely = len(numbers | nearly)
    if nearly and likely >= max(FEWEST_NUMBERS, _SHARE_OF_NUMBERS * len(numbers | against)):
        said += f"; {_named(nearly)} look like numbers: remove units and thousands separators"
    missing = {cell for cell in distinct if cell.lower() in _NO_CLASS}
    if missing:
        said += f"; declared missing: {_named(missing)}"
    if doubtful := words - missing:
        said += f"; {_named(doubtful)} is a class: add it to `missing` if it means not measured"
    target = Target(kind="classification", missing=tuple(sorted(missing)))
    return Verdict(target, f"a class ({said})")


def _numbers(cells: Sequence[str], words: Collection[str], against: Collection[str]) -> Verdict:
    """Return the verdict on a column of numbers, its decimal commas being points."""
    zeros = set(zeros_apart(cells))
    measured = [cell for cell in cells if cell not in zeros]
    values = [value for cell in measured if (value := _number(cell)) is not None]
    said = f"{len(set(values))} distinct numbers, {min(values):g} to {max(values):g}"
    if words:
        said += f"; declared missing: {_named(words)}"
    if zeros:
        count = sum(cell in zeros for cell in cells)
        said += f"; {count} cells {_named(zeros)} stand apart and are declared missing: remove "
        said += "`missing` if they were measured"
    if against:
        said += f"; no number, left out until corrected or added to `missing`: {_named(against)}"
    missing = tuple(sorted({*words, *zeros}))
    return Verdict(Target(kind="regression", missing=missing), f"a number ({said})")


def decimal_points(cells: Collection[str]) -> dict[str, str]:
    """Return cells such as `1,5` with a decimal point; none if the commas part thousands.

    That is so if every one has three digits after each comma, as `1,234`.
    """
    commas = {cell for cell in cells if "," in cell}
    if all(_THOUSANDS.fullmatch(cell) for cell in commas):
        return {}
    return {cell: cell.replace(",", ".") for cell in commas if _DECIMAL_COMMA.fullmatch(cell)}


def with_decimal_points(scanned: Scan, columns: Collection[str]) -> tuple[Scan, list[str]]:
    """Return what was scanned with the decimal commas of `columns` as points, and say so."""
    told, files = [], list(scanned.files)
    for column in columns:
        cells = [file.labels.get(column, "") for file in files]
        if points := decimal_points(cells):
            count = sum(cell in points for cell in cells)
            told.append(f"{column}: {count} decimal commas are written as points")
            files = [
                replace(file, labels={**file.labels, column: points.get(cell, cell)})
                if column in file.labels else file
                for file, cell in zip(files, cells, strict=True)
            ]  # fmt: skip
    return replace(scanned, files=files), told


def zeros_apart(cells: Sequence[str]) -> list[str]:
    """Return the texts of zeros that stand several times, apart from all other numbers.

    Apart: the nearest number is farther away than two usual steps between neighbours.
    """
    values = {cell: value for cell in cells if (value := _number(cell)) is not None}
    zeros = [cell for cell, value in values.items() if value == 0]
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
    """Return in words what is odd about the cells of targets, by the column's name."""
    told = []
    for name, target in targets.items():
        texts = [cell for cell in cells.get(name, ()) if cell not in target.missing]
        there = [cell for cell in texts if cell]
        if target.kind == "classification":
            for near in near_labels(set(there)):
                counts = Counter(there)
                named = ", ".join(f"{cell!r} ({counts[cell]})" for cell in near)
                told.append(f"{name}: {named} look like one class")
        elif zeros := zeros_apart(there):
            count = sum(cell in zeros for cell in there)
            told.append(f"{name}: {count} cells {_named(zeros)} stand apart from other numbers")
        if (empty := len(texts) - len(there)) and there:
            told.append(f"{name}: {empty} recordings have no label")
    return told


def no_numbers(cells: Mapping[str, Sequence[str]], targets: Mapping[str, Target]) -> list[str]:
    """Return in words which cells of declared numbers are none."""
    told = []
    for name, target in targets.items():
        if target.kind == "regression":
            known = {"", *target.missing}
            against = {cell for cell in cells[name] if cell not in known and _number(cell) is None}
            if against:
                told.append(
                    f"{name}: no number: {_named(against)}; correct it, or add it to `missing`"
                )
    return told


def played_as_class(found: Scan, targets: Mapping[str, Target]) -> list[str]:
    """Return in words which recordings alone make a class and are called as played sounds are."""
    named = [file for file in found.files if _PLAYED.fullmatch(file.path.stem)]
    others = [file for file in found.files if file not in named]
    told = []
    for name in (name for name, one in targets.items() if one.kind == "classification"):
        classes = {file.cell(name) for file in others} | {""}
        odd = [file.path.as_posix() for file in named if file.cell(name) not in classes]
        if odd and others:
            fix = "if it was played, not recorded, take it out of pattern or table"
            told.append(f"{name}: {_named(odd)} is a class by itself; {fix}")
    return told


def label_findings(
    tables: Sequence[Sequence[Mapping[str, str]]], targets: Mapping[str, Target]
) -> list[Finding]:
    """Return a note on each oddity in the label rows of all sessions."""
    rows = [row for table in tables for row in table if row["quality"].lower() != "reject"]
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
    some = ", ".join(repr(cell) for cell in sorted(cells)[:_NAMED])
    return some + (f" and {len(cells) - _NAMED} more" if len(cells) > _NAMED else "")
