"""What leaving out parts of the physics changes, measured on scenes that the table does not hold.

A change is the largest relative change (L2) of the amplitude in any third octave from 63 Hz up, or
of the feature, which is made of more of them and hides what a narrow band loses.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from ajgdata.features.spectrum import spectrum
from ajgdata.gripper import (
    SAMPLE_RATE_HZ,
    Plan,
    Scene,
    SignalChain,
    build_plan,
    excitation_sweep,
    record,
    simulate,
)
from ajgdata.gripper.object_library import MATERIAL_SET, OBJECTS, PLATE_MM
from ajgdata.gripper.objects import ObjectPart
from ajgdata.gripper.omissions import MARGIN
from ajgdata.gripper.scene import Numerics
from ajgdata.gripper.variation import Variation
from ajgdata.studies import TIMED
from ajgdata.types import FeatureSettings
from ajgdata.types.table import Column, Table, Value

Real = NDArray[np.floating]
Shape = dict[str, Any]
PARTS: tuple[ObjectPart, ...] = get_args(ObjectPart)
#: Centres of third octaves (IEC 61260-1, base 10) from 63 Hz, where heavy objects bounce on rubber.
BANDS_HZ = 10 ** (np.arange(18, 42) / 10)
#: Lower and upper edge of a band over its centre.
EDGES = (10**-0.05, 10**0.05)
#: Longer than any scene of the default marches; the slowest bounce rings for 50 ms.
TIME_S = 0.1
#: Offsets (mm) of the recipes of spheres and plates; those of bars and cubes are less.
OFFSET_MM = 3.0
#: Seeds from here on are of poses that the table does not hold.
FIRST_SEED = 100
TOTAL = "all that is left out"
QUICK = (
    "14 mm cube of PLA on the ground",
    "67 mm sphere of wood on concave rubber",
    "plate of wood on concave rubber",
)


@dataclass(frozen=True)
class Case:
    """An object on a support, in the pose of one grasp of one session of one gripper."""

    name: str
    shape: Shape
    support: str
    seed: int
    medium: str = "plastic"
    dx_mm: float = Numerics().dx_mm

    def plan(self, omit: Sequence[ObjectPart] = (), tolerance: float = 0.0) -> Plan:
        """Return the plan without `omit` and what the table says is worth less than `tolerance`."""
        drawn, names = Variation(), ("omissions", self.seed)
        generator = np.random.default_rng(self.seed)
        offset = generator.uniform(-OFFSET_MM, OFFSET_MM, 2)
        grasp = {
            "seed": self.seed,
            "angle_deg": generator.uniform(-90, 90),
            "offset_x_mm": offset[0],
            "offset_y_mm": offset[1],
            "nuisance": drawn.nuisance({}),
            **drawn.placement(*names),
        }
        scene = {
            "object": self.shape,
            "support": {"kind": self.support},
            "medium": {"kind": self.medium},
            "grasp": grasp,
            "session": drawn.offsets(*names),
            "assembly": Variation.model_validate({"gripper": {"name": str(names)}}).assembly(None),
            # All for the same time: stopping a little earlier or later would be seen as a change.
            "numerics": {
                "dx_mm": self.dx_mm,
                "decay_db": 160.0,
                "max_time_s": TIME_S,
                "omit": omit,
                "tolerance": tolerance,
            },
        }
        return build_plan(Scene.model_validate(scene))


@dataclass(frozen=True)
class Sound:
    """A recording without noise: feature of unit norm, amplitudes at each Hz in third octaves, and
    the process time of the response in seconds."""

    feature: Real
    bands: tuple[Real, ...]
    seconds: float

    def change(self, other: Sound) -> dict[str, float]:
        """Return the change to `other`: the largest, its third octave, and that of the feature."""
        feature = float(np.linalg.norm(self.feature - other.feature))
        pairs = zip(self.bands, other.bands, strict=True)
        changes = [float(np.linalg.norm(a - b) / np.linalg.norm(a)) for a, b in pairs]
        worst = int(np.argmax(changes))
        return {
            "measured": max(feature, changes[worst]),
            "feature": feature,
            "band_hz": float(BANDS_HZ[worst].round()),
            "time_ratio": other.seconds / self.seconds,
        }


def sound(plan: Plan) -> Sound:
    """Record the response of `plan` without noise."""
    begin = time.process_time()
    response = simulate(plan)
    seconds = time.process_time() - begin
    take = record(response, excitation_sweep(), SignalChain(noise_db_spl=None), seed=0)
    feature = spectrum(take.samples, SAMPLE_RATE_HZ, FeatureSettings()).astype(np.float64)
    amplitude = np.abs(np.fft.rfft(take.samples))
    frequency = np.fft.rfftfreq(len(take.samples), 1 / SAMPLE_RATE_HZ)
    limits = np.searchsorted(frequency, np.multiply.outer(BANDS_HZ, EDGES))
    bands = tuple(amplitude[low:high] for low, high in limits)
    return Sound(feature / np.linalg.norm(feature), bands, seconds)


def changes(case: Case) -> dict[ObjectPart, dict[str, float]]:
    """Return what leaving out each part changes. With the grains' frame the object moves, so that
    its motion and its elasticity are judged where there is no frame."""
    full, free = sound(case.plan()), sound(case.plan(("frame",)))
    measured: dict[ObjectPart, dict[str, float]] = {"frame": full.change(free)}
    for part in PARTS:
        if part in ("motion", "elastic"):
            measured[part] = free.change(sound(case.plan(("frame", part))))
        elif part != "frame":
            measured[part] = full.change(sound(case.plan((part,))))
    return measured


def sphere(diameter_mm: float, material: str) -> Shape:
    """Return a solid sphere."""
    return {"kind": "sphere", "diameter_mm": diameter_mm, "material": material}


def cube(edge_mm: float, material: str = "pla") -> Shape:
    """Return a cube."""
    return {"kind": "cube", "edge_mm": edge_mm, "material": material}


def box(length_mm: float, width_mm: float, height_mm: float, material: str) -> Shape:
    """Return a box: plates are thin, bars are long."""
    sizes = {"length_mm": length_mm, "width_mm": width_mm, "height_mm": height_mm}
    return {"kind": "box", **sizes, "material": material}


def sample() -> list[Case]:
    """Return the cases of the study: sizes and poses between those of the table, and some objects
    that it does not hold."""
    shapes = [(f"{edge} mm cube of PLA", cube(edge), "rigid") for edge in (14, 26)]
    shapes += [("64 mm sphere of plastic", sphere(64, "plastic"), "rigid")]
    for material in MATERIAL_SET.values():
        shapes += [
            (f"{size} mm sphere of {material}", sphere(size, material), "concave")
            for size in (42, 67)
        ]
        plate = box(100, 100, PLATE_MM, material)
        shapes += [(f"plate of {material}", plate, "concave")]
    for name in ("bar", "bar_flat", "foam_brick", "tennis_ball", "padlock"):
        thing = OBJECTS[name].shape.model_dump(exclude_none=True)
        shapes += [(name.replace("_", " "), thing, "rigid")]
    on = {"rigid": "the ground", "concave": "concave rubber"}
    return [
        Case(f"{name} on {on[support]}", shape, support, FIRST_SEED + number)
        for number, (name, shape, support) in enumerate(shapes)
    ]


def omission_rows(case: Case) -> list[dict[str, Value]]:
    """Return one row per part that the object has, and a last one for all that the default plan
    leaves out, if it leaves out anything."""
    tolerance = Numerics().tolerance
    default = case.plan(tolerance=tolerance)
    parts = {part.name: part for part in default.parts}
    present = {part.name for part in case.plan().parts if part.is_solved}
    named: dict[str, Value] = {"scene": case.name, "tolerance": tolerance}
    rows: list[dict[str, Value]] = [
        {**named, **change, "part": part}
        | {"bound": parts[part].effect, "kept": parts[part].is_solved}
        for part, change in changes(case).items()
        if part in present
    ]
    if all(row["kept"] for row in rows):
        return rows
    total = sound(case.plan()).change(sound(default))
    return [*rows, {**named, "part": TOTAL, "bound": None, "kept": None, **total}]


def tables(quick: bool = False) -> tuple[Table, ...]:
    """Omissions over the sample of scenes; `quick`: three of them on a coarse grid."""
    cases = sample()
    if quick:
        cases = [replace(case, dx_mm=6.0) for case in cases if case.name in QUICK]
    # Compiled kernels, before anything is timed.
    simulate(replace(cases[0], dx_mm=6.0).plan())
    rows = tuple(row for case in cases for row in omission_rows(case))
    note = (
        "The largest relative change (L2) of the amplitude in any third octave from 63 Hz to 12.5"
        " kHz, or of the feature, of a noise-free sweep. Bound: the largest change in the scenes of"
        f" the table, other sizes and poses, times {MARGIN:g}; a part without a bound is solved."
        f" With the grains' frame the object moves. Time: without the part over with it. {TIMED}"
    )
    columns = (
        Column("scene", "Scene"),
        Column("part", "Part"),
        Column("bound", "Bound"),
        Column("measured", "Measured change, largest of all bands"),
        Column("band_hz", "In the third octave at", "Hz"),
        Column("feature", "Measured change of the feature"),
        Column("kept", "Solved"),
        Column("tolerance", "Tolerance"),
        Column("time_ratio", "Time without / with"),
    )
    title = "What leaving a part out changes, simulated"
    return (Table("omissions", title, note, columns, rows),)
