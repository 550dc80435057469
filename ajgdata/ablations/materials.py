"""Hard materials: how alike grasps must be for their sounds to be told apart."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from pydantic import JsonValue

from ajgdata.ablations.base import Ablation, Folds, Hypothesis, Trial, folds_of, trial_table
from ajgdata.ablations.data import AblationData, nuisances
from ajgdata.evaluate.task_data import TaskData
from ajgdata.report.blocks import TableFigure
from ajgdata.types.table import Column, Table, Value

if TYPE_CHECKING:
    from ajgdata.report.marks import Picture

TASK = "material"
#: By the names of their columns.
MODELS_TRIED = {"linear": "linear_plain", "knn": "knn_plain"}
PAPER = {"sphere80": "materials-sphere80", "plate": "materials-plate"}
#: Told from the others by anyone: it yields.
SOFT = "styrofoam"
#: Share of what differs between two grasps, the pose included, that is left.
SHARES = (1.0, 0.1, 0.01)
#: Every part of the plan is solved.
WHOLE: dict[str, JsonValue] = {"numerics": {"tolerance": 0.0}}
#: The object cannot move on what it lies on, but for its contact with it.
GROUND: dict[str, JsonValue] = {"support": {"kind": "rigid"}}


def measure(data: AblationData) -> list[Table]:
    """Return trials, and accuracy against the share of the scatter that is left."""
    trials, rows = [], []
    for dataset, paper in PAPER.items():
        grasps = [one for one in data.grasps(dataset) if one.targets[TASK] != SOFT]
        default = data.recorded(dataset, TASK, grasps)
        ground = data.changed(dataset, TASK, grasps, GROUND)
        heard = {}
        for share in SHARES:
            scene = WHOLE | {"grasp": {"nuisance": nuisances(share)}}
            heard[share] = data.changed(dataset, TASK, grasps, scene, pose=share)
            rows.append(_row(data, dataset, share, heard[share]))
        for model in MODELS_TRIED.values():
            read = {share: _told(data, model, one) for share, one in heard.items()}
            before = _told(data, model, default)
            for hypothesis, first, second in (
                (_support(paper), _told(data, model, ground), before),
                (_parts(paper), before, read[1.0]),
                (_scatter(paper), read[1.0], read[SHARES[-1]]),
            ):
                trials.append(Trial(hypothesis, model, "accuracy", "", first, second))
    note = f"{len(default.value)} grasps of metal, wood and plastic; chance is a third."
    return [
        trial_table("materials", "Materials: effects left out, or scatter", note, trials),
        _table(rows),
    ]


def _support(paper: str) -> Hypothesis:
    return Hypothesis(
        (paper,),
        "hard materials are told apart by how they move on what they lie on",
        "on a concave piece of rubber (default) instead of the rigid ground",
    )


def _parts(paper: str) -> Hypothesis:
    return Hypothesis(
        (paper,),
        "hard materials differ by what the plan leaves out",
        "every part of the object solved",
    )


def _scatter(paper: str) -> Hypothesis:
    return Hypothesis(
        (paper,),
        "hard materials do sound different, but far less so than two grasps",
        f"{SHARES[-1]:.0%} of the scatter of grasps, every part solved",
    )


def _told(data: AblationData, model: str, rows: TaskData) -> Folds:
    return folds_of(data.validated(rows, "classification", model), "accuracy")


def _row(data: AblationData, dataset: str, share: float, rows: TaskData) -> dict[str, Value]:
    by_material = [rows.feature[rows.value == one] for one in np.unique(rows.value)]
    within = [_distance(a, b) for some in by_material for a, b in combinations(some, 2)]
    between = [_distance(some.mean(0), more.mean(0)) for some, more in combinations(by_material, 2)]
    told = {name: _told(data, model, rows) for name, model in MODELS_TRIED.items()}
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
        "Metal, wood and plastic of one shape, every part solved. Share: of the scatter"
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


def finding(table: Table) -> str:
    """Return the accuracies with the most and the least of the scatter of grasps."""
    share, right = table.numbers("share"), table.numbers("linear")
    most, least = (right[share == f(share)] for f in (np.max, np.min))
    return (
        f"Hard materials are told in {_range(most)} with {100 * share.max():g} % of the scatter of "
        f"grasps, in {_range(least)} with {100 * share.min():g} % (chance 33 %)"
    )


def _range(shares: np.ndarray) -> str:
    ends = dict.fromkeys(f"{100 * share:.0f}" for share in (shares.min(), shares.max()))
    return f"{' to '.join(ends)} %"


def distances(table: Table) -> Picture:
    """Return how far grasps of one material and different materials lie apart."""
    from ajgdata.report.study_figures import picture_of, points_of

    points = [
        point._replace(series=f"{point.series}, {name}")
        for key, name in (("within", "two grasps"), ("between", "materials"))
        for point in points_of(table, key, "dataset", "share")
    ]
    axis, place = ("relative L2 distance", ""), ("share of the scatter of grasps", "")
    return picture_of(finding(table), ABOUT, points, axis, place)


def accuracy(table: Table) -> Picture:
    """Return the accuracy of logistic regression with less of the scatter of grasps."""
    from ajgdata.report.study_figures import picture_of, points_of

    points = points_of(table, "linear", "dataset", "share")
    axis, place = ("accuracy", ""), ("share of the scatter of grasps", "")
    limit = ("chance", 1 / 3)
    return picture_of(finding(table), ABOUT, points, axis, place, limit, log=False)


ABOUT = "metal, wood and plastic of one shape, as the scatter of grasps is removed"
ABLATION = Ablation(
    "materials",
    datasets=tuple(PAPER),
    measure=measure,
    figures=(
        TableFigure(
            "materials_scatter",
            "share",
            "lines",
            distances,
            "Distance of two grasps of one material and of the materials' means.",
        ),
        TableFigure(
            "materials_scatter",
            "accuracy",
            "lines",
            accuracy,
            "Accuracy of logistic regression on grasps held out.",
        ),
    ),
)
