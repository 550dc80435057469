"""Design of a recording: can a model recognise the placement or the session instead of the class?

Grasps of one placement share the pose of the object and the state of the granulate. If each class
was placed once per session, a score on held-out grasps also counts how well the model separates
placements. If there is one session, no score shows what a new session costs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

#: What to record if class and placement cannot be distinguished.
MORE_PLACEMENTS = "record the objects in rounds, or place each several times"
MORE_SESSIONS = "record another session, on another day if possible"


class Design(NamedTuple):
    """Numbers of sessions, placements and recordings.

    `placements` is computed in two steps: for each class, its largest number of placements in one
    session, then the smallest number of all classes. It is None if placements are unknown.
    `fewest_recordings` is the number of recordings of the class with the fewest.
    """

    sessions: int
    placements: int | None
    fewest_recordings: int

    @property
    def problem(self) -> str:
        """Return which effects cannot be distinguished, without a full stop; "" if none."""
        if self.fewest_recordings == 1:
            return "a class has one recording, so class and recording cannot be distinguished"
        if self.placements is None:
            return (
                "placements are unknown (no column placement_id), so a model may recognise the"
                " placement instead of the class"
            )
        if self.placements == 1:
            return (
                "each class has one placement per session, so a model may recognise the placement"
                " instead of the class"
            )
        if self.sessions == 1:
            return "all recordings are of one session, so no score shows the cost of a new session"
        return ""

    @property
    def fix(self) -> str:
        """Return what to record next; "" if there is no problem."""
        if not self.problem:
            return ""
        fixes = []
        if self.placements is None:
            fixes.append("add the column placement_id")
        if self.placements in (None, 1):
            fixes.append(MORE_PLACEMENTS)
        if self.sessions == 1:
            fixes.append(MORE_SESSIONS)
        return "; ".join(fixes)


def recording_design(
    values: Sequence[object], sessions: Sequence[str], placements: Sequence[str] | None
) -> Design:
    """Return the design of recordings from their target values, sessions and placements (n,).

    Names of placements are unique in their session. They are unknown if `placements` is None or has
    an empty name.

    >>> recording_design("aabb", ["1", "2"] * 2, ["p", "p", "q", "q"]).placements
    1
    """
    number = None
    if placements is not None and all(placements):
        distinct = set(zip(values, sessions, placements, strict=True))
        per_session = Counter((value, session) for value, session, _ in distinct)
        largest: Counter[object] = Counter()
        for (value, _), count in per_session.items():
            largest[value] = max(count, largest[value])
        number = min(largest.values())
    return Design(
        sessions=len(set(sessions)),
        placements=number,
        fewest_recordings=min(Counter(values).values()),
    )
