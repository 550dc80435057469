"""Parts of an evaluation: which recordings a model is tested on, and with which split."""

from __future__ import annotations

from typing import NamedTuple

GROUPED, RANDOM = "grouped", "random"  #: splits that keep groups together, and that ignore them
WITHHELD = "withheld"  #: recordings whose values no fold trains on
OVERALL = "overall"  #: recordings with training values and with withheld values together
#: The same three with sessions held out instead of the groups of the task.
SESSIONS, SESSIONS_WITHHELD, SESSIONS_OVERALL = "sessions", "sessions withheld", "sessions overall"
#: Value of the column `split` of these parts.
SESSION_SPLIT = "session"
#: Target values of the test recordings of each part.
TRAINING_VALUES, WITHHELD_VALUES, ALL_VALUES = "training", "withheld", "all"
#: Recordings of one object under several names.
PLACEBO_VALUES = "placebo"
_ELSEWHERE = "on:"
_PLACEBO = "placebo "


class ValueParts(NamedTuple):
    """Parts of one split: training values, withheld values, and both together."""

    training: str
    withheld: str
    overall: str


BY_GROUP = ValueParts(GROUPED, WITHHELD, OVERALL)
BY_SESSION = ValueParts(SESSIONS, SESSIONS_WITHHELD, SESSIONS_OVERALL)
#: The part with held-out sessions, by the part with held-out groups.
IN_SESSIONS = dict(zip(BY_GROUP, BY_SESSION, strict=True))


class PartColumns(NamedTuple):
    """Cells of a table of results that identify a part."""

    split: str
    test_set: str
    target_values: str


def elsewhere(dataset: str) -> str:
    """Return the part of the recordings of another data set."""
    return f"{_ELSEWHERE}{dataset}"


def placebo(dataset: str, split: str = GROUPED) -> str:
    """Return the part of the placebo in a data set, with a split: GROUPED, RANDOM or
    SESSION_SPLIT."""
    return f"{_PLACEBO}{split}:{dataset}"


def part_columns(part: str, dataset: str) -> PartColumns:
    """Return the cells of a part; `dataset` is the data set of the task.

    >>> part_columns("withheld", "size")
    PartColumns(split='grouped', test_set='size', target_values='withheld')
    >>> part_columns("on:size_80dba", "size")
    PartColumns(split='grouped', test_set='size_80dba', target_values='training')
    >>> part_columns("sessions withheld", "size")
    PartColumns(split='session', test_set='size', target_values='withheld')
    >>> part_columns(placebo("placebo_plate", "session"), "plate")
    PartColumns(split='session', test_set='placebo_plate', target_values='placebo')
    """
    if part.startswith(_PLACEBO):
        split, _, name = part.removeprefix(_PLACEBO).partition(":")
        return PartColumns(split, name, PLACEBO_VALUES)
    if part.startswith(_ELSEWHERE):
        return PartColumns(GROUPED, part.removeprefix(_ELSEWHERE), TRAINING_VALUES)
    values = {
        WITHHELD: WITHHELD_VALUES,
        OVERALL: ALL_VALUES,
        SESSIONS_WITHHELD: WITHHELD_VALUES,
        SESSIONS_OVERALL: ALL_VALUES,
    }
    splits = {RANDOM: RANDOM, **dict.fromkeys(BY_SESSION, SESSION_SPLIT)}
    return PartColumns(splits.get(part, GROUPED), dataset, values.get(part, TRAINING_VALUES))
