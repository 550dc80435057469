"""The robot's part of a live run: steps, told one by one, what is held, and the halt."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from ajgdata.acquire.robot import UNNAMED, Placement, Robot
from ajgdata.acquire.signals import undisturbed
from ajgdata.live.control import Control, Mode
from ajgdata.live.events import EventLog
from ajgdata.types.plan import SortPlan, SortStep


@dataclass
class Steps:
    """Makes the steps of a plan's sequence, each when the run may go on.

    `held` is what is in the gripper, or may be: from the moment in which it goes down until it has
    let go. `pressing`: `release` is still to come.
    """

    robot: Robot
    plan: SortPlan
    log: EventLog
    control: Control
    held: str = ""
    pressing: bool = False
    _halted: bool = False

    def grasp(self, place: Placement) -> float | None:
        """Make the steps before `sense`; return the force (N) that was reached."""
        force = None
        for step in self.plan.sequence[: self.plan.sequence.index("sense")]:
            reached = self._step(step, place)
            force = reached if step == "approach" else force
        return force

    def place(self, value: str, where: str) -> None:
        """Make the steps after `sense` with what is a `value` ("": not known)."""
        self.held = value or UNNAMED
        for step in self.plan.sequence[self.plan.sequence.index("sense") + 1 :]:
            self._step(step, where)
        self.let_go()  # where a sequence ends without

    def let_go(self) -> None:
        """Put down what the gripper presses on, unless it has been released."""
        if self.pressing:
            self._step("release")

    def wait(self) -> None:
        """Keep still as long as before sensing."""
        self._step("wait")

    def halt(self, then: Callable[[], object]) -> None:
        """Let the robot halt, once, and call `then`. Nothing disturbs it, neither a failure nor a
        second Ctrl-C, nor a terminal that is gone."""
        while not self._halted:
            try:
                with undisturbed():
                    self._halt(then)
            except KeyboardInterrupt:  # in the instant before it is ignored
                continue

    def _halt(self, then: Callable[[], object]) -> None:
        self._halted = True
        self.control.end()
        begin, problem = time.perf_counter(), ""
        try:
            self.robot.move("halt", held=self.held)
        except BaseException as failure:  # whatever it is, the rest must be ended, too
            problem = f"the robot did not halt: {failure}; look at it first"
        seconds = time.perf_counter() - begin
        # What ended the run goes on, not that nobody listens: the log has it all the same.
        if problem:
            with suppress(OSError):
                self.log.say("problem", text=problem)
        with suppress(OSError):
            self.log.say("step", step="halt", seconds=seconds)
        with suppress(OSError):
            then()

    def _step(self, step: SortStep, about: Any = None) -> float | None:
        """Make one step, when the run may go on; return the force of `approach`."""
        self.checkpoint()
        begin, force = time.perf_counter(), None
        match step:
            case "approach":
                self.pressing, self.held = True, about.object
                force = self.robot.move("approach", **vars(about))
            case "wait":
                self.robot.move("hold", seconds=self.plan.wait_s)
            case "place":
                self.robot.move("place", bin=about)
                self.held = ""
            case "release":
                self.robot.move("release")
                self.pressing, self.held = False, ""
            case _:
                self.robot.move(step)
        self.log.say("step", step=step, seconds=time.perf_counter() - begin)
        return force

    def checkpoint(self) -> None:
        """Wait while the run is paused. Raises KeyboardInterrupt if it is to stop."""
        if self.control.mode is Mode.PAUSED:
            self.log.say("paused", reason="asked to pause")
            self.control.checkpoint()
            self.log.say("resumed", reason="asked to go on")
        else:
            self.control.checkpoint()
