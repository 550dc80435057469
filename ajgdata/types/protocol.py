"""Settings of live runs with a gripper: protocols of `ajgdata record`, plans of `ajgdata sort`.

The workflow never starts a live run.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, JsonValue, field_validator, model_validator

from ajgdata.types.base import Distinct, Strict
from ajgdata.types.names import ModelName, Name
from ajgdata.types.recipe import EMPTY

Step = Literal["loosen", "approach", "wait", "sense", "jam", "lift", "release"]
#: Steps of a grasp in the paper: the sound is recorded at ambient pressure, before jamming.
PAPER_SEQUENCE: tuple[Step, ...] = (
    "loosen",
    "approach",
    "wait",
    "sense",
    "jam",
    "lift",
    "release",
)
#: Columns of recordings.csv that the acquisition writes in addition to the labels.
ACQUIRED_COLUMNS = (
    "planned",
    "grasp_attempt",
    "reference",
    "force_reached_n",
    "setup_sha256",
    "latency_samples",
    "arrival_samples",
    "peak_dbfs",
    "clipped",
    "xruns",
    "attempts",
    "time",
    "doubt",
)


class ProtocolObject(Strict):
    """One object that is grasped, and its labels."""

    name: Name
    targets: dict[str, float | str] = Field({}, description="label of the object by target")
    shape: str | dict[str, JsonValue] | None = Field(
        None,
        description="shape for `ajgdata record --source virtual`: settings of the object, or the "
        "name of an object in the library of the virtual gripper; null: the name of this object",
    )


class References(Strict):
    """Recordings of the empty gripper, which show a drift of the gripper."""

    every: int = Field(
        10, ge=1, description="grasps between two references; a session starts with a reference"
    )


class RobotProgram(Strict):
    """A program that moves a gripper; each start of the program makes one step of a grasp."""

    command: Annotated[tuple[str, ...], Field(min_length=1)] = Field(
        description="program and arguments; its standard input is one JSON object"
    )
    timeout_s: float = Field(
        60.0, gt=0, description="seconds after which a step has failed and the program is ended"
    )


class GraspProtocol(Strict):
    """The plan of a session with a real gripper."""

    gripper: str = Field("unknown", description="name of the gripper")
    medium: str = Field("unknown", description="filling of the gripper, e.g. coffee")
    objects: Annotated[tuple[ProtocolObject, ...], Distinct] = Field(
        min_length=1, description="objects that are grasped"
    )
    grasps_per_object: int = Field(12, ge=1, description="grasps of each object per session")
    samples_per_grasp: int = Field(1, ge=1, description="recordings of each grasp")
    order: Literal["rounds", "random"] = Field(
        "rounds",
        description="order of the grasps; rounds: each round grasps all objects once, in the order "
        "of `objects`; random: the order of each round is random",
    )
    seed: int = Field(0, description="seed of the random order")
    references: References | None = Field(
        None, description="recordings of the empty gripper; null: none"
    )
    force_n: float = Field(
        8.0, gt=0, description="force of the gripper on the object in N (paper: 8 N)"
    )
    wait_s: float = Field(
        2.0,
        ge=0,
        description="time between pressing and sensing in seconds, in which the grains settle "
        "(paper: 2 s)",
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


#: Name in `objects` of a sorting plan for an empty gripper.
NOTHING = "empty"
#: Action if an object cannot be sorted.
UnsortedAction = Literal["stop", "reject"]
#: Name of a bin.
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
    below: UnsortedAction = Field(
        "stop",
        description="action if no class reaches the threshold (paper: stop); reject: put the "
        "object into `reject_bin`",
    )
    nothing: Literal["stop", "wait"] = Field(
        "stop",
        description="action if the gripper is empty; wait: repeat the grasp until there is an "
        "object",
    )
    unknown: UnsortedAction = Field(
        "stop", description="action if the object is novel (out of distribution)"
    )
    sorts: int | None = Field(None, ge=1, description="objects until the run ends; null: no limit")
    objects: tuple[Name, ...] = Field(
        (),
        description="true names of the objects, for tests and demonstrations (`empty`: no "
        "object); none: the objects are unknown",
    )
    order: Literal["given", "random"] = Field(
        "given",
        description="order of the grasped objects; given: as in `objects`; random: drawn from "
        "`objects` without end",
    )
    seed: int = Field(0, ge=0, description="seed of the random order and of simulated poses")
    force_n: float = Field(
        8.0, gt=0, description="force of the gripper on the object in N (paper: 8 N)"
    )
    wait_s: float = Field(
        2.0,
        ge=0,
        description="time between pressing and sensing in seconds, in which the grains settle "
        "(paper: 2 s)",
    )
    references: References | None = Field(
        References(),
        description="empty-gripper references, which detect an empty or changed gripper; "
        "null: none",
    )
    source: Literal["soundcard", "virtual"] = Field(
        "soundcard",
        description="source of the recordings; soundcard: a real gripper; virtual: the virtual "
        "gripper",
    )
    card: dict[str, JsonValue] = Field(
        {},
        description="options of the sound card: device, microphone and output_channel as in "
        "`ajgdata record`; attempts: number of faulty recordings of a grasp after which the run "
        "ends (default 3)",
    )
    robot: RobotProgram | None = Field(
        None, description="program that moves the gripper; null: a person"
    )

    @model_validator(mode="after")
    def _complete(self) -> SortPlan:
        if self.reject_bin is None:
            for key, action in (("below", self.below), ("unknown", self.unknown)):
                if action == "reject":
                    raise ValueError(f"{key} is reject: name the reject_bin")
        if self.order == "random" and not self.objects:
            raise ValueError("a random order needs objects")
        if self.source == "virtual" and not self.objects:
            raise ValueError("the virtual gripper needs objects: name some of the data set's")
        if self.source == "soundcard" and not self.card.get("device"):
            raise ValueError("card.device is missing: see `ajgdata device list`")
        return self
