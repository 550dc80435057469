"""Steps of the robot in a live run, the held object, and the ways to stop a run."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from ajgdata.acquire.robot import NOTHING_MEASURED, UNNAMED, Measured, Robot, RobotGrasp
from ajgdata.acquire.signals import undisturbed
from ajgdata.live.events import EventLog


class Control:
    """Stops a run from any thread. The run calls `begin` and `end` in the main thread."""

    def __init__(self) -> None:
        self.stopped = False  #: whether the run was stopped, or has ended
        self._in_run = False
        self._lock = threading.Lock()

    def stop(self) -> None:
        """End the run immediately, also in the middle of a step.

        The main thread gets KeyboardInterrupt, as after Ctrl-C. A second call does nothing, and
        neither does a call after the run has ended.
        """
        with self._lock:
            if self._in_run and not self.stopped:
                _interrupt_main_thread()
            self.stopped = True

    def begin(self) -> None:
        """Mark the begin of the run: from now on, `stop` interrupts the main thread.

        Raises KeyboardInterrupt if `stop` was called before.
        """
        # A program that a shell started in the background ignores SIGINT.
        if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        with self._lock:
            self._in_run = not self.stopped
        if self.stopped:
            raise KeyboardInterrupt

    def end(self) -> None:
        """Mark the end of the run: from now on, `stop` interrupts nothing."""
        with self._lock:
            self._in_run = False
            self.stopped = True


def _interrupt_main_thread() -> None:
    """Raise KeyboardInterrupt in the main thread.

    The signal also interrupts sleeping, reading, and waiting for a program. On Windows, which does
    not send signals to threads, reading and waiting go on until they are done.
    """
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:
        signal.raise_signal(signal.SIGINT)


@dataclass
class Steps:
    """The paper's steps of sorting one object.

    `held` is the object that is in the gripper or may be: it is set before the gripper goes down,
    and cleared after the gripper has let go. `pressing` is whether `release` is still due.
    """

    robot: Robot
    wait_s: float
    log: EventLog
    control: Control
    held: str = ""
    pressing: bool = False
    _halted: bool = False

    def grasp(self, grasp: RobotGrasp) -> Measured:
        """Loosen, approach and wait; return the numbers that the robot measured."""
        self._step("loosen")
        measured = self._step("approach", grasp)
        self.wait()
        return measured

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
        """Keep the gripper still for `wait_s`."""
        self._step("wait")

    def halt(self, then: Callable[[], object]) -> None:
        """Halt the robot once, then call `then`.

        A failure, a second Ctrl-C or a closed terminal does not prevent the halt.
        """
        while not self._halted:
            try:
                with undisturbed():
                    self._halt(then)
            except KeyboardInterrupt:  # it came before `undisturbed` ignored the signal
                continue

    def _halt(self, then: Callable[[], object]) -> None:
        self._halted = True
        self.control.end()
        problem = ""
        begin = time.perf_counter()
        try:
            self.robot.move("halt", held=self.held)
        except BaseException as failure:  # the log and the card must be closed after any failure
            problem = f"the robot did not halt: {failure}; look at it first"
        seconds = time.perf_counter() - begin
        # The log writes an event before a closed terminal raises OSError. The caller raises the
        # error that ended the run, so these errors are dropped.
        if problem:
            with suppress(OSError):
                self.log.say("problem", text=problem)
        with suppress(OSError):
            self.log.say("step", step="halt", seconds=seconds)
        with suppress(OSError):
            then()

    def _step(self, step: str, about: Any = None) -> Measured:
        """Make one step; return the numbers of `approach`."""
        measured = NOTHING_MEASURED
        begin = time.perf_counter()
        match step:
            case "approach":
                self.pressing = True
                self.held = about.object
                measured = self.robot.move("approach", **vars(about))
            case "wait":
                self.robot.move("hold", seconds=self.wait_s)
            case "place":
                self.robot.move("place", bin=about)
                self.held = ""
            case "release":
                self.robot.move("release")
                self.pressing = False
                self.held = ""
            case _:
                self.robot.move(step)
        self.log.say("step", step=step, seconds=time.perf_counter() - begin)
        return measured
