"""Tuning as an experiment: what is measured of a task, and what is said of it."""

import dataclasses
import math

import numpy as np
import pytest
from experiment_samples import measured, numbers, small_inputs, task_results

from ajgdata.evaluate.crossval import cross_validate
from ajgdata.experiments import EXPERIMENTS, asked_of
from ajgdata.experiments.base import Outcome, score_table
from ajgdata.experiments.tuning import CHOICE_COLUMNS, compared, finding, p_values, verdicts
from ajgdata.pipeline.experiments import with_page_tests
from ajgdata.report.canvas import draw
from ajgdata.report.format import DASH, number
from ajgdata.types import DatasetSpec
from ajgdata.types.table import table_of


def test_both_models_are_tested_on_the_same_folds_and_the_choices_kept():
    inputs = small_inputs(folds=3)
    outcome = measured("tuning", inputs, "ridge")
    data = inputs.data()
    for part, model in (("plain", "ridge_plain"), ("tuned", "ridge")):
        own = cross_validate(data.feature, data.value, data.group, model=model, **inputs.split)
        folds = [
            numbers(outcome.tables, part=part, metric="accuracy", statistic=f"fold {n}")[0]
            for n in range(3)
        ]
        assert folds == list(own.scores.per_fold["accuracy"])
    choices = outcome.tables[1]
    assert choices.column("choice") == [one["choice"] for one in own.choices]
    assert set(choices.column("reason")) == {""}
    assert numbers(outcome.cost, part="cost of tuned") > numbers(outcome.cost, part="cost of plain")
    with pytest.raises(ValueError, match="cnn chooses nothing; give some of linear, ridge, knn"):
        spec = {"target": "object", "experiments": {"tuning": {"models": ["cnn"]}}}
        declared = {"targets": {"object": {"kind": "classification"}}, "tasks": {"t": spec}}
        asked_of(DatasetSpec.model_validate({"name": "d", **declared}), "t")


def by_hand(plain, tuned, seconds=(2.0, 30.0), reason=""):
    """An outcome of four folds."""
    rows = [
        ("m", part, "accuracy", statistic, value)
        for part, folds in (("plain", plain), ("tuned", tuned))
        for statistic, value in (
            ("mean", np.mean(folds)), ("sd", np.std(folds, ddof=1)),
            *((f"fold {n}", v) for n, v in enumerate(folds)),
        )
    ]  # fmt: skip
    choices = [
        {"fold": n, "choice": "L2" if n else "stored", "reason": reason, "score": 0.5,
         "failed": n * (seconds[1] == 5)}
        for n in range(4)
    ]  # fmt: skip
    cost = [("m", f"cost of {p}", "train_cpu_s", "measured", s)
            for p, s in zip(("plain", "tuned"), seconds, strict=True)]  # fmt: skip
    tables = score_table(rows, ""), table_of("choices", "", choices, **CHOICE_COLUMNS)
    return Outcome(tables, (score_table(cost, ""),))


def test_what_tuning_is_worth_and_costs_is_said():
    gained = by_hand([0.5, 0.6, 0.5, 0.6], [0.71, 0.79, 0.7, 0.8])
    same = by_hand([0.5, 0.6, 0.5, 0.6], [0.6, 0.5, 0.6, 0.5], seconds=(1.0, 5.0))
    lost = by_hand([0.9] * 4, [0.5, 0.51, 0.5, 0.51], seconds=(1.0, 4.0), reason="one group")
    outcomes = {"knn": gained, "linear": same, "svm": lost}
    results = task_results("tuning", outcomes, settings={"models": tuple(outcomes)})
    one, other, third = (compared(results, result) for result in results.results)
    assert one.gain.gain == pytest.approx(0.2)
    # four folds: t(0.975, 3) = 3.182, (1/4 + 1/3) s^2 of the differences
    s = np.std([0.21, 0.19, 0.2, 0.2], ddof=1)
    assert one.gain.high - one.gain.gain == pytest.approx(3.182446 * s * np.sqrt(7 / 12), rel=1e-5)
    assert (one.times, one.choices) == (15.0, [("L2", 3), ("stored", 1)])
    assert other.gain.low < 0 < other.gain.high
    assert (third.choices, third.reasons) == ([], ["one group"])
    text = (
        "Tuning on inner folds lowers the error of 1 of 3 models, raises it for 1; training takes"
    )
    assert finding(results).startswith(f"{text} 5 × ")
    (picture,) = EXPERIMENTS["tuning"].figures(results)
    words = [text.get_text() for text in draw(picture).findobj() if hasattr(text, "get_text")]
    assert {"plain", "tuned", "k-NN", "SVM"} <= set(words)
    (table,) = EXPERIMENTS["tuning"].tables(results)
    assert table.rows[0][-2:] == ("15 ×", "L2: 3; stored: 1")
    assert [row[4] for row in table.rows] == ["supported", "not supported", "refuted"]
    assert "corrected for the 3 tests on this page (Holm)" in table.caption
    assert table.rows[1][-1].endswith("stored: 1; 3 of the candidates could not be trained")
    assert table.rows[2][-1] == "one group"
    assert "55.0 ± 5.8 % plain, 55.0 ± 5.8 % tuned; SVM" in picture.caption.alt


def test_verdicts_depend_on_all_tests_of_the_page():
    """A gain with p of about 0.02 is supported as the only test of a page, not as one of five."""
    weak = by_hand([0.5, 0.6, 0.5, 0.6], [0.66, 0.68, 0.6, 0.72])
    results = task_results("tuning", {"knn": weak}, settings={"models": ("knn",)})
    (p,) = p_values(results)
    assert 0.01 < p < 0.05 and verdicts(results) == ["supported"]
    crowded = dataclasses.replace(results, other_p=(0.3, 0.4, 0.5, 0.9, math.nan))
    assert verdicts(crowded) == ["not supported"]
    (table,) = EXPERIMENTS["tuning"].tables(crowded)
    assert table.rows[0][4:6] == ("not supported", number(5 * p, 2))
    assert "for the 5 tests on this page" in table.caption


def test_pages_count_the_tests_of_all_their_tasks_and_experiments():
    weak = by_hand([0.5, 0.6, 0.5, 0.6], [0.66, 0.68, 0.6, 0.72])
    one = task_results("tuning", {"knn": weak}, settings={"models": ("knn",)})
    first, second = (dataclasses.replace(one, task=task, page="a") for task in ("t", "u"))
    apart = dataclasses.replace(one, page="b")
    counted = with_page_tests([first, second, apart])
    p = p_values(one)
    assert [results.other_p for results in counted] == [tuple(p), tuple(p), ()]


def test_what_cannot_be_tested_is_said_and_no_interval_is_shown():
    same = by_hand([0.5, 0.6, 0.5, 0.6], [0.5, 0.6, 0.5, 0.6])
    results = task_results("tuning", {"knn": same}, settings={"models": ("knn",)})
    (table,) = EXPERIMENTS["tuning"].tables(results)
    assert table.rows[0][3:6] == ("0 (not testable) %", "not testable", DASH)
    assert finding(results).startswith("Tuning on inner folds lowers the error of 0 of 1 models;")
    draw(EXPERIMENTS["tuning"].figures(results)[0])


def test_no_gain_of_an_accuracy_leads_beyond_all_right():
    wild = by_hand([0.9, 0.1, 0.9, 0.1], [0.1, 0.9, 0.9, 0.9])
    results = task_results("tuning", {"knn": wild}, settings={"models": ("knn",)})
    one = compared(results, results.results[0])
    assert (one.gain.low, one.gain.high) == pytest.approx((-0.5, 0.5))


def test_a_smaller_error_is_a_gain_too():
    outcome = measured("tuning", small_inputs("regression"), "linear")
    results = task_results("tuning", {"linear": outcome}, "regression")
    one = compared(results, results.results[0])
    plain, tuned = np.array(one.plain.per_fold), np.array(one.tuned.per_fold)
    assert one.gain.gain == pytest.approx((plain - tuned).mean())
