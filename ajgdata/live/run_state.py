"""The state of a live run, computed from its events, for pages that open at any time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from datetime import datetime
from typing import Any

from ajgdata.live.events import Event
from ajgdata.types.plan import NOTHING

#: Grasps and problems that a page lists.
GRASPS, PROBLEMS = 24, 3
#: True objects that are not one of the classes.
OTHERS = "others"
#: Decision of a run that was uncertain.
UNSURE = "unsure"


@dataclass
class Grasp:
    """One object in the gripper.

    `value` and `probability` (None for numbers) are those of the last decision, `action` its
    action. `truth` is the true class, "" if it is unknown.
    """

    number: int
    truth: str = ""
    began: str = ""
    looks: int = 0
    value: str | float | None = None
    probability: float | None = None
    verdict: str = ""
    action: str = ""
    bin: str = ""
    placed: bool = False

    @property
    def outcome(self) -> str:
        """The class that the run decided on its own, UNSURE, or "" while it is open."""
        if self.truth == NOTHING and not self.placed:
            return ""  # correct, and none of the classes
        if self.action == "stop" or (self.placed and self.action == "reject"):
            return UNSURE
        return str(self.value) if self.placed else ""

    @property
    def wrong(self) -> bool:
        """Whether the run put the object into the bin of another class than its own."""
        return self.outcome not in ("", UNSURE) and self.truth not in ("", self.value)


@dataclass
class RunState:
    """The state of a run after its events so far; see `add` and `plain`.

    `sort_s` is the mean time from grasp to bin; `spectra` are the means of the classes in the
    training data.
    """

    n: int = -1
    time: str = ""
    began: str = ""
    plan: Mapping[str, Any] = field(default_factory=dict)
    spectra: Mapping[str, list[float]] = field(default_factory=dict)
    top_hz: float | None = None
    step: str = ""
    take: Event | None = None
    prediction: Event | None = None
    decision: Event | None = None
    grasps: list[Grasp] = field(default_factory=list)
    sort_s: float | None = None
    retakes: int = 0
    xruns: int = 0
    drift: Mapping[str, Any] | None = None
    paused: str | None = None
    problems: list[str] = field(default_factory=list)
    stopped: Event | None = None

    @property
    def placed(self) -> list[Grasp]:
        """Grasps whose object is in a bin."""
        return [grasp for grasp in self.grasps if grasp.placed]

    @property
    def mistakes(self) -> int:
        """Number of objects that the run put into a wrong bin."""
        return sum(grasp.wrong for grasp in self.grasps)

    @property
    def rows(self) -> tuple[int, int]:
        """Objects sorted in a row now, and at most: without help and without a known mistake."""
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
    def confusion(self) -> dict[str, dict[str, int]]:
        """Number of decisions by truth and outcome, if both are known."""
        classes = self.plan.get("classes", ())
        counts: dict[str, Counter[str]] = {}
        for grasp in self.grasps:
            if grasp.truth and grasp.outcome:
                truth = grasp.truth if grasp.truth in classes else OTHERS
                counts.setdefault(truth, Counter())[grasp.outcome] += 1
        return {truth: dict(row) for truth, row in counts.items()}

    @property
    def seconds(self) -> float:
        """Time from the first event to the last one."""
        return _between(self.began, self.time)

    def plain(self) -> dict[str, Any]:
        """Return the state as JSON represents it, with the last grasps only."""
        shown = [{**asdict(grasp), "outcome": grasp.outcome} for grasp in self.grasps[-GRASPS:]]
        row, longest = self.rows
        return vars(self) | {
            "grasps": shown,
            "sorts": len(self.placed),
            "in_a_row": row,
            "longest": longest,
            "problems": list(self.problems),
            "bins": self.bins,
            "confusion": self.confusion,
            "seconds": self.seconds,
        }

    def add(self, event: Event) -> None:
        """Update the state by one event. Missing keys stay unknown."""
        handle = getattr(self, f"_{event['event']}", None)
        if handle is not None:
            handle(event)
        self.n, self.time = event["n"], event["time"]
        self.began = self.began or self.time

    def _start(self, event: Event) -> None:
        self.plan = {key: value for key, value in event.items() if key not in ("spectra", "top_hz")}
        self.spectra, self.top_hz = event.get("spectra") or {}, event.get("top_hz")

    def _grasp(self, event: Event) -> None:
        self.grasps.append(Grasp(event["number"], event.get("object", ""), event["time"]))
        self.take = self.prediction = self.decision = None

    def _step(self, event: Event) -> None:
        self.step = event["step"]

    def _take(self, event: Event) -> None:
        self.step, self.take = "sense", event
        self.retakes += max(0, event.get("attempts", 1) - 1)
        self.xruns += event.get("xruns", 0)

    def _prediction(self, event: Event) -> None:
        self.prediction, self.decision = event, None
        self._update_grasp(
            value=event.get("value"),
            verdict=event.get("verdict", ""),
            probability=max((event.get("probability") or {}).values(), default=None),
            looks=event.get("look", 1),
        )

    def _decision(self, event: Event) -> None:
        self.decision = event
        values = {"action": event["action"], "bin": event.get("bin") or ""}
        if event.get("probability"):
            values["probability"] = max(event["probability"].values())
        if event.get("value"):
            values["value"] = event["value"]
        self._update_grasp(**values)

    def _placed(self, event: Event) -> None:
        if self.grasps:
            grasp = self.grasps[-1]
            self._update_grasp(placed=True, bin=event.get("bin") or "")
            seconds, mean = _between(grasp.began, event["time"]), self.sort_s or 0.0
            self.sort_s = mean + (seconds - mean) / len(self.placed)

    def _reference(self, event: Event) -> None:
        ratio = event.get("drift")
        if ratio is not None:
            text = self.drift["text"] if self.drift and ratio > 1 else ""
            self.drift = {"text": text, "ratio": ratio}

    def _drift(self, event: Event) -> None:
        self.drift = {"text": event.get("text", ""), "ratio": event.get("ratio")}

    def _paused(self, event: Event) -> None:
        self.paused = event.get("reason", "")

    def _resumed(self, event: Event) -> None:
        self.paused = None

    def _stopped(self, event: Event) -> None:
        self.stopped, self.paused, self.step = event, None, ""

    def _problem(self, event: Event) -> None:
        self.problems = [*self.problems, str(event.get("text", ""))][-PROBLEMS:]

    def _update_grasp(self, **values: Any) -> None:
        if self.grasps:
            vars(self.grasps[-1]).update(values)


def _between(began: str, ended: str) -> float:
    """Return the seconds between two ISO 8601 times; 0 if one is unknown or the clock was set
    back."""
    if not (began and ended):
        return 0.0
    span = datetime.fromisoformat(ended) - datetime.fromisoformat(began)
    return max(0.0, round(span.total_seconds(), 3))
