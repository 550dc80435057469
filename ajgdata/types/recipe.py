"""Recipes: how the virtual gripper records a data set."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, JsonValue, model_validator

from ajgdata.types.base import Distinct, Name, Strict

#: Stands in the grasp_id of a reference, where nothing is held.
EMPTY = "empty"


class RecipeObject(Strict):
    """One object of a recipe: its scene description and the labels it gets."""

    name: Name
    shape: str | dict[str, JsonValue] = Field(
        description="the gripper's object description, or a name of its library"
    )
    targets: dict[str, float | str] = Field({}, description="its values of the targets")
    grasp: dict[str, JsonValue] = Field(
        {}, description="its own grasp settings, e.g. angle_deg: 9; what `vary` draws goes before"
    )


class Recipe(Strict):
    """A recipe by which the virtual gripper records a data set."""

    seed: int = Field(0, description="of everything that is drawn")
    sessions: int = Field(1, ge=1, description="sessions, each with every object")
    grasps_per_object: int = Field(
        ge=1, description="grasps of each object per session, each with its own nuisances"
    )
    order: Literal["blocks", "rounds"] = Field(
        "rounds",
        description="blocks: all grasps of an object in a row, which is placed once per session;"
        " rounds: the objects in turn, placed again for each grasp",
    )
    placements: int = Field(
        1,
        ge=1,
        description="in `order: blocks`, placings of each object per session: each object has this "
        "number of blocks, which share its grasps",
    )
    samples_per_grasp: int = Field(1, ge=1, description="recordings of each grasp")
    scene: dict[str, JsonValue] = Field({}, description="overrides of the gripper's default scene")
    variants: dict[Name, dict[str, JsonValue]] = Field(
        {},
        description="what replaces keys of `scene`, by variant, e.g. coffee: {medium: {kind: "
        "coffee}}: each is recorded in `sessions` sessions of its own",
    )
    same_grasps: bool = Field(
        True, description="every variant places the objects alike; false: each draws its own grasps"
    )
    references: int = Field(
        0,
        ge=0,
        description="empty-gripper references at the start of a session; their `object` is empty",
    )
    variation: dict[str, JsonValue] | None = Field(
        None,
        description="how far grippers, sessions and grasps differ, in addition to the nuisances of "
        "the scene; {}: by its defaults; null: not at all, and each grasp has a bed of its own",
    )
    signal: dict[str, JsonValue] = Field(
        {},
        description="overrides of its default signal chain, e.g. external_noise_dba: 80; they need"
        " no new simulation",
    )
    grasps_of: Name | None = Field(
        None,
        description="draw the same grasps as the recipe of this data set, e.g. to record them again"
        " under other noise",
    )
    vary: dict[str, tuple[float, float]] = Field(
        {}, description="grasp settings drawn uniformly for each grasp, e.g. angle_deg: [-10, 10]"
    )
    objects: Annotated[tuple[RecipeObject, ...], Distinct] = Field(
        min_length=1, description="what is grasped"
    )

    @model_validator(mode="after")
    def _drawable(self) -> Recipe:
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
