"""Events of a live run: their log, and the state of the run that follows from them.

The log has one JSON object per line. `n` counts from 0, `time` is ISO 8601 in UTC, `event` is the
name of the event, and the other keys depend on this name.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal, Self

from ajgdata.types.protocol import NOTHING

#: Events, and the keys of each:
#: start: dataset task model classes threshold bins device robot session; for the dashboard
#:        also source ("simulated", "recorded"); for the terminal also novelty (why no prediction
#:        is called known, "" if some are)
#: grasp: number object ("" if it is unknown)
#: step: step seconds                      (loosen approach wait jam lift place release halt)
#: take: recording seconds peak_dbfs clipped xruns attempts
#: prediction: recording seconds and the keys of `Prediction.plain`
#: decision: action (place wait reject stop) value bin reason seconds
#: placed: value bin object ("" if it is unknown)
#: reference: kind (empty) recording verdict (nothing, if the model recognises the empty gripper)
#: drift: text                             (the gripper has changed)
#: stopped: reason held ("" for nothing) sorts seconds finished (as planned)
#: problem: text                           (one line, with what to do)
EventName = Literal[
    "start",
    "grasp",
    "step",
    "take",
    "prediction",
    "decision",
    "placed",
    "reference",
    "drift",
    "stopped",
    "problem",
]
Event = Mapping[str, Any]
Listener = Callable[[Event], object]
#: Grasps and problems that a page lists.
MAX_LISTED_GRASPS = 24
MAX_LISTED_PROBLEMS = 3
#: Decision of a run that was uncertain.
UNSURE = "unsure"


class EventLog:
    """Writes each event to a file, then passes it to the listeners."""

    def __init__(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self.path = path
        self._file = path.open("ab")
        self._listeners: list[Listener] = []
        self._count = 0

    def listen(self, listener: Listener) -> None:
        """Call `listener` with each event from now on, in order."""
        self._listeners.append(listener)

    def say(self, event: EventName, **about: Any) -> None:
        """Write an event; raises ValueError for values that JSON cannot represent, such as NaN.

        Raises OSError if a listener does (its terminal was closed), after all were called.
        """
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        entry = {"n": self._count, "time": now, "event": event, **about}
        line = json.dumps(entry, allow_nan=False).encode() + b"\n"
        self._count += 1  # before writing: an interruption cannot give two events one number
        self._file.write(line)
        self._file.flush()
        listener_error = None
        for listener in self._listeners:
            try:
                listener(entry)
            except OSError as error:
                listener_error = error
        if listener_error is not None:
            raise listener_error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        """Write the whole log to the disk."""
        self._file.flush()
        os.fsync(self._file.fileno())
        self._file.close()


@dataclass
class GraspState:
    """One object in the gripper.

    `value` and `probability` (None for numbers) are those of the prediction, `action` is that of
    the decision. `truth` is the true class, "" if it is unknown.
    """

    number: int
    truth: str = ""
    value: str | float | None = None
    probability: float | None = None
    action: str = ""
    bin: str = ""
    placed: bool = False

    @property
    def outcome(self) -> str:
        """The class on which the run decided, UNSURE, or "" before the decision."""
        if self.truth == NOTHING and not self.placed:
            return ""  # the empty gripper was recognised: no class was decided
        if self.action == "stop" or (self.placed and self.action == "reject"):
            return UNSURE
        return str(self.value) if self.placed else ""

    @property
    def wrong(self) -> bool:
        """Whether the run put the object into the bin of another class than its own."""
        return self.outcome not in ("", UNSURE) and self.truth not in ("", self.value)


@dataclass
class RunState:
    """The state of a run after its events so far; see `add` and `plain`."""

    n: int = -1
    time: str = ""
    began: str = ""
    plan: Event = field(default_factory=dict)
    step: str = ""
    take: Event | None = None
    prediction: Event | None = None
    decision: Event | None = None
    grasps: list[GraspState] = field(default_factory=list)
    drift: str = ""  #: warning of the last reference
    problems: list[str] = field(default_factory=list)
    stopped: Event | None = None

    @property
    def placed(self) -> list[GraspState]:
        """Grasps whose object is in a bin."""
        return [grasp for grasp in self.grasps if grasp.placed]

    @property
    def mistakes(self) -> int:
        """Number of objects that the run put into a wrong bin."""
        return sum(grasp.wrong for grasp in self.grasps)

    @property
    def rows(self) -> tuple[int, int]:
        """Number of objects sorted in a row now, and the largest number of the run.

        A row ends at a decision that was uncertain, and at an object in a wrong bin.
        """
        row = longest = 0
        for grasp in self.placed:
            row = 0 if grasp.outcome == UNSURE or grasp.wrong else row + 1
            longest = max(longest, row)
        return row, longest

    @property
    def bins(self) -> dict[str, int]:
        """Number of objects per bin."""
        return dict(Counter(grasp.bin for grasp in self.placed))

    @property
    def seconds(self) -> float:
        """Time from the first event to the last one; 0 if the clock was set back."""
        if not self.began:
            return 0.0
        span = datetime.fromisoformat(self.time) - datetime.fromisoformat(self.began)
        return max(0.0, round(span.total_seconds(), 3))

    def plain(self) -> dict[str, Any]:
        """Return the state as JSON represents it, with the last grasps only."""
        shown = [
            {**asdict(grasp), "outcome": grasp.outcome}
            for grasp in self.grasps[-MAX_LISTED_GRASPS:]
        ]
        row, longest = self.rows
        return vars(self) | {
            "grasps": shown,
            "sorts": len(self.placed),
            "mistakes": self.mistakes,
            "in_a_row": row,
            "longest": longest,
            "bins": self.bins,
            "seconds": self.seconds,
        }

    def add(self, event: Event) -> None:
        """Update the state by one event."""
        match event["event"]:
            case "start":
                self.plan = event
            case "step":
                self.step = event["step"]
            case "take":
                self.step = "sense"
                self.take = event
            case "reference":
                self.drift = ""
            case "drift":
                self.drift = event["text"]
            case "stopped":
                self.stopped = event
                self.step = ""
            case "problem":
                self.problems = [*self.problems, event["text"]][-MAX_LISTED_PROBLEMS:]
            case "grasp" | "prediction" | "decision" | "placed":
                self._add_to_grasp(event)
        self.n = event["n"]
        self.time = event["time"]
        if not self.began:
            self.began = self.time

    def _add_to_grasp(self, event: Event) -> None:
        """Update the last grasp by an event, or begin the next grasp."""
        if event["event"] == "grasp":
            self.grasps.append(GraspState(event["number"], event["object"]))
            self.take = self.prediction = self.decision = None
            return
        grasp = self.grasps[-1]
        match event["event"]:
            case "prediction":
                self.prediction = event
                grasp.value = event["value"]
                grasp.probability = max(event["probability"].values(), default=None)
            case "decision":
                self.decision = event
                grasp.action = event["action"]
            case "placed":
                grasp.placed = True
                grasp.bin = event["bin"]
