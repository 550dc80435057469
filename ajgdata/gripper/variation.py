"""Differences between grippers, sessions and grasps, and random values of them.

Each value has a seed of its own, which is derived from names: the name of the gripper, or the names
of data set and session. Values are uniformly distributed within ± the amount, on each axis.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from ajgdata.gripper.objects import SceneModel
from ajgdata.gripper.scene import derive_seed

Amount = Annotated[float, Field(ge=0, le=20)]
#: Settings of a part of a scene, by key.
Settings = dict[str, Any]


class GripperVariation(SceneModel):
    """Differences between grippers; a gripper has the same values in every session and data set."""

    name: str | None = Field(
        None, description="name of the gripper; null: `scene.gripper`, if this is a name"
    )
    askew_mm: Amount = Field(2.5, description="shift of the balloon's tip along x and y")
    fill_slope_deg: Amount = Field(2.5, description="slope of the fill along x and y")
    transducers_mm: Amount = Field(0.5, description="shift of speaker and microphone along x and y")


class SessionVariation(SceneModel):
    """Differences between sessions, and between placements of objects in a session."""

    one_sitting: bool = Field(
        False, description="all sessions of the recipe share the values of one session"
    )
    jig_mm: Amount = Field(
        2.5, description="shift of the object by jig and calibrated axis, along x and y"
    )
    temperature_k: Amount = Field(2.0, description="temperature of the air")
    drift_k: Annotated[float, Field(ge=0, le=2)] = Field(
        0.5, description="standard deviation of the smooth drift of the air within a session"
    )
    drift_grasps: Annotated[float, Field(ge=1, le=10_000)] = Field(
        70.0,
        description="at a distance of n grasps, the drift has the correlation"
        " exp(-(n/drift_grasps)²/2)",
    )
    fill_mm: Amount = Field(0.6, description="depth of the bed")
    placement_mm: Amount = Field(
        1.0, description="position of an object; once per session in `order: blocks`"
    )
    placement_deg: Amount = Field(
        1.0, description="angle of an object; once per session in `order: blocks`"
    )


class GraspVariation(SceneModel):
    """Differences between grasps, in addition to those of scene.grasp.nuisance."""

    memory: Annotated[float, Field(ge=0, lt=1)] = Field(
        0.475, description="correlation of surface and packing of the bed with the previous grasp"
    )
    grain_force: Annotated[float, Field(ge=0, le=1)] = Field(
        0.22, description="see scene.grasp.nuisance"
    )


class Variation(SceneModel):
    """Differences between the grippers, sessions and grasps of a recipe."""

    gripper: GripperVariation = GripperVariation()
    session: SessionVariation = SessionVariation()
    grasp: GraspVariation = GraspVariation()

    def assembly(self, design: object) -> Settings:
        """Return `scene.assembly` of the gripper.

        `design` is `scene.gripper`; if it is a name, it is the default for `gripper.name`.

        >>> drawn = Variation().assembly("default")
        >>> drawn == Variation().assembly({"height_mm": 50}), drawn == Variation().assembly("small")
        (True, False)
        """
        name = self.gripper.name or (design if isinstance(design, str) else "default")
        amounts = {
            "askew_mm": self.gripper.askew_mm,
            "fill_slope_deg": self.gripper.fill_slope_deg,
            "speaker_moved_mm": self.gripper.transducers_mm,
            "microphone_moved_mm": self.gripper.transducers_mm,
        }
        return {key: _within(amount, "gripper", name, key) for key, amount in amounts.items()}

    def offsets(self, *names: str | int) -> Settings:
        """Return `scene.session` of a session, which `names` identify."""
        return {
            "jig_mm": _within(self.session.jig_mm, *names, "session", "jig"),
            "temperature_k": _within(self.session.temperature_k, *names, "session", "air")[0],
            "fill_mm": _within(self.session.fill_mm, *names, "session", "fill")[0],
        }

    def placement(self, *names: str | int) -> Settings:
        """Return the errors in `scene.grasp` of a placement, which `names` identify."""
        return {
            "placed_mm": _within(self.session.placement_mm, *names, "placement"),
            "placed_deg": _within(self.session.placement_deg, *names, "turn")[0],
        }

    def bed(self, number: int, *names: str | int) -> Settings:
        """Return the history in `scene.grasp` of grasp `number`; `names` identify the bed."""
        if not self.grasp.memory:
            return {}
        seed = derive_seed(*names, "bed")
        return {"history": {"seed": seed, "number": number, "memory": self.grasp.memory}}

    def air(self, number: int, *names: str | int) -> Settings:
        """Return the drift of the air in `scene.grasp` at grasp `number` of a session.

        `names` identify the session. The drift is a smooth Gaussian process of the number.
        """
        from ajgdata.gripper.random_fields import RandomField  # numba; Snakemake reads recipes

        seed = derive_seed(*names, "session", "drift")
        # The process is a line through a field of two dimensions, the least that a field has.
        process = RandomField(seed, "drift", 2, self.session.drift_grasps)
        drift = process.on_axes(np.array([float(number)]), np.zeros(1))[0, 0]
        return {"temperature_k": round(self.session.drift_k * float(drift), 4)}

    def nuisance(self, own: Mapping[str, Any]) -> Settings:
        """Return `scene.grasp.nuisance`; the settings in `own` have priority."""
        return {"grain_force": self.grasp.grain_force, **own}


def _within(amount: float, *names: str | int) -> list[float]:
    """Return two uniformly distributed values within ± `amount`."""
    generator = np.random.default_rng(derive_seed(*names))
    return [round(float(value), 4) for value in amount * generator.uniform(-1, 1, 2)]
