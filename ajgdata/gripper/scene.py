"""The scene of a recording: plain data, checked before a simulation starts.

In the frame of the gripper, z points up, z = 0 is the rim where the balloon meets the housing, and
x = y = 0 is the axis. Sizes are in millimetres, as on a drawing; the solver uses SI units.
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

#: Version of the physics, a part of every digest. A change of the results of scenes increases it.
PHYSICS_VERSION = 5
#: The time step follows from the speed of sound at this temperature; hotter air shortens it.
HOTTEST_C = 30.0
#: Range of the temperature of the air, with the offsets of session and grasp.
COLDEST_AIR_C = -20.0
HOTTEST_AIR_C = 60.0
#: The local porosity is limited to this number of standard deviations.
PACKING_SIGMAS = 3.0
SAMPLE_RATE_HZ = 44_100
Precision = Literal["float32", "float64"]
Shift = Annotated[float, Field(ge=-50, le=50)]
Degrees = Annotated[float, Field(ge=-45, le=45)]
Pair = tuple[Shift, Shift]

#: Grain diameter in mm and porosity of each medium. The diameters are those of the paper (coffee:
#: medium grind), the porosities those of random loose packings of spheres and of ground coffee.
GRAINS = {"plastic": (6.0, 0.40), "metal": (4.5, 0.40), "coffee": (0.7, 0.50), "air": (6.0, 0.40)}


class Medium(SceneModel):
    """Grains inside the balloon; `air` is a gripper without grains. The fill level is a setting of
    the gripper."""

    kind: Literal["plastic", "metal", "coffee", "air"] = "plastic"
    grain_diameter_mm: Annotated[float, Field(ge=0.05, le=20)] = Field(
        6.0, description="default: that of the kind"
    )
    porosity: Annotated[float, Field(ge=0.2, le=0.95)] = Field(
        0.40, description="default: that of the kind"
    )
    heave_deg: Annotated[float, Field(gt=0, lt=60)] = Field(
        30.0, description="friction angle: half-angle of the cone that heaves above an imprint"
    )
    heave_fraction: Annotated[float, Field(ge=0, le=1)] = Field(
        0.5, description="share of displaced grains that heave there; all others spread; estimate"
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
    slope_deg: Annotated[float, Field(ge=0, le=10)] = Field(
        1.5, description="slope of the free surface"
    )
    packing: Annotated[float, Field(ge=0, le=0.2)] = Field(
        0.06, description="local porosity, relative to the mean"
    )
    packing_correlation_mm: Annotated[float, Field(ge=0.5, le=1000)] = 5.0
    force: Annotated[float, Field(ge=0, le=0.2)] = Field(
        0.03, description="grasp force, relative to the mean"
    )
    grain_force: Annotated[float, Field(ge=0, le=1)] = Field(
        0.0,
        description="force on one grain, relative to the mean; N = (object's width / grain)² grains"
        " carry an object, so the depth of its imprint scatters by √N less",
    )


class Assembly(SceneModel):
    """Tolerances of one gripper relative to its design; the same in all its sessions."""

    askew_mm: Pair = Field(
        (0.0, 0.0), description="shift of the free balloon's tip along x, y; its rim does not move"
    )
    fill_slope_deg: tuple[Degrees, Degrees] = Field(
        (0.0, 0.0), description="rise of the grains' surface along x and along y"
    )
    speaker_moved_mm: Pair = Field((0.0, 0.0), description="x, y added to gripper.speaker_mm")
    microphone_moved_mm: Pair = Field((0.0, 0.0), description="x, y added to gripper.microphone_mm")


class SessionOffsets(SceneModel):
    """Deviations that all grasps of a session share, and that differ between sessions."""

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
    """Position of a grasp in the history of its bed, which is loosened and not poured again.

    Surface and packing follow an autoregressive process of first order: field = ρ · previous field
    + √(1 - ρ²) · new field. Their variance is constant, and two grasps at a distance of n grasps
    have the correlation ρⁿ.
    """

    seed: Annotated[int, Field(ge=0, lt=2**63)] = Field(description="seed of the whole history")
    number: Annotated[int, Field(ge=0, lt=10**9)] = Field(
        0, description="number of earlier grasps with this bed"
    )
    memory: Annotated[float, Field(ge=0, lt=1)] = Field(
        0.0, description="ρ, the correlation of successive grasps"
    )


class Grasp(SceneModel):
    """One closing of the gripper on the object."""

    seed: Annotated[int, Field(ge=0, lt=2**63)] = Field(0, description="seed of all nuisances")
    angle_deg: float = Field(0.0, description="angle of the object about z")
    offset_x_mm: float = Field(0.0, description="offset of the object's centre from the axis")
    offset_y_mm: float = 0.0
    force_n: Annotated[float, Field(ge=1e-3, le=40)] = Field(8.0, description="paper: 8 N")
    placed_mm: Pair = Field((0.0, 0.0), description="error of the placement, added to the offset")
    placed_deg: Degrees = Field(0.0, description="error of the placement, added to the angle")
    temperature_k: Annotated[float, Field(ge=-20, le=20)] = Field(
        0.0, description="drift of the air in the session, added to environment.temperature_c"
    )
    nuisance: Nuisance = Nuisance()
    history: History | None = Field(
        None, description="history of the bed; null: a newly poured bed, drawn from `seed`"
    )


class Environment(SceneModel):
    """Temperature and pressure of the air."""

    temperature_c: Annotated[float, Field(ge=COLDEST_AIR_C, le=HOTTEST_AIR_C)] = 22.0
    pressure_pa: Annotated[float, Field(ge=5e4, le=1.1e5)] = 101_325.0


class Numerics(SceneModel):
    """Grid, precision and length of the response.

    `ajgdata.studies.accuracy` measures the error of the feature as a function of the run time.
    """

    dx_mm: Annotated[float, Field(ge=0.8, le=6)] = Field(
        4.2, description="edge of a cell; nearly the finest grid with four steps per sample"
    )
    poles: Literal[0, 1, 2] = Field(
        2, description="relaxation poles in the compressibility of the grains"
    )
    cfl: Annotated[float, Field(ge=0.01, lt=1)] = Field(
        0.99, description="upper bound of the time step in units of its limit at 30 °C"
    )
    precision: Precision = "float32"
    decay_db: Annotated[float, Field(ge=20, le=160)] = Field(
        50.0, description="stop when the energy in the cavity has fallen by this level"
    )
    max_time_s: Annotated[float, Field(gt=0, le=1)] = Field(
        0.2, description="longest response; stop there if the energy has not fallen enough"
    )
    modes_hz: Annotated[float, Field(gt=0, le=21_000)] = Field(
        8_000.0, description="modes of the object up to this frequency are solved"
    )
    omit: tuple[ObjectPart, ...] | None = Field(
        None,
        description="omitted parts of the object; null: on hard blocks, those that change the"
        " feature by less than 1 %; []: none",
    )


class Scene(SceneModel):
    """Everything that determines one impulse response.

    Without an object (`object: null`), the gripper hangs free in the air. `gripper` and `object`
    can be names (`grippers.GRIPPERS`, `object_library.OBJECTS`). The scene contains their sizes and
    not their names, so its digest depends only on the sizes.

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
    def _check(self) -> Scene:
        """Raise ValueError for a scene that is not possible."""
        actual = actual_scene(self)
        _check_gripper(actual)
        _check_air(actual, self)
        _check_position(actual)
        _check_grid(self)
        _check_packing(self)
        return self


def actual_scene(scene: Scene) -> Scene:
    """Return a scene with its deviations added to the settings that they change.

    These are the shifts of the transducers, all offsets of the session, and the errors of placement
    and the drift of the grasp. Shift and slope in `assembly` remain, because no other setting
    contains them. The result is not checked.

    >>> turned = Scene.model_validate({"grasp": {"angle_deg": 9, "placed_deg": -1.5}})
    >>> actual_scene(turned).grasp.angle_deg, actual_scene(turned).grasp.placed_deg
    (7.5, 0.0)
    """
    gripper = scene.gripper
    grasp = scene.grasp
    air = scene.environment
    assembly = scene.assembly
    session = scene.session
    actual_gripper = {
        "bed_depth_mm": gripper.bed_depth_mm + session.fill_mm,
        "speaker_mm": _moved(gripper.speaker_mm, assembly.speaker_moved_mm),
        "microphone_mm": _moved(gripper.microphone_mm, assembly.microphone_moved_mm),
    }
    centre = _moved(_moved((grasp.offset_x_mm, grasp.offset_y_mm), grasp.placed_mm), session.jig_mm)
    without_errors = Grasp()
    actual_grasp = {
        "offset_x_mm": centre[0],
        "offset_y_mm": centre[1],
        "angle_deg": grasp.angle_deg + grasp.placed_deg,
        "placed_mm": without_errors.placed_mm,
        "placed_deg": without_errors.placed_deg,
        "temperature_k": without_errors.temperature_k,
    }
    temperature_c = air.temperature_c + session.temperature_k + grasp.temperature_k
    return scene.model_copy(
        update={
            "gripper": gripper.model_copy(update=actual_gripper),
            "grasp": grasp.model_copy(update=actual_grasp),
            "environment": air.model_copy(update={"temperature_c": temperature_c}),
            "assembly": Assembly(
                askew_mm=assembly.askew_mm, fill_slope_deg=assembly.fill_slope_deg
            ),
            "session": SessionOffsets(),
        }
    )


def _moved(position: tuple[float, float], shift: tuple[float, float]) -> tuple[float, float]:
    return position[0] + shift[0], position[1] + shift[1]


def _check_gripper(actual: Scene) -> None:
    """Raise ValueError for a gripper that is not possible with its assembly and fill."""
    try:
        Gripper.model_validate(actual.gripper.model_dump())
    except ValidationError as error:
        message = error.errors()[0]["msg"].removeprefix("Value error, ")
        raise ValueError(f"with assembly and session: {message}") from None
    if math.hypot(*actual.assembly.askew_mm) > actual.gripper.rim_radius_mm / 2:
        raise ValueError(
            "assembly.askew_mm puts the balloon's tip outside half of the rim's radius, "
            f"{actual.gripper.rim_radius_mm / 2:g} mm: reduce it"
        )


def _check_air(actual: Scene, scene: Scene) -> None:
    """Raise ValueError if session and drift take the air out of its range."""
    temperature_c = actual.environment.temperature_c
    if not COLDEST_AIR_C <= temperature_c <= HOTTEST_AIR_C:
        raise ValueError(
            f"session.temperature_k {scene.session.temperature_k:g} and grasp.temperature_k "
            f"{scene.grasp.temperature_k:g} take the air to {temperature_c:g} °C: keep it from "
            f"{COLDEST_AIR_C:g} to {HOTTEST_AIR_C:g} °C"
        )


def _check_position(actual: Scene) -> None:
    """Raise ValueError if the object's centre is outside the rim."""
    offset_mm = math.hypot(actual.grasp.offset_x_mm, actual.grasp.offset_y_mm)
    rim_mm = actual.gripper.rim_radius_mm
    if actual.object and offset_mm > rim_mm:
        raise ValueError(
            f"the object's centre lies outside the gripper's rim of {rim_mm:g} mm: "
            "reduce grasp.offset_x_mm or grasp.offset_y_mm"
        )


def _check_grid(scene: Scene) -> None:
    """Raise ValueError if the grid is too coarse for the gripper."""
    least_mm = min(scene.gripper.height_mm, scene.gripper.balloon_depth_mm)
    if least_mm < 2 * scene.numerics.dx_mm:
        raise ValueError(
            f"numerics.dx_mm {scene.numerics.dx_mm:g} is too coarse for a gripper of "
            f"{least_mm:g} mm: at most {least_mm / 2:g}"
        )


def _check_packing(scene: Scene) -> None:
    """Raise ValueError if the loosest parts of the packing would have no grains."""
    if scene.medium.kind == "air":
        return
    loosest = scene.medium.porosity * (1 + PACKING_SIGMAS * scene.grasp.nuisance.packing)
    if loosest >= 1:
        limit = (1 / scene.medium.porosity - 1) / PACKING_SIGMAS
        raise ValueError(
            f"medium.porosity {scene.medium.porosity:g} leaves no grains where the packing "
            f"is loosest: lower grasp.nuisance.packing below {limit:.3f}"
        )


def _known(name: str, noun: str, names: Iterable[str]) -> str:
    """Return `name` if it is one of `names`. Raises ValueError with the most similar names if it is
    not."""
    known = sorted(names)
    if name not in known:
        close = difflib.get_close_matches(name, known, n=3, cutoff=0.5) or known
        raise ValueError(f"no {noun} is called {name!r}: try {', '.join(close)}")
    return name


def derive_seed(*parts: str | int) -> int:
    """Return a seed of 63 bits from names and numbers.

    >>> derive_seed(7, "cube_10", 3)
    4718857417853082337

    It is the beginning of the SHA-256 of the parts as JSON, so it depends neither on other scenes
    nor on the machine.
    """
    digest = hashlib.sha256(json.dumps(parts).encode()).digest()
    return int.from_bytes(digest[:8], "big") >> 1


def scene_digest(scene: Scene) -> str:
    """Return the SHA-256 (hex) of the scene's canonical JSON and the version of the physics."""
    content = {"physics": PHYSICS_VERSION, "scene": scene.model_dump(mode="json")}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()
