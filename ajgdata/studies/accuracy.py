"""Error against run time: how far a grid is from the limit of ever finer ones, and what it costs.

Errors are those of the feature (`ajgdata.features`: Hann STFT magnitude of the recorded sweep,
summed over time, unit norm), without noise, relative L2 against a fine grid of the wide scheme; the
reference is itself compared with a coarser one, and two-point differences with it. Run times are
process times of `simulate`, the best of several, each scheme beside the other.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper import SAMPLE_RATE_HZ, Scene, SignalChain, excitation_sweep, record, simulate
from ajgdata.gripper.scene import Numerics
from ajgdata.gripper.solver_plan import build_plan
from ajgdata.studies import TIMED
from ajgdata.types.table import Column, Table, Value

Real = NDArray[np.floating]
Numbers = dict[str, float | int | str]
FRAME, HOP = 2048, 512
#: kHz, as shown.
BANDS_KHZ = ((0.1, 1.0), (1.0, 3.0), (3.0, 6.0), (6.0, 20.0))
OBJECTS = {
    "20 mm cube": {"kind": "cube", "edge_mm": 20},
    "80 mm sphere": {"kind": "ellipsoid", "diameters_mm": [80, 80, 80]},
    "80 x 15 x 25 mm bar": {"kind": "box", "length_mm": 80, "width_mm": 15, "height_mm": 25},
}
QUIET = SignalChain(noise_db_spl=None)
#: The plain second-order kernel that the default is compared with.
PLAIN: Numbers = {"scheme": "second", "dx_mm": 2.5}
REPEATS = 2


@dataclass(frozen=True)
class Settings:
    """Choice of grids; `reference_mm` is the finest, that all others are compared with."""

    reference_mm: float = 1.5
    check_mm: float = 2.0
    wide_mm: Sequence[float] = (5.2, 4.2, 3.75, 3.3, 2.75)
    second_mm: Sequence[float] = (5.0, 4.0, 3.0, 2.5, 2.0)
    objects: Sequence[str] = tuple(OBJECTS)
    repeats: int = REPEATS
    variants: Sequence[Numbers] = field(
        default=(
            {},
            {"precision": "float64"},
            {"poles": 1},
            {"poles": 0},
            {"decay_db": 40.0},
            {"decay_db": 60.0},
            {"decay_db": 80.0},
        )
    )


QUICK = Settings(3.3, 4.2, (6.0, 5.2), (6.0, 5.0), ("20 mm cube",), 1, ({}, {"poles": 0}))
ERROR = Column("error", "Error of the feature")
COST = (
    Column("time_s", "Run time", "s"),
    Column("ratio", "Run time over the plain kernel's at 2.5 mm"),
    Column("steps", "Steps"),
    Column("cells", "Open cells"),
    Column("memory_mb", "Arrays of the kernel", "MB"),
)


@dataclass(frozen=True)
class Run:
    """Result and cost of one simulation."""

    feature: Real
    time_s: float
    steps: int
    cells: int
    memory_mb: float


def scene(name: str, numbers: Numbers) -> Scene:
    """One of OBJECTS in one grasp, with these settings of the numerics."""
    return Scene.model_validate({"object": OBJECTS[name], "numerics": numbers})


def feature(samples: Real) -> Real:
    """Hann 2048/512 STFT magnitude (1025,) of `samples` (n,), summed over time, unit norm: as
    `ajgdata.features` defines it, before any scaling of its own."""
    frames = np.lib.stride_tricks.sliding_window_view(samples, FRAME)[::HOP]
    window = np.hanning(FRAME + 1)[:-1]
    magnitude = np.abs(np.fft.rfft(frames * window, axis=1)).sum(0)
    return magnitude / np.linalg.norm(magnitude)


@cache
def _sweep() -> Real:
    return excitation_sweep()


def run(what: Scene, repeats: int = 1) -> Run:
    """Simulate `what` as often as `repeats` says; the time is the shortest."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        ir = simulate(what)
        times.append(time.process_time() - start)
    steps, cells = ir.provenance["steps"], ir.provenance["cells"]
    heard = record(ir, _sweep(), QUIET).samples
    return Run(feature(heard), min(times), steps, cells, build_plan(what).bytes / 1e6)


def relative_error(feature: Real, reference: Real) -> float:
    """Relative L2 difference of two features (1025,)."""
    return float(np.linalg.norm(feature - reference) / np.linalg.norm(reference))


def decibels(feature: Real, reference: Real) -> list[float]:
    """Root mean square of the error in level (dB) of a feature (1025,) in each of BANDS_KHZ."""
    khz = np.fft.rfftfreq(FRAME, 1e3 / SAMPLE_RATE_HZ)
    level = 20 * np.log10(feature / reference)
    return [
        float(np.sqrt(np.mean(level[(khz >= low) & (khz < high)] ** 2))) for low, high in BANDS_KHZ
    ]


def _figures(one: Run, reference: Real, plain_s: float) -> dict[str, Value]:
    bands = {f"db_{low:g}_{high:g}": level for (low, high), level in _levels(one, reference)}
    return {
        "error": relative_error(one.feature, reference),
        **bands,
        "time_s": one.time_s,
        "ratio": one.time_s / plain_s,
        "steps": one.steps,
        "cells": one.cells,
        "memory_mb": one.memory_mb,
    }


def _levels(one: Run, reference: Real) -> Iterable[tuple[tuple[float, float], float]]:
    return zip(BANDS_KHZ, decibels(one.feature, reference), strict=True)


def _columns(*first: Column) -> tuple[Column, ...]:
    bands = (
        Column(f"db_{low:g}_{high:g}", f"Level, {low:g} to {high:g} kHz", "dB rms")
        for low, high in BANDS_KHZ
    )
    return (*first, ERROR, *bands, *COST)


def tables(quick: bool = False) -> tuple[Table, ...]:
    """The sweep of the grid, the targets, and what other settings change at the default grid.

    A minute and a half on one core; `quick` takes seconds and shows only that all of it works.
    """
    settings = QUICK if quick else Settings()
    simulate(scene(settings.objects[0], {"dx_mm": 6.0}))  # compiles the kernels
    references = {name: _reference(name, settings) for name in settings.objects}
    plain_s = {name: run(scene(name, PLAIN), settings.repeats).time_s for name in references}
    rows: list[dict[str, Value]] = []
    for name, reference in references.items():
        rows += _sweep_of(name, reference, plain_s[name], settings)
    return (
        Table(
            "accuracy",
            "Error against run time",
            f"Against a {settings.reference_mm:g} mm grid of the wide scheme. Second: the plain"
            f" leapfrog with two-point differences on the same cut cells. {TIMED}",
            _columns(
                Column("object", "Object"),
                Column("scheme", "Scheme"),
                Column("dx_mm", "Grid", "mm"),
            ),
            tuple(rows),
        ),
        _checks(references, settings),
        _variants(references, plain_s, settings),
    )


def _reference(name: str, settings: Settings) -> Real:
    return run(scene(name, {"dx_mm": settings.reference_mm})).feature


def _sweep_of(
    name: str, reference: Real, plain_s: float, settings: Settings
) -> list[dict[str, Value]]:
    cases: list[Numbers] = [{"scheme": "wide", "dx_mm": dx} for dx in settings.wide_mm]
    cases += [{"scheme": "second", "dx_mm": dx} for dx in settings.second_mm]
    runs = [run(scene(name, case), settings.repeats) for case in cases]
    return [
        {"object": name, **case, **_figures(one, reference, plain_s)}
        for case, one in zip(cases, runs, strict=True)
    ]


def _checks(references: dict[str, Real], settings: Settings) -> Table:
    """Compare the reference with a coarser grid."""
    rows: list[dict[str, Value]] = []
    for name, reference in references.items():
        case: Numbers = {"scheme": "wide", "dx_mm": settings.check_mm}
        error = relative_error(run(scene(name, case)).feature, reference)
        rows.append({"object": name, **case, "error": error})
    return Table(
        "accuracy-reference",
        "How good the reference is",
        "A coarser grid of the same scheme bounds the error of the reference; plain differences "
        "come closer to it as their grid is refined (see the sweep).",
        (
            Column("object", "Object"),
            Column("scheme", "Scheme"),
            Column("dx_mm", "Grid", "mm"),
            ERROR,
        ),
        tuple(rows),
    )


def _variants(references: dict[str, Real], plain_s: dict[str, float], settings: Settings) -> Table:
    """Precision, poles and stopping at the default grid, against the reference and the default."""
    name, reference = next(iter(references.items()))
    default = run(scene(name, {})).feature
    rows: list[dict[str, Value]] = []
    for numbers in settings.variants:
        one = run(scene(name, numbers), settings.repeats)
        numerics = Numerics.model_validate(numbers)
        rows.append(
            {
                "precision": numerics.precision,
                "poles": numerics.poles,
                "decay_db": numerics.decay_db,
                "change": relative_error(one.feature, default),
                **_figures(one, reference, plain_s[name]),
            }
        )
    first = (
        Column("precision", "Precision"),
        Column("poles", "Relaxation poles"),
        Column("decay_db", "Stops after", "dB"),
        Column("change", "Change of the feature"),
    )
    return Table(
        "accuracy-settings",
        "Precision, poles and stopping",
        f"{name} on the default grid; the change is against the default settings. {TIMED}",
        _columns(*first),
        tuple(rows),
    )
