"""What physically surrounds a recording: plain data, checked before anything runs.

Frame of the gripper: z points up, z = 0 is the rim where the balloon meets the housing, the axis of
the gripper is x = y = 0. Sizes are millimetres, as on a drawing; the solver works in SI units.
"""

from __future__ import annotations

import hashlib
import json
import math
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from ajgdata.gripper.materials import Material, MaterialName, Support
from ajgdata.gripper.plain import Finite, NonNegative, PartName, Plain, Positive

#: Raised whenever the same scene would give other numbers; part of every digest.
PHYSICS_VERSION = 1
#: Δt is fixed by the speed of sound at this temperature, so warmer scenes are refused.
HOTTEST_C = 30.0
SAMPLE_RATE_HZ = 44_100


class Membrane(Plain):
    """Latex balloon as a locally reacting wall: m dv/dt + r v + k ∫v dt = p."""

    mass_kg_m2: NonNegative = Field(0.3, description="0.3 mm of latex at 1000 kg/m3")
    resistance_pa_s_m: NonNegative = Field(
        450.0, description="radiation into open air (rho c = 413) and the loss of latex"
    )
    stiffness_n_m3: NonNegative = Field(
        1e5, description="order of T (2.4/R)^2 for a tension of 40 N/m at R = 50 mm; estimate"
    )


class Gripper(Plain):
    """Rigid conical housing with a half-ellipsoid balloon below; the paper gives no dimensions
    but the 70 mm between the transducers."""

    roof_radius_mm: Positive = 40.0
    rim_radius_mm: Positive = 50.0
    height_mm: Positive = Field(45.0, description="rim to roof")
    balloon_depth_mm: Positive = Field(45.0, description="rim to tip of the free balloon")
    speaker_mm: tuple[Finite, Finite] = Field(
        (-35.0, 3.0),
        description="x, y on the roof; off the mirror planes, or angles could not"
        " be told from their mirror images",
    )
    microphone_mm: tuple[Finite, Finite] = (34.0, -5.0)
    transducer_sigma_mm: Positive = Field(2.5, description="Gaussian volume of each transducer")
    port_mm: tuple[Finite, Finite] = Field((18.0, 28.0), description="vacuum port on the roof")
    port_bore_mm: Positive = 4.0
    port_length_mm: Positive = Field(10.0, description="inert part of the fitting; hose is matched")
    wall_admittance: NonNegative = Field(
        2e-3,
        description="rho c / z of the housing; estimate: the thermoviscous boundary layer at 3 kHz "
        "gives 5e-4 to 1e-3, doubled for printed walls",
    )
    membrane: Membrane = Membrane()
    stiffness_n_m3: Positive = Field(4e5, description="grasp force per displaced volume")
    drape_deg: Annotated[float, Field(gt=0, lt=90)] = Field(
        72.0, description="steepest slope of the membrane beside an edge"
    )
    drape_smoothing_mm: Positive = 1.5
    clearance_mm: Positive = Field(4.0, description="no scene may pinch the cavity below this")

    @model_validator(mode="after")
    def _inside(self) -> Gripper:
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
        return self


#: Grain diameter in mm and porosity. Diameters: the paper (coffee: medium grind); porosities:
#: random loose packing of spheres, and of ground coffee.
GRAINS = {"plastic": (6.0, 0.40), "metal": (4.5, 0.40), "coffee": (0.7, 0.50), "air": (6.0, 0.40)}


class Medium(Plain):
    """Grain bed inside the balloon; `air` is the empty gripper."""

    kind: Literal["plastic", "metal", "coffee", "air"] = "plastic"
    grain_diameter_mm: Positive = Field(6.0, description="default: of the kind")
    porosity: Annotated[float, Field(gt=0.2, lt=0.9)] = Field(
        0.40, description="default: of the kind"
    )
    bed_depth_mm: Positive = Field(
        35.0, description="on the axis, before the grasp; the paper does not give the fill level"
    )
    heave_deg: Annotated[float, Field(gt=0, lt=60)] = Field(
        30.0, description="friction angle: half-angle of the cone that heaves above an imprint"
    )
    heave_fraction: Annotated[float, Field(ge=0, le=1)] = Field(
        0.5, description="share of displaced grains that heave there; the rest spreads; estimate"
    )

    @model_validator(mode="before")
    @classmethod
    def _by_kind(cls, given: Any) -> Any:
        if isinstance(given, dict):
            diameter, porosity = GRAINS.get(given.get("kind", "plastic"), GRAINS["plastic"])
            return {"grain_diameter_mm": diameter, "porosity": porosity, **given}
        return given


class Solid(Plain):
    """What all objects share: they are rigid, or of a material that moves, yields and rings."""

    material: Literal["rigid"] | MaterialName | Material = "rigid"


class Cube(Solid):
    """A cube on the table."""

    kind: Literal["cube"]
    edge_mm: Annotated[float, Field(gt=0, le=80)]


class Box(Solid):
    """A box on the table; at angle 0 its length lies along x."""

    kind: Literal["box"]
    length_mm: Annotated[float, Field(gt=0, le=1000)]
    width_mm: Annotated[float, Field(gt=0, le=1000)]
    height_mm: Annotated[float, Field(gt=0, le=150)]


class Cylinder(Solid):
    """A standing cylinder."""

    kind: Literal["cylinder"]
    diameter_mm: Annotated[float, Field(gt=0, le=1000)]
    height_mm: Annotated[float, Field(gt=0, le=150)]


class Ellipsoid(Solid):
    """An ellipsoid resting on the table on its third axis; a sphere has three equal diameters."""

    kind: Literal["ellipsoid"]
    diameters_mm: tuple[
        Annotated[float, Field(gt=0, le=200)],
        Annotated[float, Field(gt=0, le=200)],
        Annotated[float, Field(gt=0, le=150)],
    ]


Object = Annotated[Cube | Box | Cylinder | Ellipsoid, Field(discriminator="kind")]


class Nuisance(Plain):
    """What differs between two grasps of the same object in the same pose (standard deviations)."""

    roughness_mm: NonNegative = Field(1.0, description="free surface of the bed")
    roughness_correlation_mm: Positive = 6.0
    slope_deg: Annotated[float, Field(ge=0, le=10)] = Field(1.5, description="of the free surface")
    packing: Annotated[float, Field(ge=0, le=0.2)] = Field(0.06, description="relative porosity")
    packing_correlation_mm: Positive = 5.0
    force: Annotated[float, Field(ge=0, le=0.2)] = Field(0.03, description="relative grasp force")
    temperature_k: Annotated[float, Field(ge=0, le=2)] = Field(0.5, description="of the air")


class Grasp(Plain):
    """One placement of the object under the gripper."""

    seed: Annotated[int, Field(ge=0, lt=2**63)] = Field(0, description="of every nuisance")
    angle_deg: Finite = Field(0.0, description="of the object about z")
    offset_x_mm: Finite = Field(0.0, description="of the object's centre from the axis")
    offset_y_mm: Finite = 0.0
    force_n: Annotated[float, Field(gt=0, le=40)] = Field(8.0, description="paper: 8 N")
    nuisance: Nuisance = Nuisance()


class Environment(Plain):
    """The air."""

    temperature_c: Annotated[float, Field(ge=0, le=HOTTEST_C)] = 22.0
    pressure_pa: Annotated[float, Field(ge=5e4, le=1.1e5)] = 101_325.0


class Numerics(Plain):
    """Grid and stopping.

    Error of the feature (relative L2) against a 1.5 mm grid on a 20 mm cube, whole band | 0.1-3 |
    3-6 | 6-20 kHz: 4 mm 0.42 | 0.08 | 0.16 | 0.52, 3 mm 0.26 | 0.06 | 0.11 | 0.32, 2.8 mm 0.25 |
    0.07 | 0.11 | 0.30, 2.5 mm 0.17 | 0.04 | 0.07 | 0.21, 2 mm 0.12 | 0.04 | 0.07 | 0.15. Trust the
    default up to 3 kHz (0.6 dB) and with care to 6 kHz (2 dB); above, the modes are the grid's.
    """

    dx_mm: Annotated[float, Field(ge=0.8, le=6)] = Field(
        2.5, description="finest grid at which 300 grasps take about three minutes on two cores"
    )
    cfl: Annotated[float, Field(gt=0, lt=1)] = Field(
        0.99, description="upper bound of c Δt √3 / dx at 30 °C"
    )
    precision: Literal["float32", "float64"] = "float32"
    decay_db: Annotated[float, Field(ge=20, le=160)] = Field(
        60.0, description="stop when the energy in the cavity has fallen by this much"
    )
    max_time_s: Annotated[float, Field(gt=0, le=1)] = Field(0.2, description="stop at the latest")
    tolerance: Annotated[float, Field(ge=0, le=1)] = Field(
        0.01, description="parts that change the feature by less (relative L2) are left out"
    )
    keep: tuple[PartName, ...] = Field((), description="parts of the plan that are never left out")


class Scene(Plain):
    """Everything that determines one impulse response. `object: null` hangs free in the air."""

    gripper: Gripper = Gripper()
    medium: Medium = Medium()
    object: Object | None = None
    support: Support = Support()
    grasp: Grasp = Grasp()
    environment: Environment = Environment()
    numerics: Numerics = Numerics()

    @model_validator(mode="after")
    def _fits(self) -> Scene:
        reach = self.gripper.rim_radius_mm
        if self.object and math.hypot(self.grasp.offset_x_mm, self.grasp.offset_y_mm) > reach:
            raise ValueError(
                f"the object's centre lies outside the gripper's rim of {reach:g} mm: "
                "reduce grasp.offset_x_mm or grasp.offset_y_mm"
            )
        lowest = 2 * self.numerics.dx_mm
        if min(self.gripper.height_mm, self.gripper.balloon_depth_mm) < lowest:
            raise ValueError("numerics.dx_mm is too coarse for this gripper: halve it")
        depth = self.gripper.balloon_depth_mm + self.gripper.height_mm - self.gripper.clearance_mm
        if self.medium.kind != "air" and self.medium.bed_depth_mm > depth:
            raise ValueError(f"medium.bed_depth_mm overfills the gripper: at most {depth:g}")
        return self


def derive_seed(*parts: str | int) -> int:
    """Seed of 63 bits from names and numbers, e.g. `derive_seed(7, "cube_10", 3)`.

    The SHA-256 of the parts' JSON: one scene's seed depends on no other scene and on no machine.
    """
    digest = hashlib.sha256(json.dumps(parts).encode()).digest()
    return int.from_bytes(digest[:8], "big") >> 1


def scene_digest(scene: Scene) -> str:
    """SHA-256 (hex) of the scene's canonical JSON and the version of the physics."""
    content = {"physics": PHYSICS_VERSION, "scene": scene.model_dump(mode="json")}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()
