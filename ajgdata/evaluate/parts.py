"""Parts of an evaluation: which recordings a model is tested on, and with which split."""

from __future__ import annotations

from typing import NamedTuple

GROUPED, RANDOM = "grouped", "random"  #: splits that keep groups together, and that ignore them
WITHHELD = "withheld"  #: recordings whose values no fold trains on
OVERALL = "overall"  #: recordings with training values and with withheld values together
#: Target values of the test recordings of each part.
TRAINING_VALUES, WITHHELD_VALUES, ALL_VALUES = "training", "withheld", "all"
_ELSEWHERE = "on:"


class PartColumns(NamedTuple):
    """Cells of a table of results that identify a part."""

    split: str
    test_set: str
    target_values: str


def elsewhere(dataset: str) -> str:
    """Return the part of the recordings of another data set."""
    return f"{_ELSEWHERE}{dataset}"


def part_columns(part: str, dataset: str) -> PartColumns:
    """Return the cells of a part; `dataset` is the data set of the task.

    >>> part_columns("withheld", "size")
    PartColumns(split='grouped', test_set='size', target_values='withheld')
    >>> part_columns("on:size_80dba", "size")
    PartColumns(split='grouped', test_set='size_80dba', target_values='training')
    """
    values = {WITHHELD: WITHHELD_VALUES, OVERALL: ALL_VALUES}
    is_elsewhere = part.startswith(_ELSEWHERE)
    return PartColumns(
        split=RANDOM if part == RANDOM else GROUPED,
        test_set=part.removeprefix(_ELSEWHERE) if is_elsewhere else dataset,
        target_values=values.get(part, TRAINING_VALUES),
    )
