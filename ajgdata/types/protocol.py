"""Protocols: what a person, or a robot, records with a real gripper, in which order.

The workflow never runs one: `ajgdata record NAME --device …` does.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, field_validator

from ajgdata.types.base import Distinct, Name, Strict
from ajgdata.types.recipe import EMPTY

Step = Literal["loosen", "approach", "wait", "sense", "jam", "lift", "release"]
#: The paper's: sensing happens at ambient pressure, before jamming.
PAPER_SEQUENCE: tuple[Step, ...] = (
    "loosen", "approach", "wait", "sense", "jam", "lift", "release",
)  # fmt: skip
#: Columns of recordings.csv that the acquisition writes in addition to the labels.
ACQUIRED_COLUMNS = (
    "planned", "grasp_attempt", "reference", "force_reached_n", "setup_sha256", "latency_samples",
    "arrival_samples", "peak_dbfs", "clipped", "xruns", "attempts", "time", "doubt",
)  # fmt: skip


class ProtocolObject(Strict):
    """One object that is grasped, and the labels that are known of it beforehand."""

    name: Name
    targets: dict[str, float | str] = Field({}, description="its values of the targets")


class References(Strict):
    """Recordings of the empty gripper, which distinguish drift from objects."""

    every: int = Field(
        10, ge=1, description="grasps between two of them; the session begins with one, too"
    )


class RobotProgram(Strict):
    """A program that makes one step of a grasp each time it runs."""

    command: Annotated[tuple[str, ...], Field(min_length=1)] = Field(
        description="program and arguments; gets one JSON object on its standard input"
    )
    timeout_s: float = Field(60.0, gt=0, description="of one step; then the program is ended")


class GraspProtocol(Strict):
    """A protocol by which a session is recorded with a real gripper."""

    gripper: str = Field("unknown", description="name of the gripper")
    medium: str = Field("unknown", description="what the gripper is filled with")
    objects: Annotated[tuple[ProtocolObject, ...], Distinct] = Field(
        min_length=1, description="what is grasped"
    )
    grasps_per_object: int = Field(12, ge=1, description="in one session")
    samples_per_grasp: int = Field(1, ge=1, description="recordings while one grasp is held")
    order: Literal["rounds", "random"] = Field(
        "rounds",
        description="rounds: each object once, then all again; random: the same, each round in an "
        "order of its own",
    )
    seed: int = Field(0, description="of the random order")
    references: References | None = Field(
        None, description="recordings of the empty gripper; null: none"
    )
    force_n: float = Field(8.0, gt=0, description="that the object is pressed with (paper: 8 N)")
    wait_s: float = Field(
        2.0, ge=0, description="between pressing and sensing, for grains to settle (paper: 2 s)"
    )
    sequence: tuple[Step, ...] = Field(PAPER_SEQUENCE, description="steps of one grasp (paper)")
    robot: RobotProgram | None = Field(
        None, description="program that moves the gripper; null: a person"
    )

    @field_validator("objects")
    @classmethod
    def _no_reference(cls, objects: tuple[ProtocolObject, ...]) -> tuple[ProtocolObject, ...]:
        if EMPTY in {item.name for item in objects}:
            raise ValueError(f"an object is called {EMPTY}, as references are: rename it")
        return objects

    @field_validator("sequence")
    @classmethod
    def _senses_once(cls, sequence: tuple[Step, ...]) -> tuple[Step, ...]:
        if sequence.count("sense") != 1 or "approach" not in sequence[: sequence.index("sense")]:
            raise ValueError("a sequence needs `sense` once, and `approach` before it")
        return sequence
