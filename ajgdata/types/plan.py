"""Plans of `ajgdata sort`, read from a file of YAML."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, JsonValue, model_validator

from ajgdata.types.base import ModelName, Name, Strict
from ajgdata.types.protocol import References, RobotProgram

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
