"""Models asked about recordings with the speaker silent: what is measured, shown and refused."""

import dataclasses

import numpy as np
import pytest
from result_samples import sizes
from test_cross_validation import inputs, score, store

from ajgdata.experiments import shortcut
from ajgdata.experiments.base import Other, Result, TaskResults
from ajgdata.experiments.settings import ShortcutSettings
from ajgdata.experiments.shortcut import TEST_COLUMNS
from ajgdata.experiments.silence_tests import silence_tests
from ajgdata.store.features import FeatureRows, text_column
from ajgdata.types.table import table_of


def elsewhere(*, quiet: bool) -> FeatureRows:
    """Return recordings of further grasps; `quiet`: of noise that knows nothing of the target."""
    shard = store(grasp_id=text_column([f"t/{n // 2}" for n in range(40)]))
    if quiet:
        shard.feature[:] = np.random.default_rng(1).uniform(0.99, 1.01, shard.feature.shape)
    return shard


def measured(model="linear", settings=None, **changes):
    sets = {"loud": elsewhere(quiet=False), "quiet": elsewhere(quiet=True)}
    given = inputs(**({"other_sets": sets} | changes))
    settings = settings or ShortcutSettings(test_on=("loud", "quiet"))
    return {table.name: table for table in shortcut.measure(given, settings, model).tables}


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({}, "rank correlation"),
        ({"period_deg": 40.0}, "correlation of angles"),
    ],
)
def test_a_model_that_hears_the_target_is_flagged_and_one_that_hears_noise_is_not(changes, name):
    tables = measured(**changes)
    loud, quiet = tables["silence"].rows
    assert (loud["data_set"], quiet["data_set"]) == ("loud", "quiet")
    assert loud["measure"] == quiet["measure"] == name
    assert loud["p"] == 1 / 1000
    assert quiet["p"] > 0.01
    assert score(tables, "on:loud", name) == loud["value"] > loud["null"]
    assert score(tables, "on:loud", name, "chance") == loud["null"]
    assert score(tables, "on:quiet", "p", "of 999") == quiet["p"]
    assert "flagged" not in loud  # p of one test: the page corrects it and flags
    assert set(tables["scores"].column("model")) == {"linear"}


def silence(**flagged: bool) -> TaskResults:
    """Results of models by name, flagged or not."""
    results = []
    for model, flag in flagged.items():
        value, p = (0.8, 0.001) if flag else (0.1, 0.7)
        test = ("quiet", "rank correlation", value, 0.2, 999, p)
        rows = [dict(zip(TEST_COLUMNS, test, strict=True))]
        tables = {"silence": table_of("silence", "", rows, **TEST_COLUMNS)}
        results.append(Result(model, model, {"folds": 2}, tables, {}))
    return sizes(
        results=tuple(results),
        experiment="shortcut",
        papers={},
        settings=ShortcutSettings(test_on=("quiet",)),
        other_sets={"quiet": Other("Silence")},
    )


def test_a_model_that_knows_the_answer_in_silence_is_shown_as_flagged():
    said = shortcut.EXPERIMENT.summary(silence(cnn=True, knn=False))  # p of two tests
    assert "cnn on Silence: rank correlation with the truth 0.8, 0.2 with labels" in said
    assert "p = 0.002: flagged." in said and "p = 0.7: not flagged." in said


def test_p_is_corrected_for_all_tests_on_the_page():
    here = silence(cnn=True)
    there = silence(cnn=True, knn=False)
    (test,) = silence_tests(dataclasses.replace(here, same_page=(here, there)))
    assert test[0] is here.results[0] and test[1]["p"] == pytest.approx(0.003)
