"""Robots that move the gripper, and the order of the steps of one grasp."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from typing import Any, Protocol

from ajgdata.acquire.robot_numbers import parse_numbers
from ajgdata.acquire.signals import ending_signals_delayed
from ajgdata.types import DataError
from ajgdata.types.protocol import RobotProgram, Step

#: Object of a grasp whose name is not known.
UNNAMED = "object"
#: Prints a request and returns when the person has confirmed it.
Confirm = Callable[[str], None]
#: Numbers that a robot measured, by name, for example `force_n`, the reached force (N).
Measured = Mapping[str, float]
NOTHING_MEASURED: Measured = {}


@dataclass(frozen=True)
class RobotGrasp:
    """One grasp for a robot. `object` is "" for the empty gripper, UNNAMED if it is not known."""

    grasp_id: str
    object: str
    number: int
    force_n: float


class RobotError(DataError):
    """A step that failed; recordings are kept."""


class Robot(Protocol):
    """Interface of a robot that moves the gripper."""

    def move(self, step: str, **about: Any) -> Measured:
        """Make one step, and return when it is done. Raises RobotError if it is impossible.

        - `loosen`: make the grains flow again, away from any object.
        - `approach` (with the fields of a `RobotGrasp`): press the gripper onto the object until
          `force_n`, and return the measured numbers. Touch nothing if `object` is "".
        - `hold` (`seconds`): keep still. `jam`: evacuate the gripper. `lift`: lift the object.
        - `release`: put the object down and let go; also called to end a grasp that failed.
        - `place` (`bin`): carry the object to a bin and let go.
        - `halt` (`held`): stop at once and stay safe. `held` is the object in the gripper, or "".
          Called once, as the last step, also during another step or after it failed.

        Only `approach` returns numbers; their names have the unit at the end.
        """
        ...


def grasp_once(
    robot: Robot,
    grasp: RobotGrasp,
    sequence: Sequence[Step],
    wait_s: float,
    sense: Callable[[Measured], None],
) -> None:
    """Make the steps of `sequence`; `sense` is called with the numbers that the robot measured.

    After an error between `approach` and `release` the robot lets go before the error is raised.
    """
    measured = NOTHING_MEASURED
    pressing = False
    try:
        for step in sequence:
            pressing = step == "approach" or (pressing and step != "release")
            match step:
                case "approach":
                    measured = robot.move("approach", **vars(grasp))
                case "wait":
                    robot.move("hold", seconds=wait_s)
                case "sense":
                    sense(measured)
                case _:
                    robot.move(step)
    except BaseException:
        if pressing:
            with suppress(Exception):  # the first error is the cause
                robot.move("release")
        raise


class ManualRobot:
    """A person who moves the gripper by hand and confirms each grasp."""

    def __init__(self, confirm: Confirm) -> None:
        self._confirm = confirm

    def move(self, step: str, **about: Any) -> Measured:
        """Request a step; steps that are part of another one do nothing. Nothing is measured."""
        match step:
            case "approach" if about["object"]:
                named = "the next object" if about["object"] == UNNAMED else about["object"]
                self._confirm(
                    f"loosen the gripper and press it on {named} with {about['force_n']:g} N"
                )
            case "approach":
                self._confirm("loosen the gripper and let it hang free, touching nothing")
            case "hold":
                time.sleep(about["seconds"])
            case "place":
                self._confirm(f"put it into bin {about['bin']}")
            case "halt":
                held = about["held"]
                self._confirm(f"stopped; take {held} out of the gripper" if held else "stopped")
        return NOTHING_MEASURED


class CommandRobot:
    """Runs a program for each step (see acquire.robot.Robot).

    On standard input: {"step": "approach", "object": "cube", "grasp_id": "cube_01", "number": 1,
    "force_n": 8.0}; `hold` has "seconds", `place` "bin", `halt` "held", other steps nothing else. A
    step may be ended in the middle: `halt` follows. Exit code 0 means success; for `approach`,
    standard output may be a JSON object of measured numbers, and of lists of numbers, such as
    {"force_n": 7.9, "joints_rad": [0.1, 0.2]}. The last line of standard error is the reason of a
    failure.
    """

    def __init__(self, program: RobotProgram) -> None:
        self._program = program

    def move(self, step: str, **about: Any) -> Measured:
        """Run the program for a step; return the numbers that it prints for `approach`."""
        where = f"robot, {step}"
        name = self._program.command[0]
        limit_s = self._program.timeout_s + about.get("seconds", 0.0)
        try:
            code, output, errors = self._run(json.dumps({"step": step, **about}), limit_s)
        except OSError as error:
            problem = f"{name} cannot be started ({error.strerror})"
            raise RobotError(where, problem, "correct robot.command") from None
        except subprocess.TimeoutExpired:
            fix = "check the robot, then raise robot.timeout_s if it was only slow"
            raise RobotError(where, f"{name} was not finished after {limit_s:g} s", fix) from None
        if code:
            reason = (errors.strip().splitlines() or ["no message"])[-1]
            problem = f"{name} failed with exit code {code}: {reason}"
            raise RobotError(where, problem, "check the robot, then run again")
        if step != "approach" or not output.strip():
            return NOTHING_MEASURED
        try:
            return parse_numbers(output)
        except ValueError as error:
            fix = 'print nothing, or numbers such as {"force_n": 7.9, "joints_rad": [0.1, 0.2]}'
            raise RobotError(where, f"{name} printed {error}", fix) from None

    def _run(self, message: str, limit_s: float) -> tuple[int, str, str]:
        """Return exit code, standard output and standard error of the program.

        After an error or a signal, the program is killed, so the arm stops.
        """

        def kill_after_error(kind: type[BaseException] | None, *_: object) -> None:
            if kind is not None:
                _kill(process)

        with ExitStack() as stack:
            # A signal during the start would leave a program that nothing ends.
            with ending_signals_delayed():
                process = stack.enter_context(
                    subprocess.Popen(
                        self._program.command,
                        stdin=subprocess.PIPE,
                        stdout=subprocess.PIPE,
                        stderr=subprocess.PIPE,
                        text=True,
                        errors="replace",
                        start_new_session=True,
                    )
                )
                stack.push(kill_after_error)
            output, errors = process.communicate(message, timeout=limit_s)
        return process.returncode, output, errors


def _kill(process: subprocess.Popen[str]) -> None:
    """Kill a program that has a session of its own, and, except on Windows, its child processes."""
    if hasattr(os, "killpg"):
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()


def make_robot(program: RobotProgram | None, confirm: Confirm) -> Robot:
    """Return the robot that runs `program`, or without one a person, whom `confirm` asks."""
    return ManualRobot(confirm) if program is None else CommandRobot(program)
