"""A robot that is a program: run once for each step, JSON in, JSON out."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from tempfile import TemporaryFile
from typing import IO, Annotated, Any

from pydantic import Field, ValidationError

from ajgdata.acquire.robot import Confirm, Placement, RobotError
from ajgdata.types import Strict, describe


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

    def loosen(self) -> None:
        """Run the step `loosen`."""
        self._run("loosen")

    def approach(self, placement: Placement) -> float | None:
        """Run the step `approach`; return the force (N) that the program says was reached."""
        answer = self._run("approach", **vars(placement))
        force = answer.get("force_n")
        if force is None:
            return None
        if (
            isinstance(force, bool)
            or not isinstance(force, int | float)
            or not math.isfinite(force)
        ):
            raise self._error("approach", f"says force_n = {force!r}", "let it print a number of N")
        return float(force)

    def hold(self, seconds: float) -> None:
        """Run the step `hold`, which takes as long as it holds."""
        self._run("hold", seconds=seconds)

    def jam(self) -> None:
        """Run the step `jam`."""
        self._run("jam")

    def lift(self) -> None:
        """Run the step `lift`."""
        self._run("lift")

    def release(self) -> None:
        """Run the step `release`."""
        self._run("release")

    def place(self, bin: str) -> None:
        """Run the step `place`."""
        self._run("place", bin=bin)

    def halt(self, held: str) -> None:
        """Run the step `halt`."""
        self._run("halt", held=held)

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
    if hasattr(os, "killpg"):
        with suppress(ProcessLookupError):  # nothing is left
            os.killpg(program.pid, signal.SIGKILL)
    else:
        program.kill()
    program.wait()


@contextmanager
def open_command(settings: Mapping[str, Any], confirm: Confirm) -> Iterator[CommandRobot]:
    """Yield a robot that runs programs (types.RobotMaker). Raises DataError for wrong settings."""
    try:
        checked = CommandSettings.model_validate(settings)
    except ValidationError as error:
        raise describe(error, "protocol.robot_settings") from None
    yield CommandRobot(checked)
