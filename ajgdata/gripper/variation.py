"""How far grippers, sessions and grasps differ, and the draws of it.

Each draw has a seed of its own, derived from names: of a gripper from its name alone, of a session
from the names of data set and session. What is drawn lies evenly within ± the amount, on each axis.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from ajgdata.gripper.objects import SceneModel
from ajgdata.gripper.scene import derive_seed

Amount = Annotated[float, Field(ge=0, le=20)]
Drawn = dict[str, Any]


class GripperVariation(SceneModel):
    """Between grippers: fixed by the gripper's name, the same in every session and data set."""

    name: str | None = Field(
        None, description="whose draws these are; null: `scene.gripper`, where that is a name"
    )
    askew_mm: Amount = Field(2.5, description="tip of the balloon, x and y")
    fill_slope_deg: Amount = Field(2.5, description="slope of the fill along x and y")
    transducers_mm: Amount = Field(0.5, description="place of speaker and microphone, x and y")


class SessionVariation(SceneModel):
    """Between sessions, and between the objects that were placed in one."""

    one_sitting: bool = Field(
        False, description="all sessions of the recipe are of one sitting: what is theirs is one"
    )
    jig_mm: Amount = Field(2.5, description="jig and calibrated axis of the gripper, x and y")
    temperature_k: Amount = Field(2.0, description="of the air")
    drift_k: Annotated[float, Field(ge=0, le=2)] = Field(
        0.5, description="standard deviation of the air's smooth drift within a session"
    )
    drift_grasps: Annotated[float, Field(ge=1, le=10_000)] = Field(
        70.0, description="n grasps apart, the drift has the correlation exp(-(n/drift_grasps)²/2)"
    )
    fill_mm: Amount = Field(0.6, description="depth of the bed")
    placement_mm: Amount = Field(
        1.0, description="position of an object: once per session in `order: blocks`"
    )
    placement_deg: Amount = Field(1.0, description="the same for its angle")


class GraspVariation(SceneModel):
    """Between grasps, in addition to the standard deviations of scene.grasp.nuisance."""

    memory: Annotated[float, Field(ge=0, lt=1)] = Field(
        0.475, description="correlation of the bed's surface and packing with the grasp before"
    )
    grain_force: Annotated[float, Field(ge=0, le=1)] = Field(
        0.22, description="see scene.grasp.nuisance"
    )


class Variation(SceneModel):
    """Of a recipe: what differs between grippers, sessions and grasps."""

    gripper: GripperVariation = GripperVariation()
    session: SessionVariation = SessionVariation()
    grasp: GraspVariation = GraspVariation()

    def assembly(self, design: object) -> Drawn:
        """Return `scene.assembly` of the gripper, whose name is `design` if it is not given here.

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

    def offsets(self, *names: str | int) -> Drawn:
        """Return `scene.session` of the session that `names` stand for."""
        return {
            "jig_mm": _within(self.session.jig_mm, *names, "session", "jig"),
            "temperature_k": _within(self.session.temperature_k, *names, "session", "air")[0],
            "fill_mm": _within(self.session.fill_mm, *names, "session", "fill")[0],
        }

    def placement(self, *names: str | int) -> Drawn:
        """Return the placement of an object in `scene.grasp`, by `names`."""
        return {
            "placed_mm": _within(self.session.placement_mm, *names, "placement"),
            "placed_deg": _within(self.session.placement_deg, *names, "turn")[0],
        }

    def bed(self, number: int, *names: str | int) -> Drawn:
        """Return what `scene.grasp` holds of its bed, whose history `names` stand for."""
        if not self.grasp.memory:
            return {}
        seed = derive_seed(*names, "bed")
        return {"history": {"seed": seed, "number": number, "memory": self.grasp.memory}}

    def air(self, number: int, *names: str | int) -> Drawn:
        """Return the drift of the air at grasp `number` of the session that `names` stand for.

        The drift is a smooth Gaussian process of the number of the grasp.
        """
        from ajgdata.gripper.random_fields import RandomField  # Snakemake reads recipes without it

        seed = derive_seed(*names, "session", "drift")
        # A line through a field of two dimensions: fields have at least two.
        process = RandomField(seed, "drift", 2, self.session.drift_grasps)
        drift = process.on_axes(np.array([float(number)]), np.zeros(1))[0, 0]
        return {"temperature_k": round(self.session.drift_k * float(drift), 4)}

    def nuisance(self, own: Mapping[str, Any]) -> Drawn:
        """Return `scene.grasp.nuisance` with what differs between grasps, unless it is in `own`."""
        return {"grain_force": self.grasp.grain_force, **own}


def _within(amount: float, *names: str | int) -> list[float]:
    """Two even draws within ± amount."""
    generator = np.random.default_rng(derive_seed(*names))
    return [round(float(value), 4) for value in amount * generator.uniform(-1, 1, 2)]
