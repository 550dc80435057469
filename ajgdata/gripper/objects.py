"""Objects under the gripper: the base of all data models, materials, supports and shapes.

Shapes are primitives that stand on the table, and compounds of primitives. The gripper touches an
object from above, so a shape is a height over the table, and the space below an overhang is filled.
Sizes are in millimetres. Angles are about z, and at angle 0 the length is along x. Materials are in
SI units.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator

#: Metres in a millimetre: scenes are in millimetres, and the solver uses SI units.
MM = 1e-3
Positive = Annotated[float, Field(gt=0)]
Finite = Annotated[float, Field(allow_inf_nan=False)]

#: Parts of the object's physics that a plan can omit.
ObjectPart = Literal["motion", "elastic", "compliance", "film", "frame"]
#: Parts of the physics of a scene.
PartName = Literal["bed", "poles", "membrane", "object", ObjectPart, "support"]


class SceneError(ValueError):
    """Error of a scene that is not possible, e.g. an object that would close the cavity."""


class SceneModel(BaseModel):
    """Base of all data models of the gripper.

    Unknown keys and numbers that are not finite are errors. Instances are immutable.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Material(SceneModel):
    """A linear isotropic solid; `loss` is the loss factor η of E (1 + iη), a constant.

    The bounds are far beyond all materials, and their squares and ratios do not overflow.
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

#: Handbook values of common products: wood is softwood along the grain, plastic is a hard polymer
#: (PLA, ABS, polystyrene), styrofoam is expanded polystyrene, and foam is soft polyurethane.
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


#: Least and largest mean gap (µm) between a smooth sheet and a surface that it touches at the
#: highest points. The gap is the levelling depth of the profile, about three times its mean
#: deviation Ra (ISO 21920-2). Ra depends on the process: 0.1-1.6 ground or turned metal, 0.4-3
#: moulded plastic or rubber, 3-12 sanded wood, 5-25 printed layers. The gaps of Styrofoam (valleys
#: between beads) and foam (open cells) are estimates.
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
    """Support of the object: the rigid ground, or a concave piece of rubber.

    The concave piece is a block with a dish in its top. Round objects lie in the dish. Wide flat
    objects lie on its rim, above the hollow.
    """

    kind: Literal["rigid", "concave"] = "rigid"
    thickness_mm: Annotated[float, Field(ge=0, le=1000)] = Field(
        5.0,
        description="thickness of the rubber under the dish; not in the paper",
    )
    rim_radius_mm: Annotated[float, Field(ge=5, le=200)] = Field(
        35.0, description="radius of the dish's rim, which carries a plate of 100 mm; not in paper"
    )
    rim_width_mm: Annotated[float, Field(ge=0.5, le=50)] = Field(
        4.0, description="width of the edge around the dish"
    )
    dish_radius_mm: Annotated[float, Field(ge=10, le=1000)] = Field(
        80.0, description="radius of curvature of the dish"
    )

    @property
    def dish_depth_mm(self) -> float:
        """Height of the rim over the bottom of the dish."""
        return self.dish_radius_mm - math.sqrt(self.dish_radius_mm**2 - self.rim_radius_mm**2)

    @model_validator(mode="after")
    def _check_dish(self) -> Support:
        """Raise ValueError for a dish that is not possible."""
        if self.kind == "concave" and self.dish_radius_mm < self.rim_radius_mm:
            raise ValueError(
                f"dish_radius_mm {self.dish_radius_mm:g} is smaller than rim_radius_mm "
                f"{self.rim_radius_mm:g}: a dish is at most half a sphere"
            )
        if self.kind == "concave" and self.thickness_mm == 0:
            raise ValueError("thickness_mm 0 leaves no rubber under the dish: give it some")
        return self


def material_of(material: Literal["rigid"] | MaterialName | Material) -> Material | None:
    """Return a material that is given by name or by its numbers; None for a rigid object."""
    if isinstance(material, Material):
        return material
    return None if material == "rigid" else MATERIALS[material]


#: Least width of a footprint: the distance of the samples of the membrane's raster.
NARROWEST_MM = 0.5
Width = Annotated[float, Field(ge=NARROWEST_MM, le=1000)]
Height = Annotated[float, Field(ge=1e-6, le=1000)]


def _spelling(material: Any) -> str:
    """Return the tag of a material: it is given by its name or by its numbers."""
    return "str" if isinstance(material, str) else "numbers"


AnyMaterial = Annotated[
    Annotated[Literal["rigid", MaterialName], Tag("str")] | Annotated[Material, Tag("numbers")],
    Discriminator(_spelling),
]


class Solid(SceneModel):
    """Base of all objects: rigid, or of a material that moves, yields and rings.

    With `shell_mm`, the object is hollow and has walls of this thickness.
    """

    material: AnyMaterial = "rigid"
    shell_mm: Annotated[float, Field(gt=0)] | None = None
    gap_um: Annotated[float, Field(ge=0, le=2000)] | None = Field(
        None, description="mean gap between surface and membrane; null: that of the material"
    )

    @property
    def size_mm(self) -> tuple[float, float, float]:
        """Length, width and height of the bounding box at angle 0."""
        raise NotImplementedError

    @property
    def title(self) -> str:
        """Kind and sizes, for messages and captions."""
        sizes = " x ".join(f"{size:g}" for size in self.size_mm)
        return f"{getattr(self, 'kind', 'object')} ({sizes} mm)"

    @property
    def volume_mm3(self) -> float:
        """Volume of the material, without the hollow."""
        full = self._enclosed_mm3(0.0)
        return full if self.shell_mm is None else full - self._enclosed_mm3(self.shell_mm)

    def _enclosed_mm3(self, inset: float) -> float:
        """Return the volume (mm³) within the surface, moved inwards by `inset` mm."""
        raise NotImplementedError

    @model_validator(mode="after")
    def _check_shell(self) -> Solid:
        if self.shell_mm is not None and 2 * self.shell_mm >= min(self.size_mm):
            raise ValueError(
                f"shell_mm {self.shell_mm:g} fills a {self.title}: it must be below half of the "
                "smallest size, or absent for a solid object"
            )
        return self


class Cube(Solid):
    """A cube."""

    kind: Literal["cube"]
    edge_mm: Width

    @property
    def size_mm(self) -> tuple[float, float, float]:
        """Length, width, height."""
        return self.edge_mm, self.edge_mm, self.edge_mm

    def _enclosed_mm3(self, inset: float) -> float:
        return (self.edge_mm - 2 * inset) ** 3


class Box(Solid):
    """A box; a plate is a thin box."""

    kind: Literal["box"]
    length_mm: Width
    width_mm: Width
    height_mm: Height

    @property
    def size_mm(self) -> tuple[float, float, float]:
        """Length, width, height."""
        return self.length_mm, self.width_mm, self.height_mm

    def _enclosed_mm3(self, inset: float) -> float:
        return math.prod(size - 2 * inset for size in self.size_mm)


class Cylinder(Solid):
    """A standing cylinder."""

    kind: Literal["cylinder"]
    diameter_mm: Width
    height_mm: Height

    @property
    def size_mm(self) -> tuple[float, float, float]:
        """Length, width, height."""
        return self.diameter_mm, self.diameter_mm, self.height_mm

    def _enclosed_mm3(self, inset: float) -> float:
        return math.pi / 4 * (self.diameter_mm - 2 * inset) ** 2 * (self.height_mm - 2 * inset)


class Rod(Solid):
    """A lying cylinder."""

    kind: Literal["rod"]
    diameter_mm: Width
    length_mm: Width

    @property
    def size_mm(self) -> tuple[float, float, float]:
        """Length, width, height."""
        return self.length_mm, self.diameter_mm, self.diameter_mm

    def _enclosed_mm3(self, inset: float) -> float:
        return math.pi / 4 * (self.diameter_mm - 2 * inset) ** 2 * (self.length_mm - 2 * inset)


class Sphere(Solid):
    """A sphere."""

    kind: Literal["sphere"]
    diameter_mm: Width

    @property
    def size_mm(self) -> tuple[float, float, float]:
        """Length, width, height."""
        return self.diameter_mm, self.diameter_mm, self.diameter_mm

    def _enclosed_mm3(self, inset: float) -> float:
        return math.pi / 6 * (self.diameter_mm - 2 * inset) ** 3


class Ellipsoid(Solid):
    """An ellipsoid resting on its third axis."""

    kind: Literal["ellipsoid"]
    diameters_mm: tuple[Width, Width, Height]

    @property
    def size_mm(self) -> tuple[float, float, float]:
        """Length, width, height."""
        return self.diameters_mm

    def _enclosed_mm3(self, inset: float) -> float:
        return math.pi / 6 * math.prod(d - 2 * inset for d in self.diameters_mm)


Primitive = Annotated[Cube | Box | Cylinder | Rod | Sphere | Ellipsoid, Field(discriminator="kind")]
Position = Annotated[float, Field(ge=-1000, le=1000)]


class Placed(SceneModel):
    """One part of a compound: a primitive, the position of its middle, and the height (`lift_mm`)
    of its underside."""

    shape: Primitive
    x_mm: Position = 0.0
    y_mm: Position = 0.0
    lift_mm: Annotated[float, Field(ge=0, le=1000)] = 0.0
    angle_deg: float = 0.0

    @property
    def reach_mm(self) -> tuple[float, float]:
        """Half extents along x and y."""
        length, width, _ = self.shape.size_mm
        turn = math.radians(self.angle_deg)
        cosine = abs(math.cos(turn))
        sine = abs(math.sin(turn))
        return (length * cosine + width * sine) / 2, (length * sine + width * cosine) / 2


class Compound(Solid):
    """One body of several primitives; its material and shell are those of all parts."""

    kind: Literal["compound"]
    parts: Annotated[tuple[Placed, ...], Field(min_length=1, max_length=32)]

    @property
    def size_mm(self) -> tuple[float, float, float]:
        """Length, width, height of the box around all parts."""
        length = _span((p.x_mm, p.reach_mm[0]) for p in self.parts)
        width = _span((p.y_mm, p.reach_mm[1]) for p in self.parts)
        return length, width, max(p.lift_mm + p.shape.size_mm[2] for p in self.parts)

    def _enclosed_mm3(self, inset: float) -> float:
        """Return the sum over the parts (mm³): an overlap of two parts counts twice."""
        return sum(p.shape._enclosed_mm3(inset) for p in self.parts)

    @model_validator(mode="after")
    def _check_parts(self) -> Compound:
        """Raise ValueError for parts that are not one body."""
        lowest = min(part.lift_mm for part in self.parts)
        if lowest > 0:
            raise ValueError(f"no part rests on the table: lower every lift_mm by {lowest:g}")
        for part in self.parts:
            has_own = part.shape.shell_mm is not None or part.shape.gap_um is not None
            if part.shape.material != "rigid" or has_own:
                raise ValueError(
                    "material, shell_mm and gap_um belong to the compound, not to its parts"
                )
            if self.shell_mm is not None and 2 * self.shell_mm >= min(part.shape.size_mm):
                raise ValueError(
                    f"shell_mm {self.shell_mm:g} fills the part {part.shape.title}: "
                    "it must be below half of its smallest size"
                )
        return self


def _span(parts: Iterable[tuple[float, float]]) -> float:
    """Return the length covered by parts with these centres and half extents."""
    intervals = [(centre - reach, centre + reach) for centre, reach in parts]
    return max(high for _, high in intervals) - min(low for low, _ in intervals)


Object = Annotated[
    Cube | Box | Cylinder | Rod | Sphere | Ellipsoid | Compound, Field(discriminator="kind")
]
