"""The sorting loop: approach, sense, decide, jam, lift, place; and a safe end from anywhere."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ajgdata.acquire.robot import UNNAMED, Placement, Robot
from ajgdata.acquire.virtual import Card
from ajgdata.live.control import Control
from ajgdata.live.decision import Action, judge
from ajgdata.live.drift import DriftWatch
from ajgdata.live.events import EventLog, shown_spectrum
from ajgdata.live.kept import KeptRun
from ajgdata.live.predictor import Prediction, Predictor
from ajgdata.live.run_state import RunState
from ajgdata.live.steps import Steps
from ajgdata.types.plan import NOTHING, SortPlan


class EndedByPerson(Exception):  # noqa: N818  # no error: somebody has had enough
    """The person who was asked ended the run instead."""


@dataclass(frozen=True)
class Outcome:
    """A run that ended by itself. `finished`: nothing was left to sort, or the person ended it;
    else an object was in doubt, as `reason` says. `mistakes` count where the truth is known."""

    sorts: int
    longest_row: int
    mistakes: int
    reason: str
    finished: bool


def arrivals(plan: SortPlan) -> Iterator[str]:
    """Yield the name of each object that comes; "" for ever where a plan does not say."""
    if plan.order == "random":
        generator = np.random.default_rng(plan.seed)
        while True:
            yield plan.objects[generator.integers(len(plan.objects))]
    yield from plan.objects
    while not plan.objects:
        yield ""


@dataclass
class Sorter:
    """Sorts by a plan, for which everything is open.

    `played` float32 (n,) is the excitation, `truth` gives the class of an object by its name.
    The robot may raise EndedByPerson. Every event is entered in `log`; `control` pauses and stops.
    """

    plan: SortPlan
    senses: Predictor
    card: Card
    played: NDArray[np.float32]
    robot: Robot
    kept: KeptRun
    log: EventLog
    control: Control = field(default_factory=Control)
    truth: Callable[[str], str] = str
    watch: DriftWatch | None = None
    _state: RunState = field(default_factory=RunState)
    _changed: bool = False
    _begun: float = 0.0

    def __post_init__(self) -> None:
        self._steps = Steps(self.robot, self.plan.wait_s, self.log, self.control)

    def run(self, coming: Iterable[str]) -> Outcome:
        """Sort what comes, in the main thread.

        Whatever else ends it, the robot halts, `stopped` says why and what is held, and the error
        goes on: CardError, RobotError, KeyboardInterrupt (Ctrl-C, `Control.stop`), SystemExit.
        """
        self._begun = time.monotonic()
        self.log.listen(self._state.add)
        self.control.begin()
        try:
            reason, finished = self._sort_all(coming)
            self.control.end()
            self._say_stopped(reason, finished=finished)
        except BaseException as error:
            ending = error  # worded only when nothing can come before the robot halts
            self._steps.halt(lambda: self._say_stopped(_why(ending)))
            raise
        state = self._state
        return Outcome(len(state.placed), state.rows[1], state.mistakes, reason, finished)

    def _sort_all(self, coming: Iterable[str]) -> tuple[str, bool]:
        every = self.plan.references.every if self.plan.references else 0
        try:
            for number, thing in enumerate(coming, start=1):
                if every and (number - 1) % every == 0:
                    self._refer(number)
                if doubt := self._sort(number, thing):
                    return doubt, False
                if len(self._state.placed) == self.plan.sorts:
                    return "all are sorted, as planned", True
        except EndedByPerson:
            with suppress(EndedByPerson):
                self._steps.let_go()
            return "ended by the person", True
        return "nothing is left to sort", True

    def _sort(self, number: int, thing: str) -> str:
        """Sort one object; return why the run is to stop, "" if it goes on."""
        known = "" if not thing else NOTHING if thing == NOTHING else self.truth(thing)
        self.log.say("grasp", number=number, object=known)
        looks: list[Prediction] = []
        while True:
            looks.append(self._look(number, len(looks) + 1, thing))
            begin = time.perf_counter()
            decision = judge(looks, self.plan)
            self.log.say("decision", seconds=time.perf_counter() - begin, **vars(decision))
            if decision.action in (Action.PLACE, Action.REJECT):
                value = decision.value if decision.action is Action.PLACE else ""
                self._steps.place(value, decision.bin)
                self.log.say("placed", value=value, bin=decision.bin, object=known)
                return ""
            self._steps.let_go()
            if decision.action is Action.WAIT:
                self._steps.wait()
                return ""
            if decision.action is Action.STOP:
                return decision.reason

    def _look(self, number: int, look: int, thing: str) -> Prediction:
        """Grasp, record and predict; what is recorded is kept before anything else happens."""
        empty = thing == NOTHING
        name = "" if empty else thing or UNNAMED
        place = Placement(f"sort_{number:04d}_{look}", name, number, self.plan.force_n)
        force = self._steps.grasp(place)
        begin = time.perf_counter()
        capture = self.card.take(self.played)
        seconds = time.perf_counter() - begin
        grasp = self.kept.look(number, look, thing, capture, force)
        where = {"recording": self.kept.name(grasp), "look": look}
        rate = self.card.settings.sample_rate_hz
        begin = time.perf_counter()
        prediction = self.senses.predict(capture.samples, rate)
        predicting = time.perf_counter() - begin
        feature = self.senses.feature(capture.samples, rate)
        self.log.say(
            "take", **where, seconds=seconds, peak_dbfs=capture.peak_dbfs,
            clipped=capture.clipped, xruns=capture.xruns, attempts=capture.attempts,
            spectrum=shown_spectrum(feature),
        )  # fmt: skip
        self.log.say("prediction", **where, seconds=predicting, **prediction.plain())
        self.kept.said(grasp, prediction)
        return prediction

    def _refer(self, number: int) -> None:
        """Record the empty gripper, and warn if it has changed."""
        self._steps.grasp(Placement(f"{NOTHING}_{number:04d}", "", number, self.plan.force_n))
        capture = self.card.take(self.played)
        grasp = self.kept.reference(number, capture)
        self._steps.let_go()
        rate = self.card.settings.sample_rate_hz
        feature = self.senses.feature(capture.samples, rate)
        self.senses = self.senses.with_references(feature[np.newaxis])
        ratio = self.watch.observe(feature) if self.watch else None
        self.log.say("reference", kind=NOTHING, recording=self.kept.name(grasp), drift=ratio)
        has_changed = ratio is not None and ratio > 1
        if has_changed and not self._changed:  # once, until the gripper is as it was
            text = (
                f"the gripper has changed: empty, it sounds {ratio:.2g} times as different as the "
                "alarm allows; check filling, membrane and temperature"
            )
            self.log.say("drift", text=text, ratio=ratio)
        self._changed = has_changed

    def _say_stopped(self, reason: str, *, finished: bool = False) -> None:
        seconds, held = time.monotonic() - self._begun, self._steps.held
        self.log.say(
            "stopped", reason=reason, held=held, sorts=len(self._state.placed),
            seconds=seconds, finished=finished,
        )  # fmt: skip


def _why(error: BaseException) -> str:
    if isinstance(error, KeyboardInterrupt):
        return "stopped by a person"
    if isinstance(error, SystemExit):
        return f"stopped by signal {int(error.code or 0) - 128}"
    return str(error) or type(error).__name__
