"""Numbers of recordings with issues, as `ajgdata check`, the run and the report print them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from ajgdata.types.base import ISSUE_LEVELS, WHOLE, Finding, many

#: Code of the issue of a grasp that was not recorded.
_NO_RECORDING = "skipped"


@dataclass(frozen=True)
class IssueCounts:
    """Numbers of recordings whose worst issue is an error, a warning or a note."""

    errors: int = 0
    warnings: int = 0
    notes: int = 0

    def __add__(self, other: IssueCounts) -> IssueCounts:
        """Return the counts of two data sets together."""
        return IssueCounts(
            self.errors + other.errors, self.warnings + other.warnings, self.notes + other.notes
        )

    def __bool__(self) -> bool:
        """Return True if a recording has an issue."""
        return self != IssueCounts()

    def __str__(self) -> str:
        """Return the counts with nouns, e.g. `1 error, 0 warnings, 60 notes`."""
        counts = (
            many(self.errors, "error"),
            many(self.warnings, "warning"),
            many(self.notes, "note"),
        )
        return ", ".join(counts)


def issue_counts(issues: Iterable[Finding]) -> IssueCounts:
    """Count the recordings of one data set by their worst issue, each recording once.

    Issues of whole sessions and of the data set are not counted.
    """
    worst_ranks: dict[tuple[str, str], int] = {}  # by session_id and recording_id
    for issue in issues:
        if issue.recording_id == WHOLE or issue.code == _NO_RECORDING:
            continue
        recording = (issue.session_id, issue.recording_id)
        rank = ISSUE_LEVELS.index(issue.level)
        worst_ranks[recording] = min(rank, worst_ranks.get(recording, rank))
    levels = Counter(ISSUE_LEVELS[rank] for rank in worst_ranks.values())
    return IssueCounts(errors=levels["error"], warnings=levels["warning"], notes=levels["note"])
