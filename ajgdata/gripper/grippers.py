"""The gripper, and named variants of it."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import Field, field_validator, model_validator

from ajgdata.gripper.objects import MM, Positive, SceneModel

#: First root of the Bessel function J0: the lowest mode of a circular membrane.
DRUM = 2.405
#: Least stiffness (N/m³) of a membrane with tension: smaller ones cause overflow.
SLACKEST_N_M3 = 1e-6
Size = Annotated[float, Field(ge=5, le=200)]
Coordinate = Annotated[float, Field(ge=-200, le=200)]


class Membrane(SceneModel):
    """The latex balloon as a locally reacting wall: m dv/dt + r v + k ∫v dt = p."""

    mass_kg_m2: Annotated[float, Field(ge=0, le=1e9)] = Field(
        0.3, description="0.3 mm of latex at 1000 kg/m3"
    )
    resistance_pa_s_m: Annotated[float, Field(ge=0, le=1e15)] = Field(
        450.0, description="radiation into open air (rho c = 413), and the loss of latex"
    )
    stiffness_n_m3: Annotated[float, Field(ge=0, le=1e15)] = Field(
        1e5, description="T (2.4/R)^2 for a tension of about 40 N/m at R = 50 mm; estimate"
    )
    pinned: bool = Field(
        True, description="under grains, the membrane moves only in the spans between them"
    )
    film: Annotated[float, Field(ge=0, le=20)] = Field(
        1.0,
        description="thickness of the air between membrane and object, relative to the middle of"
        " the range for the object's material",
    )

    @field_validator("stiffness_n_m3")
    @classmethod
    def _check_stiffness(cls, value: float) -> float:
        if 0 < value < SLACKEST_N_M3:
            raise ValueError(
                f"membrane.stiffness_n_m3 {value:g} is too small: use 0 for a limp membrane, or at"
                f" least {SLACKEST_N_M3:g}"
            )
        return value


class Gripper(SceneModel):
    """A rigid conical housing with a balloon below, which is half of an ellipsoid.

    The paper gives no dimensions except the 70 mm between the transducers.
    """

    roof_radius_mm: Size = 40.0
    rim_radius_mm: Size = 50.0
    height_mm: Size = Field(45.0, description="rim to roof")
    balloon_depth_mm: Size = Field(45.0, description="rim to tip of the free balloon")
    bed_depth_mm: Positive = Field(
        35.0,
        description="fill level: depth of the grains on the axis before the grasp, without effect"
        " in air. Not in the paper",
    )
    speaker_mm: tuple[Coordinate, Coordinate] = Field(
        (-35.0, 3.0),
        description="x, y on the roof. Its radius is almost that of the microphone, so an angle and"
        " its mirror image give almost the same sound (see docs/virtual-gripper.md)",
    )
    microphone_mm: tuple[Coordinate, Coordinate] = (34.0, -5.0)
    transducer_sigma_mm: Annotated[float, Field(ge=0.5, le=10)] = Field(
        2.5, description="width of the Gaussian volume of each transducer"
    )
    port_mm: tuple[Coordinate, Coordinate] = Field(
        (18.0, 28.0), description="vacuum port on the roof"
    )
    port_bore_mm: Annotated[float, Field(gt=0, le=50)] = 4.0
    port_length_mm: Annotated[float, Field(gt=0, le=1e6)] = Field(
        10.0, description="length of the fitting, an inert mass; the hose behind it is matched"
    )
    wall_admittance: Annotated[float, Field(ge=0, le=1e6)] = Field(
        4e-3,
        description="rho c / z of the housing and its flange, at all frequencies; one to ten times"
        " that of the thermoviscous boundary layer (1.2e-3 at 3 kHz)",
    )
    membrane: Membrane = Membrane()
    stiffness_n_m3: Annotated[float, Field(ge=1e3, le=1e9)] = Field(
        4e5, description="grasp force per displaced volume"
    )
    clearance_mm: Annotated[float, Field(ge=4)] = Field(
        4.0, description="least height of a pinched cavity in a scene; never less than 4 mm"
    )

    @property
    def tension_n_m(self) -> float:
        """Tension of the membrane, T = k (R/2.405)², N/m.

        k is its stiffness and R the radius of the rim: a drum yields in its lowest mode.
        """
        return self.membrane.stiffness_n_m3 * (self.rim_radius_mm * MM / DRUM) ** 2

    @model_validator(mode="after")
    def _check(self) -> Gripper:
        """Raise ValueError for a gripper whose parts do not fit together."""
        if self.roof_radius_mm >= self.rim_radius_mm:
            raise ValueError("roof_radius_mm must be smaller than rim_radius_mm")
        for name, margin in (
            ("speaker_mm", self.transducer_sigma_mm),
            ("microphone_mm", self.transducer_sigma_mm),
            ("port_mm", self.port_bore_mm / 2),
        ):
            x, y = getattr(self, name)
            if math.hypot(x, y) + margin > self.roof_radius_mm:
                raise ValueError(
                    f"{name} ({x:g}, {y:g}) lies outside the roof of radius "
                    f"{self.roof_radius_mm:g} mm: move it inwards"
                )
        distance = math.dist(self.speaker_mm, self.microphone_mm)
        if distance < 2 * self.transducer_sigma_mm:
            raise ValueError(
                f"speaker_mm and microphone_mm are {distance:g} mm apart and would overlap: "
                f"keep them {2 * self.transducer_sigma_mm:g} mm apart"
            )
        if self.clearance_mm >= self.height_mm:
            raise ValueError(
                f"clearance_mm {self.clearance_mm:g} leaves no room below the roof: lower it, or "
                f"raise height_mm {self.height_mm:g}"
            )
        deepest = self.balloon_depth_mm + self.height_mm - self.clearance_mm
        if self.bed_depth_mm > deepest:
            raise ValueError(
                f"bed_depth_mm {self.bed_depth_mm:g} overfills the gripper: at most {deepest:g}"
            )
        return self


def scaled(factor: float, **changes: Any) -> Gripper:
    """Return the default gripper with all sizes times `factor`, except those of transducers, bore
    and fitting; `changes` replace settings."""
    base = Gripper()
    sizes: dict[str, Any] = {
        name: getattr(base, name) * factor
        for name in (
            "roof_radius_mm",
            "rim_radius_mm",
            "height_mm",
            "balloon_depth_mm",
            "bed_depth_mm",
        )
    }
    for name in ("speaker_mm", "microphone_mm", "port_mm"):
        x, y = getattr(base, name)
        sizes[name] = (x * factor, y * factor)
    return Gripper(**(sizes | changes))


_THICK = Membrane(mass_kg_m2=1.0, stiffness_n_m3=3.3e5)

#: Variants by name. They are estimates: the paper has one gripper, whose sizes are unknown.
GRIPPERS: dict[str, Gripper] = {
    "default": Gripper(),
    "small": scaled(0.8),
    "large": scaled(1.25),
    "shallow": Gripper(height_mm=35.0, balloon_depth_mm=35.0, bed_depth_mm=27.0),
    "deep": Gripper(height_mm=60.0, balloon_depth_mm=50.0, bed_depth_mm=39.0),
    "half-filled": Gripper(bed_depth_mm=20.0),
    "overfilled": Gripper(bed_depth_mm=50.0),
    "thick-membrane": Gripper(membrane=_THICK, stiffness_n_m3=6e5),
    "wide-cone": Gripper(roof_radius_mm=40.0, rim_radius_mm=60.0),
    "moved-transducers": Gripper(
        speaker_mm=(-30.0, 15.0), microphone_mm=(22.0, -26.0), port_mm=(25.0, 20.0)
    ),
    # The smallest roof for transducers at a distance of 70 mm, and 10 mm from every mirror plane.
    "unequal-radii": Gripper(
        roof_radius_mm=44.0, speaker_mm=(-40.7, -1.8), microphone_mm=(29.0, -8.2)
    ),
    "symmetric": Gripper(speaker_mm=(-35.0, 0.0), microphone_mm=(35.0, 0.0), port_mm=(0.0, 0.0)),
    "close-transducers": Gripper(speaker_mm=(-17.5, 3.0), microphone_mm=(17.5, -5.0)),
}
