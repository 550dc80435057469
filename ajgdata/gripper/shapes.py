"""Objects under the gripper: primitives, standing on the table, and compounds of them.

The gripper meets an object from above, so that a shape is a height over the table: what hangs over
is filled below. Sizes are millimetres; angles turn about z, and at angle 0 lengths lie along x.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from ajgdata.gripper.object_materials import Material, MaterialName, material_of
from ajgdata.gripper.scene_model import SceneModel

#: Narrower footprints fall between the samples of the membrane's raster.
NARROWEST_MM = 0.5
Width = Annotated[float, Field(ge=NARROWEST_MM, le=1000)]
Height = Annotated[float, Field(gt=0, le=1000)]


def _spelt(material: Any) -> str:
    """By which a mistake in a material is told: as one of a name or as one of its numbers."""
    return "str" if isinstance(material, str) else "numbers"


AnyMaterial = Annotated[
    Annotated[Literal["rigid", MaterialName], Tag("str")] | Annotated[Material, Tag("numbers")],
    Discriminator(_spelt),
]


class Solid(SceneModel):
    """Base of all objects: they are rigid, or of a material that moves, yields and rings.

    With `shell_mm` the object is hollow, with walls of that thickness.
    """

    material: AnyMaterial = "rigid"
    shell_mm: Annotated[float, Field(gt=0)] | None = None
    gap_um: Annotated[float, Field(ge=0, le=2000)] | None = Field(
        None, description="air between surface and membrane, on average; null: of the material"
    )

    @property
    def size_mm(self) -> tuple[float, float, float]:
        """Length, width and height of the bounding box at angle 0."""
        raise NotImplementedError

    @property
    def title(self) -> str:
        """Kind and size, for messages and captions."""
        sizes = " x ".join(f"{size:g}" for size in self.size_mm)
        return f"{getattr(self, 'kind', 'object')} ({sizes} mm)"

    @property
    def volume_mm3(self) -> float:
        """Volume of the material, without the hollow."""
        full = self._enclosed_mm3(0.0)
        return full if self.shell_mm is None else full - self._enclosed_mm3(self.shell_mm)

    @property
    def mass_kg(self) -> float | None:
        """Mass by volume and density; None for a rigid object, which has no density."""
        material = material_of(self.material)
        return None if material is None else material.density_kg_m3 * self.volume_mm3 * 1e-9

    def _enclosed_mm3(self, inset: float) -> float:
        """Volume enclosed by the surface moved inwards by `inset` mm."""
        raise NotImplementedError

    @model_validator(mode="after")
    def _hollow(self) -> Solid:
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
    """A box; plates are thin boxes."""

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
    """One part of a compound: where its middle stands, and how high its underside is."""

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
        c, s = abs(math.cos(turn)), abs(math.sin(turn))
        return (length * c + width * s) / 2, (length * s + width * c) / 2


class Compound(Solid):
    """One body made of several primitives; its material and shell are those of all parts."""

    kind: Literal["compound"]
    parts: Annotated[tuple[Placed, ...], Field(min_length=1, max_length=32)]

    @property
    def size_mm(self) -> tuple[float, float, float]:
        """Length, width, height of the box around all parts."""
        spans = [
            max(centre + reach for centre, reach in along)
            - min(centre - reach for centre, reach in along)
            for along in (
                [(p.x_mm, p.reach_mm[0]) for p in self.parts],
                [(p.y_mm, p.reach_mm[1]) for p in self.parts],
            )
        ]
        return spans[0], spans[1], max(p.lift_mm + p.shape.size_mm[2] for p in self.parts)

    def _enclosed_mm3(self, inset: float) -> float:
        """Sum over the parts: where they overlap, the overlap counts twice."""
        return sum(p.shape._enclosed_mm3(inset) for p in self.parts)

    @model_validator(mode="after")
    def _one_body(self) -> Compound:
        lowest = min(part.lift_mm for part in self.parts)
        if lowest > 0:
            raise ValueError(f"no part rests on the table: lower every lift_mm by {lowest:g}")
        for part in self.parts:
            given = part.shape.shell_mm, part.shape.gap_um
            if part.shape.material != "rigid" or given != (None, None):
                raise ValueError(
                    "material, shell_mm and gap_um belong to the compound, not to its parts"
                )
            if self.shell_mm is not None and 2 * self.shell_mm >= min(part.shape.size_mm):
                raise ValueError(
                    f"shell_mm {self.shell_mm:g} fills the part {part.shape.title}: "
                    "it must be below half of its smallest size"
                )
        return self


Object = Annotated[
    Cube | Box | Cylinder | Rod | Sphere | Ellipsoid | Compound, Field(discriminator="kind")
]
