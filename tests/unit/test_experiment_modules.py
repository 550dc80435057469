"""Experiments: recordings of a task in, tables out; figures, captions and rows made of them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from experiment_samples import measured, small_inputs, task_results

from ajgdata.evaluate.calibration import weighted_quantile
from ajgdata.evaluate.in_use import calibration, half_width
from ajgdata.evaluate.splits import grouped_folds
from ajgdata.experiments.base import Outcome
from ajgdata.experiments.registry import EXPERIMENTS, load_experiment
from ajgdata.experiments.requests import listing_keys, requested_experiments
from ajgdata.experiments.sorting import CALIBRATED, PLAIN
from ajgdata.models import fit_model, make_model
from ajgdata.report.canvas import draw
from ajgdata.report.comparison import PaperFigure
from ajgdata.types import DatasetSpec
from ajgdata.types.table import table_of

PAPER = PaperFigure(id="x", metric="m", value=80, unit="%", text="coffee loses & loses", where="w")


def nothing(*_):
    return None


# Learning curve


@pytest.mark.parametrize(
    ("value", "reached", "says", "agrees"),
    [
        (3, 39, "4 (4 to 4); 50.0 ± 1.0 % with 16", "worse"),
        (4, 39, "4 (4 to 4); 50.0 ± 1.0 % with 16", "agrees"),  # exactly the published number
        (12, 39, "4 (4 to 4); 50.0 ± 1.0 % with 16", "better"),
        (
            20,
            80,
            "more than 16 (more than 16 to more than 16); 50.0 ± 1.0 % with 16",
            "inconclusive",
        ),
        (12, 80, "more than 16 (more than 16 to more than 16); 50.0 ± 1.0 % with 16", "worse"),
    ],
)
def test_how_many_grasps_reach_the_papers_accuracy(value, reached, says, agrees):
    rows = [
        {"groups": n, "draw": d, "recordings": n, "metric": "accuracy", "value": v, "chance": 0.25}
        for n, mean, sd in ((1, 0.20, 0.05), (4, 0.40, 0.03), (16, 0.50, 0.01))
        for d, v in enumerate((mean - sd, mean, mean + sd))
    ]
    table = table_of("curve", "c", rows, **{key: key for key in rows[0]})
    shares = [
        {"groups": n, "draw": d, "grasp": f"g{g}", "correct": mean}
        for n, mean in ((1, 0.20), (4, 0.40), (16, 0.50))
        for d in range(3)
        for g in range(12)
    ]
    held_out = table_of("held_out", "h", shares, **{key: key for key in shares[0]})
    paper = PAPER.model_copy(update={"value": value, "reached": reached})
    results = task_results(
        "learning_curve",
        {"knn": Outcome((table, held_out))},
        papers={"learning_curve": paper},
        settings={"groups": [1, 4, 16], "repeats": 3},
    )
    (row,) = load_experiment("learning_curve").paper_comparison(results, nothing)
    assert (row.result, row.agrees, row.model) == (says, agrees, "k-NN")
    (advice,) = load_experiment("learning_curve").advice(results)
    assert advice.startswith("With 16 instead of 4 training grasps per class, the accuracy of k-NN")
    assert advice.endswith(" changed from 40 to 50 %.")


# Sorting


def sorting_results(accepted, correct, **changes):
    """Shares by calibrated probabilities, with intervals; plain ones accept all, and half wrongly.

    `accepted` and `correct` are the share and the ends of its interval.
    """
    decisions = [
        {"part": part, "classes": 4, "grasps": 80}
        | {"accepted": a[0], "accepted low": a[1], "accepted high": a[2]}
        | {"correct": c[0], "correct low": c[1], "correct high": c[2]}
        for part, a, c in (
            (CALIBRATED, accepted, correct),
            (PLAIN, (1.0, 0.95, 1.0), (0.5, 0.4, 0.6)),
        )
    ]
    runs = [
        {"part": part, "run": n, "sorts": n, "errors": 0}
        for part in (PLAIN, CALIBRATED)
        for n in range(101)
    ]
    named = {"decisions": decisions, "runs": runs}
    tables = [table_of(n, n, rows, **{k: k for k in rows[0]}) for n, rows in named.items()]
    share = {"unit": "%", "row": "", "correct": 39}
    papers = {
        "sorting": PAPER.model_copy(update=share | {"id": "a", "value": 97.5, "trials": 40}),
        "sorting.correct": PAPER.model_copy(update=share | {"id": "c", "value": 100, "trials": 39}),
    }
    options = {"papers": papers, "settings": {"scenario": "random poses"}} | changes
    return task_results("sorting", {"cnn": Outcome(tuple(tables))}, **options)


GOOD = (0.98, 0.93, 1.0)


@pytest.mark.parametrize(
    ("accepted", "verdict"),
    [
        (GOOD, "agrees"),
        # 39 of 40: 86.8 to 99.9 %. The difference -0.075 has the interval -0.15 to 0.04
        ((0.90, 0.84, 0.95), "agrees"),
        # below our low end and the published low end alike, but the intervals overlap
        ((0.84, 0.76, 0.92), "worse"),
        ((0.90, 0.70, 1.0), "inconclusive"),
    ],
)
def test_sorting_is_compared_by_two_shares_with_the_intervals_of_both(accepted, verdict):
    results = sorting_results(accepted, GOOD)
    shares = list(load_experiment("sorting").paper_comparison(results, nothing))
    assert [row.paper.id for row in shares] == ["a", "c"]
    assert [row.agrees for row in shares] == [verdict, "agrees"]
    first, second = shares
    assert first.result.endswith(
        " with plain probabilities; 39 of 40 in the paper, at least 88.7 % (one-sided 95 % bound)"
    )
    assert second.result == (
        "98 % (93 to 100) correct among accepted (80 grasps, calibrated); "
        "50 % (40 to 60) with plain probabilities; "
        "39 of 39 in the paper, at least 92.6 % (one-sided 95 % bound)"
    )
    assert [mark.value for mark in second.marks] == [98, 25]


def test_sorting_without_a_decision_has_no_verdict():
    nan = float("nan")
    results = sorting_results((0.0, 0.0, 0.05), (nan, nan, nan))
    accepted, correct = load_experiment("sorting").paper_comparison(results, nothing)
    assert (accepted.agrees, correct.agrees) == ("worse", "inconclusive")
    assert correct.result.startswith("nothing correct among accepted")
    rows = list(load_experiment("sorting").rows(results))
    assert [row.value for row in rows] == [
        "0 % (0 to 5)",
        "nothing",
        "100 % (95 to 100)",
        "50 % (40 to 60)",
    ]


def test_other_scenarios_on_the_page_stand_in_the_comparison():
    near = {"settings": {"scenario": "known locations"}, "dataset": "near", "papers": {}}
    other = sorting_results((0.99, 0.95, 1.0), GOOD, **near)
    results = replace(sorting_results(GOOD, GOOD), same_page=(other,))
    row, _ = load_experiment("sorting").paper_comparison(results, nothing)
    assert "; 99 % (95 to 100) for known locations; 39 of 40" in row.result
    assert row.label == "random poses"
    assert not list(load_experiment("sorting").paper_comparison(other, nothing))


def test_the_title_of_sorting_has_both_shares_and_the_runs():
    (lengths, _) = load_experiment("sorting").plots
    results = sorting_results((0.85, 0.76, 0.92), GOOD)
    assert lengths.bind(results).conclusion == (
        "CNN: 85 % accepted, 98 % of the accepted correct; 50 (5 to 95) objects until the first "
        "refusal"
    )
    assert lengths.bind(results).published == (39,)


# Novel objects


def test_the_title_of_novel_objects_compares_the_guard_with_single_detectors():
    rows = [
        {"key": key, "detector": key, "detected": rate, "low": rate / 2, "high": 2 * rate}
        for key, rate in (("guard", 0.3), ("nearest", 0.1), ("relative", 0.4), ("energy", 0.04))
    ]
    columns = {key: key for key in rows[0]}
    outcome = Outcome((table_of("detectors", "d", rows, **columns),))
    results = task_results("novel_objects", {"": outcome})
    (curve,) = load_experiment("novel_objects").plots
    assert curve.title(results) == (
        "30 % (15 to 60) of novel objects detected at 5 % false alarms; best alone 40 % (relative)"
    )


# Reflected energy


@pytest.mark.parametrize(
    ("ends", "verdict"),
    [((0.05, 0.14), "agrees"), ((0.05, 0.3), "inconclusive"), ((0.21, 0.3), "disagrees")],
)
def test_more_than_80_per_cent_is_lost_if_the_interval_of_coffee_is_beyond(ends, verdict):
    classes = [
        {"label": label, "grasps": 4, "mean": mean, "sd": 0.05, "low": low, "high": high}
        for label, mean, (low, high) in (
            ("air", 1.0, (1.0, 1.0)),
            ("coffee", 0.1, ends),
            ("steel_balls", 0.5, (0.4, 0.6)),
        )
    ]
    results = task_results(
        "reflected_energy",
        {"": Outcome((table_of("classes", "c", classes, **{key: key for key in classes[0]}),))},
        settings={"reference": "air", "band_hz": [100, 6000]},
        papers={"reflected_energy": PAPER},
    )
    steel, _ = load_experiment("reflected_energy").rows(results)
    assert (steel.label, steel.value) == ("steel balls", "50 (40 to 60) %")
    (row,) = load_experiment("reflected_energy").paper_comparison(results, nothing)
    low, high = (round(100 - 100 * end) for end in reversed(ends))
    values = "energy lost: coffee 90 %, steel_balls 50 %"
    lost = f"{values}; 95 % intervals: coffee {low} to {high} %, steel_balls 40 to 60 %"
    assert (row.result, row.agrees) == (lost, verdict)


def losses(plastic: float, metal: float, coffee: float):
    """Return the comparison of losses (per cent, ± 1) with `more than 80 % of coffee`."""
    rows = [
        {"label": label, "mean": 1 - lost / 100, "sd": 0.01, "grasps": 16}
        | {"low": 0.99 - lost / 100, "high": 1.01 - lost / 100}
        for label, lost in (("metal", metal), ("plastic", plastic), ("coffee", coffee))
    ]
    classes = [{"label": "air", "mean": 1.0, "sd": 0, "grasps": 16, "low": 1, "high": 1}, *rows]
    table = table_of("classes", "c", classes, **{key: key for key in classes[0]})
    paper = PAPER.model_copy(
        update={"value": 80, "unit": "%", "order": ("plastic", "metal", "coffee")}
    )
    results = task_results(
        "reflected_energy",
        {"": Outcome((table,))},
        settings={"reference": "air", "band_hz": [100, 6000]},
        papers={"reflected_energy": paper},
    )
    (row,) = load_experiment("reflected_energy").paper_comparison(results, nothing)
    return row


def test_order_and_losses_of_all_media_are_compared():
    assert losses(50, 70, 90).agrees == "agrees"
    shared = losses(84, 87, 96)  # all three lose more than 80 %, in the published order
    assert shared.agrees == "partly agrees"
    assert shared.result.endswith("plastic and metal lose more than 80 % as well")
    assert losses(50, 70, 75).agrees == "partly agrees"  # the order only
    assert losses(70, 50, 90).agrees == "partly agrees"  # metal reflects more than plastic
    assert losses(95, 90, 70).agrees == "disagrees"
    # Differences of two values ± 1 are known to ± √2.
    assert (
        "metal loses 18.6 to 21.4 percentage points more than plastic" in losses(50, 70, 90).result
    )


# Other grippers


def test_a_model_on_another_gripper_against_calibration_grasps():
    rows = [
        {"other": name, "grasps": n, "fold": f, "metric": "rmse", "value": mean * (1 + d)}
        | {"chance": 9.0, "home": home and home * (1 + d) if n == 0 else None, "recordings": 2}
        for name, means, home in (("b", (8.0, 2.0), 1.0), ("c", (17.0, 3.0), None))
        for n, mean in zip((0, 4), means, strict=True)
        for f, d in enumerate((-0.1, 0.1))
    ]
    outcome = Outcome((table_of("folds", "f", rows, **{key: key for key in rows[0]}),))
    results = task_results(
        "cross_gripper",
        {"knn": outcome},
        kind="regression",
        settings={"test_on": ["b", "c"], "grasps": [0, 4]},
        papers={"cross_gripper": PAPER},
    )
    (illustration,) = load_experiment("cross_gripper").figures(results)
    left, _ = draw(illustration).axes
    np.testing.assert_allclose(left.containers[0].lines[0].get_xydata(), [[0, 8], [4, 2]])
    said = {row.metric: row.value for row in load_experiment("cross_gripper").rows(results)}
    assert said["RMSE, Gripper b, grasps 0"] == "8.0 ± 1.1 mm"
    assert said["RMSE, Gripper c, grasps 0"] == "17.0 ± 2.4 mm, not better than chance"
    assert said["RMSE, Gripper c, grasps 4"] == "3.00 ± 0.42 mm"
    (row,) = load_experiment("cross_gripper").paper_comparison(results, nothing)
    assert row.result.startswith("1.00 ± 0.14 mm where it was trained, 8.0 ± 1.1 mm on Gripper b")


def test_bars_of_another_gripper_end_at_possible_values_and_the_caption_names_what_was_added():
    rows = [
        {"other": "b", "grasps": 0, "fold": f, "metric": "accuracy", "value": value}
        | {"chance": 0.25, "home": 0.9, "recordings": 2}
        for f, value in enumerate((0.0, 0.0, 0.3))
    ]
    outcome = Outcome((table_of("folds", "f", rows, **{key: key for key in rows[0]}),))
    settings = {"test_on": ["b"], "grasps": [0]}
    kind = {"kind": "classification", "settings": settings}
    results = task_results("cross_gripper", {"knn": outcome}, **kind)
    (illustration,) = load_experiment("cross_gripper").figures(results)
    (segments,) = draw(illustration).axes[0].containers[0].lines[2]
    (bar,) = segments.get_segments()
    # Mean 10 %, standard deviation 17.3 %: the bar would begin below 0 %.
    assert bar[:, 0].tolist() == pytest.approx([0.0, 10 + 300**0.5])
    assert "without any of its grasps in the training" in illustration.caption.text


# Conformal intervals


def test_the_weighted_quantile_is_the_least_value_that_reaches_the_share():
    values = np.array([[3.0, 1], [1, 2], [2, 3]])
    weights = np.array([0.25, 0.25, 0.25])
    np.testing.assert_array_equal(weighted_quantile(values, weights, 0.5), [2, 2])
    np.testing.assert_array_equal(weighted_quantile(values, weights, 0.75), [3, 3])
    assert np.isinf(weighted_quantile(values, weights, 0.76)).all()


def test_the_half_width_is_that_of_split_conformal():
    """The ceil((n + 1) c)-th least residual (Vovk et al. 2005)."""
    residuals = np.arange(1.0, 20)  # 19: (n + 1) c is whole for c = 0.9
    halves = [half_width(residuals, np.arange(19), c) for c in (0.5, 0.9, 0.99)]
    assert halves == [10, 18, math.inf]
    assert half_width(residuals, np.arange(19), 0.99, period=180) == 90  # no angle is further


def test_what_is_evaluated_is_the_interval_that_is_shipped():
    """In each fold the half width that training for use stores, of a model of the training part."""
    inputs = small_inputs("regression")
    outcome = measured("conformal_intervals", inputs, "linear_plain", coverages=[0.9])
    data = inputs.data()
    x = data.feature
    y = data.value
    group = data.group
    for fold, (train, test) in enumerate(grouped_folds(y, group, "regression", 5, 0)):
        shipped = calibration(
            x[train], y[train], group[train], group[train], model="linear_plain", kind="regression"
        )
        fitted = fit_model(
            make_model("linear_plain", "regression", 0), x[train], y[train], group[train]
        )
        row = outcome.tables[1].where(fold=fold).rows[0]
        assert row["width"] == 2 * shipped.half_width
        away = np.abs(y[test] - fitted.predict(x[test]))
        assert row["held"] == np.mean(away <= shipped.half_width)


def test_intervals_are_quantiles_of_residuals_by_grasp(monkeypatch):
    """24 training grasps have residuals 1 to 24 in both recordings. With one weight for the new
    grasp, each weighs 1/25: a share of 0.5 needs 13 grasps, 0.7 needs 18, 0.97 more than 24."""

    def ranks(_x, _y, group, **_):
        return np.unique(group, return_inverse=True)[1] + 1.0

    monkeypatch.setattr("ajgdata.experiments.conformal_intervals.held_out_residuals", ranks)
    coverages = [0.5, 0.7, 0.97]
    outcome = measured(
        "conformal_intervals", small_inputs("regression"), "linear_plain", coverages=coverages
    )
    for fold in range(5):
        rows = outcome.tables[1].where(fold=fold)
        assert rows.numbers("coverage").tolist() == coverages
        assert rows.numbers("width").tolist() == [26, 36, math.inf]
    of_angles = measured(
        "conformal_intervals",
        small_inputs("regression", period_deg=40.0),
        "linear_plain",
        coverages=coverages,
    )
    # no angle is further than half a period from another
    assert of_angles.tables[1].where(fold=0).numbers("width").tolist() == [26, 36, 40]
    assert of_angles.tables[1].where(coverage=0.97).numbers("held").tolist() == [1] * 5


# What a task asks for


def spec(**changes) -> DatasetSpec:
    content = {
        "name": "d",
        "features": {"window": 1024, "hop": 256},
        "targets": {"x": {"kind": "classification"}, "y": {"kind": "regression"}},
        "tasks": {"t": {"target": "x", "models": ["knn"], **changes}},
    }
    return DatasetSpec.model_validate(content)


@pytest.mark.parametrize(
    ("experiments", "says"),
    [
        (
            {"cross_gripper": {"test_on": ["a"], "grasps": [0, 2, 2]}},
            r"experiments.cross_gripper.grasps lists 2 twice",
        ),
        (
            {"shortcut": {"test_on": ["a", "b", "a"]}},
            r"experiments.shortcut.test_on lists a twice",
        ),
        (
            {"nope": {}},
            "no experiment 'nope': there are conformal_intervals",
        ),
        ({"learning_curve": {}}, r"experiments.learning_curve: groups is missing"),
        ({"conformal_intervals": {}}, "conformal_intervals is for regression, not classification"),
        (
            {"reflected_energy": {"reference": "a", "band_hz": [1, 2]}},
            "needs features.quantity power",
        ),
    ],
)
def test_what_cannot_be_measured_is_refused_with_task_and_reason(experiments, says):
    with pytest.raises(ValueError, match=f"task t: .*{says}"):
        requested_experiments(spec(experiments=experiments), "t")


def test_all_lists_of_settings_are_checked_for_repeated_values():
    keys = {name: listing_keys(e.settings) for name, e in EXPERIMENTS.items() if not e.of_embedding}
    assert keys["cross_gripper"] == ["test_on", "grasps", "models"]
    assert keys["conformal_intervals"] == ["coverages", "models"]
    assert keys["reflected_energy"] == []  # the two ends of a band are no list
