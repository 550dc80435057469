"""Protocols of recordings, and plans of `ajgdata sort`: runs with a gripper, real or virtual.

The workflow runs neither: `ajgdata record NAME --device …` and `ajgdata sort PLAN.yaml` do.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, JsonValue, field_validator, model_validator

from ajgdata.types.base import Distinct, ModelName, Name, Strict
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
        10, ge=1, description="grasps between two references; a session starts with a reference"
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
    force_n: float = Field(8.0, gt=0, description="force of the gripper on the object (paper: 8 N)")
    wait_s: float = Field(
        2.0, ge=0, description="wait between pressing and sensing; grains settle (paper: 2 s)"
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


#: Name in `objects` of a plan if the gripper closes on no object.
NOTHING = "empty"
Doubtful = Literal["stop", "reject"]
Bin = Annotated[str, Field(min_length=1, max_length=60)]


class SortPlan(Strict):
    """Settings of a sorting run."""

    dataset: Name = Field(description="data set of the model")
    task: Name = Field(description="classification task of the data set")
    model: ModelName = Field("cnn", description="model with class probabilities")
    threshold: float = Field(
        0.6, ge=0, le=1, description="smallest class probability for sorting (paper: 0.6)"
    )
    bins: Annotated[dict[str, Bin], Field(min_length=1)] = Field(
        description="bin of each class; if a class has no bin, the run does not start"
    )
    reject_bin: Bin | None = Field(None, description="bin of rejected objects")
    below: Doubtful = Field(
        "stop",
        description="action if no class reaches the threshold (paper: stop); reject: put the "
        "object into `reject_bin`",
    )
    nothing: Literal["stop", "wait"] = Field(
        "stop", description="action if the gripper is empty; wait: try again until it is not"
    )
    unknown: Doubtful = Field(
        "stop", description="action if the object is novel (out of distribution)"
    )
    sorts: int | None = Field(None, ge=1, description="objects until the run ends; null: no limit")
    objects: tuple[Name, ...] = Field(
        (),
        description="true names of the objects, for tests and demonstrations (`empty`: no "
        "object); none: unknown objects",
    )
    order: Literal["given", "random"] = Field(
        "given", description="order of `objects`; random: draw each object at random, without end"
    )
    seed: int = Field(0, ge=0, description="seed of the random order and of simulated poses")
    force_n: float = Field(8.0, gt=0, description="force of the gripper on the object (paper: 8 N)")
    wait_s: float = Field(
        2.0, ge=0, description="wait between pressing and sensing; grains settle (paper: 2 s)"
    )
    references: References | None = Field(
        References(),
        description="empty-gripper references, which detect an empty or changed gripper; "
        "null: none",
    )
    source: Literal["soundcard", "virtual"] = Field(
        "soundcard", description="virtual: the virtual gripper, in this process"
    )
    card: dict[str, JsonValue] = Field(
        {},
        description="options of the sound card: device, microphone and output_channel as in "
        "`ajgdata record`; attempts: recordings with a fault before the run ends (default 3)",
    )
    robot: RobotProgram | None = Field(
        None, description="program that moves the gripper; null: a person"
    )

    @model_validator(mode="after")
    def _has_what_it_needs(self) -> SortPlan:
        rejecting = [key for key in ("below", "unknown") if getattr(self, key) == "reject"]
        if rejecting and self.reject_bin is None:
            raise ValueError(f"{rejecting[0]} is reject: name the reject_bin")
        if self.order == "random" and not self.objects:
            raise ValueError("a random order needs objects")
        if self.source == "virtual" and not self.objects:
            raise ValueError("the virtual gripper needs objects: name some of the data set's")
        if self.source == "soundcard" and not self.card.get("device"):
            raise ValueError("card.device is missing: see `ajgdata device list`")
        return self
