"""The sorting loop: approach, sense, decide, jam, lift, place. It ends safely at any step."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from ajgdata.acquire.card import Capture, Sound
from ajgdata.acquire.live_session import REJECTED, LiveSession
from ajgdata.acquire.protocol import PlannedGrasp
from ajgdata.acquire.robot import UNNAMED, Robot, RobotGrasp
from ajgdata.acquire.robot_numbers import number_labels
from ajgdata.acquire.virtual import Card
from ajgdata.evaluate.sorting import decide
from ajgdata.live.events import EventLog, RunState
from ajgdata.live.predictor import NoveltyVerdict, Prediction, Predictor
from ajgdata.live.steps import Control, Steps
from ajgdata.types.protocol import NOTHING, SortPlan

#: Columns of recordings.csv in addition to those of acquisition.
SORT_COLUMN = "sort"
PREDICTED_COLUMN = "predicted"
CONFIDENCE_COLUMN = "confidence"
VERDICT_COLUMN = "verdict"
#: Warning if the model does not recognise the empty gripper.
CHANGED = (
    "the gripper has changed: the model no longer recognises it as empty; check filling, membrane "
    "and temperature"
)


class EndedByPerson(Exception):  # noqa: N818  # a decision of a person, not an error
    """A person ended the run at a prompt."""


def arrivals(plan: SortPlan) -> Iterator[str]:
    """Yield the name of each object in the order of arrival.

    A plan without objects yields "" without end.
    """
    if plan.order == "random":
        generator = np.random.default_rng(plan.seed)
        while True:
            yield plan.objects[generator.integers(len(plan.objects))]
    yield from plan.objects
    while not plan.objects:
        yield ""


class Action(StrEnum):
    """Action after a decision."""

    PLACE = "place"
    WAIT = "wait"  #: the gripper is empty: grasp again later
    REJECT = "reject"
    STOP = "stop"


@dataclass(frozen=True)
class SortingDecision:
    """A decision with its reason.

    `value` is the most probable class ("" if the recording is not of a known class). `bin` is the
    bin of the object ("" unless it is placed or rejected).
    """

    action: Action
    value: str
    bin: str
    reason: str


def judge(prediction: Prediction, plan: SortPlan) -> SortingDecision:
    """Return the decision on a recorded object."""
    if prediction.verdict is NoveltyVerdict.NOTHING:
        return SortingDecision(Action(plan.nothing), "", "", "nothing held")
    if prediction.verdict is NoveltyVerdict.UNKNOWN:
        reason = f"novel object: novelty {prediction.novelty:.2f}, limit 1"
        return _not_placed(Action(plan.unknown), "", plan, reason)
    best = str(prediction.value)
    probability = np.array(list(prediction.probability.values()))
    share = percent(float(probability.max()))
    if decide(probability, plan.threshold) is None:
        reason = f"{best} has {share}, needs {percent(plan.threshold)}"
        return _not_placed(Action(plan.below), best, plan, reason)
    note = ""
    if prediction.verdict is NoveltyVerdict.NOT_CHECKED:
        note = ", novelty not checked"
    elif prediction.verdict is NoveltyVerdict.NO_SIGN:
        note = f", no sign of a novel object ({detection_text(prediction)})"
    return SortingDecision(Action.PLACE, best, plan.bins[best], f"{best}, {share}{note}")


def _not_placed(action: Action, value: str, plan: SortPlan, reason: str) -> SortingDecision:
    """Return the decision on an object that is not put into the bin of a class."""
    reject_bin = ""
    if action is Action.REJECT:
        reject_bin = plan.reject_bin or ""
    return SortingDecision(action, value, reject_bin, reason)


def percent(share: float) -> str:
    """Return a share in per cent, rounded down: only the whole is 100 %."""
    return f"{min(np.floor(1000 * share) / 10, 100):g} %"


def detection_text(prediction: Prediction) -> str:
    """Return the share of novel objects that the check of a prediction detects, as a clause."""
    rate = prediction.detection_rate
    if rate is None:
        return "the detection rate of this check is not measured"
    return f"this check detects {percent(rate)} of novel objects"


@dataclass
class Sorter:
    """A run that sorts by a plan. Sound card, robot, session and log are open.

    `played` is the excitation, float32 (n,), or passive recording. `labels` returns the targets of
    an object by its name, and `target` is the target that decides the bin. The robot may raise
    EndedByPerson. Recordings are stored in `session`, events in `log`; `control` stops the run.
    `recordings` is the number of stored recordings.
    """

    plan: SortPlan
    senses: Predictor
    card: Card
    played: Sound
    robot: Robot
    session: LiveSession
    log: EventLog
    target: str
    labels: Callable[[str], Mapping[str, float | str]]
    control: Control = field(default_factory=Control)
    recordings: int = 0
    #: The model before this run, or with the first reference; later references are compared with it
    _before: Predictor | None = None
    _state: RunState = field(default_factory=RunState)
    _begun: float = 0.0

    def __post_init__(self) -> None:
        self._steps = Steps(self.robot, self.plan.wait_s, self.log, self.control)

    @property
    def _played_samples(self) -> np.ndarray | None:
        """The samples of the played sound; None if nothing is played."""
        return self.played if isinstance(self.played, np.ndarray) else None

    def run(self) -> RunState:
        """Sort the arriving objects in the main thread; return the state at the end.

        If an error ends the run, the robot halts, the event `stopped` has the reason and the held
        object, and the error propagates: CardError, RobotError, KeyboardInterrupt (Ctrl-C,
        `Control.stop`), SystemExit.
        """
        self._begun = time.monotonic()
        self.log.listen(self._state.add)
        self._say_start()
        try:
            self.control.begin()
            reason, finished = self._sort_all(arrivals(self.plan))
            self.control.end()
            self._say_stopped(reason, finished=finished)
        except BaseException as error:
            ending = error  # the robot halts before the text of the error is made
            self._steps.halt(lambda: self._say_stopped(_why(ending)))
            raise
        return self._state

    def _sort_all(self, coming: Iterable[str]) -> tuple[str, bool]:
        """Return the reason of the end, and whether the run finished.

        A run has finished if no object is left, or if a person ended it. It has not finished if a
        decision stopped it.
        """
        every = self.plan.references.every if self.plan.references else 0
        try:
            for number, name in enumerate(coming, start=1):
                if every and (number - 1) % every == 0:
                    self._record_reference(number)
                reason_to_stop = self._sort(number, name)
                if reason_to_stop:
                    return reason_to_stop, False
                if len(self._state.placed) == self.plan.sorts:
                    return f"{self.plan.sorts} objects are sorted, as planned", True
        except EndedByPerson:
            with suppress(EndedByPerson):
                self._steps.let_go()
            return "ended at the terminal", True
        return "no object is left", True

    def _sort(self, number: int, name: str) -> str:
        """Sort one object; return the reason to stop, "" if the run continues."""
        known = name
        if name != NOTHING:
            known = str(self.labels(name).get(self.target, name))
        self.log.say("grasp", number=number, object=known)
        prediction = self._sense(number, name)
        begin = time.perf_counter()
        decision = judge(prediction, self.plan)
        self.log.say("decision", seconds=time.perf_counter() - begin, **vars(decision))
        if decision.action in (Action.PLACE, Action.REJECT):
            value = decision.value if decision.action is Action.PLACE else ""
            self._steps.place(value, decision.bin)
            self.log.say("placed", value=value, bin=decision.bin, object=known)
            return ""
        self._steps.let_go()
        if decision.action is Action.STOP:
            return decision.reason
        self._steps.wait()
        return ""

    def _sense(self, number: int, name: str) -> Prediction:
        """Grasp, record and predict. The recording is stored before it is predicted."""
        if name == NOTHING:
            held = touched = ""
            reference = NOTHING
        else:
            held = name
            touched = name or UNNAMED
            reference = ""
        targets = self.labels(held) if held else {}
        grasp = PlannedGrasp(f"sort_{number:04d}", held, number, 1, targets, reference)
        measured = self._steps.grasp(RobotGrasp(grasp.name, touched, number, self.plan.force_n))
        begin = time.perf_counter()
        capture = self.card.take(self.played)
        recording_s = time.perf_counter() - begin
        labels = {
            PREDICTED_COLUMN: "",
            CONFIDENCE_COLUMN: "",
            VERDICT_COLUMN: "",
            SORT_COLUMN: str(number),
            **number_labels(measured),
        }
        recording = self._store(grasp, capture, labels, known=bool(name))
        begin = time.perf_counter()
        rate_hz = self.card.settings.sample_rate_hz
        prediction = self.senses.predict(capture.samples, rate_hz, self._played_samples)
        predicting_s = time.perf_counter() - begin
        self.log.say(
            "take",
            recording=recording,
            seconds=recording_s,
            peak_dbfs=capture.peak_dbfs,
            clipped=capture.clipped,
            xruns=capture.xruns,
            attempts=capture.attempts,
        )
        self.log.say("prediction", recording=recording, seconds=predicting_s, **prediction.plain())
        confidence = max(prediction.probability.values(), default=None)
        predicted = {
            PREDICTED_COLUMN: str(prediction.value),
            VERDICT_COLUMN: str(prediction.verdict),
            CONFIDENCE_COLUMN: "" if confidence is None else f"{confidence:.4f}",
        }
        self.session.label(grasp, predicted)
        return prediction

    def _record_reference(self, number: int) -> None:
        """Record the empty gripper; warn if the model has references and does not recognise it."""
        grasp = PlannedGrasp(f"{NOTHING}_{number:04d}", "", number, 1, {}, NOTHING)
        self._steps.grasp(RobotGrasp(grasp.name, "", number, self.plan.force_n))
        capture = self.card.take(self.played)
        recording = self._store(grasp, capture, {}, known=True)
        self._steps.let_go()
        rate_hz = self.card.settings.sample_rate_hz
        before = self._before or self.senses
        verdict = before.predict(capture.samples, rate_hz, self._played_samples).verdict
        self.log.say("reference", kind=NOTHING, recording=recording, verdict=str(verdict))
        if before.has_references and verdict is not NoveltyVerdict.NOTHING:
            self.log.say("drift", text=CHANGED)
        had_references = before.has_references
        feature = self.senses.feature(capture.samples, rate_hz, self._played_samples)
        self.senses = self.senses.with_references(feature[np.newaxis])
        self._before = before if had_references else self.senses

    def _store(
        self, grasp: PlannedGrasp, capture: Capture, labels: Mapping[str, str], *, known: bool
    ) -> str:
        """Store a recording; return its name in the feature file.

        A recording of an object that is not `known` has `quality: reject`. It is not a reference,
        and no model is trained on it before a person enters its label and quality.
        """
        if not known:
            quality = REJECTED
        elif capture.clipped:
            quality = "clipped"
        else:
            quality = "ok"
        self.recordings += 1
        self.session.record(
            grasp, 1, 0, capture.samples, quality=quality, labels={**capture.labels(), **labels}
        )
        return f"{self.session.folder.name}/{grasp.name}_1"

    def _say_start(self) -> None:
        plan = self.plan
        rejected = {"rejected": plan.reject_bin} if plan.reject_bin else {}
        self.log.say(
            "start",
            **plan.model_dump(include={"dataset", "task", "model", "threshold"}),
            classes=list(self.senses.classes),
            bins={**plan.bins, **rejected},
            device=self.card.settings.device,
            robot="command" if plan.robot else "manual",
            source="simulated" if plan.source == "virtual" else "recorded",
            session=self.session.folder.name,
            novelty=self.senses.novelty_note,
        )

    def _say_stopped(self, reason: str, *, finished: bool = False) -> None:
        self.log.say(
            "stopped",
            reason=reason,
            held=self._steps.held,
            sorts=len(self._state.placed),
            seconds=time.monotonic() - self._begun,
            finished=finished,
        )


def _why(error: BaseException) -> str:
    """Return the reason for which an error ended the run."""
    if isinstance(error, KeyboardInterrupt):
        return "stopped by a person"
    if isinstance(error, SystemExit):
        return f"stopped by signal {int(error.code or 0) - 128}"
    return str(error) or type(error).__name__
