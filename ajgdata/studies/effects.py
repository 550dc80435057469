"""What each effect of the contact is worth: one setting changed, all else the same, simulated."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.features.spectrum import frequencies_hz, spectrum
from ajgdata.gripper import (
    SAMPLE_RATE_HZ,
    Scene,
    SignalChain,
    build_plan,
    excitation_sweep,
    record,
    simulate,
)
from ajgdata.gripper.object_library import OBJECTS
from ajgdata.gripper.scene import Numerics
from ajgdata.studies import TIMED
from ajgdata.types import FeatureSettings
from ajgdata.types.table import Column, Table, Value

Real = NDArray[np.floating]
Given = Mapping[str, Any]
QUIET = SignalChain(noise_db_spl=None)
LOW = frequencies_hz(SAMPLE_RATE_HZ, FeatureSettings()) < 1_200
#: As long as the default marches; the same for all, so that stopping is not heard as a change.
NUMERICS = {"decay_db": 160.0, "max_time_s": 0.06}
#: What the first design draped by.
CONE = {"gripper": {"drape_deg": 72.0, "drape_smoothing_mm": 1.5}}


def _membrane(**settings: float) -> Given:
    return {"gripper": {"membrane": settings}}


def _sphere(material: str, shell_mm: float | None) -> Given:
    sphere = {"kind": "sphere", "diameter_mm": 80, "material": material, "shell_mm": shell_mm}
    return {"object": sphere}


@dataclass(frozen=True)
class Effect:
    """One change: from the scene `before` to the scene `after`, of an object of the library.

    `what` is how the default stands to it: "default" is `after`; a "range" goes from end to end; a
    "variant" is not the default.
    """

    name: str
    thing: str
    what: str
    before: Given
    after: Given


def _effects() -> tuple[Effect, ...]:
    tension = (_membrane(stiffness_n_m3=5e4), _membrane(stiffness_n_m3=2e5))
    ends = tuple({"gripper": {"drape_smoothing_mm": width}} for width in (0.75, 3.0))
    film = {end: _membrane(film=end) for end in (0.0, 0.25, 1.0, 4.0)}
    pressed = ("cube_20p7", "bar", "sphere30_metal")
    held = ("cube_20p7", "sphere80_metal", "sphere80_wood", "sphere80_styrofoam", "plate_wood")
    plates = ("metal", "wood", "plastic", "styrofoam")
    return (
        *(Effect("drape by tension, not at 72°", o, "default", CONE, {}) for o in pressed),
        *(Effect("tension of 20 to 80 N/m", o, "range", *tension) for o in pressed[:2]),
        Effect("rounding of 0.75 to 3 mm", "cube_20p7", "range", *ends),
        *(Effect("trapped air", o, "default", film[0.0], film[1.0]) for o in held),
        *(Effect("trapped air × ¼ to × 4", o, "range", film[0.25], film[4.0]) for o in held[1:3]),
        *(
            Effect(f"hollow, {wall} mm", f"sphere80_{name}", "variant", *_hollow(material, wall))
            for name, material, wall in (
                ("metal", "steel", 1.0),
                ("plastic", "plastic", 2.0),
                ("wood", "wood", 4.0),
            )
        ),
        *(
            Effect("thickness within its tolerance", f"plate_{name}", "variant", *_both(name))
            for name in plates
        ),
    )


def _hollow(material: str, wall: float) -> tuple[Given, Given]:
    return _sphere(material, None), _sphere(material, wall)


def _both(name: str) -> tuple[Given, Given]:
    return {"object": f"plate_{name}_thin"}, {"object": f"plate_{name}_thick"}


EFFECTS = _effects()
QUICK = tuple(one for one in EFFECTS if one.thing in ("cube_20p7", "sphere80_wood"))


@dataclass(frozen=True)
class Heard:
    """A feature (1025,), and the process time of plan and response in seconds."""

    feature: Real
    seconds: float


def heard(thing: str, given: Given, seed: int = 0, dx_mm: float | None = None) -> Heard:
    """Record the object as `given` changes its scene, without noise; spheres and plates lie on the
    concave piece of rubber, all else on the ground."""
    grid = NUMERICS | ({} if dx_mm is None else {"dx_mm": dx_mm})
    rests = "concave" if OBJECTS[thing].category in ("sphere", "plate") else "rigid"
    scene = {"object": thing, "support": {"kind": rests}, "grasp": {"seed": seed}, **given}
    scene["numerics"] = grid
    begin = time.process_time()
    response = simulate(build_plan(Scene.model_validate(scene)))
    seconds = time.process_time() - begin
    take = record(response, excitation_sweep(), QUIET)
    feature = spectrum(take.samples, SAMPLE_RATE_HZ, FeatureSettings()).astype(np.float64)
    return Heard(feature, seconds)


def distance(one: Real, other: Real) -> tuple[float, float]:
    """Relative L2 distance of features (1025,): whole band, below 1.2 kHz."""
    change = one - other
    whole = np.linalg.norm(change) / np.linalg.norm(other)
    return float(whole), float(np.linalg.norm(change[LOW]) / np.linalg.norm(other[LOW]))


def effect_row(effect: Effect, dx_mm: float | None = None) -> dict[str, Value]:
    """Return what the change does, beside what another grasp in the changed scene does."""
    before = heard(effect.thing, effect.before, dx_mm=dx_mm)
    after = heard(effect.thing, effect.after, dx_mm=dx_mm)
    again = heard(effect.thing, effect.after, 1, dx_mm)
    change, low = distance(before.feature, after.feature)
    scatter, scatter_low = distance(again.feature, after.feature)
    tolerance = Numerics().tolerance
    return {
        "effect": effect.name,
        "object": effect.thing,
        "what": effect.what,
        "change": change,
        "change_low": low,
        "scatter": scatter,
        "scatter_low": scatter_low,
        "worth": change > tolerance,
        "tolerance": tolerance,
        "time_ratio": after.seconds / before.seconds,
    }


def tables(quick: bool = False) -> tuple[Table, ...]:
    """What each effect is worth; `quick`: two objects on a coarse grid."""
    dx_mm = 6.0 if quick else None
    # Compiled kernels, before anything is timed.
    for thing, given in (("sphere30_metal", CONE), ("cube_20p7", {}), ("cube_20p7", CONE)):
        heard(thing, given, dx_mm=6.0)
    rows = tuple(effect_row(effect, dx_mm) for effect in (QUICK if quick else EFFECTS))
    return (
        Table(
            "effects",
            "What each effect of the contact is worth, simulated",
            "Relative L2 change of the feature of a noise-free sweep by one change of the scene,"
            " whole band and below 1.2 kHz; scatter: between two grasps of the changed scene."
            " Default: the change is made in every scene; range: from one end of what is not known"
            " to the other; variant: not the default. Worth it: above the tolerance of a plan."
            f" Time: after over before, plan and response. {TIMED}",
            (
                Column("effect", "Effect"),
                Column("object", "Object"),
                Column("what", "Is"),
                Column("change", "Change"),
                Column("change_low", "Change, low"),
                Column("scatter", "Scatter"),
                Column("scatter_low", "Scatter, low"),
                Column("worth", "Worth it"),
                Column("tolerance", "Tolerance"),
                Column("time_ratio", "Time after / before"),
            ),
            rows,
        ),
    )
