"""Everything that physically surrounds a recording: plain data, checked before anything runs.

Frame of the gripper: z points up, z = 0 is the rim where the balloon meets the housing, the axis of
the gripper is x = y = 0. Sizes are millimetres, as on a drawing; the solver works in SI units.
"""

from __future__ import annotations

import difflib
import hashlib
import json
import math
from collections.abc import Iterable
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, field_validator, model_validator

from ajgdata.gripper.grippers import GRIPPERS, Gripper
from ajgdata.gripper.object_library import OBJECTS
from ajgdata.gripper.objects import Object, ObjectPart, SceneModel, Support

#: Raised whenever the same scene would give other numbers; part of every digest.
PHYSICS_VERSION = 5
#: Δt is fixed by the speed of sound at this temperature; warmer scenes take a shorter one.
HOTTEST_C = 30.0
#: Range of the temperature of the air, which the offset of a session must not leave.
COLDEST_AIR_C = -20.0
HOTTEST_AIR_C = 60.0
#: The local porosity stays within this many standard deviations.
PACKING_SIGMAS = 3.0
SAMPLE_RATE_HZ = 44_100
Precision = Literal["float32", "float64"]
Shift = Annotated[float, Field(ge=-50, le=50)]
Degrees = Annotated[float, Field(ge=-45, le=45)]
Pair = tuple[Shift, Shift]

#: Grain diameter in mm and porosity. Diameters: the paper (coffee: medium grind); porosities:
#: random loose packing of spheres, and of ground coffee.
GRAINS = {"plastic": (6.0, 0.40), "metal": (4.5, 0.40), "coffee": (0.7, 0.50), "air": (6.0, 0.40)}


class Medium(SceneModel):
    """Grains inside the balloon; `air` is the empty gripper. How full it is says the gripper."""

    kind: Literal["plastic", "metal", "coffee", "air"] = "plastic"
    grain_diameter_mm: Annotated[float, Field(ge=0.05, le=20)] = Field(
        6.0, description="default: of the kind"
    )
    porosity: Annotated[float, Field(ge=0.2, le=0.95)] = Field(
        0.40, description="default: of the kind"
    )
    heave_deg: Annotated[float, Field(gt=0, lt=60)] = Field(
        30.0, description="friction angle: half-angle of the cone that heaves above an imprint"
    )
    heave_fraction: Annotated[float, Field(ge=0, le=1)] = Field(
        0.5, description="share of displaced grains that heave there; the rest spreads; estimate"
    )

    @model_validator(mode="before")
    @classmethod
    def _with_its_grains(cls, content: Any) -> Any:
        if isinstance(content, dict):
            diameter, porosity = GRAINS.get(content.get("kind", "plastic"), GRAINS["plastic"])
            return {"grain_diameter_mm": diameter, "porosity": porosity, **content}
        return content


class Nuisance(SceneModel):
    """Differences between two grasps of the same object in the same pose (standard deviations)."""

    roughness_mm: Annotated[float, Field(ge=0, le=5)] = Field(
        1.0, description="free surface of the bed"
    )
    roughness_correlation_mm: Annotated[float, Field(ge=0.5, le=1000)] = 6.0
    slope_deg: Annotated[float, Field(ge=0, le=10)] = Field(1.5, description="of the free surface")
    packing: Annotated[float, Field(ge=0, le=0.2)] = Field(0.06, description="relative porosity")
    packing_correlation_mm: Annotated[float, Field(ge=0.5, le=1000)] = 5.0
    force: Annotated[float, Field(ge=0, le=0.2)] = Field(0.03, description="relative grasp force")
    grain_force: Annotated[float, Field(ge=0, le=1)] = Field(
        0.0,
        description="relative, of one grain: the depth at which (object's width / grain)² of them"
        " bear the force scatters by the root less",
    )


class Assembly(SceneModel):
    """Tolerances of one gripper relative to its design; the same in all its sessions."""

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
    """Place of a grasp in the history of its bed of grains, which is loosened and not poured again.

    Surface and packing follow an autoregressive process of first order, field = ρ · field before
    + √(1 - ρ²) · new, so that their variance stays and grasps n apart correlate by ρⁿ.
    """

    seed: Annotated[int, Field(ge=0, lt=2**63)] = Field(description="of the whole history")
    number: Annotated[int, Field(ge=0, lt=10**9)] = Field(
        0, description="grasps that the bed went through before"
    )
    memory: Annotated[float, Field(ge=0, lt=1)] = Field(0.0, description="ρ")


class Grasp(SceneModel):
    """One closing of the gripper on the object."""

    seed: Annotated[int, Field(ge=0, lt=2**63)] = Field(0, description="of every nuisance")
    angle_deg: float = Field(0.0, description="of the object about z")
    offset_x_mm: float = Field(0.0, description="of the object's centre from the axis")
    offset_y_mm: float = 0.0
    force_n: Annotated[float, Field(ge=1e-3, le=40)] = Field(8.0, description="paper: 8 N")
    placed_mm: Pair = Field((0.0, 0.0), description="x, y added to the offset when it was placed")
    placed_deg: Degrees = Field(0.0, description="added to the angle when it was placed")
    temperature_k: Annotated[float, Field(ge=-20, le=20)] = Field(
        0.0, description="drift of the air in the session, added to environment.temperature_c"
    )
    nuisance: Nuisance = Nuisance()
    history: History | None = Field(
        None, description="of the bed; null: it is newly poured, as `seed` draws it"
    )


class Environment(SceneModel):
    """The air."""

    temperature_c: Annotated[float, Field(ge=COLDEST_AIR_C, le=HOTTEST_AIR_C)] = 22.0
    pressure_pa: Annotated[float, Field(ge=5e4, le=1.1e5)] = 101_325.0


class Numerics(SceneModel):
    """Grid, precision and stopping.

    The error of the feature against run time is measured by `ajgdata.studies.accuracy`.
    """

    dx_mm: Annotated[float, Field(ge=0.8, le=6)] = Field(
        4.2, description="nearly the finest grid with four steps a sample"
    )
    poles: Literal[0, 1, 2] = Field(
        2, description="relaxation poles in the compressibility of the grains"
    )
    cfl: Annotated[float, Field(ge=0.01, lt=1)] = Field(
        0.99, description="upper bound of the time step in units of its limit at 30 °C"
    )
    precision: Precision = "float32"
    decay_db: Annotated[float, Field(ge=20, le=160)] = Field(
        50.0, description="stop when the energy in the cavity has fallen by this much"
    )
    max_time_s: Annotated[float, Field(gt=0, le=1)] = Field(0.2, description="stop at the latest")
    modes_hz: Annotated[float, Field(gt=0, le=21_000)] = Field(
        8_000.0, description="modes of the object up to this frequency are solved"
    )
    omit: tuple[ObjectPart, ...] | None = Field(
        None,
        description="parts of the object left out; null: those of hard blocks that change the sound"
        " by less than 1 %; []: none",
    )


class Scene(SceneModel):
    """Everything that determines one impulse response. `object: null` hangs free in the air.

    `gripper` and `object` may be given by name (`grippers.GRIPPERS`, `object_library.OBJECTS`).
    The scene holds what the name stands for, so that its digest depends on sizes and not on names.

    >>> scene = Scene.model_validate({"object": "cube_20p7", "medium": {"kind": "coffee"}})
    >>> scene.object.edge_mm, scene.medium.grain_diameter_mm, scene.grasp.force_n
    (20.7, 0.7, 8.0)
    """

    gripper: Gripper = Gripper()
    medium: Medium = Medium()
    object: Object | None = None
    support: Support = Support()
    grasp: Grasp = Grasp()
    environment: Environment = Environment()
    assembly: Assembly = Assembly()
    session: SessionOffsets = SessionOffsets()
    numerics: Numerics = Numerics()

    @field_validator("gripper", mode="before")
    @classmethod
    def _gripper_by_name(cls, value: Any) -> Any:
        return GRIPPERS[_known(value, "gripper", GRIPPERS)] if isinstance(value, str) else value

    @field_validator("object", mode="before")
    @classmethod
    def _object_by_name(cls, value: Any) -> Any:
        return OBJECTS[_known(value, "object", OBJECTS)].shape if isinstance(value, str) else value

    @model_validator(mode="after")
    def _fits(self) -> Scene:
        met = actual_scene(self)
        _refuse_gripper(met)
        _refuse_air(met, self)
        reach = self.gripper.rim_radius_mm
        if self.object and math.hypot(met.grasp.offset_x_mm, met.grasp.offset_y_mm) > reach:
            raise ValueError(
                f"the object's centre lies outside the gripper's rim of {reach:g} mm: "
                "reduce grasp.offset_x_mm or grasp.offset_y_mm"
            )
        least = min(self.gripper.height_mm, self.gripper.balloon_depth_mm)
        if least < 2 * self.numerics.dx_mm:
            raise ValueError(
                f"numerics.dx_mm {self.numerics.dx_mm:g} is too coarse for a gripper of "
                f"{least:g} mm: at most {least / 2:g}"
            )
        if self.medium.kind != "air":
            loosest = self.medium.porosity * (1 + PACKING_SIGMAS * self.grasp.nuisance.packing)
            if loosest >= 1:
                limit = (1 / self.medium.porosity - 1) / PACKING_SIGMAS
                raise ValueError(
                    f"medium.porosity {self.medium.porosity:g} leaves no grains where the packing "
                    f"is loosest: lower grasp.nuisance.packing below {limit:.3f}"
                )
        return self


def actual_scene(scene: Scene) -> Scene:
    """Return the scene that the gripper meets: what differs from the design, and from what the
    session and the grasp were meant to be, is added to the settings that it changes.

    Balloon and fill stay as `assembly` has them. Nothing is checked again.

    >>> turned = Scene.model_validate({"grasp": {"angle_deg": 9, "placed_deg": -1.5}})
    >>> actual_scene(turned).grasp.angle_deg, actual_scene(turned).grasp.placed_deg
    (7.5, 0.0)
    """
    gripper, grasp, air = scene.gripper, scene.grasp, scene.environment
    assembly, session, neutral = scene.assembly, scene.session, Grasp()
    meets = {
        "bed_depth_mm": gripper.bed_depth_mm + session.fill_mm,
        "speaker_mm": _moved(gripper.speaker_mm, assembly.speaker_moved_mm),
        "microphone_mm": _moved(gripper.microphone_mm, assembly.microphone_moved_mm),
    }
    centre = _moved(_moved((grasp.offset_x_mm, grasp.offset_y_mm), grasp.placed_mm), session.jig_mm)
    held = {
        "offset_x_mm": centre[0],
        "offset_y_mm": centre[1],
        "angle_deg": grasp.angle_deg + grasp.placed_deg,
        "placed_mm": neutral.placed_mm,
        "placed_deg": neutral.placed_deg,
        "temperature_k": neutral.temperature_k,
    }
    warmth = {"temperature_c": air.temperature_c + session.temperature_k + grasp.temperature_k}
    fixed = Assembly(askew_mm=assembly.askew_mm, fill_slope_deg=assembly.fill_slope_deg)
    return scene.model_copy(
        update={
            "gripper": gripper.model_copy(update=meets),
            "grasp": grasp.model_copy(update=held),
            "environment": air.model_copy(update=warmth),
            "assembly": fixed,
            "session": SessionOffsets(),
        }
    )


def _moved(place: tuple[float, float], by: tuple[float, float]) -> tuple[float, float]:
    return place[0] + by[0], place[1] + by[1]


def _refuse_gripper(met: Scene) -> None:
    """Raise ValueError for a gripper that cannot be as it came out and was filled."""
    try:
        Gripper.model_validate(met.gripper.model_dump())
    except ValidationError as error:
        message = error.errors()[0]["msg"].removeprefix("Value error, ")
        raise ValueError(f"with assembly and session: {message}") from None
    if math.hypot(*met.assembly.askew_mm) > met.gripper.rim_radius_mm / 2:
        raise ValueError(
            "assembly.askew_mm puts the balloon's tip outside half of the rim's radius, "
            f"{met.gripper.rim_radius_mm / 2:g} mm: reduce it"
        )


def _refuse_air(met: Scene, scene: Scene) -> None:
    """Raise ValueError for air that session and drift take out of its range."""
    temperature_c = met.environment.temperature_c
    if not COLDEST_AIR_C <= temperature_c <= HOTTEST_AIR_C:
        raise ValueError(
            f"session.temperature_k {scene.session.temperature_k:g} and grasp.temperature_k "
            f"{scene.grasp.temperature_k:g} take the air to {temperature_c:g} °C: keep it from "
            f"{COLDEST_AIR_C:g} to {HOTTEST_AIR_C:g} °C"
        )


def _known(name: str, what: str, names: Iterable[str]) -> str:
    """`name` if it is one of `names`; ValueError with those most like it if not."""
    known = sorted(names)
    if name not in known:
        close = difflib.get_close_matches(name, known, n=3, cutoff=0.5) or known
        raise ValueError(f"no {what} is called {name!r}: try {', '.join(close)}")
    return name


def derive_seed(*parts: str | int) -> int:
    """Return a seed of 63 bits from names and numbers.

    >>> derive_seed(7, "cube_10", 3)
    4718857417853082337

    It is the SHA-256 of the parts' JSON: one scene's seed depends on no other one, on no machine.
    """
    digest = hashlib.sha256(json.dumps(parts).encode()).digest()
    return int.from_bytes(digest[:8], "big") >> 1


def scene_digest(scene: Scene) -> str:
    """Return the SHA-256 (hex) of the scene's canonical JSON and the version of the physics."""
    content = {"physics": PHYSICS_VERSION, "scene": scene.model_dump(mode="json")}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()
