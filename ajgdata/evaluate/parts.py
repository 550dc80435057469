"""Parts of an evaluation: a split, and the recordings that a model is tested on.

The name of a part is a text, so that it can be a value in a table. The columns of the table of
results have its split, its test set and its target values (see `part_columns`).
"""

from __future__ import annotations

from typing import NamedTuple

#: Test parts of folds that keep the groups of the task together.
GROUPED = "grouped"
#: Test parts of folds that ignore groups.
RANDOM = "random"
#: Recordings with withheld values, on which no fold is trained.
WITHHELD = "withheld"
#: Recordings with training values and with withheld values together.
OVERALL = "overall"
#: Parts GROUPED, WITHHELD and OVERALL with sessions held out instead of the groups of the task.
SESSIONS = "sessions"
SESSIONS_WITHHELD = "sessions withheld"
SESSIONS_OVERALL = "sessions overall"
#: Split of these three parts.
SESSION_SPLIT = "session"
#: Target values of the test recordings.
TRAINING_VALUES = "training"
WITHHELD_VALUES = "withheld"
ALL_VALUES = "all"
#: Class names of a placebo: one object under several names.
PLACEBO_VALUES = "placebo"
#: Beginnings of the names of parts of another data set, and of a placebo.
_ELSEWHERE = "on:"
_PLACEBO = "placebo "


class ValueParts(NamedTuple):
    """Parts of one split: training values, withheld values, and both together."""

    training: str
    withheld: str
    overall: str


BY_GROUP = ValueParts(GROUPED, WITHHELD, OVERALL)
BY_SESSION = ValueParts(SESSIONS, SESSIONS_WITHHELD, SESSIONS_OVERALL)
#: Parts with held-out sessions, by the part with held-out groups.
IN_SESSIONS = dict(zip(BY_GROUP, BY_SESSION, strict=True))


class PartColumns(NamedTuple):
    """Cells of a row of the table of results that identify a part."""

    split: str
    test_set: str
    target_values: str


def elsewhere(dataset: str) -> str:
    """Return the name of the part that tests the recordings of another data set."""
    return f"{_ELSEWHERE}{dataset}"


def placebo(dataset: str, split: str = GROUPED) -> str:
    """Return the name of the part that tests the placebo of a data set.

    `split` is GROUPED, RANDOM or SESSION_SPLIT.
    """
    return f"{_PLACEBO}{split}:{dataset}"


def part_columns(part: str, dataset: str) -> PartColumns:
    """Return the cells of a part. `dataset` is the data set of the task.

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
