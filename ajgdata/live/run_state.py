"""The state of a live run, folded from its events: what a page shows, also one opened in mid-run.

`advanced` is a pure function, state and event to state. A state is as small after a million events
as after a hundred: a plan, one grasp in detail, the last `GRASPS`, counts.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from ajgdata.live.events import Event
from ajgdata.types.plan import NOTHING

#: Grasps that are told one by one.
GRASPS = 24
#: Problems that are told; names that are counted apart, the rest is `OTHERS` together.
PROBLEMS, NAMES, OTHERS = 3, 40, "others"
#: In the column of what was decided: nothing was sure enough, or a person had to say it.
UNSURE = "unsure"
_PLAN = (
    "dataset", "task", "model", "unit", "classes", "threshold", "bins", "looks", "device", "robot",
    "session", "source", "replay",
)  # fmt: skip
_TAKE = ("recording", "look", "seconds", "peak_dbfs", "clipped", "xruns", "attempts", "spectrum")
_PREDICTION = (
    "look", "seconds", "kind", "value", "unit", "verdict", "novelty", "probability", "interval",
    "remarks", "detection_rate",
)  # fmt: skip
_DECISION = ("action", "value", "bin", "probability", "looks", "reason")


@dataclass(frozen=True)
class Grasp:
    """One object in the gripper, and what became of it.

    `value` and `probability` (None for numbers) are what the model says at last, `action` what was
    decided last; `placed`: it lies in `bin`. `truth` is what the object is, "" if nobody knows;
    `asked`: a person had to say it.
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
    asked: bool = False

    @property
    def outcome(self) -> str:
        """Return the class that the run decided by itself, UNSURE, or "" while it is open."""
        if self.truth == NOTHING and not self.placed:
            return ""  # right, and none of the classes
        if self.action == "stop" or (self.placed and (self.asked or self.action == "reject")):
            return UNSURE
        return str(self.value) if self.placed else ""


@dataclass(frozen=True)
class RunState:
    """What is known of a run after event number `n`; see `plain`.

    `sort_s` is the mean time of a sort, from grasp to bin; `confusion` counts the decisions by
    truth, where that is known; `spectra` are means by class, of `training` or of this run.
    """

    n: int = -1
    time: str = ""
    began: str = ""
    plan: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    step: str = ""
    take: Mapping[str, Any] | None = None
    prediction: Mapping[str, Any] | None = None
    decision: Mapping[str, Any] | None = None
    grasps: tuple[Grasp, ...] = ()
    bins: Mapping[str, int] = dataclasses.field(default_factory=dict)
    confusion: Mapping[str, Mapping[str, int]] = dataclasses.field(default_factory=dict)
    sorts: int = 0
    in_a_row: int = 0
    longest: int = 0
    sort_s: float | None = None
    takes: int = 0
    retakes: int = 0
    xruns: int = 0
    spectra: Mapping[str, list[float]] = dataclasses.field(default_factory=dict)
    spectra_of: str = ""
    averaged: Mapping[str, int] = dataclasses.field(default_factory=dict)
    top_hz: float | None = None
    drift: Mapping[str, Any] | None = None
    paused: str | None = None
    problems: tuple[str, ...] = ()
    stopped: Mapping[str, Any] | None = None

    @property
    def seconds(self) -> float:
        """Return the time from the run's first event to its last."""
        return _between(self.began, self.time)

    def plain(self) -> dict[str, Any]:
        """Return it as JSON can hold it."""
        found = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        del found["averaged"]
        found["grasps"] = [
            {**dataclasses.asdict(one), "outcome": one.outcome} for one in self.grasps
        ]
        return {**found, "seconds": self.seconds}


def folded(events: Iterable[Event]) -> RunState:
    """Return the state of a run after `events`."""
    state = RunState()
    for event in events:
        state = advanced(state, event)
    return state


def advanced(state: RunState, event: Event) -> RunState:
    """Return the state after one more event. What an event lacks stays unknown."""
    kind = event["event"]
    if kind == "start":  # a log that goes on with another run begins anew
        state = RunState()
    changed = _CHANGES[kind](state, event) if kind in _CHANGES else {}
    began = state.began or event["time"]
    return dataclasses.replace(
        state, **{"n": event["n"], "time": event["time"], "began": began} | changed
    )


def _start(state: RunState, event: Event) -> dict[str, Any]:
    spectra = event.get("spectra") or {}
    return {
        "plan": _some(event, _PLAN),
        "spectra": spectra,
        "spectra_of": "training" if spectra else "",
        "top_hz": event.get("top_hz"),
    }


def _grasp(state: RunState, event: Event) -> dict[str, Any]:
    begun = Grasp(event["number"], event.get("object", ""), event["time"])
    kept = (*state.grasps, begun)[-GRASPS:]
    return {"grasps": kept, "take": None, "prediction": None, "decision": None}


def _step(state: RunState, event: Event) -> dict[str, Any]:
    return {"step": event["step"]}


def _take(state: RunState, event: Event) -> dict[str, Any]:
    return {
        "step": "sense",
        "take": _some(event, _TAKE),
        "takes": state.takes + 1,
        "retakes": state.retakes + max(0, event.get("attempts", 1) - 1),
        "xruns": state.xruns + event.get("xruns", 0),
    }


def _prediction(state: RunState, event: Event) -> dict[str, Any]:
    told = _some(event, _PREDICTION)
    probability = told.get("probability") or {}
    looks = told.get("look", 1)
    about = {
        "value": told.get("value"),
        "verdict": told.get("verdict", ""),
        "probability": max(probability.values(), default=None),
        "looks": looks,
    }
    return {"prediction": told, "decision": None, "grasps": _last(state, **about)}


def _decision(state: RunState, event: Event) -> dict[str, Any]:
    told = _some(event, _DECISION)
    combined = told.get("probability")
    sure = max(combined.values(), default=None) if isinstance(combined, Mapping) else combined
    about: dict[str, Any] = {"action": told["action"], "bin": told.get("bin") or ""}
    if sure is not None:
        about["probability"] = sure
    if told.get("value"):
        about["value"] = told["value"]
    if told["action"] == "ask":
        about["asked"] = True
    return {"decision": told, **_counted_again(state, _last(state, **about))}


def _placed(state: RunState, event: Event) -> dict[str, Any]:
    sorts, seconds = state.sorts + 1, state.sort_s
    about: dict[str, Any] = {"placed": True, "bin": event.get("bin") or ""}
    if state.grasps:
        last = _between(state.grasps[-1].began, event["time"])
        seconds = last if seconds is None else seconds + (last - seconds) / sorts
        about["truth"] = event.get("object") or state.grasps[-1].truth
    row = event.get("in_a_row", 0)
    return {
        "sorts": sorts,
        "sort_s": seconds,
        "in_a_row": row,
        "longest": max(row, state.longest),
        "bins": _plus(state.bins, about["bin"]),
        **_heard(state, about.get("truth") or str(event.get("value", ""))),
        **_counted_again(state, _last(state, **about)),
    }


def _truth(state: RunState, event: Event) -> dict[str, Any]:
    number, truth = event["number"], event.get("object", "")
    corrected = tuple(
        dataclasses.replace(one, truth=truth) if one.number == number else one
        for one in state.grasps
    )
    counted = _counted_again(state, corrected)
    placed = [one for one in corrected if one.placed]
    if placed and placed[-1].number == number and placed[-1].value != truth:
        counted["in_a_row"] = 0
    return counted


def _reference(state: RunState, event: Event) -> dict[str, Any]:
    ratio = event.get("drift")
    if ratio is None:
        return {}
    text = state.drift["text"] if state.drift and ratio > 1 else ""  # below the alarm it is over
    return {"drift": {"text": text, "ratio": ratio}}


def _drift(state: RunState, event: Event) -> dict[str, Any]:
    return {"drift": {"text": event.get("text", ""), "ratio": event.get("ratio")}}


def _paused(state: RunState, event: Event) -> dict[str, Any]:
    return {"paused": event.get("reason", "")}


def _resumed(state: RunState, event: Event) -> dict[str, Any]:
    return {"paused": None}


def _stopped(state: RunState, event: Event) -> dict[str, Any]:
    told = _some(event, ("reason", "held", "sorts", "seconds", "finished"))
    return {"stopped": told, "paused": None, "step": ""}


def _problem(state: RunState, event: Event) -> dict[str, Any]:
    return {"problems": (*state.problems, str(event.get("text", "")))[-PROBLEMS:]}


_CHANGES: dict[str, Callable[[RunState, Event], dict[str, Any]]] = {
    "start": _start, "grasp": _grasp, "step": _step, "take": _take, "prediction": _prediction,
    "decision": _decision, "placed": _placed, "truth": _truth, "reference": _reference,
    "drift": _drift, "paused": _paused, "resumed": _resumed, "stopped": _stopped,
    "problem": _problem,
}  # fmt: skip


def _some(event: Event, names: Iterable[str]) -> dict[str, Any]:
    return {name: event[name] for name in names if name in event}


def _between(began: str, ended: str) -> float:
    """Return the seconds between two times in ISO 8601; 0 if one of them is not known, or if the
    clock was set back."""
    if not (began and ended):
        return 0.0
    span = datetime.fromisoformat(ended) - datetime.fromisoformat(began)
    return max(0.0, round(span.total_seconds(), 3))


def _last(state: RunState, **about: Any) -> tuple[Grasp, ...]:
    """Return the grasps, the last of them with what is known `about` it."""
    if not state.grasps:
        return ()
    return (*state.grasps[:-1], dataclasses.replace(state.grasps[-1], **about))


def _plus(counts: Mapping[str, int], name: str, more: int = 1) -> dict[str, int]:
    """Return counts with `more` of `name`; names beyond `NAMES` are counted as `OTHERS`."""
    if name not in counts and len(counts) >= NAMES:
        name = OTHERS
    found = {**counts, name: counts.get(name, 0) + more}
    return {key: count for key, count in found.items() if count}


def _counted_again(state: RunState, grasps: tuple[Grasp, ...]) -> dict[str, Any]:
    """Return `grasps` and the confusion after those that differ from the state's were exchanged."""
    confusion, classes = dict(state.confusion), state.plan.get("classes", ())
    for old, new in zip(state.grasps, grasps, strict=True):
        for one, more in ((old, -1), (new, 1)):
            if old != new and one.truth and one.outcome:
                row = one.truth if one.truth in classes else OTHERS
                column = one.outcome if one.outcome in (*classes, UNSURE) else OTHERS
                confusion[row] = _plus(confusion.get(row, {}), column, more)
    return {"grasps": grasps, "confusion": {name: row for name, row in confusion.items() if row}}


def _heard(state: RunState, name: str) -> dict[str, Any]:
    """Return the class means of this run with the last take, unless those of training are known."""
    spectrum = (state.take or {}).get("spectrum")
    if state.spectra_of == "training" or not spectrum or not name:
        return {}
    if name not in state.spectra and len(state.spectra) >= NAMES:
        return {}
    count = state.averaged.get(name, 0) + 1
    before = state.spectra.get(name, spectrum)
    mean = [old + (new - old) / count for old, new in zip(before, spectrum, strict=True)]
    return {
        "spectra": {**state.spectra, name: mean},
        "spectra_of": "run",
        "averaged": {**state.averaged, name: count},
    }
