"""Error budget: error of the feature by source, run time, and error in differences between objects.

An error is the relative L2 error of the noise-free feature (`ajgdata.features.spectrum`, unit
norm). For each source, only its own setting varies, and the reference has the best setting of this
source. For the error of all sources together, the reference has the best settings of grid,
stopping, modes and omissions. Run times are CPU times of planning and simulation, the shortest of
several.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ajgdata.features.spectrum import frequencies_hz
from ajgdata.gripper import SAMPLE_RATE_HZ, Scene, simulate
from ajgdata.gripper.scene import Numerics
from ajgdata.gripper.variation import Variation
from ajgdata.studies import ALL_SOURCES, TIMES_NOTE
from ajgdata.studies.noise_free import noise_free, relative_error, timed, unit_feature
from ajgdata.types import FeatureSettings
from ajgdata.types.table import Column, Table, Value

Real = NDArray[np.floating]
SceneSettings = dict[str, Any]
#: Frequency bands (kHz).
BANDS_KHZ = ((0.1, 1.0), (1.0, 3.0), (3.0, 6.0), (6.0, 20.0))
#: Two objects of each class of scenes, between which a user wants to distinguish.
SCENES: dict[str, tuple[SceneSettings, SceneSettings]] = {
    "hard cubes": ({"object": "cube_20p7"}, {"object": "cube_22p0"}),
    "soft and hard objects": ({"object": "foam_brick"}, {"object": "banana"}),
    "balls that move on rubber": (
        {"object": "sphere80_metal", "support": {"kind": "concave"}},
        {"object": "sphere80_styrofoam", "support": {"kind": "concave"}},
    ),
    "thin plates on rubber": (
        {"object": "plate_wood", "support": {"kind": "concave"}},
        {"object": "plate_plastic", "support": {"kind": "concave"}},
    ),
    "cubes near the rim": (
        {"object": "cube_20p7", "grasp": {"offset_x_mm": 20}},
        {"object": "cube_22p0", "grasp": {"offset_x_mm": 20}},
    ),
    "cubes in coffee": (
        {"object": "cube_20p7", "medium": {"kind": "coffee"}},
        {"object": "cube_22p0", "medium": {"kind": "coffee"}},
    ),
}
DEFAULT_NUMERICS = Numerics()
#: Grid spacings (mm); the finest grid is the reference.
GRIDS_MM = (5.2, DEFAULT_NUMERICS.dx_mm, 3.75, 3.3, 2.75, 2.0)
#: Settings of each source of error, the reference last. The CFL numbers give 4, 6, 8 and 15
#: steps per sample on the default grid.
SOURCES: dict[str, tuple[SceneSettings, ...]] = {
    "grid": tuple({"dx_mm": dx_mm} for dx_mm in GRIDS_MM),
    "time step": tuple({"cfl": cfl} for cfl in (DEFAULT_NUMERICS.cfl, 0.75, 0.54, 0.27)),
    "stopping": tuple(
        {"decay_db": db} for db in (30.0, 40.0, DEFAULT_NUMERICS.decay_db, 60.0, 80.0)
    ),
    "number of modes": tuple(
        {"modes_hz": hz} for hz in (4_000.0, DEFAULT_NUMERICS.modes_hz, 21_000.0)
    ),
    "fitted medium": tuple({"poles": poles} for poles in (1, DEFAULT_NUMERICS.poles)),
    "float32": ({"precision": DEFAULT_NUMERICS.precision}, {"precision": "float64"}),
    "omitted parts": ({"omit": DEFAULT_NUMERICS.omit}, {"omit": ()}),
}
#: Sources of the error together: the largest source, and sources with short run times. All sources
#: together would take ten times as long.
TOGETHER = ("grid", "stopping", "number of modes", "omitted parts")
#: Finest grid (mm) of a quick run.
QUICK_MM = 3.3
#: Longest response (s); every response ends earlier.
LONGEST_S = 0.5
#: Number of grasps of one object for the scatter between grasps.
SCATTER_GRASPS = 8
#: Number of runs, of which the shortest time counts.
REPEATS = 3


@dataclass(frozen=True)
class SimulationRun:
    """Result and cost of one simulation."""

    feature: Real
    time_s: float


def run(scene: Scene, repeats: int = 1) -> SimulationRun:
    """Simulate a scene `repeats` times, and return the feature and the shortest time."""
    response, time_s = timed(partial(simulate, scene), repeats)
    return SimulationRun(unit_feature(noise_free(response)), time_s)


def level_db(feature: Real) -> Real:
    """Return the level in dB of a feature (1025,)."""
    return 20 * np.log10(np.maximum(feature, np.finfo(float).tiny))


def in_bands(values: Real) -> dict[str, Real]:
    """Return the parts of values (1025,) that belong to each band, by the key of its column."""
    khz = frequencies_hz(SAMPLE_RATE_HZ, FeatureSettings()) / 1e3
    return {f"db_{low:g}_{high:g}": values[(khz >= low) & (khz < high)] for low, high in BANDS_KHZ}


def decibels(feature: Real, reference: Real) -> dict[str, float]:
    """Return the root mean square of the error in level (dB) of a feature (1025,), by band."""
    error = level_db(feature) - level_db(reference)
    return {key: float(np.sqrt(np.mean(part**2))) for key, part in in_bands(error).items()}


def scene_of(settings: Mapping[str, Any], seed: int = 0, **numerics: Any) -> Scene:
    """Return a scene of SCENES as grasp number `seed` in a session of the default gripper."""
    variation = Variation()
    grasp = {
        **settings.get("grasp", {}),
        "seed": seed,
        "nuisance": variation.nuisance({}),
        **variation.bed(seed, "accuracy"),
        **variation.air(seed, "accuracy"),
    }
    varied = {"grasp": grasp, "assembly": variation.assembly("default"), "numerics": numerics}
    return Scene.model_validate({**settings, **varied})


def best_settings(sources: Mapping[str, Sequence[SceneSettings]]) -> SceneSettings:
    """Return the best settings of the sources TOGETHER."""
    best = {key: value for source in TOGETHER for key, value in sources[source][-1].items()}
    return {**best, "max_time_s": LONGEST_S}


def budget_rows(
    scene_class: str,
    settings: SceneSettings,
    sources: Mapping[str, Sequence[SceneSettings]],
    default: SimulationRun,
    best: SimulationRun,
    repeats: int,
) -> list[dict[str, Value]]:
    """Return one row per setting of each source of error, and one row for all sources together.

    `default` and `best` are the runs of the scene with the default settings, and with the best
    settings of the sources TOGETHER.
    """
    rows = [
        _row(scene_class, ALL_SOURCES, "default", default, best, default.time_s, is_default=True)
    ]
    for source, options in sources.items():
        limits: SceneSettings = {"max_time_s": LONGEST_S} if source == "stopping" else {}
        reference = run(scene_of(settings, **options[-1], **limits))
        for option in options[:-1]:
            [(key, value)] = option.items()
            is_default = value == getattr(DEFAULT_NUMERICS, key)
            result = default if is_default else run(scene_of(settings, **option, **limits), repeats)
            label = f"{key} {'default' if value is None else value}"
            rows.append(
                _row(
                    scene_class,
                    source,
                    label,
                    result,
                    reference,
                    default.time_s,
                    is_default=is_default,
                )
            )
    return rows


def _row(
    scene_class: str,
    source: str,
    setting: str,
    result: SimulationRun,
    reference: SimulationRun,
    default_s: float,
    *,
    is_default: bool,
) -> dict[str, Value]:
    return {
        "kind": scene_class,
        "source": source,
        "setting": setting,
        "error": relative_error(result.feature, reference.feature),
        "time_s": result.time_s,
        "ratio": result.time_s / default_s,
        "is_default": is_default,
        **decibels(result.feature, reference.feature),
    }


def difference_rows(
    scene_class: str,
    settings: SceneSettings,
    defaults: Sequence[SimulationRun],
    bests: Sequence[SimulationRun],
) -> list[dict[str, Value]]:
    """Return one row per band: error in the difference between two objects, and scatter of grasps.

    The difference is that of the levels of both objects in the same grasp; its error is that of the
    default settings. The scatter is that between grasps of the first object. `defaults` and `bests`
    are the runs of both objects; `settings` are those of the first object.
    """
    computed = level_db(defaults[0].feature) - level_db(defaults[1].feature)
    true = level_db(bests[0].feature) - level_db(bests[1].feature)
    grasps = [
        level_db(run(scene_of(settings, seed)).feature) for seed in range(1, SCATTER_GRASPS + 1)
    ]
    scatter = in_bands(np.std(grasps, axis=0, ddof=1))
    rows: list[dict[str, Value]] = []
    for (low, high), key in zip(BANDS_KHZ, scatter, strict=True):
        own = in_bands(computed)[key]
        exact = in_bands(true)[key]
        error = float(np.sqrt(np.mean((own - exact) ** 2)))
        size = float(np.sqrt(np.mean(exact**2)))
        between = float(np.sqrt(np.mean(scatter[key] ** 2)))
        rows.append(
            {
                "kind": scene_class,
                "band": f"{low:g} to {high:g}",
                "error_db": error,
                "difference_db": size,
                "relative": error / size,
                "correlation": float(np.corrcoef(own, exact)[0, 1]),
                "scatter_db": between,
                "of_scatter": error / between,
            }
        )
    return rows


def tables(quick: bool = False) -> tuple[Table, ...]:
    """Return the error budget, and the errors in differences between objects.

    It takes two minutes on one core. `quick` computes one class of scenes without the finest grid.
    """
    scene_classes = list(SCENES)
    sources = dict(SOURCES)
    if quick:
        scene_classes = scene_classes[:1]
        sources["grid"] = tuple({"dx_mm": dx_mm} for dx_mm in GRIDS_MM if dx_mm >= QUICK_MM)
    best = best_settings(sources)
    repeats = 1 if quick else REPEATS
    # The first simulation compiles the kernels, before any time is measured.
    simulate(scene_of(SCENES[scene_classes[0]][0], dx_mm=6.0))
    budget: list[dict[str, Value]] = []
    differences: list[dict[str, Value]] = []
    for scene_class in scene_classes:
        first = SCENES[scene_class][0]
        defaults = [run(scene_of(settings), repeats) for settings in SCENES[scene_class]]
        bests = [run(scene_of(settings, **best)) for settings in SCENES[scene_class]]
        budget += budget_rows(scene_class, first, sources, defaults[0], bests[0], repeats)
        differences += difference_rows(scene_class, first, defaults, bests)
    # The page shows the first rows: the totals, then the sources at the default settings.
    budget.sort(key=lambda row: (row["source"] != ALL_SOURCES, not row["is_default"]))
    note = (
        "Only the setting of the source varies; its reference has the best setting: a grid of"
        f" {best['dx_mm']:g} mm, 15 steps per sample, a decay of 80 dB, modes up to 21 kHz, two"
        " poles, float64, no omission. Two poles of the medium have an error of their own that no"
        f" setting removes. Together: {', '.join(TOGETHER)}. {TIMES_NOTE}"
    )
    about = (
        "Difference between two objects in the same grasp, default settings against the best ones."
        f" Scatter: standard deviation over {SCATTER_GRASPS} grasps of the first object in one"
        " pose."
    )
    return (
        Table("accuracy", "Error by source", note, _budget_columns(), tuple(budget)),
        Table(
            "differences",
            "Error in differences between objects",
            about,
            _difference_columns(),
            tuple(differences),
        ),
    )


def _budget_columns() -> tuple[Column, ...]:
    return (
        Column("kind", "Scenes"),
        Column("source", "Source of the error"),
        Column("setting", "Setting"),
        Column("error", "Error of the feature"),
        Column("ratio", "Run time over the default's"),
        Column("is_default", "Default"),
        Column("time_s", "Run time", "s"),
        *_band_columns(),
    )


def _band_columns() -> Sequence[Column]:
    return [
        Column(f"db_{low:g}_{high:g}", f"Level, {low:g} to {high:g} kHz", "dB rms")
        for low, high in BANDS_KHZ
    ]


def _difference_columns() -> tuple[Column, ...]:
    return (
        Column("kind", "Scenes"),
        Column("band", "Band", "kHz"),
        Column("error_db", "Error of the difference", "dB rms"),
        Column("relative", "Error over the difference"),
        Column("correlation", "Correlation"),
        Column("of_scatter", "Error over the scatter between grasps"),
        Column("difference_db", "Difference", "dB rms"),
        Column("scatter_db", "Scatter between grasps", "dB"),
    )
