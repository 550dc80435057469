"""Scenes that are one and the same: settings that nothing reads are set to their defaults."""

from __future__ import annotations

from typing import TypeVar

from pydantic import BaseModel

from ajgdata.gripper.scene import Scene, as_met

Model = TypeVar("Model", bound=BaseModel)
#: Settings that nothing reads unless the membrane is pressed on something.
PRESSING = ("drape_deg", "drape_smoothing_mm", "stiffness_n_m3")
POSE = ("angle_deg", "offset_x_mm", "offset_y_mm", "force_n")
#: Settings of a support that only a concave one reads.
DISH = ("rim_radius_mm", "rim_width_mm", "dish_radius_mm")
#: Settings of the grains beside their `kind`.
BED = ("roughness_mm", "slope_deg", "packing")


def canonical(scene: Scene) -> Scene:
    """Return the scene that stands for all whose response is the same, bit for bit.

    An empty gripper has no grains whose size could matter; without an object there is no pose; what
    is rigid does not feel what it rests on; a random field of no strength has no correlation
    length; without any nuisance, no seed, and a bed without any no history. What came out
    otherwise than meant is as if it had been meant.

    >>> turned = Scene.model_validate({"object": None, "grasp": {"angle_deg": 33}})
    >>> canonical(turned) == canonical(Scene())
    True
    """
    scene = as_met(scene)
    made = scene.assembly
    gripper, medium, support, grasp = scene.gripper, scene.medium, scene.support, scene.grasp
    nuisance = grasp.nuisance
    if medium.kind == "air":
        gripper, medium = _default(gripper, "bed_depth_mm"), type(medium)(kind="air")
        nuisance = nuisance.model_copy(update=dict.fromkeys((*BED, "grain_force"), 0.0))
        made = _default(made, "fill_slope_deg")
        # A fill level that any gripper can have.
        gripper = gripper.model_copy(update={"bed_depth_mm": gripper.balloon_depth_mm})
    if scene.object is None:
        gripper = _default(gripper, *PRESSING)
        medium = _default(medium, "heave_deg", "heave_fraction")
        grasp = _default(grasp, *POSE)
        support = type(support)()
        nuisance = nuisance.model_copy(update={"force": 0.0, "grain_force": 0.0})
    if scene.object is None or scene.object.material == "rigid":
        gripper = gripper.model_copy(update={"membrane": _default(gripper.membrane, "film")})
    if support.kind == "rigid" or (scene.object and scene.object.material == "rigid"):
        support = type(support)()
    if support.kind == "rubber":
        support = _default(support, *DISH)
    if nuisance.roughness_mm == 0:
        nuisance = _default(nuisance, "roughness_correlation_mm")
    if nuisance.packing == 0:
        nuisance = _default(nuisance, "packing_correlation_mm")
    grasp = grasp.model_copy(update={"nuisance": nuisance})
    uneven = any(getattr(nuisance, name) for name in BED)
    if not uneven:
        grasp = _default(grasp, "history")
    poured = uneven and grasp.history is None
    if not (poured or nuisance.force or nuisance.grain_force or nuisance.temperature_k):
        grasp = _default(grasp, "seed")
    parts = {"gripper": gripper, "medium": medium, "support": support, "grasp": grasp}
    return scene.model_copy(update=parts | {"assembly": made})


def _default(model: Model, *names: str) -> Model:
    fields = type(model).model_fields
    return model.model_copy(update={name: fields[name].get_default() for name in names})
