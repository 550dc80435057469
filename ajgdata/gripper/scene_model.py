"""Base and number types of every model of the gripper."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

#: Metres in a millimetre: scenes are drawn in millimetres and solved in SI units.
MM = 1e-3
Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Finite = Annotated[float, Field(allow_inf_nan=False)]

#: Parts of what is grasped that a plan can leave out.
ObjectPart = Literal["motion", "elastic", "compliance", "film", "frame"]
#: Parts of the physics of a scene.
PartName = Literal["bed", "poles", "membrane", "object", ObjectPart, "support", "noise"]


class SceneError(ValueError):
    """A scene that cannot exist, e.g. an object that would pinch the cavity shut."""


class SceneModel(BaseModel):
    """Base of every model of the gripper: unknown keys and numbers that are not finite are errors,
    instances are immutable."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
