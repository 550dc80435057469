"""Omitted parts of the physics: the time that each omission saves, and the change of the sound.

A change is the relative change (L2) of the feature, or the largest relative change of the
amplitude in any third octave from 63 Hz. The feature alone would hide a change in a narrow band.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper import SAMPLE_RATE_HZ, Plan, Scene, build_plan, simulate
from ajgdata.gripper.object_library import MATERIAL_SET, OBJECTS, PLATE_MM
from ajgdata.gripper.objects import ObjectPart
from ajgdata.gripper.parts import WITH_FRAME, omitted_parts
from ajgdata.gripper.scene import Numerics
from ajgdata.gripper.variation import Variation
from ajgdata.studies import LEFT_OUT, TIMES_NOTE
from ajgdata.studies.noise_free import noise_free, relative_error, timed, unit_feature
from ajgdata.types.table import Column, Table, Value

Real = NDArray[np.floating]
Shape = dict[str, Any]
OBJECT_PARTS: tuple[ObjectPart, ...] = get_args(ObjectPart)
#: Centres (Hz) of third octaves (IEC 61260-1, base 10). Heavy objects bounce on rubber at 63 Hz.
BANDS_HZ = 10 ** (np.arange(18, 42) / 10)
#: Lower and upper edge of a band over its centre.
EDGES = (10**-0.05, 10**0.05)
#: Length of a response (s), above that of any default scene; the slowest bounce lasts 50 ms.
TIME_S = 0.1
#: Offsets (mm) of the recipes of spheres and plates; offsets of bars and cubes are smaller.
OFFSET_MM = 3.0
#: Omissions that are not a part of the object, with the settings of the solver.
DEFAULT_MODES = f"modes from {Numerics().modes_hz / 1e3:g} to 21 kHz"
SOLVER: dict[str, dict[str, Any]] = {
    DEFAULT_MODES: {"modes_hz": Numerics().modes_hz},
    "second relaxation pole of the grains": {"poles": 1},
    "both relaxation poles": {"poles": 0},
}
#: Parts that the default omits under hard blocks, all together.
BLOCK_PARTS = "frame, motion and elastic"
#: The settings of a complete plan.
COMPLETE: dict[str, Any] = {"modes_hz": 21_000.0, "poles": 2}
#: Least share of the time that an omission has to save.
LEAST_SAVING = 0.02
#: Largest change of the feature by an omission: a tenth of the change between two grasps.
LARGEST_CHANGE = 0.01
#: Largest change of any third octave.
LARGEST_BAND_CHANGE = 0.05
#: Number of runs, of which the shortest time counts.
REPEATS = 3
#: Names of the cases of a quick run.
QUICK = ("14 mm cube of PLA", "67 mm sphere of wood", "plate of wood")


@dataclass(frozen=True)
class Case:
    """An object on a support, in one grasp of one session of one gripper.

    `scene_class` is the class of scenes to which it belongs.
    """

    scene_class: str
    name: str
    shape: Shape
    support: str
    seed: int
    medium: str = "plastic"
    dx_mm: float = Numerics().dx_mm
    solver: dict[str, Any] = field(default_factory=lambda: dict(COMPLETE))

    def plan(self, omit: Sequence[ObjectPart] = ()) -> Plan:
        """Return the plan without the parts `omit` of the object."""
        return build_plan(self.scene(omit))

    def used_omissions(self) -> set[str]:
        """Return the omissions of the default plan of the scene, with the names of `changes`."""
        if omitted_parts(self.scene(None)):
            return {DEFAULT_MODES, BLOCK_PARTS}
        return {DEFAULT_MODES}

    def scene(self, omit: Sequence[ObjectPart] | None) -> Scene:
        """Return the scene without the parts `omit`; None omits those of the default."""
        drawn = Variation()
        names = ("omissions", self.seed)
        generator = np.random.default_rng(self.seed)
        offset = generator.uniform(-OFFSET_MM, OFFSET_MM, 2)
        grasp = {
            "seed": self.seed,
            "angle_deg": generator.uniform(-90, 90),
            "offset_x_mm": offset[0],
            "offset_y_mm": offset[1],
            "nuisance": drawn.nuisance({}),
            **drawn.placement(*names),
            **drawn.air(0, *names),
        }
        scene = {
            "object": self.shape,
            "support": {"kind": self.support},
            "medium": {"kind": self.medium},
            "grasp": grasp,
            "session": drawn.offsets(*names),
            "assembly": Variation.model_validate({"gripper": {"name": str(names)}}).assembly(None),
            # Equal lengths, because an earlier or later end would count as a change.
            "numerics": {
                "dx_mm": self.dx_mm,
                "decay_db": 160.0,
                "max_time_s": TIME_S,
                "omit": omit,
                **self.solver,
            },
        }
        return Scene.model_validate(scene)


@dataclass(frozen=True)
class Sound:
    """A noise-free recording, and the CPU time of its simulation (s).

    `feature` has unit norm. `bands` are the amplitudes of each third octave.
    """

    feature: Real
    bands: tuple[Real, ...]
    seconds: float

    def change(self, other: Sound) -> dict[str, float]:
        """Return the changes of another sound: the largest, its third octave, feature and time."""
        feature = relative_error(other.feature, self.feature)
        pairs = zip(self.bands, other.bands, strict=True)
        changes = [relative_error(changed, own) for own, changed in pairs]
        worst = int(np.argmax(changes))
        return {
            "measured": max(feature, changes[worst]),
            "feature": feature,
            "band_hz": float(BANDS_HZ[worst].round()),
            "time_ratio": other.seconds / self.seconds,
        }


def sound(plan: Plan) -> Sound:
    """Simulate a plan, and record its response without noise; the time is the shortest."""
    response, seconds = timed(partial(simulate, plan), REPEATS)
    samples = noise_free(response)
    amplitude = np.abs(np.fft.rfft(samples))
    frequency = np.fft.rfftfreq(len(samples), 1 / SAMPLE_RATE_HZ)
    limits = np.searchsorted(frequency, np.multiply.outer(BANDS_HZ, EDGES))
    bands = tuple(amplitude[low:high] for low, high in limits)
    return Sound(unit_feature(samples), bands, seconds)


def changes(case: Case) -> dict[str, dict[str, float]]:
    """Return the changes by each omission, by the name of the part.

    The object moves with the frame of the grains, so the omissions of its motion and elasticity are
    measured without the frame. Parts that the scene lacks, or that have no mode, are absent.
    """
    complete = case.plan()
    present = {part.name for part in complete.parts if part.is_solved}
    full = sound(complete)
    plan_without_frame = case.plan(("frame",))
    free = sound(plan_without_frame)
    measured: dict[str, dict[str, float]] = {}
    for part in OBJECT_PARTS:
        if part not in present:
            continue
        if part == "frame":
            measured[part] = full.change(free)
        elif part in WITH_FRAME:
            plan = case.plan(("frame", part))
            if has_less(plan, plan_without_frame):
                measured[part] = free.change(sound(plan))
        else:
            measured[part] = full.change(sound(case.plan((part,))))
    if omitted_parts(case.scene(None)):
        measured[BLOCK_PARTS] = full.change(sound(case.plan(("frame", *WITH_FRAME))))
    for name, settings in SOLVER.items():
        plan = replace(case, solver=COMPLETE | settings).plan()
        if has_less(plan, complete) or "poles" in settings:
            measured[name] = full.change(sound(plan))
    return measured


def has_less(plan: Plan, other: Plan) -> bool:
    """Return whether a plan has fewer modes than another."""
    return bool(plan.system.modes.inertia.size < other.system.modes.inertia.size)


def sphere(diameter_mm: float, material: str) -> Shape:
    """Return a solid sphere."""
    return {"kind": "sphere", "diameter_mm": diameter_mm, "material": material}


def cube(edge_mm: float, material: str = "pla") -> Shape:
    """Return a cube."""
    return {"kind": "cube", "edge_mm": edge_mm, "material": material}


def box(length_mm: float, width_mm: float, height_mm: float, material: str) -> Shape:
    """Return a box, for example a thin plate or a long bar."""
    sizes = {"length_mm": length_mm, "width_mm": width_mm, "height_mm": height_mm}
    return {"kind": "box", **sizes, "material": material}


def sample() -> list[Case]:
    """Return the cases of the study."""
    cases = [("cubes", f"{edge} mm cube of PLA", cube(edge), "rigid") for edge in (14, 26)]
    for material in MATERIAL_SET.values():
        cases.append(("spheres", f"67 mm sphere of {material}", sphere(67, material), "concave"))
        plate = box(100, 100, PLATE_MM, material)
        cases.append(("plates", f"plate of {material}", plate, "concave"))
    for name in ("bar", "bar_flat", "foam_brick", "tennis_ball", "padlock"):
        shape = OBJECTS[name].shape.model_dump(exclude_none=True)
        scene_class = "bars" if name.startswith("bar") else "household objects"
        cases.append((scene_class, name.replace("_", " "), shape, "rigid"))
    return [Case(*case, seed) for seed, case in enumerate(cases)]


def omission_rows(cases: Sequence[Case]) -> list[dict[str, Value]]:
    """Return one row per part and class of scenes.

    A row has the median of the time that the omission saves, and the largest change in any scene of
    the class.
    """
    by_part: dict[tuple[str, str], list[dict[str, float]]] = {}
    used: set[tuple[str, str]] = set()
    for case in cases:
        used |= {(part, case.scene_class) for part in case.used_omissions()}
        for part, change in changes(case).items():
            by_part.setdefault((part, case.scene_class), []).append(change)
    rows: list[dict[str, Value]] = []
    for (part, scene_class), measured in sorted(by_part.items()):
        saved = 1 - float(np.median([change["time_ratio"] for change in measured]))
        feature = max(change["feature"] for change in measured)
        worst = max(change["measured"] for change in measured)
        is_safe = feature <= LARGEST_CHANGE and worst <= LARGEST_BAND_CHANGE
        is_used = (part, scene_class) in used
        rows.append(
            {
                "part": part,
                "kind": scene_class,
                "saved": saved,
                "feature": feature,
                "measured": worst,
                "verdict": verdict(saved, is_safe=is_safe, is_used=is_used),
                "scenes": len(measured),
            }
        )
    return rows


def verdict(saved: float, *, is_safe: bool, is_used: bool) -> str:
    """Return whether a part is left out or solved, and why it is solved.

    >>> verdict(0.1, is_safe=True, is_used=True), verdict(0.1, is_safe=True, is_used=False)
    ('left out', 'solved: scenes vary')
    >>> verdict(0.1, is_safe=False, is_used=False), verdict(0.0, is_safe=True, is_used=False)
    ('solved: changes the sound', 'solved: saves no time')
    """
    if is_used:
        return LEFT_OUT if is_safe else "left out: changes the sound"
    if not is_safe:
        return "solved: changes the sound"
    if saved >= LEAST_SAVING:
        return "solved: scenes vary"
    return "solved: saves no time"


def tables(quick: bool = False) -> tuple[Table, ...]:
    """Return the omissions by class of scenes; `quick` computes three scenes on a coarse grid."""
    cases = sample()
    if quick:
        cases = [replace(case, dx_mm=6.0) for case in cases if case.name in QUICK]
    # The first simulation compiles the kernels, before any time is measured.
    simulate(replace(cases[0], dx_mm=6.0).plan())
    note = (
        "The change is the largest in any scene of the class, relative (L2), of the feature of a"
        " noise-free sweep, and of the amplitude in any third octave from 63 Hz to 12.5 kHz. Motion"
        " and elasticity are judged without the frame of the grains, with which the object moves."
        f" An omission must save {100 * LEAST_SAVING:g} % of the time, and change the feature by"
        f" at most {LARGEST_CHANGE:g}, any third octave by {LARGEST_BAND_CHANGE:g}. Scenes vary:"
        f" the class is wider than the measured scenes, so the part is solved. {TIMES_NOTE}"
    )
    columns = (
        Column("part", "Left out"),
        Column("kind", "Scenes"),
        Column("saved", "Time saved, as a share"),
        Column("feature", "Change of the feature"),
        Column("measured", "Change of any third octave"),
        Column("verdict", "Verdict"),
        Column("scenes", "Number of scenes"),
    )
    title = "What leaving a part out saves and changes, simulated"
    rows = omission_rows(cases)
    rows.sort(key=lambda row: row["verdict"] != LEFT_OUT)  # the page shows the first rows
    return (Table("omissions", title, note, columns, tuple(rows)),)
