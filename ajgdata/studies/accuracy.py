"""Error against run time: how far a grid is from the limit of ever finer ones, and what it costs.

Errors are those of the feature (`ajgdata.features.spectrum`, unit norm), without noise, relative L2
against the finest grid. Run times are process times of `simulate`, the best of several.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ajgdata.features.spectrum import frequencies_hz, spectrum
from ajgdata.gripper import SAMPLE_RATE_HZ, Scene, SignalChain, excitation_sweep, record, simulate
from ajgdata.gripper.scene import Numerics
from ajgdata.gripper.solver_plan import build_plan
from ajgdata.studies import TIMED
from ajgdata.types import FeatureSettings
from ajgdata.types.table import Column, Table, Value

Real = NDArray[np.floating]
#: kHz, as shown.
BANDS_KHZ = ((0.1, 1.0), (1.0, 3.0), (3.0, 6.0), (6.0, 20.0))
OBJECTS = {
    "20 mm cube": {"kind": "cube", "edge_mm": 20},
    "80 mm sphere": {"kind": "ellipsoid", "diameters_mm": [80, 80, 80]},
    "80 x 15 x 25 mm bar": {"kind": "box", "length_mm": 80, "width_mm": 15, "height_mm": 25},
}
QUIET = SignalChain(noise_db_spl=None)
#: Grid steps (mm); the finest is the reference, the next finest bounds the error of the reference.
GRIDS_MM = (5.2, Numerics().dx_mm, 3.75, 3.3, 2.75, 2.0, 1.5)
QUICK_GRIDS_MM = (6.0, 5.2, Numerics().dx_mm, 3.3)
REPEATS = 2


@dataclass(frozen=True)
class Run:
    """Result and cost of one simulation."""

    feature: Real
    time_s: float
    steps: int
    cells: int
    memory_mb: float


def run(scene: Scene, repeats: int = 1) -> Run:
    """Simulate a scene `repeats` times; the time is the shortest."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        response = simulate(scene)
        times.append(time.process_time() - start)
    steps, cells = response.provenance["steps"], response.provenance["cells"]
    samples = record(response, excitation_sweep(), QUIET).samples
    feature = spectrum(samples, SAMPLE_RATE_HZ, FeatureSettings()).astype(np.float64)
    feature /= np.linalg.norm(feature)
    return Run(feature, min(times), steps, cells, build_plan(scene).bytes / 1e6)


def relative_error(feature: Real, reference: Real) -> float:
    """Return the relative L2 difference of two features (1025,)."""
    return float(np.linalg.norm(feature - reference) / np.linalg.norm(reference))


def decibels(feature: Real, reference: Real) -> dict[str, float]:
    """Return the root mean square of the error in level (dB) of a feature (1025,), by band."""
    khz = frequencies_hz(SAMPLE_RATE_HZ, FeatureSettings()) / 1e3
    level = 20 * np.log10(feature / reference)
    return {
        f"db_{low:g}_{high:g}": float(np.sqrt(np.mean(level[(khz >= low) & (khz < high)] ** 2)))
        for low, high in BANDS_KHZ
    }


def tables(quick: bool = False) -> tuple[Table, ...]:
    """Return the errors and costs of all grids but the finest.

    A minute and a half on one core; `quick` takes seconds and shows only that all of it works.
    """
    grids = QUICK_GRIDS_MM if quick else GRIDS_MM
    objects = tuple(OBJECTS)[: 1 if quick else None]
    simulate(Scene.model_validate({"object": OBJECTS[objects[0]], "numerics": {"dx_mm": 6.0}}))
    rows = tuple(row for name in objects for row in _grid_rows(name, grids, quick))
    note = (
        f"Against a grid of {grids[-1]:g} mm; the error of the next finest grid bounds that of the"
        f" reference. {TIMED}"
    )
    return (Table("accuracy", "Error against run time", note, _columns(), rows),)


def _grid_rows(name: str, grids: tuple[float, ...], quick: bool) -> list[dict[str, Value]]:
    """Return one row per grid but the last, which all are compared with."""
    *runs, reference = (
        run(
            Scene.model_validate({"object": OBJECTS[name], "numerics": {"dx_mm": dx_mm}}),
            1 if quick or dx_mm == grids[-1] else REPEATS,
        )
        for dx_mm in grids
    )
    default_s = runs[grids.index(Numerics().dx_mm)].time_s
    return [
        {
            "object": name,
            "dx_mm": dx_mm,
            "error": relative_error(result.feature, reference.feature),
            **decibels(result.feature, reference.feature),
            "time_s": result.time_s,
            "ratio": result.time_s / default_s,
            "steps": result.steps,
            "cells": result.cells,
            "memory_mb": result.memory_mb,
        }
        for dx_mm, result in zip(grids, runs, strict=False)
    ]


def _columns() -> tuple[Column, ...]:
    return (
        Column("object", "Object"),
        Column("dx_mm", "Grid", "mm"),
        Column("error", "Error of the feature"),
        *(
            Column(f"db_{low:g}_{high:g}", f"Level, {low:g} to {high:g} kHz", "dB rms")
            for low, high in BANDS_KHZ
        ),
        Column("time_s", "Run time", "s"),
        Column("ratio", "Run time over the default grid's"),
        Column("steps", "Steps"),
        Column("cells", "Open cells"),
        Column("memory_mb", "Arrays of the kernel", "MB"),
    )
