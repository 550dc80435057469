"""Recordings in, tables out: errors, predictions, cost; and why a task cannot be evaluated."""

import re

import numpy as np
import pytest
from experiment_samples import with_task_settings

from ajgdata.evaluate import crossval
from ajgdata.evaluate.agreement import GRASP_INTERVAL
from ajgdata.evaluate.intervals import metric_interval
from ajgdata.evaluate.parts import part_columns
from ajgdata.experiments import cross_validation
from ajgdata.experiments.base import Inputs
from ajgdata.models import fit_model
from ajgdata.store.feature_array import frequency_axis
from ajgdata.store.features import FeatureColumn, FeatureRows, text_column
from ajgdata.types import CrossValidationSettings as Settings


def store(**columns) -> FeatureRows:
    """40 recordings of 10 grasps; the first 100 bins tell the size, the other 300 the class."""
    generator = np.random.default_rng(0)
    grasp = np.repeat(np.arange(10), 4)
    size = 10.0 + grasp
    feature = generator.uniform(0.99, 1.01, (40, 400)).astype(np.float32)
    feature[:, :100] *= size[:, np.newaxis]
    feature[:, 100:] *= 1 + grasp[:, np.newaxis] % 2
    missing = np.arange(40) < 4
    kind = np.where(missing, "", np.array(["even", "odd"])[grasp % 2])
    given = {
        "recording": text_column([f"s/{n:02d}" for n in range(40)]),
        "grasp_id": text_column([f"s/g{n}" for n in grasp]),
        "edge_mm": FeatureColumn(np.where(missing, np.nan, size), {"units": "mm"}),
        "kind": text_column(kind.tolist()),
        "constant": FeatureColumn(np.full(40, 3.0)),
        "one_group": text_column(["x"] * 40),
        "some_group": text_column(["" if n == 20 else "x" for n in range(40)]),
    }
    return FeatureRows(
        feature, (frequency_axis(np.arange(400.0)),), given | columns, {"source": "recorded"}
    )


def inputs(**changes) -> Inputs:
    given = {
        "dataset": "d",
        "task": "t",
        "target": "edge_mm",
        "kind": "regression",
        "unit": "mm",
        "groups": "grasp_id",
        "folds": 3,
        "seed": 0,
        "store": store(),
    }
    return Inputs(**with_task_settings(given | changes))


KINDS = {"target": "kind", "kind": "classification", "unit": ""}


def measured(model="linear", settings=None, **changes):
    """Return the tables by name, those of cost, and what else is told."""
    outcome = cross_validation.measure(inputs(**changes), settings or Settings(), model)
    tables, cost = ({t.name: t for t in group} for group in (outcome.tables, outcome.cost))
    return tables, cost, outcome.about


def columns(part):
    """Return the cells that identify a part of the data set `d`."""
    return part_columns(part, "d")._asdict()


def score(tables, part, metric, statistic="pooled"):
    (row,) = tables["scores"].where(**columns(part), metric=metric, statistic=statistic).rows
    return row["value"]


def folds_of(tables, part, metric):
    rows = tables["scores"].where(**columns(part), metric=metric).rows
    return [row["value"] for row in rows if row["statistic"].startswith("fold ")]


def test_regression():
    tables, cost, about = measured()
    # those whose target is missing are left out
    assert about["parts"] == {"grouped": {"recordings": 36, "groups": 9, "folds": 3}}
    predictions = tables["predictions"]
    assert len(predictions.rows) == 36
    assert predictions.rows[0]["recording"] == "s/04"
    assert predictions.rows[0]["probability"] is None
    errors = predictions.numbers("y_pred") - predictions.numbers("y_true")
    rmse = np.sqrt(np.mean(np.square(errors)))
    assert score(tables, "grouped", "rmse") == pytest.approx(rmse, rel=1e-9)
    assert rmse < score(tables, "grouped", "rmse", "chance") / 2
    each = folds_of(tables, "grouped", "rmse")
    assert score(tables, "grouped", "rmse", "mean") == pytest.approx(np.mean(each), rel=1e-12)
    assert score(tables, "grouped", "rmse", "sd") == pytest.approx(np.std(each, ddof=1), rel=1e-9)
    folds = {r["recording"]: r["fold"] for r in predictions.rows}
    for first in range(4, 40, 4):  # the four recordings of a grasp share their fold
        assert len({folds[f"s/{n:02d}"] for n in range(first, first + 4)}) == 1
    assert {r["metric"] for r in cost["scores"].rows} == {
        "train_s",
        "train_cpu_s",
        "inference_s_per_recording",
        "latency_s",
    }


def test_classification_beside_a_random_split():
    tables, cost, about = measured("knn", Settings(compare_random=True), **KINDS)
    assert score(tables, "grouped", "accuracy") == 1.0
    assert about["classes"] == ["even", "odd"]
    assert about["parts"]["random"]["groups"] == 36
    assert tables["predictions"].column("split") == ["grouped"] * 36 + ["random"] * 36
    assert all(0.5 <= p <= 1 for p in tables["predictions"].numbers("probability"))
    assert set(cost["scores"].column("split")) == {"grouped", "random"}


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        (
            {"groups": "one_group"},
            "all recordings have the same 'one_group': folds need at least two",
        ),
        (
            {"target": "constant"},
            "every recording has the same 'constant': at least two values are required",
        ),
        ({"target": "nope"}, "there is no column 'nope': add it to recordings.csv"),
        ({"groups": "some_group"}, "recording 's/20' has no 'some_group', which groups folds"),
        (
            {"withhold": np.arange(11.0, 19)},
            "withhold: at least two values must be left to train on",
        ),
    ],
)
def test_what_cannot_be_evaluated_is_refused_with_the_reason(changes, reason):
    with pytest.raises(ValueError, match=f"^{re.escape(reason)}$"):
        measured(**changes)


def test_withheld_values_are_trained_on_by_no_fold_and_predicted_by_all():
    tables, _, about = measured(withhold=[13.0, 17.0])
    assert about["parts"]["grouped"]["recordings"] == 36 - 8
    assert about["parts"]["withheld"]["recordings"] == 8
    known, new = (tables["predictions"].where(**columns(part)) for part in ("grouped", "withheld"))
    assert set(new.column("y_true")) == {13.0, 17.0}
    assert not set(known.column("y_true")) & {13.0, 17.0}
    assert sorted(new.column("fold")) == [0] * 8 + [1] * 8 + [2] * 8
    for fold, rmse in enumerate(folds_of(tables, "withheld", "rmse")):
        mine = new.where(fold=fold)
        errors = mine.numbers("y_pred") - mine.numbers("y_true")
        assert rmse == pytest.approx(np.sqrt(np.mean(np.square(errors))))
    means = {p: score(tables, p, "rmse", "mean") for p in ("grouped", "withheld", "overall")}
    low, high = sorted((means["grouped"], means["withheld"]))
    assert 0.9 * low < means["overall"] < 1.1 * high


def test_intervals_are_those_of_the_stored_predictions_by_grasp():
    """What is stored of each recording, with its grasp, gives the same ends."""
    shard = store(grasp_id=text_column([f"s/{n // 2}" for n in range(40)]))
    tables, _, _ = measured(store=shard, withhold=[11.0, 13.0, 15.0, 17.0, 18.0])
    names, grasps = (shard.columns[key].values.tolist() for key in ("recording", "grasp_id"))
    grasp_of = dict(zip(names, grasps, strict=True))

    def ends(*parts):
        rows = [row for part in parts for row in tables["predictions"].where(**columns(part)).rows]
        y_true, y_pred, fold = (
            np.array([row[key] for row in rows]) for key in ("y_true", "y_pred", "fold")
        )
        grasp = np.array([grasp_of[row["recording"]] for row in rows])
        part = np.array([row["target_values"] for row in rows])
        return metric_interval(y_true, y_pred, fold, grasp, part=part, kind="regression")

    for name, given in (("withheld", ["withheld"]), ("overall", ["grouped", "withheld"])):
        stored = [score(tables, name, "rmse", end) for end in GRASP_INTERVAL]
        assert stored == pytest.approx(ends(*given), rel=1e-9)
        assert stored[0] < score(tables, name, "rmse", "mean") < stored[1]
    assert score(tables, "grouped", "rmse", GRASP_INTERVAL[0]) is None  # of eight grasps


def test_other_data_sets_are_tested_without_a_grasp_on_both_sides():
    """A copy: each recording is predicted once, by the fold that holds its grasp out, hence as
    well as the original; and one with further grasps, which every fold predicts."""
    new = store(grasp_id=text_column([f"t/{n}" for n in range(40)]))
    stores = {"copy": store(), "new": new}
    settings = Settings(test_on=("copy", "new"))
    tables, _, about = measured(settings=settings, other_sets=stores, withhold=[15.0])
    for metric in ("rmse", "mae"):
        there = folds_of(tables, "on:copy", metric)
        assert there == folds_of(tables, "grouped", metric)
    # without the missing, and the withheld value
    assert about["parts"]["on:copy"]["recordings"] == 32
    assert len(tables["predictions"].where(**columns("on:new")).rows) == 3 * 32


def placed(*, sessions=4, seed=0, bins=6, effect=0.0) -> FeatureRows:
    """Recordings of three classes in sessions of five grasps, each recorded twice.

    A bin tells the placement exactly, whatever is placed; another one tells the class, by `effect`.
    """
    generator = np.random.default_rng(seed)
    names = [
        (session, kind, grasp, sample)
        for session in range(sessions)
        for kind in "abc"
        for grasp in range(5)
        for sample in range(2)
    ]
    placement = {(s, k): generator.normal() for s in range(sessions) for k in "abc"}
    feature = generator.normal(0, 0.01, (len(names), bins)).astype(np.float32)
    feature[:, 0] += [placement[s, k] for s, k, _, _ in names]
    feature[:, 1] += [effect * "abc".index(k) for _, k, _, _ in names]
    given = {
        "recording": text_column([f"s{s}/{k}{g}_{n}" for s, k, g, n in names]),
        "session_id": text_column([f"s{s}" for s, _, _, _ in names]),
        "grasp_id": text_column([f"s{s}/{k}{g}" for s, k, g, _ in names]),
        "placement_id": text_column([f"s{s}/{k}" for s, k, _, _ in names]),
        "object": text_column([k for _, k, _, _ in names]),
        "kind": text_column([k for _, k, _, _ in names]),
    }
    return FeatureRows(
        feature, (frequency_axis(np.arange(float(bins))),), given, {"source": "recorded"}
    )


def accuracy(tables, part, statistic="pooled"):
    return score(tables, part, "accuracy", statistic)


def test_a_placement_is_recognised_within_a_session_and_not_in_another():
    tables, _, about = measured("knn_plain", store=placed(), **KINDS)
    assert accuracy(tables, "grouped") > 0.75
    assert accuracy(tables, "sessions") < 0.6
    assert about["parts"]["sessions"]["folds"] == 3  # the folds of the task, of four sessions
    real, _, _ = measured("knn_plain", store=placed(effect=10.0), **KINDS)
    assert accuracy(real, "sessions") == 1.0


def test_one_placement_per_session_is_the_split_by_session():
    by_placement, _, about = measured(
        "knn_plain", store=placed(), groups="placement_id", folds=9, **KINDS
    )
    by_session, _, _ = measured("knn_plain", store=placed(), groups="session_id", folds=9, **KINDS)
    assert accuracy(by_placement, "grouped") == accuracy(by_session, "grouped")
    assert list(about["parts"]) == ["grouped"]  # one value, and not the same one twice


def test_a_single_session_and_a_declined_comparison_have_no_split_by_session():
    _, _, about = measured("knn_plain", store=placed(sessions=1), **KINDS)
    assert list(about["parts"]) == ["grouped"]
    _, _, declined = measured(
        "knn_plain", Settings(compare_sessions=False), store=placed(), **KINDS
    )
    assert list(declined["parts"]) == ["grouped"]


def test_settings_are_chosen_by_grasp_if_one_session_is_left_to_train_on(monkeypatch):
    """With two sessions, the training part is one group: a choice by session is impossible."""
    chosen = []

    def fitted(model, features, target, groups, limit=None):
        chosen.append(len(np.unique(groups)))
        return fit_model(model, features, target, groups, limit)

    monkeypatch.setattr(crossval, "fit_model", fitted)
    measured("knn", store=placed(sessions=2), folds=2, **KINDS)
    assert chosen == [15, 15, 15, 15]  # grasps: half of thirty, in both splits
    chosen.clear()
    measured("knn", store=placed(), groups="session_id", folds=4, **KINDS)
    assert chosen == [3] * 4  # sessions, because there are several


def test_a_placebo_in_another_data_set_is_measured_by_the_same_splits():
    settings = Settings(placebo="nothing")
    tables, cost, about = measured(
        "knn_plain",
        settings,
        store=placed(effect=10.0),
        other_sets={"nothing": placed(seed=1)},
        **KINDS,
    )
    assert accuracy(tables, "grouped") == 1.0
    assert (
        accuracy(tables, "placebo grouped:nothing") > 0.75
    )  # the protocol gives the placement away
    assert accuracy(tables, "placebo session:nothing") < 0.6
    assert accuracy(tables, "placebo grouped:nothing", "chance") == pytest.approx(1 / 3)
    assert about["parts"]["placebo grouped:nothing"]["groups"] == 60
    own = cost["scores"].where(split="grouped", test_set="", metric="train_cpu_s").rows
    assert len(own) == 1


def test_placebo_objects_of_a_data_set_belong_to_no_other_evaluation():
    recorded = placed(effect=10.0)
    placebo = placed(seed=1)
    renamed = {"object": {"a": "x", "b": "y", "c": "z"}}
    prefixes = {"grasp_id": "p", "placement_id": "p", "recording": "p"}
    columns = {}
    for name, column in placebo.columns.items():
        names = renamed.get(name, {})
        own = [prefixes.get(name, "") + names.get(text, text) for text in column.values.tolist()]
        columns[name] = text_column([*recorded.columns[name].values.tolist(), *own])
    columns["kind"] = text_column([*recorded.columns["kind"].values, *[""] * 120])
    both = FeatureRows(
        np.concatenate([recorded.feature, placebo.feature]),
        recorded.axes,
        columns,
        {"source": "recorded"},
    )
    own = {"store": both, "target": "object", "kind": "classification", "unit": ""}
    tables, _, about = measured("knn_plain", placebo_objects=["x", "y", "z"], **own)
    assert about["classes"] == ["a", "b", "c"]
    assert about["parts"]["grouped"]["recordings"] == 120
    assert accuracy(tables, "grouped") == 1.0
    assert accuracy(tables, "placebo grouped:d") > 0.75
    assert accuracy(tables, "placebo session:d") < 0.6
    _, _, numbers = measured(placebo_objects=["x"], store=store(object=text_column(["a"] * 40)))
    assert list(numbers["parts"]) == ["grouped"]  # names are no values of a regression


def test_the_design_of_a_recording_is_stored_with_its_scores():
    _, _, about = measured("knn_plain", store=placed(sessions=2), **KINDS)
    assert about["design"] == {"sessions": 2, "placements": 1, "fewest_recordings": 20}
    without = placed(sessions=1)
    columns = {name: c for name, c in without.columns.items() if name != "placement_id"}
    unknown = FeatureRows(without.feature, without.axes, columns, without.attrs)
    _, _, about = measured("knn_plain", store=unknown, **KINDS)
    assert about["design"] == {"sessions": 1, "placements": None, "fewest_recordings": 10}


def test_controls_that_are_not_possible_do_not_lose_the_score():
    """A class that is in one session only cannot be held out with its session."""
    two = placed(sessions=2, effect=10.0)
    named, session = (two.columns[name].values for name in ("kind", "session_id"))
    kinds = np.where((named == "c") & (session == "s1"), "", named).tolist()
    store_of_one = FeatureRows(
        two.feature, two.axes, {**two.columns, "kind": text_column(kinds)}, two.attrs
    )
    tables, _, about = measured("knn_plain", store=store_of_one, placebo_objects=["x"], **KINDS)
    assert accuracy(tables, "grouped") == 1.0
    assert set(about["unmeasured"]) == {"held-out sessions", "placebo"}
    assert "'c'" in about["unmeasured"]["held-out sessions"]
    assert list(about["parts"]) == ["grouped"]


def test_sessions_are_held_out_for_the_named_models_only():
    settings = Settings(compare_sessions=("knn_plain",))
    _, _, named = measured("knn_plain", settings, store=placed(), **KINDS)
    _, _, other = measured("linear_plain", settings, store=placed(), **KINDS)
    assert list(named["parts"]) == ["grouped", "sessions"]
    assert list(other["parts"]) == ["grouped"]
