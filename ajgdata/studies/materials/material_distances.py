"""Distances between materials, effect by effect of contact physics, simulated."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ajgdata.features.spectrum import frequencies_hz, spectrum
from ajgdata.gripper import SAMPLE_RATE_HZ, Scene, SignalChain, excitation_sweep, record, simulate
from ajgdata.gripper.scene_model import ObjectPart
from ajgdata.studies.materials.contact_estimates import HARD, REFERENCE, SHAPES
from ajgdata.types import FeatureSettings
from ajgdata.types.table import Column, Table, Value

R = NDArray[np.floating]
SETTINGS = FeatureSettings()
QUIET = SignalChain(noise_db_spl=None)
LOW = frequencies_hz(SAMPLE_RATE_HZ, SETTINGS) < 2_500
MATERIALS_TRIED = (*HARD, "styrofoam")


@dataclass(frozen=True)
class Physics:
    """Physics that is simulated: parts left out, the support, the membrane under the grains."""

    omit: tuple[ObjectPart, ...]
    support: str = "rigid"
    pinned: bool = False


#: Each adds one effect to the one before.
STEPS = {
    "skin of the object yields": Physics(("film", "frame", "elastic", "motion")),
    "+ it moves on its contact with the ground": Physics(("film", "frame", "elastic")),
    "+ it lies on concave rubber": Physics(("film", "frame", "elastic"), "concave"),
    "+ it bends and rings": Physics(("film", "frame"), "concave"),
    "+ grains carry sound to it": Physics(("film",), "concave"),
    "+ grains hold the membrane": Physics(("film",), "concave", True),
}


@cache
def feature(shape: str, material: str, physics: Physics, seed: int, dx_mm: float) -> R:
    """Feature (1025,) of a recording without noise."""
    scene = Scene.model_validate(
        {
            "object": {**SHAPES[shape], "material": material},
            "support": {"kind": physics.support},
            "gripper": {"membrane": {"pinned": physics.pinned}},
            "grasp": {"seed": seed},
            "numerics": {"dx_mm": dx_mm, "tolerance": 0.0, "omit": physics.omit},
        }
    )
    take = record(simulate(scene), excitation_sweep(), QUIET)
    return spectrum(take.samples, SAMPLE_RATE_HZ, SETTINGS).astype(float)


def distance(one: R, other: R) -> tuple[float, float]:
    """Relative L2 distance of a feature (1025,) from the `other`: whole band, below 2.5 kHz."""
    change = one - other
    whole = np.linalg.norm(change) / np.linalg.norm(other)
    return float(whole), float(np.linalg.norm(change[LOW]) / np.linalg.norm(other[LOW]))


def scatter(shape: str, physics: Physics, grasps: int, dx_mm: float) -> tuple[float, float]:
    """Root mean square distance between two grasps of the same steel object."""
    features = [feature(shape, REFERENCE, physics, s, dx_mm) for s in range(1, grasps + 1)]
    pairs = np.array([distance(a, b) for a, b in combinations(features, 2)])
    whole, low = np.sqrt(np.mean(pairs**2, axis=0))
    return float(whole), float(low)


def distances(
    shapes: Iterable[str] = tuple(SHAPES),
    steps: Iterable[str] = tuple(STEPS),
    grasps: int = 6,
    dx_mm: float = 4.0,
) -> Table:
    """Distance from steel by effect, beside what another grasp of the same object does."""
    rows = tuple(row for shape in shapes for row in _rows(shape, steps, grasps, dx_mm))
    return Table(
        "material_distances",
        "Distance between materials, simulated",
        "Relative L2 distance of the feature from that of steel in the same grasp, whole band and"
        " below 2.5 kHz; scatter: between two grasps of the steel object. Each step adds an effect"
        f" to the one before. Plastic balls, {dx_mm:g} mm grid, no noise. Nothing is fitted to the"
        " paper.",
        (
            Column("shape", "Object"),
            Column("step", "Physics"),
            *(Column(name, name.capitalize()) for name in MATERIALS_TRIED),
            *(Column(f"{name}_low", f"{name.capitalize()}, low") for name in MATERIALS_TRIED),
            Column("scatter", "Scatter"),
            Column("scatter_low", "Scatter, low"),
        ),
        rows,
    )


def _rows(
    shape: str, steps: Iterable[str], grasps: int, dx_mm: float
) -> Iterator[dict[str, Value]]:
    for step in steps:
        physics = STEPS[step]
        steel = feature(shape, REFERENCE, physics, 1, dx_mm)
        row: dict[str, Value] = {"shape": shape, "step": step}
        for name in MATERIALS_TRIED:
            row[name], row[f"{name}_low"] = distance(feature(shape, name, physics, 1, dx_mm), steel)
        row["scatter"], row["scatter_low"] = scatter(shape, physics, grasps, dx_mm)
        yield row
