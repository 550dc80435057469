"""The guided acquisition: robot, sound card and operator record a plan, grasp by grasp."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ajgdata.acquire.card import Capture, CardError, Sound, TakeError
from ajgdata.acquire.live_session import REJECTED, LiveSession
from ajgdata.acquire.operator import Choice, Operator, OperatorDecision
from ajgdata.acquire.protocol import DOUBT, REFERENCE, PlannedGrasp, grasp_id, remaining
from ajgdata.acquire.robot import Measured, Robot, RobotError, RobotGrasp, grasp_once
from ajgdata.acquire.robot_numbers import number_labels
from ajgdata.acquire.virtual import Card
from ajgdata.features.checks import check_samples
from ajgdata.types import FeatureKind, GraspProtocol, PassiveRecording

#: Note at the start of a session without a played sound.
NO_MARKERS = "no sound is played: lost frames are detected only if the driver reports them"
_CHOICES = (Choice.REDO, Choice.SKIP, Choice.QUIT)


class AcquisitionOutcome(NamedTuple):
    """Numbers of written recordings and of remaining grasps, and skipped grasps with the reason.

    Grasps remain if the operator quits.
    """

    recorded: int
    left: int
    skipped: Mapping[str, str]


class Problem(NamedTuple):
    """A problem of a recording. A recording with a `fatal` problem cannot be kept."""

    text: str
    fatal: bool


@dataclass
class GuidedAcquisition:
    """Records the remaining grasps of a plan into a session.

    `played` is the excitation, float32 (n,), or passive recording. `targets` are the columns of
    labels. `features` are the settings of the feature, for which the recordings are checked.
    """

    session: LiveSession
    planned: Sequence[PlannedGrasp]
    protocol: GraspProtocol
    targets: Collection[str]
    features: FeatureKind
    card: Card
    played: Sound
    robot: Robot
    operator: Operator
    _problems: list[Problem] = field(default_factory=list)
    _recorded: int = 0
    _reason: str = ""

    def run(self) -> AcquisitionOutcome:
        """Record the remaining grasps. Raises CardError, and RobotError if nobody is there."""
        if isinstance(self.played, PassiveRecording):
            self.operator.note(NO_MARKERS)
        queue = remaining(self.planned, self.session.recordings, self.session.skipped)
        total = len(self.planned)
        while queue:
            grasp = queue[0]
            self.operator.announce(grasp, total - len(queue), total)
            choice = self._grasp(grasp)
            if choice is Choice.KEEP:
                queue.pop(0)
            elif choice is Choice.SKIP:
                self.session.skip(grasp, self._reason)
                queue.pop(0)
            elif choice is Choice.QUIT:
                self._drop_partial(grasp)
                break
        return AcquisitionOutcome(self._recorded, len(queue), self.session.skipped)

    def _grasp(self, grasp: PlannedGrasp) -> Choice:
        """Make one attempt at a grasp; return the decision about it."""
        attempt = self.session.begin(grasp)
        self._problems = []
        self._reason = "skipped by the operator"
        try:
            error = self._record(grasp, attempt)
            if error is not None:
                # A complete grasp may be kept: the error came after its last recording.
                is_complete = len(self.session.whole(grasp)) == grasp.samples
                return self._decide(str(error), is_complete)
            return self._judge(grasp, attempt)
        except OperatorDecision as decision:
            return decision.choice
        except BaseException as error:  # for example an unplugged card, Ctrl-C, a full disk
            self._drop_partial(grasp)
            if isinstance(error, CardError):
                fix = f"{error.fix}; recordings are kept: run the same command again to resume"
                raise CardError(error.where, error.problem, fix) from None
            raise

    def _record(self, grasp: PlannedGrasp, attempt: int) -> TakeError | RobotError | None:
        """Record one attempt; return an error on which the operator can decide, or None."""
        protocol = self.protocol
        place = RobotGrasp(grasp_id(grasp, attempt), grasp.object, grasp.number, protocol.force_n)

        def sense(measured: Measured) -> None:
            for sample in range(grasp.samples):
                self._take(grasp, attempt, sample, measured)

        try:
            grasp_once(self.robot, place, protocol.sequence, protocol.wait_s, sense)
        except TakeError as error:
            return error
        except RobotError as error:
            if not self.operator.attended:
                raise
            return error
        return None

    def _take(self, grasp: PlannedGrasp, attempt: int, sample: int, measured: Measured) -> None:
        """Record one sample. Targets without a value get an empty cell, for a person to fill in."""
        if isinstance(self.played, PassiveRecording):
            self.operator.note(self.played.waiting_text)
        capture = self.card.take(self.played)
        usual_dbfs = self._usual_dbfs(grasp)
        problems = self._check(capture)
        self._problems += problems
        texts = [problem.text for problem in problems]
        without_value = sorted(set(self.targets) - set(grasp.targets))
        labels = {
            **dict.fromkeys(without_value, ""),
            **number_labels(measured),
            **capture.labels(),
            DOUBT: "; ".join(texts),
        }
        quality = REJECTED if problems else "ok"
        self.session.record(grasp, attempt, sample, capture.samples, quality=quality, labels=labels)
        self._recorded += 1
        self.operator.show(capture.peak_dbfs, usual_dbfs, texts, capture.doubts)

    def _check(self, capture: Capture) -> list[Problem]:
        """Return the problems that `ajgdata check` would report, and samples at full scale."""
        rate_hz = self.card.settings.sample_rate_hz
        issues = check_samples(
            capture.samples,
            "PCM_24",
            self.features.least_samples(rate_hz),
            sample_rate_hz=rate_hz,
            lines_hz=self.features.reaching_hz(rate_hz),
        )
        problems = [Problem(f"{i.problem}; {i.fix}", i.level == "error") for i in issues]
        if capture.clipped and "clipped" not in {issue.code for issue in issues}:
            text = f"{capture.clipped} samples reach full scale: clipped; lower the gain and redo"
            problems.append(Problem(text, fatal=False))
        return problems

    def _judge(self, grasp: PlannedGrasp, attempt: int) -> Choice:
        """Keep a grasp without problems; otherwise the operator decides."""
        if not self._problems:
            return Choice.KEEP
        text = "; ".join(dict.fromkeys(problem.text for problem in self._problems))
        may_keep = not any(problem.fatal for problem in self._problems)
        choice = self._decide(text, may_keep)
        if choice is Choice.KEEP:
            self.session.accept(grasp, attempt)
        return choice

    def _decide(self, problem: str, may_keep: bool) -> Choice:
        """Return the decision of the operator. The problem is the reason of a skipped grasp."""
        self._reason = problem
        choices = (Choice.KEEP, *_CHOICES) if may_keep else _CHOICES
        return self.operator.decide(problem, choices)

    def _usual_dbfs(self, grasp: PlannedGrasp) -> float | None:
        """Return the median peak of the object's good recordings; None if there are none."""
        same_object = [
            row
            for row in self.session.recordings
            if row.object == grasp.object and row.labels.get(REFERENCE, "") == grasp.reference
        ]
        peaks = [
            float(row.labels["peak_dbfs"])
            for row in same_object
            if row.quality == "ok" and row.labels.get("peak_dbfs")
        ]
        return float(np.median(peaks)) if peaks else None

    def _drop_partial(self, grasp: PlannedGrasp) -> None:
        """Reject a grasp unless it is complete."""
        if len(self.session.whole(grasp)) < grasp.samples:
            self.session.reject(grasp)
