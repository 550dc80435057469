"""Robots: what moves the gripper, and the steps of one grasp in their order."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pkgutil import resolve_name
from tempfile import TemporaryFile
from typing import Annotated, Any, Protocol

from pydantic import Field, ValidationError

from ajgdata.types import ROBOTS, DataError, Strict, describe
from ajgdata.types.protocol import Step

#: Object of a placement whose name is not known.
UNNAMED = "object"
#: Prints a request and returns when the person has confirmed it.
Confirm = Callable[[str], None]


@dataclass(frozen=True)
class Placement:
    """One grasp for a robot. `object` is "" for the empty gripper, UNNAMED if it is not known."""

    grasp_id: str
    object: str
    number: int
    force_n: float


class RobotError(DataError):
    """A step that failed; recordings are kept."""


class Robot(Protocol):
    """Moves the gripper."""

    def move(self, step: str, **about: Any) -> float | None:
        """Make one step, and return when it is done. Raises RobotError if it is impossible.

        - `loosen`: make the grains flow again, away from any object.
        - `approach` (with the fields of a `Placement`): press the gripper onto the object until
          `force_n`, and return the measured force (N), None if nothing measures it. Touch nothing
          if `object` is "".
        - `hold` (`seconds`): keep still. `jam`: evacuate the gripper. `lift`: lift the object.
        - `release`: put the object down and let go; also called to end a grasp that failed.
        - `place` (`bin`): carry the object to a bin and let go.
        - `halt` (`held`): stop at once and stay safe. `held` is the object in the gripper, "" if it
          is empty. Called once, as the last step, at any moment, also in the middle of another
          step, and when that failed.
        """
        ...


def grasp_once(
    robot: Robot,
    placement: Placement,
    sequence: Sequence[Step],
    wait_s: float,
    sense: Callable[[float | None], None],
) -> None:
    """Make the steps of `sequence`; `sense` is called with the measured force (N).

    After an error between `approach` and `release` the robot lets go before the error is raised.
    """
    force: float | None = None
    pressing = False
    try:
        for step in sequence:
            pressing = step == "approach" or (pressing and step != "release")
            match step:
                case "approach":
                    force = robot.move("approach", **vars(placement))
                case "wait":
                    robot.move("hold", seconds=wait_s)
                case "sense":
                    sense(force)
                case _:
                    robot.move(step)
    except BaseException:
        if pressing:
            with suppress(Exception):  # the first error is the cause
                robot.move("release")
        raise


class ManualRobot:
    """A person, who confirms each grasp."""

    def __init__(self, confirm: Confirm) -> None:
        self._confirm = confirm

    def move(self, step: str, **about: Any) -> float | None:
        """Request a step; steps that are part of another one do nothing. No force is measured."""
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
        return None


@contextmanager
def open_manual(settings: Mapping[str, Any], confirm: Confirm) -> Iterator[ManualRobot]:
    """Yield a person. Raises DataError for any setting: there is none."""
    if settings:
        raise DataError(
            "protocol.robot_settings", f"unknown key {min(settings)}", "manual has no settings"
        )
    yield ManualRobot(confirm)


class CommandSettings(Strict):
    """Settings of the robot `command`."""

    command: Annotated[tuple[str, ...], Field(min_length=1)] = Field(
        description="program and arguments; gets one JSON object on its standard input"
    )
    timeout_s: float = Field(60.0, gt=0, description="of one step; then the program is ended")


class CommandRobot:
    """Runs a program for each step (see acquire.robot.Robot).

    On standard input: {"step": "approach", "object": "cube", "grasp_id": "cube_01", "number": 1,
    "force_n": 8.0}; `hold` has "seconds", `place` "bin", `halt` "held", other steps nothing else. A
    step may be ended in the middle: `halt` follows. Exit code 0 means success; for `approach`,
    standard output may contain {"force_n": 7.9}, the measured force. The last line of standard
    error is the reason of a failure.
    """

    def __init__(self, settings: CommandSettings) -> None:
        self._settings = settings

    def move(self, step: str, **about: Any) -> float | None:
        """Run the program for a step; return the force (N) that it prints for `approach`."""
        limit_s = self._settings.timeout_s + about.get("seconds", 0.0)
        code, output, errors = self._run(step, json.dumps({"step": step, **about}), limit_s)
        if code is None:
            fix = "check the robot, then raise robot_settings.timeout_s if it was only slow"
            raise self._error(step, f"was not done after {limit_s:g} s", fix)
        if code:
            reason = (errors.strip().splitlines() or ["no message"])[-1]
            fix = "check the robot, then run again"
            raise self._error(step, f"failed with exit code {code}: {reason}", fix)
        if step != "approach" or not output.strip():
            return None
        try:
            force = float(json.loads(output)["force_n"])
        except (ValueError, TypeError, KeyError):
            force = math.nan
        if not math.isfinite(force):
            problem = f"printed {output.strip()[:60]!r}"
            raise self._error(step, problem, 'print nothing, or {"force_n": 7.9}')
        return force

    def _run(self, step: str, message: str, limit_s: float) -> tuple[int | None, str, str]:
        """Return exit code (None after `limit_s`), standard output and standard error."""
        # Files instead of pipes: a pipe ends only with the last process that has it.
        with TemporaryFile() as output, TemporaryFile() as errors:
            try:
                program = subprocess.Popen(
                    self._settings.command,
                    stdin=subprocess.PIPE,
                    stdout=output,
                    stderr=errors,
                    start_new_session=True,  # its child processes are ended with it
                )
            except OSError as error:
                problem = f"cannot be started ({error.strerror})"
                raise self._error(step, problem, "correct it") from None
            code = None
            try:
                with suppress(subprocess.TimeoutExpired):
                    program.communicate(message.encode(), timeout=limit_s)
                    code = program.returncode
            finally:
                with suppress(ProcessLookupError):  # all have ended
                    os.killpg(program.pid, signal.SIGKILL)
                program.wait()
            texts = []
            for file in (output, errors):
                file.seek(0)
                texts.append(file.read().decode(errors="replace"))
        return code, texts[0], texts[1]

    def _error(self, step: str, problem: str, fix: str) -> RobotError:
        return RobotError(f"robot, {step}", f"{self._settings.command[0]} {problem}", fix)


@contextmanager
def open_command(settings: Mapping[str, Any], confirm: Confirm) -> Iterator[CommandRobot]:
    """Yield a robot that runs programs. Raises DataError for wrong settings."""
    try:
        checked = CommandSettings.model_validate(settings)
    except ValidationError as error:
        raise describe(error, "protocol.robot_settings") from None
    yield CommandRobot(checked)


@contextmanager
def open_robot(name: str, settings: Mapping[str, Any], confirm: Confirm) -> Iterator[Robot]:
    """Yield the robot `name`. Raises DataError if it, or one of its settings, is wrong."""
    with resolve_name(ROBOTS[name])(settings, confirm) as robot:
        if not callable(getattr(robot, "move", None)):
            problem = f"robot {name!r} has no method move(step, **about)"
            raise DataError("protocol.robot", problem, "update its package")
        yield robot
