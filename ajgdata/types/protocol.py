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


#: Stands among the objects of a plan where nothing lies there.
NOTHING = "empty"
Doubtful = Literal["stop", "reject"]
Bin = Annotated[str, Field(min_length=1, max_length=60)]


class SortPlan(Strict):
    """A plan by which objects are sorted."""

    dataset: Name = Field(description="data set of the model")
    task: Name = Field(description="its task, of classes")
    model: ModelName = Field("cnn", description="a model with probabilities")
    threshold: float = Field(
        0.6, ge=0, le=1, description="least probability of a class that is sorted (paper: 0.6)"
    )
    bins: Annotated[dict[str, Bin], Field(min_length=1)] = Field(
        description="bin of each class; a class without one is refused before anything moves"
    )
    reject_bin: Bin | None = Field(None, description="bin of what is rejected")
    below: Doubtful = Field(
        "stop",
        description="when no class reaches the threshold (paper: stop); reject: into `reject_bin`",
    )
    nothing: Literal["stop", "wait"] = Field(
        "stop", description="when nothing is held; wait: until an object is there"
    )
    unknown: Doubtful = Field(
        "stop", description="when the object is unlike anything that the model learnt"
    )
    sorts: int | None = Field(None, ge=1, description="end after so many; null: until it stops")
    objects: tuple[Name, ...] = Field(
        (),
        description="what lies there, for tests and demonstrations: the truth is then known "
        "(`empty`: nothing). None: nobody knows",
    )
    order: Literal["given", "random"] = Field(
        "given", description="of `objects`; random: any of them comes next, again and again"
    )
    seed: int = Field(0, ge=0, description="of the random order, and of poses that are simulated")
    force_n: float = Field(8.0, gt=0, description="that the object is pressed with (paper: 8 N)")
    wait_s: float = Field(
        2.0, ge=0, description="between pressing and sensing, for grains to settle (paper: 2 s)"
    )
    references: References | None = Field(
        References(),
        description="recordings of the empty gripper, to detect `nothing held` and a "
        "changed gripper; null: none",
    )
    source: Literal["soundcard", "virtual"] = Field(
        "soundcard", description="virtual: the virtual gripper, in this process"
    )
    card: dict[str, JsonValue] = Field(
        {},
        description="of a sound card: device, input_channel and output_channel, as the options of "
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
