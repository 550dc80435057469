"""Robots: whoever moves the gripper, and the steps of one grasp in their order."""

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
from typing import IO, Annotated, Any, Protocol

from pydantic import Field, ValidationError

from ajgdata.types import ROBOTS, DataError, Strict, describe
from ajgdata.types.protocol import Step

#: Object of a placement where something lies that nobody has named.
UNNAMED = "object"
#: Says something to the person and returns when that has been done.
Confirm = Callable[[str], None]


@dataclass(frozen=True)
class Placement:
    """One grasp, as a robot needs to know it. `object` is "" when nothing shall be held, UNNAMED
    when nobody knows what lies there."""

    grasp_id: str
    object: str
    number: int
    force_n: float


class RobotError(DataError):
    """A step that was not made; what is recorded stays."""


class Robot(Protocol):
    """Moves the gripper."""

    def move(self, step: str, **about: Any) -> float | None:
        """Make one step, and return when it is done. Raises RobotError if it cannot be made.

        - `loosen`: make the grains flow again, away from any object.
        - `approach` (with the fields of a `Placement`): press the gripper onto the object until
          `force_n`, and return the force (N) that was reached, None if nothing measures it. Nothing
          is touched if `object` is "".
        - `hold` (`seconds`): keep still. `jam`: evacuate the gripper. `lift`: lift what is held.
        - `release`: put the object down and let go; also called to end a grasp that failed.
        - `place` (`bin`): carry what is held to a bin and let go.
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
    """Make the steps of `sequence`; `sense` is called with the force that was reached.

    Whatever ends it between `approach` and `release`, the robot lets go before the error goes on.
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
            with suppress(Exception):  # the first error is the one to mend
                robot.move("release")
        raise


class ManualRobot:
    """A person, who is asked once per grasp."""

    def __init__(self, confirm: Confirm) -> None:
        self._confirm = confirm

    def move(self, step: str, **about: Any) -> float | None:
        """Ask for a step; the steps that are part of another one do nothing. No force is
        measured."""
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
    "force_n": 8.0}; `hold` comes with "seconds", `place` with "bin", `halt` with "held" (what is in
    the gripper, or ""), the others with the step alone. A step may be ended in the middle: `halt`
    follows. Exit code 0 says that the step was made; of `approach`, standard output may hold
    {"force_n": 7.9}, the force that was reached. The last line of standard error says why not.
    """

    def __init__(self, settings: CommandSettings) -> None:
        self._settings = settings

    def move(self, step: str, **about: Any) -> float | None:
        """Run the program for a step; return the force (N) that it prints for `approach`."""
        force = self._run(step, **about).get("force_n")
        if step != "approach" or force is None:
            return None
        is_number = isinstance(force, int | float) and not isinstance(force, bool)
        if not is_number or not math.isfinite(force):
            raise self._error(step, f"says force_n = {force!r}", "let it print a number of N")
        return float(force)

    def _run(self, step: str, **about: Any) -> dict[str, Any]:
        limit_s = self._settings.timeout_s + about.get("seconds", 0.0)
        asked = json.dumps({"step": step, **about}).encode()
        # Into files: a pipe ends only with the last of the processes that hold it.
        with TemporaryFile() as out, TemporaryFile() as err:
            try:
                program = subprocess.Popen(
                    self._settings.command,
                    stdin=subprocess.PIPE,
                    stdout=out,
                    stderr=err,
                    start_new_session=True,  # what it starts is ended with it
                )
            except OSError as error:
                problem = f"cannot be started ({error.strerror})"
                raise self._error(step, problem, "correct it") from None
            try:
                program.communicate(asked, timeout=limit_s)
            except subprocess.TimeoutExpired:
                fix = "look at the robot, then raise robot_settings.timeout_s if it was only slow"
                raise self._error(step, f"was not done after {limit_s:g} s", fix) from None
            finally:
                _end(program)
            if program.returncode:
                said = (_text(err).strip().splitlines() or ["it says nothing"])[-1]
                problem = f"failed with exit code {program.returncode}: {said}"
                raise self._error(step, problem, "look at the robot, then go on")
            return self._answer(step, _text(out))

    def _answer(self, step: str, out: str) -> dict[str, Any]:
        if not out.strip():
            return {}
        try:
            answer = json.loads(out)
        except json.JSONDecodeError:
            answer = None
        if not isinstance(answer, dict):
            fix = "let it print one JSON object, or nothing"
            raise self._error(step, f"printed {out.strip()[:60]!r}", fix)
        return answer

    def _error(self, step: str, problem: str, fix: str) -> RobotError:
        return RobotError(f"robot, {step}", f"{self._settings.command[0]} {problem}", fix)


def _text(file: IO[bytes]) -> str:
    """Return what a program wrote, whatever its encoding."""
    file.seek(0)
    return file.read().decode(errors="replace")


def _end(program: subprocess.Popen[bytes]) -> None:
    """End what is left of a program and of what it started."""
    with suppress(ProcessLookupError):  # nothing is left
        os.killpg(program.pid, signal.SIGKILL)
    program.wait()


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
