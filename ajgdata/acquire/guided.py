"""The guided acquisition: plan, robot, card and operator, one grasp after another."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ajgdata.acquire.card import Capture, Card, CardError, TakeError
from ajgdata.acquire.live_session import REJECTED, LiveSession
from ajgdata.acquire.operator import Choice, Decision, Operator, Progress, Report
from ajgdata.acquire.protocol import (
    DOUBT,
    REFERENCE,
    PlannedGrasp,
    grasp_id,
    remaining,
)
from ajgdata.acquire.robot import Placement, Robot, RobotError, grasp_once
from ajgdata.features.checks import check_samples
from ajgdata.types import GraspProtocol, Target

#: A peak this far from the earlier ones of the object is a knob or a plug: grasps differ by less.
JUMP_DB = 12.0
_OFFERED = (Choice.REDO, Choice.SKIP, Choice.QUIT)


class Outcome(NamedTuple):
    """An acquisition's outcome: recordings made, grasps that are left because the operator ended
    it, and skipped grasps with the reason."""

    recorded: int
    left: int
    skipped: Mapping[str, str]


class Problem(NamedTuple):
    """What speaks against a recording; `fatal`: it cannot be kept; `marked`: nobody need decide,
    since it is marked for whoever uses it."""

    text: str
    fatal: bool
    marked: bool = False


@dataclass
class GuidedAcquisition:
    """Records what is left of a plan into a session.

    `played` float32 (n,) is the excitation, `targets` what labels are asked for, `window` the
    samples that a feature needs.
    """

    session: LiveSession
    planned: Sequence[PlannedGrasp]
    protocol: GraspProtocol
    targets: Mapping[str, Target]
    window: int
    card: Card
    played: np.ndarray
    robot: Robot
    operator: Operator
    _problems: list[Problem] = field(default_factory=list)
    _spent_s: list[float] = field(default_factory=list)
    _recorded: int = 0
    _reason: str = ""

    def run(self) -> Outcome:
        """Make the grasps that are left. Raises CardError, and RobotError if nobody is there."""
        queue = remaining(self.planned, self.session.recordings, self.session.skipped)
        while queue:
            grasp = queue[0]
            self.operator.announce(grasp, self._progress(len(queue)))
            start = time.monotonic()
            match self._grasp(grasp):
                case Choice.KEEP:
                    queue.pop(0)
                    if not self._label_after(grasp):
                        break
                    self._spent_s.append(time.monotonic() - start)
                case Choice.SKIP:
                    self.session.skip(grasp, self._reason)
                    queue.pop(0)
                case Choice.QUIT:
                    self._drop_partial(grasp)
                    break
        return Outcome(self._recorded, len(queue), self.session.skipped)

    def _progress(self, left: int) -> Progress:
        mean_s = sum(self._spent_s) / len(self._spent_s) if self._spent_s else None
        total = len(self.planned)
        return Progress(total - left, total, None if mean_s is None else mean_s * left)

    def _grasp(self, grasp: PlannedGrasp) -> Choice:
        """Make one attempt at a grasp; return what becomes of it."""
        attempt = self.session.begin(grasp)
        self._problems, self._reason = [], "left out by the operator; record it another time"
        try:
            if error := self._failed(grasp, attempt):
                whole = len(self.session.whole(grasp)) == grasp.samples  # it failed afterwards
                return self._decide(str(error), (Choice.KEEP, *_OFFERED) if whole else _OFFERED)
            return self._judge(grasp, attempt)
        except Decision as decision:
            return decision.choice
        except BaseException as error:  # a card that is gone, Ctrl-C, a full disk
            self._drop_partial(grasp)
            if isinstance(error, CardError):
                fix = f"{error.fix}; what was recorded is kept: acquire again to go on"
                raise CardError(error.where, error.problem, fix) from None
            raise

    def _failed(self, grasp: PlannedGrasp, attempt: int) -> TakeError | RobotError | None:
        """Record an attempt; return what went wrong if somebody may decide about it."""
        try:
            self._move(grasp, attempt, self._ask(grasp, self._names("before")))
        except TakeError as error:
            return error
        except RobotError as error:
            if not self.operator.attended:
                raise
            return error
        return None

    def _label_after(self, grasp: PlannedGrasp) -> bool:
        """Ask for what is known only now; False if the operator quits instead."""
        try:
            known = self._ask(grasp, self._names("after"))
        except Decision:
            return False
        if known:
            self.session.label(grasp, known)
        return True

    def _names(self, moment: str) -> list[str]:
        return [name for name, when in self.protocol.ask.items() if when == moment]

    def _ask(self, grasp: PlannedGrasp, names: Sequence[str]) -> dict[str, str]:
        if not grasp.object:
            return {}
        return {name: self.operator.label(name, self.targets[name], grasp) for name in names}

    def _move(self, grasp: PlannedGrasp, attempt: int, known: Mapping[str, str]) -> None:
        """Let the robot make the grasp, and record while it holds."""
        protocol = self.protocol
        place = Placement(grasp_id(grasp, attempt), grasp.object, grasp.number, protocol.force_n)
        later = dict.fromkeys((n for n in protocol.ask if n not in known), "")

        def sense(force_n: float | None) -> None:
            labels = {**later, **known} if grasp.object else {}
            force = "" if force_n is None else f"{force_n:g}"
            for sample in range(grasp.samples):
                self._take(grasp, attempt, sample, {**labels, "force_reached_n": force})

        grasp_once(self.robot, place, protocol.sequence, protocol.wait_s, sense)

    def _take(
        self, grasp: PlannedGrasp, attempt: int, sample: int, labels: Mapping[str, str]
    ) -> None:
        silence = grasp.reference == "silence"
        capture = self.card.listen(len(self.played)) if silence else self.card.take(self.played)
        known = self._usual_dbfs(grasp)
        problems = [] if silence else self._doubts(grasp, capture, known)
        self._problems += problems
        quality = REJECTED if silence or problems else "ok"
        said = [problem.text for problem in problems]
        labels = {**labels, **capture.labels(), DOUBT: "; ".join(said)}
        self.session.record(grasp, attempt, sample, capture.samples, quality=quality, labels=labels)
        self._recorded += 1
        self.operator.show(Report(grasp, sample, capture.peak_dbfs, known, said, capture.doubts))

    def _doubts(self, grasp: PlannedGrasp, capture: Capture, known: float | None) -> list[Problem]:
        """Return what `ajgdata validate` would say of it, and what it cannot know."""
        found = check_samples(capture.samples, "PCM_24", self.window)
        doubts = [
            Problem(f"{r.problem}; {r.fix}", r.level == "error", r.code == "clipped") for r in found
        ]
        if capture.clipped and "clipped" not in {remark.code for remark in found}:
            problem = f"{capture.clipped} samples reach full scale: clipped"
            doubts.append(Problem(f"{problem}; lower the gain and redo", False, marked=True))
        jump = 0.0 if known is None else capture.peak_dbfs - known
        if abs(jump) > JUMP_DB:
            problem = f"{jump:+.0f} dB from earlier grasps of {grasp.object or 'nothing'}"
            doubts.append(Problem(f"{problem}; check gain and plugs", False))
        return doubts

    def _judge(self, grasp: PlannedGrasp, attempt: int) -> Choice:
        """Accept a grasp without problems, else let the operator decide."""
        if not self._problems:
            return Choice.KEEP
        said = "; ".join(dict.fromkeys(problem.text for problem in self._problems))
        person = self.operator.attended
        may_keep = not any(one.fatal or not (person or one.marked) for one in self._problems)
        choice = self._decide(said, (Choice.KEEP, *_OFFERED) if may_keep else _OFFERED)
        if choice is Choice.KEEP:
            self.session.accept(grasp, attempt)
        return choice

    def _decide(self, problem: str, choices: Sequence[Choice]) -> Choice:
        """Let the operator decide; the problem is the reason if the grasp is left out for it."""
        self._reason = problem
        return self.operator.decide(problem, choices)

    def _usual_dbfs(self, grasp: PlannedGrasp) -> float | None:
        """Return the median peak of the object's good recordings; None if there are none."""
        peaks = [
            float(row.labels["peak_dbfs"])
            for row in self.session.recordings
            if (row.object, row.labels.get(REFERENCE, "")) == (grasp.object, grasp.reference or "")
            and row.quality == "ok"
            and row.labels.get("peak_dbfs")
        ]
        return float(np.median(peaks)) if peaks else None

    def _drop_partial(self, grasp: PlannedGrasp) -> None:
        """Reject a grasp unless all of it counts."""
        if len(self.session.whole(grasp)) < grasp.samples:
            self.session.reject(grasp)
