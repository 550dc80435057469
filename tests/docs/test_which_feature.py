"""The page on features has the numbers of its file, and its claims follow from them."""

import json

import numpy as np
import pytest

from tools.feature_page import (
    FAMILIES,
    FEATURES,
    FIGURE,
    MARGIN,
    MODELS,
    PAGE,
    REFERENCE,
    RESULTS,
    TARGETS,
    TITLE,
    dataset_gains,
    family_gains,
    fold_gains,
    page_with_tables,
    score,
    score_text,
    skill,
)


@pytest.fixture(scope="module")
def results():
    return json.loads(RESULTS.read_text(encoding="utf-8"))


def test_the_tables_are_those_of_the_measured_numbers(results):
    text = PAGE.read_text(encoding="utf-8")
    assert page_with_tables(text, results) == text


def test_the_advice_follows_from_the_verdicts(results):
    text = PAGE.read_text(encoding="utf-8")
    assert text.startswith(f"# {TITLE}\n")
    gains = fold_gains(results["scores"])
    assert f"in any of {len(gains)} tested comparisons" in text
    assert f"corrected for all {len(gains)} comparisons" in text
    assert f"±{100 * MARGIN:g} hundredths" in text
    means = family_gains(results["scores"])
    verdicts = [gain.verdict for gain in gains.values()]
    assert "better" not in [*verdicts, *(gain.verdict for _, gain in means.values())]
    worse = [key for key, gain in gains.items() if gain.verdict == "worse"]
    named = [(results["scores"][row]["dataset"], feature) for row, feature in worse]
    assert named == [("knock_material", "spectrogram")]
    for (family, _), (_, gain) in means.items():
        if family.source == "simulated" and not family.is_new_condition:
            assert gain.verdict == "no difference"
        if family.source == "recorded":
            assert gain.verdict == ("no test" if family.is_new_condition else "inconclusive")


@pytest.mark.parametrize(
    ("dataset", "held_out", "test_set", "feature", "model"),
    [
        ("size", "grasp_id", "", "mel", None),
        ("ycb", "grasp_id", "", "mel", None),
        ("mini_tapsense", "session_id", "", "spectrogram", "ridge"),
        ("ycb", "grasp_id", "ycb_moved_transducers", "spectrogram", "ridge"),
        ("active_rp", "grasp_id", "", "spectrogram", "ridge"),
        ("knock_material", "grasp_id", "", "spectrogram", "ridge"),
        ("knock_material", "grasp_id", "", "spectrogram", "knn_plain"),
        ("size", "grasp_id", "size_80dba", "spectrogram", "knn_plain"),
        ("size", "grasp_id", "size_80dba", "mel", "knn_plain"),
    ],
)
def test_the_advice_has_the_measured_numbers(results, dataset, held_out, test_set, feature, model):
    key = (dataset, held_out, test_set)
    (row,) = (
        row
        for row in results["scores"]
        if (row["dataset"], row["held_out"], row["test_set"]) == key
    )
    _, unit = TARGETS[dataset, row["target"]]
    advice = PAGE.read_text(encoding="utf-8").split("## Mean gain")[0]
    for shown in (feature, REFERENCE):
        assert score_text(score(row, shown, model), unit) in advice


def test_the_advice_on_noise_follows_from_the_scores_of_each_model(results):
    (row,) = (row for row in results["scores"] if row["test_set"] == "size_80dba")
    errors = {
        model: {feature: score(row, feature, model) for feature in FEATURES} for model in MODELS
    }
    assert min(errors["knn_plain"], key=errors["knn_plain"].get) == "transfer_function"
    assert max(errors["ridge"], key=errors["ridge"].get) == "transfer_function"
    assert [f for f, rmse in errors["ridge"].items() if rmse < row["chance"]] == ["mel"]
    advice = PAGE.read_text(encoding="utf-8").split("## Mean gain")[0]
    for model, feature in (
        ("knn_plain", "transfer_function"),
        ("ridge", "transfer_function"),
        ("ridge", "mel"),
    ):
        assert f"({score_text(errors[model][feature], 'mm')})" in advice


def test_the_models_disagree_as_often_as_the_page_says(results):
    rows = results["scores"]
    signs = [
        np.sign(
            [
                skill(row, score(row, feature, model)) - skill(row, score(row, REFERENCE, model))
                for model in MODELS
            ]
        ).prod()
        for row in rows
        for feature in row["features"]
        if feature != REFERENCE
    ]
    text = PAGE.read_text(encoding="utf-8")
    assert f"In {signs.count(-1)} of all {len(signs)} comparisons" in text
    for family in FAMILIES:
        if (family.source, family.is_new_condition) == ("recorded", True):
            continue  # two data sets
        gains = dataset_gains(rows, family, "mel", "knn_plain")
        assert (np.mean(gains) > 0) == (family.source == "recorded")


def test_the_figure_has_both_sources():
    picture = FIGURE.read_text(encoding="utf-8")
    assert len(picture) < 300_000
    assert all(f"<!-- {source} -->" in picture for source in ("recorded", "simulated"))
