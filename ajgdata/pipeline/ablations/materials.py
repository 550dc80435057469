"""Hard materials: how alike must grasps be for their sounds to be told apart?"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from pydantic import JsonValue

from ajgdata.evaluate.task_data import TaskData
from ajgdata.pipeline.ablations.bench import Bench, nuisances
from ajgdata.pipeline.ablations.trials import Folds, Hypothesis, Trial, folds_of, trial_table
from ajgdata.types.table import Column, Table, Value

TASK = "material"
MODELS_TRIED = ("linear", "knn")
PAPER = {"sphere80": "materials-sphere80", "plate": "materials-plate"}
#: Told from the others by anyone: it yields.
SOFT = "styrofoam"
#: Share of what differs between two grasps, the pose included, that is left.
SHARES = (1.0, 0.1, 0.01)
#: Every part of the plan is solved, and the object lies on rubber, which lets it move.
WHOLE: dict[str, JsonValue] = {
    "numerics": {"tolerance": 0.0},
    "support": {"kind": "rubber"},
}


def tables(bench: Bench) -> list[Table]:
    """Trials, and accuracy against what is left of the scatter."""
    trials, rows = [], []
    for dataset, paper in PAPER.items():
        grasps = [one for one in bench.grasps(dataset) if one.targets[TASK] != SOFT]
        default = bench.recorded(dataset, TASK, grasps)
        heard = {}
        for share in SHARES:
            scene = WHOLE | {"grasp": {"nuisance": nuisances(share)}}
            heard[share] = bench.changed(dataset, TASK, grasps, scene, pose=share)
            rows.append(_row(bench, dataset, share, heard[share]))
        for model in MODELS_TRIED:
            read = {share: _told(bench, model, one) for share, one in heard.items()}
            before = _told(bench, model, default)
            for hypothesis, first, second in (
                (_parts(paper), before, read[1.0]),
                (_scatter(paper), read[1.0], read[SHARES[-1]]),
            ):
                trials.append(Trial(hypothesis, model, "accuracy", "", first, second))
    note = f"{len(default.value)} grasps of metal, wood and plastic; chance is a third."
    return [
        trial_table("materials", "Materials: effects left out, or scatter", note, trials),
        _table(rows),
    ]


def _parts(paper: str) -> Hypothesis:
    return Hypothesis(
        (paper,),
        "hard materials differ by what the plan leaves out, or by the support",
        "every part of the object solved, on rubber",
    )


def _scatter(paper: str) -> Hypothesis:
    return Hypothesis(
        (paper,),
        "hard materials do sound different, but far less so than two grasps",
        f"{SHARES[-1]:.0%} of the scatter of grasps, every part solved, on rubber",
    )


def _told(bench: Bench, model: str, rows: TaskData) -> Folds:
    return folds_of(bench.validated(rows, "classification", model), "accuracy")


def _row(bench: Bench, dataset: str, share: float, rows: TaskData) -> dict[str, Value]:
    by_material = [rows.feature[rows.value == one] for one in np.unique(rows.value)]
    within = [_distance(a, b) for some in by_material for a, b in combinations(some, 2)]
    between = [_distance(some.mean(0), more.mean(0)) for some, more in combinations(by_material, 2)]
    told = {model: _told(bench, model, rows) for model in MODELS_TRIED}
    return {
        "dataset": dataset,
        "share": share,
        "within": _rms(within),
        "between": _rms(between),
        **{model: float(np.mean(folds.values)) for model, folds in told.items()},
        "seconds": told["linear"].seconds,
    }


def _distance(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.linalg.norm(one - other) / np.linalg.norm(other))


def _rms(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _table(rows: list[dict[str, Value]]) -> Table:
    return Table(
        "materials_scatter",
        "Materials: how alike grasps must be",
        "Metal, wood and plastic of one shape, every part solved, on rubber. Share: of the scatter"
        " of grasps and of what the pose varies. Distances: relative L2 of the feature, between two"
        " grasps of one material, and between the materials' means, which differ by their"
        " grasps as well; the microphone's noise is in both.",
        (
            Column("dataset", "Data set"),
            Column("share", "Share of scatter"),
            Column("within", "Two grasps apart"),
            Column("between", "Materials apart"),
            Column("linear", "Accuracy, logistic regression"),
            Column("knn", "Accuracy, k-NN"),
            Column("seconds", "Training", "s"),
        ),
        tuple(rows),
    )
