"""Robots: whoever moves the gripper, and the steps of one grasp in their order."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, Protocol

from ajgdata.types import ROBOTS, DataError
from ajgdata.types.protocol import Step
from ajgdata.types.registry import resolve

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
    """Moves the gripper. Each method returns when the step is done, and raises RobotError if it
    cannot be made."""

    def loosen(self) -> None:
        """Make the grains flow again, away from any object."""
        ...

    def approach(self, placement: Placement) -> float | None:
        """Press the gripper onto the object until `force_n`, with no more than that.

        Returns the force that was reached in N, None if nothing measures it. Nothing is touched if
        the placement's object is "".
        """
        ...

    def hold(self, seconds: float) -> None:
        """Keep still."""
        ...

    def jam(self) -> None:
        """Evacuate the gripper."""
        ...

    def lift(self) -> None:
        """Lift what is held."""
        ...

    def release(self) -> None:
        """Put the object down and let go; also called to end a grasp that failed."""
        ...

    def place(self, bin: str) -> None:
        """Carry what is held to a bin and let go."""
        ...

    def halt(self, held: str) -> None:
        """Stop at once and stay safe. `held` is the object in the gripper, "" if it is empty.

        Called once, as the last step, at any moment, also in the middle of another step, and when
        that failed.
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
                    force = robot.approach(placement)
                case "wait":
                    robot.hold(wait_s)
                case "sense":
                    sense(force)
                case _:
                    getattr(robot, step)()
    except BaseException:
        if pressing:
            with suppress(Exception):  # the first error is the one to mend
                robot.release()
        raise


class ManualRobot:
    """A person: told what to do once a grasp, since hands know the rest."""

    def __init__(self, confirm: Confirm) -> None:
        self._confirm = confirm

    def loosen(self) -> None:
        """Part of what `approach` asks for, as are the other steps that do nothing here."""

    def approach(self, placement: Placement) -> float | None:
        """Ask for the grasp; a person's force is not measured."""
        if placement.object:
            force = f"{placement.force_n:g} N"
            named = "the next object" if placement.object == UNNAMED else placement.object
            what = f"loosen the gripper and press it on {named} with {force}"
        else:
            what = "loosen the gripper and let it hang free, touching nothing"
        self._confirm(what)
        return None

    def hold(self, seconds: float) -> None:
        """Wait for the grains to settle."""
        time.sleep(seconds)

    def jam(self) -> None:
        """See `loosen`."""

    def lift(self) -> None:
        """See `loosen`."""

    def release(self) -> None:
        """See `loosen`."""

    def place(self, bin: str) -> None:
        """Ask for it."""
        self._confirm(f"put it into bin {bin}")

    def halt(self, held: str) -> None:
        """Ask for what is still in the gripper."""
        self._confirm(f"stopped; take {held} out of the gripper" if held else "stopped")


@contextmanager
def open_manual(settings: Mapping[str, Any], confirm: Confirm) -> Iterator[ManualRobot]:
    """Yield a person (types.RobotMaker). Raises DataError for any setting: there is none."""
    if settings:
        raise DataError(
            "protocol.robot_settings", f"unknown key {min(settings)}", "manual has no settings"
        )
    yield ManualRobot(confirm)


@contextmanager
def open_robot(name: str, settings: Mapping[str, Any], confirm: Confirm) -> Iterator[Robot]:
    """Yield the robot `name`. Raises DataError if it, or one of its settings, is wrong."""
    try:
        opened = resolve(ROBOTS[name].open)
    except ValueError as error:
        raise DataError("protocol.robot", str(error), "the protocol may name another") from None
    with opened(settings, confirm) as robot:
        yield robot
