"""Materials of objects and of their support: plain data, SI units."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from ajgdata.gripper.scene_model import SceneModel


class Material(SceneModel):
    """A linear isotropic solid; `loss` is the loss factor η of E (1 + iη), taken as constant.

    Bounds lie far beyond all there is, and within what squares and ratios of them can hold.
    """

    density_kg_m3: Annotated[float, Field(ge=1e-6, le=1e12)]
    young_pa: Annotated[float, Field(ge=1e-6, le=1e18)]
    poisson: Annotated[float, Field(gt=-1, lt=0.5)]
    loss: Annotated[float, Field(ge=0, le=1)]


def _solid(density: float, young: float, poisson: float, loss: float) -> Material:
    return Material(density_kg_m3=density, young_pa=young, poisson=poisson, loss=loss)


MaterialName = Literal[
    "steel", "aluminium", "wood", "plastic", "pla", "styrofoam", "foam", "rubber"
]

#: Handbook values, of the order of what one would buy: wood is softwood along the grain, plastic a
#: hard polymer (PLA, ABS, polystyrene), styrofoam expanded polystyrene, foam soft polyurethane.
MATERIALS: dict[MaterialName, Material] = {
    "steel": _solid(7850.0, 200e9, 0.30, 0.002),
    "aluminium": _solid(2700.0, 70e9, 0.33, 0.003),
    "wood": _solid(650.0, 8e9, 0.30, 0.02),
    "plastic": _solid(1200.0, 3e9, 0.35, 0.04),
    "pla": _solid(1200.0, 3e9, 0.35, 0.04),
    "styrofoam": _solid(25.0, 5e6, 0.10, 0.06),
    "foam": _solid(30.0, 2e5, 0.20, 0.20),
    "rubber": _solid(1100.0, 3e6, 0.48, 0.15),
}


#: Mean gap (µm) between a smooth sheet and the surface, which it touches at its highest points: the
#: levelling depth of the profile, about three times its mean deviation Ra (ISO 21920-2). From and
#: to: Ra by process, 0.1-1.6 ground or turned metal, 0.4-3 moulded plastic or rubber, 3-12 sanded
#: wood, 5-25 printed layers; Styrofoam and foam: valleys between beads, open cells (estimates).
GAP_UM: dict[MaterialName, tuple[float, float]] = {
    "steel": (0.3, 5.0),
    "aluminium": (0.3, 5.0),
    "wood": (10.0, 40.0),
    "plastic": (1.0, 10.0),
    "pla": (15.0, 75.0),
    "styrofoam": (50.0, 500.0),
    "foam": (100.0, 1000.0),
    "rubber": (1.0, 10.0),
}


class Support(SceneModel):
    """What the object lies on: the rigid ground, a sheet of rubber on it, or a concave piece of
    rubber: a block with a dish in its top. Round objects lie in the dish, wide flat ones on its
    rim, free over the hollow."""

    kind: Literal["rigid", "rubber", "concave"] = "rigid"
    thickness_mm: Annotated[float, Field(ge=0, le=1000)] = Field(
        5.0,
        description="of the rubber sheet, or under the bottom of the dish; the paper gives none",
    )
    rim_radius_mm: Annotated[float, Field(ge=5, le=200)] = Field(
        35.0, description="of the dish's rim, which carries a plate of 100 mm; the paper gives none"
    )
    rim_width_mm: Annotated[float, Field(ge=0.5, le=50)] = Field(
        4.0, description="of the edge around the dish"
    )
    dish_radius_mm: Annotated[float, Field(ge=10, le=1000)] = Field(
        80.0, description="radius of curvature of the dish"
    )

    @property
    def dish_depth_mm(self) -> float:
        """Height of the rim over the bottom of the dish."""
        return self.dish_radius_mm - math.sqrt(self.dish_radius_mm**2 - self.rim_radius_mm**2)

    @model_validator(mode="after")
    def _dished(self) -> Support:
        if self.kind == "concave" and self.dish_radius_mm < self.rim_radius_mm:
            raise ValueError(
                f"dish_radius_mm {self.dish_radius_mm:g} is smaller than rim_radius_mm "
                f"{self.rim_radius_mm:g}: a dish is at most half a sphere"
            )
        if self.kind == "concave" and self.thickness_mm == 0:
            raise ValueError("thickness_mm 0 leaves no rubber under the dish: give it some")
        return self


def material_of(material: Literal["rigid"] | MaterialName | Material) -> Material | None:
    """The material by name or as given; None for a rigid object."""
    if isinstance(material, Material):
        return material
    return None if material == "rigid" else MATERIALS[material]
