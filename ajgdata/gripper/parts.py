"""The parts of a scene's physics, and which of them its plan leaves out."""

from __future__ import annotations

from dataclasses import dataclass

from ajgdata.gripper.objects import ObjectPart, PartName, material_of
from ajgdata.gripper.scene import Scene

#: Parts that the frame of the grains needs: with grains on it, the object moves.
WITH_FRAME: frozenset[ObjectPart] = frozenset({"motion", "elastic"})
#: Young's modulus (Pa) from which a block is hard: PLA and wood are.
HARD_PA = 1e9
#: Least size of a block (mm).
BLOCK_MM = 10.0


@dataclass(frozen=True)
class PhysicsPart:
    """One part of the physics: solved or left out."""

    name: PartName
    is_solved: bool


def left_out(scene: Scene) -> set[ObjectPart]:
    """Return the parts of the object that the plan of a scene leaves out.

    If the scene names none, they are the frame of the grains, and with it the object's motion and
    elasticity, for hard blocks: that saves 11 to 18 % of the time and changes the feature by less
    than 0.01 (page *Omitted parts* of the report).
    """
    if scene.numerics.omit is None:
        return {"frame", *WITH_FRAME} if is_hard_block(scene) else set()
    absent = set(scene.numerics.omit)
    return absent if "frame" in absent else absent - WITH_FRAME


def is_hard_block(scene: Scene) -> bool:
    """Return whether the object is a solid, hard cube or box on the ground, and not a plate.

    >>> is_hard_block(Scene.model_validate({"object": "cube_20p7"}))
    True
    >>> is_hard_block(Scene.model_validate({"object": "foam_brick"}))
    False
    """
    held = scene.object
    if held is None or held.kind not in ("cube", "box") or held.shell_mm is not None:
        return False
    material = material_of(held.material)
    if material is None or scene.support.kind != "rigid":
        return False
    return material.young_pa >= HARD_PA and min(held.size_mm) >= BLOCK_MM
