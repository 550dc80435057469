"""One line of changes.jsonl: a decision of a person about a recording."""

from __future__ import annotations

from typing import Literal, get_args

from pydantic import Field, model_validator

from ajgdata.types.base import Strict
from ajgdata.types.names import NAME_PATTERN
from ajgdata.types.session import QUALITIES, is_reserved

Action = Literal["ok", "reject", "label", "note", "undo"]
#: All actions, in the order of the help text.
ACTIONS: tuple[Action, ...] = get_args(Action)
OBJECT = "object"
#: Column of recordings.csv that a rejection changes.
QUALITY = "quality"
REJECT = "reject"


def is_changeable(column: str) -> bool:
    """Return whether people can change a column of recordings.csv: object, quality, or a label."""
    if column in (OBJECT, QUALITY):
        return True
    return NAME_PATTERN.fullmatch(column) is not None and not is_reserved(column)


class LabelChange(Strict):
    """A decision about one recording.

    `old` and `new` are cells of the column `column`, or empty. A note is in `new`. `undo` takes
    back the last change of the recording that counts; its `new` is the cell after it.
    """

    time: str = Field(min_length=1, description="UTC, e.g. 2026-01-31T12:00:00Z")
    recording_id: str = Field(min_length=1, description="recording_id in recordings.csv")
    sha256: str = Field(
        "", pattern=r"^([0-9a-f]{64})?$", description="sha256 of the recording in recordings.csv"
    )
    action: Action = Field(description="the decision")
    column: str = Field("", description="changed column of recordings.csv; empty for a note")
    old: str = Field("", description="cell before the change")
    new: str = Field("", description="cell after the change, or the text of a note")
    reason: str = Field("", description="reason of the change")
    author: str = Field("", description="name of the user")

    @model_validator(mode="after")
    def _can_be_applied(self) -> LabelChange:
        if self.column and not is_changeable(self.column):
            raise ValueError(f"{self.column!r} is not a label")
        if self.column == QUALITY and self.new not in QUALITIES:
            raise ValueError(f"quality {self.new!r} is not one of {', '.join(QUALITIES)}")
        return self

    @property
    def is_label(self) -> bool:
        """Whether the change gives a column of recordings.csv another value."""
        return bool(self.column) and self.new != self.old

    def __str__(self) -> str:
        """Return the change in words, e.g. `label by anna at 2026-01-31T12:00:00Z: object cube ->
        bar (misread)`."""
        who = f" by {self.author}" if self.author else ""
        reason = f" ({self.reason})" if self.reason else ""
        what = self.new
        if self.column:
            what = f"{self.column} {self.old!r} -> {self.new!r}"
        return f"{self.action}{who} at {self.time}: {what}{reason}"
