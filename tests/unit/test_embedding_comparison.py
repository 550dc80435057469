"""Embeddings beside the paper: numbers and verdicts computed from stored results."""

import dataclasses

import numpy as np
import pytest
from embedding_samples import SETTINGS

from ajgdata.experiments.base import Result, TaskResults
from ajgdata.experiments.embedding_distances import categories_of
from ajgdata.experiments.registry import load_experiment
from ajgdata.experiments.settings import CrossGripperSettings
from ajgdata.report.comparison import PaperFigure, ResultCost
from ajgdata.types import Embedding, TaskSettings
from ajgdata.types.table import Table, table_of

TASK = TaskSettings(target="object", kind="classification", unit="", groups="grasp_id", folds=2)
#: Two folds of 4 s; 0.03 s for 20 recordings.
COST = ResultCost(8.0, pytest.approx(1.5))


def listed(name: str, rows: list[dict]) -> Table:
    """A table whose columns are called as their keys."""
    return table_of(name, name, rows, **{key: key for key in rows[0]})


def results(name, paper, tables=(), cost=(), **about):
    """Results of an experiment on embeddings with 2 and 4 dimensions."""
    stored = [{table.name: table for table in some} for some in (tables, cost)]
    return TaskResults(
        name,
        "d",
        "Things",
        "poses",
        TASK,
        "simulated",
        Embedding.model_validate(SETTINGS),
        (Result("", "", about, *stored),),
        papers={name: paper} if paper else {},
    )


def knn(latent=(0.45, 0.65), paper=None) -> TaskResults:
    """Accuracy on raw features and latents; a latent of d dimensions takes d + 0.03 s per fold."""
    rows = [
        {"space": "raw", "dimension": None, "values": [0.4, 0.6]},
        {"space": "latent", "dimension": 4, "values": latent},
        {"space": "latent", "dimension": 2, "values": [0.4, 0.6]},
    ]
    times = [
        {
            "space": row["space"],
            "dimension": row["dimension"],
            "fit_s": float(row["dimension"] or 0),
        }
        | {"transform_s": 0.02, "query_s": 0.01, "recordings": 20}
        for row in rows
    ]
    runs = [
        {"space": row["space"], "dimension": row["dimension"], "run": n, "accuracy": value}
        for row in rows
        for n, value in enumerate(row["values"])
    ]
    scores = [listed("knn", runs)]
    return results("embedding_knn", paper, scores, [listed("times", times)], chance=0.25)


def distances(paper=None, **within: float) -> TaskResults:
    """Two runs: distances within each category, and 3 between two; the first run is 0.1 narrower
    within cylindrical."""
    rows = []
    for space in ("latent", "raw"):
        for i, first in enumerate(within):
            for second in list(within)[i:]:
                for run, off in enumerate((-0.0708, 0.0708)):
                    value = (within[first] if first == second else 3.0) + off
                    value -= 0.1 * (first == second == "cylindrical" and run == 0)
                    row = {"space": space, "first": first, "second": second}
                    rows.append(row | {"run": run, "distance": value})
    return results("embedding_distances", paper, [listed("categories", rows)])


def figure(value=None):
    return PaperFigure(id="x", metric="", value=value, unit="", text="as told", where="there")


def row(result, measured):
    """The one comparison of results, of a run in which k-NN was measured."""
    (outcome,) = load_experiment(result.experiment).paper_comparison(result, lambda *_: measured)
    return outcome


@pytest.mark.parametrize(
    ("runs", "text", "agrees"),
    [
        # raw: 0.4 and 0.6 in two folds with one initialisation each. Relative gains of 25 and
        # 26 %: variance 0.5; t(0.975, 1) = 12.706, times the root of (1/2 + 1) 0.5: 11
        ([0.525, 0.73], "25.5 (14.5 to 36.5) % higher", "agrees"),
        # Clipped: no gain is below -100 %, and from 50 % right no gain is above 100 %.
        ([0.5, 0.76], "26 (-100 to 100) % higher", "inconclusive"),
        ([0.45, 0.655], "10.5 (-0.504 to 21.5) % higher", "worse"),
        # two initialisations of each fold; their means are all that folds differ by: nothing
        ([0.5, 0.6, 0.7, 0.8], "30 ± 12 % higher", "inconclusive"),
    ],
)
def test_the_gain_is_that_of_each_run_over_its_fold(runs, text, agrees):
    measured = knn(runs, figure(26.6))
    outcome = row(measured, measured)
    assert outcome.result.startswith(f"{text} (")
    gain = 100 * (np.mean(runs) - 0.5)
    assert f"{gain:.3g} percentage points) at 4 dimensions; exploratory" in outcome.result
    assert (outcome.agrees, outcome.cost, outcome.model) == (agrees, COST, "k-NN on the latent")


@pytest.mark.parametrize(
    ("within", "agrees"),
    [
        ({"cylindrical": 1, "other": 2.5, "spherical": 1}, "agrees"),
        ({"cylindrical": 1, "other": 0.5, "spherical": 1}, "partly agrees"),  # the narrowest
        ({"cylindrical": 4, "other": 2, "spherical": 4}, "disagrees"),
    ],
)
def test_categories_lie_together_or_do_not(within, agrees):
    outcome = row(distances(figure(), **within), knn())
    assert outcome.cost == COST
    assert outcome.agrees == agrees
    assert f"spherical {within['spherical']} within" in outcome.result


def test_gaps_are_to_the_mean_of_the_others():
    categories = categories_of(distances(cylindrical=1, other=2, spherical=1), "latent")
    assert categories["spherical"].gap.mean == pytest.approx(2)
    assert categories["cylindrical"].gap.mean == pytest.approx(2.05)
    assert categories["cylindrical"].gap.sd == pytest.approx(0.1 / 2**0.5)


def test_a_partly_agreeing_statement_has_a_remark_with_the_part_that_does_not_agree():
    remark = row(distances(figure(), cylindrical=1, other=0.5, spherical=1), knn()).remark
    # In each run, other is 0.5 narrower than spherical.
    assert remark == (
        "2 of 3 statements of the paper agree, but “other has the largest distance within”"
        " disagrees (difference -0.5, over folds and initialisations)"
    )
    agreeing = row(distances(figure(), cylindrical=1, other=2.5, spherical=1), knn())
    assert (agreeing.agrees, agreeing.remark) == ("agrees", "")


def gripper_row(knn_there: float):
    """The comparison of a CNN at 80 % and k-NN at 60 % on their gripper, with a chance of 10 %."""
    there = {"CNN": (0.8, 0.12), "k-NN": (0.6, knn_there)}
    measured = []
    for label, (home, value) in there.items():
        folds = [
            {"other": "moved", "grasps": 0, "fold": fold, "metric": "accuracy"}
            | {"value": value + shift, "chance": 0.1, "home": home + shift, "recordings": 0}
            for fold, shift in enumerate((-0.01, 0.01))
        ]
        name = "cnn" if label == "CNN" else "knn"
        measured.append(Result(name, label, {}, {"folds": listed("folds", folds)}, {}))
    settings = CrossGripperSettings(test_on=("moved",), grasps=(0,))
    task = dataclasses.replace(
        results("cross_gripper", figure()), settings=settings, results=tuple(measured)
    )
    return row(task, None)


def test_a_model_that_keeps_more_than_half_of_its_skill_is_named_in_a_remark():
    outcome = gripper_row(0.42)  # skill 32 of 50 %
    assert outcome.agrees == "agrees" and outcome.model == "CNN"
    assert outcome.remark.startswith("the verdict is about the paper's model, CNN; k-NN")
    assert "(60 % where it was trained, chance 10 %)" in outcome.remark
    assert gripper_row(0.34).remark == ""  # skill 24 of 50 %
