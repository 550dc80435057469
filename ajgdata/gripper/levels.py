"""What differs between grippers of one design, between sessions, and between grasps of a session.

Plain numbers of one scene: neutral where nothing is said. `ajgdata.gripper.variation` draws them.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from ajgdata.gripper.scene_model import SceneModel

Shift = Annotated[float, Field(ge=-50, le=50)]
Degrees = Annotated[float, Field(ge=-45, le=45)]
Pair = tuple[Shift, Shift]


class Assembly(SceneModel):
    """How one gripper came out beside its design; the same in all its sessions."""

    askew_mm: Pair = Field(
        (0.0, 0.0), description="x, y of the tip of the free balloon, whose rim is where it was"
    )
    fill_slope_deg: tuple[Degrees, Degrees] = Field(
        (0.0, 0.0), description="rise of the grains' surface along x and along y"
    )
    speaker_moved_mm: Pair = Field((0.0, 0.0), description="x, y, against gripper.speaker_mm")
    microphone_moved_mm: Pair = Field((0.0, 0.0), description="x, y, against gripper.microphone_mm")


class SessionOffsets(SceneModel):
    """What is the same for all grasps of a session, and another in the next."""

    jig_mm: Pair = Field(
        (0.0, 0.0),
        description="x, y added to each offset of the object: error of the jig and of the gripper's"
        " calibrated axis",
    )
    temperature_k: Annotated[float, Field(ge=-20, le=20)] = Field(
        0.0, description="added to environment.temperature_c"
    )
    fill_mm: Shift = Field(0.0, description="added to gripper.bed_depth_mm")


class History(SceneModel):
    """Place of a grasp in the history of its bed of grains, which is loosened and not poured anew.

    Surface and packing follow an autoregressive process of first order, field = ρ · field before
    + √(1 - ρ²) · new, so that their variance stays and grasps n apart correlate by ρⁿ.
    """

    seed: Annotated[int, Field(ge=0, lt=2**63)] = Field(description="of the whole history")
    number: Annotated[int, Field(ge=0, lt=10**9)] = Field(
        0, description="grasps that the bed went through before"
    )
    memory: Annotated[float, Field(ge=0, lt=1)] = Field(0.0, description="ρ")
