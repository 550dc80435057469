"""The robot's steps of a live run, the object that is held, and the halt."""

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


@dataclass
class Steps:
    """Makes the paper's steps of a sort, each when the run may go on.

    `held` is what is in the gripper, or may be: from the moment in which it goes down until it has
    let go. `pressing`: `release` is still to come.
    """

    robot: Robot
    wait_s: float
    log: EventLog
    control: Control
    held: str = ""
    pressing: bool = False
    _halted: bool = False

    def grasp(self, placement: Placement) -> float | None:
        """Loosen, approach and wait; return the force (N) that was reached."""
        self._step("loosen")
        force = self._step("approach", placement)
        self.wait()
        return force

    def place(self, value: str, bin_name: str) -> None:
        """Jam, lift, place and release an object of the class `value` ("": unknown)."""
        self.held = value or UNNAMED
        self._step("jam")
        self._step("lift")
        self._step("place", bin_name)
        self.let_go()

    def let_go(self) -> None:
        """Put down what the gripper presses on, unless it has been released."""
        if self.pressing:
            self._step("release")

    def wait(self) -> None:
        """Keep still for `wait_s`, as before sensing."""
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

    def _step(self, step: str, about: Any = None) -> float | None:
        """Make one step, when the run may go on; return the force of `approach`."""
        self.checkpoint()
        begin, force = time.perf_counter(), None
        match step:
            case "approach":
                self.pressing, self.held = True, about.object
                force = self.robot.move("approach", **vars(about))
            case "wait":
                self.robot.move("hold", seconds=self.wait_s)
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
