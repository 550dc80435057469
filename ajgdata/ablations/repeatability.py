"""Repeatability of grasps: objects without their scatter, sizes with twice as much."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from ajgdata.ablations.base import Ablation, Hypothesis, Trial, folds_of, trial_table
from ajgdata.ablations.data import NUISANCES, AblationData, nuisances
from ajgdata.acquire.source import Grasp
from ajgdata.types import Kind
from ajgdata.types.table import Column, Table, Value

STILL = Hypothesis(
    ("ycb", "data-size"),
    "packing, surface, force, depth and temperature, new with each grasp, limit the accuracy",
    "no scatter of grasps, poses as before",
)
NOISIER = Hypothesis(
    ("size", "size-known", "size-unknown"),
    "the scatter of grasps sets the error, and the simulation's is an estimate",
    "twice the scatter of grasps",
    "worse",
)
#: Grasps of each kind in the table of scatter.
GRASPS = 4
ORIGINS = {
    "surface": ("roughness_mm", "slope_deg"),
    "packing": ("packing",),
    "force": ("force",),
    "grains that bear the object": ("grain_force",),
    "temperature": ("temperature_k",),
    "all of them": NUISANCES,
}


def measure(data: AblationData) -> list[Table]:
    """Return trials, and how far grasps lie apart by what differs between them."""
    objects, cubes = data.grasps("ycb", sessions=2), data.grasps("size", each=3)
    trials = [
        *_trials(data, ("ycb", "object", "classification", "accuracy", ""), STILL, objects, 0),
        *_trials(data, ("size", "size", "regression", "rmse", "mm"), NOISIER, cubes, 2),
    ]
    note = f"{len(objects)} grasps of household objects, {len(cubes)} of cubes, one recording each."
    return [
        trial_table("repeatability", "Repeatability of grasps", note, trials),
        _scatter(data, cubes[0]),
    ]


def _trials(
    data: AblationData,
    task: tuple[str, str, Kind, str, str],
    hypothesis: Hypothesis,
    grasps: Sequence[Grasp],
    factor: float,
) -> list[Trial]:
    """Return trials of each model on `grasps` as they are and with `factor` times their scatter."""
    dataset, name, kind, metric, unit = task
    before = data.recorded(dataset, name, grasps)
    after = data.changed(dataset, name, grasps, {"grasp": {"nuisance": nuisances(factor)}})
    trials = []
    for model in data.models:
        first, second = (
            folds_of(data.validated(rows, kind, model), metric) for rows in (before, after)
        )
        trials.append(Trial(hypothesis, model, metric, unit, first, second))
    return trials


def _scatter(data: AblationData, grasp: Grasp) -> Table:
    setup = {key: value for key, value in grasp.setup.items() if key != "grasp"}
    rows: list[dict[str, Value]] = []
    for name, only in ORIGINS.items():
        still = [{"nuisance": nuisances(1, only), "seed": seed} for seed in range(GRASPS)]
        rows.append({"origin": name, "distance": _apart([data.heard(setup, g) for g in still])})
    generator = np.random.default_rng(data.seed)
    for name, turn, shift in (("pose, 10° and 2 mm", 10, 2), ("pose, 90° and 10 mm", 90, 10)):
        drawn = generator.uniform(-1, 1, (GRASPS, 3)) * [turn, shift, shift]
        poses = [
            {"nuisance": nuisances(0), "angle_deg": a, "offset_x_mm": x, "offset_y_mm": y}
            for a, x, y in drawn.round(4).tolist()
        ]
        rows.append({"origin": name, "distance": _apart([data.heard(setup, g) for g in poses])})
    return Table(
        "scatter",
        "How far grasps of one object lie apart",
        f"Relative L2 distance of the feature, without noise, root mean square over the pairs of"
        f" {GRASPS} grasps of the smallest cube that differ in nothing but what is named.",
        (Column("origin", "What differs"), Column("distance", "Distance")),
        tuple(rows),
    )


def _apart(features: Sequence[np.ndarray]) -> float:
    pairs = [np.linalg.norm(a - b) / np.linalg.norm(b) for a, b in combinations(features, 2)]
    return float(np.sqrt(np.mean(np.square(pairs))))


ABLATION = Ablation("repeatability", datasets=("ycb", "size"), measure=measure)
