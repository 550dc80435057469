"""The robot's steps of a live run, the object that is held, the stop and the halt."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from ajgdata.acquire.robot import UNNAMED, Robot, RobotGrasp
from ajgdata.acquire.signals import undisturbed
from ajgdata.live.events import EventLog


class Control:
    """Stops a run from any thread; `begin` and `end` are called by the run in the main thread."""

    def __init__(self) -> None:
        self.stopped = False  #: also after the run has ended
        self._in_run = False
        self._lock = threading.Lock()

    def stop(self) -> None:
        """End the run now, in the middle of a step: as Ctrl-C does, by KeyboardInterrupt in the
        main thread. If it is called again, or after the run has ended, it does nothing."""
        with self._lock:
            if self._in_run and not self.stopped:
                # a signal also wakes what sleeps, reads, or waits for a program
                signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
            self.stopped = True

    def begin(self) -> None:
        """Mark the begin of the run: only now may `stop` interrupt it. Raises KeyboardInterrupt if
        it has been stopped before.

        A program that a shell started in the background ignores SIGINT; a run must be stoppable.
        """
        if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        with self._lock:
            self._in_run = not self.stopped
        if self.stopped:
            raise KeyboardInterrupt

    def end(self) -> None:
        """Mark the end of the run: nothing is interrupted from now on."""
        with self._lock:
            self._in_run, self.stopped = False, True


@dataclass
class Steps:
    """Makes the paper's steps of a sort.

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

    def grasp(self, grasp: RobotGrasp) -> float | None:
        """Loosen, approach and wait; return the force (N) that was reached."""
        self._step("loosen")
        force = self._step("approach", grasp)
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
        """Release the object under the gripper, unless it has been released."""
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
        """Make one step; return the force of `approach`."""
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
