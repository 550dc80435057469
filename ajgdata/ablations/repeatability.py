"""Repeatability of grasps: objects without their scatter, sizes with twice as much."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from ajgdata.ablations.base import Ablation, Hypothesis, Trial, folds_of, trial_table
from ajgdata.ablations.data import NUISANCES, AblationData, nuisances
from ajgdata.acquire.source import Grasp
from ajgdata.gripper.variation import Variation
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
#: Of a setup: what is drawn by grasp, session and gripper.
DRAWN = ("grasp", "assembly", "session")
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
#: What differs between grippers and between sessions, by the key of the setup that holds it.
KEPT = {
    "gripper: balloon askew": ("assembly", "askew_mm"),
    "gripper: slope of the fill": ("assembly", "fill_slope_deg"),
    "gripper: places of the transducers": ("assembly", "speaker_moved_mm", "microphone_moved_mm"),
    "session: jig": ("session", "jig_mm"),
    "session: warmth": ("session", "temperature_k"),
    "session: fill": ("session", "fill_mm"),
    "placement": ("grasp", "placed_mm", "placed_deg"),
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
    setup = {key: grasp.setup[key] for key in grasp.setup if key not in DRAWN}
    rows: list[dict[str, Value]] = []
    for name, (part, *keys) in KEPT.items():
        heard = [data.heard(*_kept(setup, part, keys, number)) for number in range(GRASPS)]
        rows.append({"origin": name, "distance": _apart(heard)})
    for name, only in ORIGINS.items():
        still = [{"nuisance": nuisances(1, only), "seed": seed} for seed in range(GRASPS)]
        apart = _apart([data.heard(setup, g) for g in still])
        rows.append({"origin": f"grasp: {name}", "distance": apart})
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
        f" {GRASPS} grasps of the smallest cube that differ in nothing but what is named, by the"
        " defaults of a variation; grasps: each with a bed that is poured anew.",
        (Column("origin", "What differs"), Column("distance", "Distance")),
        tuple(rows),
    )


def _kept(
    setup: Mapping[str, Any], part: str, keys: Sequence[str], number: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return setup and grasp without scatter, with one draw of what a gripper or a session keeps.

    `number` is that of the gripper, of the session or of the placement.
    """
    varied = Variation()
    drawn = {
        "assembly": varied.assembly(f"gripper {number}"),
        "session": varied.offsets(number),
        "grasp": varied.placement(number),
    }
    only = {key: drawn[part][key] for key in keys}
    still = {"nuisance": nuisances(0)}
    if part == "grasp":
        return dict(setup), still | only
    return {**setup, part: only}, still


def _apart(features: Sequence[np.ndarray]) -> float:
    pairs = [np.linalg.norm(a - b) / np.linalg.norm(b) for a, b in combinations(features, 2)]
    return float(np.sqrt(np.mean(np.square(pairs))))


ABLATION = Ablation("repeatability", datasets=("ycb", "size"), measure=measure)
