"""Recipes: how the virtual gripper records a data set."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, JsonValue, model_validator

from ajgdata.types.base import Distinct, Strict
from ajgdata.types.names import Name

#: Part of the grasp_id of a reference, in place of the name of an object.
EMPTY = "empty"


class RecipeObject(Strict):
    """One object of a recipe: its shape and its labels."""

    name: Name
    shape: str | dict[str, JsonValue] = Field(
        description="settings of the object, or the name of an object in the library of the "
        "virtual gripper"
    )
    targets: dict[str, float | str] = Field({}, description="label of the object by target")
    grasp: dict[str, JsonValue] = Field(
        {},
        description="grasp settings of this object, e.g. angle_deg: 9; values that `vary` draws "
        "replace them",
    )


class Recipe(Strict):
    """The grasps of a data set that the virtual gripper records."""

    seed: int = Field(0, description="seed of all random values")
    sessions: int = Field(
        1, ge=1, description="number of sessions; each session contains all objects"
    )
    grasps_per_object: int = Field(
        ge=1, description="grasps of each object per session, each with other nuisances"
    )
    order: Literal["blocks", "rounds"] = Field(
        "rounds",
        description="order of the grasps; blocks: all grasps of an object in a row, with one "
        "placement per session; rounds: one grasp of each object in turn, with a new placement for "
        "each grasp",
    )
    placements: int = Field(
        1,
        ge=1,
        description="placements of each object per session with `order: blocks`; the grasps of an "
        "object are divided into this number of blocks",
    )
    samples_per_grasp: int = Field(1, ge=1, description="recordings of each grasp")
    scene: dict[str, JsonValue] = Field({}, description="changes of the default scene")
    variants: dict[Name, dict[str, JsonValue]] = Field(
        {},
        description="changes of `scene` by name of the variant, e.g. coffee: {medium: {kind: "
        "coffee}}; each variant is recorded in `sessions` separate sessions",
    )
    same_grasps: bool = Field(
        True,
        description="true: all variants have the same grasps; false: each variant draws other "
        "grasps",
    )
    references: int = Field(
        0,
        ge=0,
        description="empty-gripper references at the start of a session; their `object` is empty",
    )
    variation: dict[str, JsonValue] | None = Field(
        None,
        description="differences between grippers, sessions and grasps, in addition to the "
        "nuisances of the scene; {}: default differences; null: none, and each grasp has a newly "
        "poured bed of grains",
    )
    signal: dict[str, JsonValue] = Field(
        {},
        description="changes of the default signal chain, e.g. external_noise_dba: 80; impulse "
        "responses are not simulated again",
    )
    grasps_of: Name | None = Field(
        None,
        description="data set whose recipe draws the same grasps, e.g. to record these grasps with "
        "other noise",
    )
    vary: dict[str, tuple[float, float]] = Field(
        {},
        description="lowest and highest value of grasp settings that are drawn uniformly for each "
        "grasp, e.g. angle_deg: [-10, 10]",
    )
    objects: Annotated[tuple[RecipeObject, ...], Distinct] = Field(
        min_length=1, description="objects that are grasped"
    )

    @model_validator(mode="after")
    def _consistent(self) -> Recipe:
        for key, (low, high) in self.vary.items():
            if low > high:
                raise ValueError(f"vary.{key} = [{low:g}, {high:g}] must be [low, high]")
        if self.references and any(item.name == EMPTY for item in self.objects):
            raise ValueError(f"an object is called {EMPTY}, as references are: rename it")
        if self.order == "rounds" and self.placements > 1:
            raise ValueError(
                "placements needs `order: blocks`: in rounds, each grasp is a placement"
            )
        if self.placements > self.grasps_per_object:
            raise ValueError(
                f"placements {self.placements} needs as many grasps_per_object: it is "
                f"{self.grasps_per_object}"
            )
        for scene in (self.scene, *self.variants.values()):
            if not isinstance(scene.get("grasp", {}), dict):
                raise ValueError("scene.grasp must hold keys")
        return self
