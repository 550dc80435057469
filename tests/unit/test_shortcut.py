"""Models asked about recordings with the speaker silent: what is measured, shown and refused."""

import dataclasses

import numpy as np
import pytest
from matplotlib.text import Text
from pydantic import ValidationError
from result_samples import sizes
from test_cross_validation import KINDS, inputs, score, store

from ajgdata.experiments import cross_validation, shortcut
from ajgdata.experiments.base import Other, Result, TaskResults
from ajgdata.experiments.shortcut import TEST_COLUMNS, Settings
from ajgdata.report.canvas import draw
from ajgdata.store.features import Shard, text_column
from ajgdata.types.table import table_of


def elsewhere(*, quiet: bool) -> Shard:
    """Return recordings of further grasps; `quiet`: of noise that knows nothing of the target."""
    shard = store(grasp_id=text_column([f"t/{n // 2}" for n in range(40)]))
    if quiet:
        shard.feature[:] = np.random.default_rng(1).uniform(0.99, 1.01, shard.feature.shape)
    return shard


def measured(model="linear", settings=None, **changes):
    others = {"loud": elsewhere(quiet=False), "quiet": elsewhere(quiet=True)}
    given = inputs(**({"others": others} | changes))
    settings = settings or Settings(test_on=("loud", "quiet"))
    return {table.name: table for table in shortcut.measure(given, settings, model).tables}


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({}, "rank correlation"),
        ({"period_deg": 40.0}, "correlation of angles"),
        (KINDS, "mutual information"),
    ],
)
def test_a_model_that_hears_the_target_is_flagged_and_one_that_hears_noise_is_not(changes, name):
    tables = measured(**changes)
    loud, quiet = tables["silence"].rows
    assert (loud["data_set"], quiet["data_set"]) == ("loud", "quiet")
    assert loud["measure"] == quiet["measure"] == name
    assert loud["flagged"] is True and loud["p"] == 1 / 1000
    assert quiet["flagged"] is False and quiet["p"] > 0.01
    assert score(tables, "silent:loud", name) == loud["value"] > loud["null"]
    assert score(tables, "silent:loud", name, "chance") == loud["null"]
    assert score(tables, "silent:quiet", "p", "of 999") == quiet["p"]
    assert set(tables["scores"].column("model")) == {"linear"}


def test_errors_where_something_is_played_stand_beside_those_of_cross_validation():
    settings = Settings(test_on=("loud", "quiet"), sounding=("loud",))
    tables = measured(settings=settings, withhold=[15.0])
    assert tables["silence"].column("data_set") == ["quiet"]
    assert set(tables["scores"].column("part")) == {"silent:quiet"}
    same = cross_validation.measure(
        inputs(others={"loud": elsewhere(quiet=False)}, withhold=[15.0]),
        cross_validation.Settings(test_on=("loud",)),
        "linear",
    )
    (scores,) = (table for table in same.tables if table.name == "scores")
    for row, part in zip(tables["errors"].rows, ("grouped", "on:loud"), strict=True):
        for statistic in ("mean", "sd", "chance"):
            assert row[statistic] == score({"scores": scores}, part, "rmse", statistic)


def test_settings_that_leave_nothing_silent_are_refused():
    with pytest.raises(ValidationError, match="sounding: b is not in test_on; add it there"):
        Settings(test_on=("a",), sounding=("b",))
    with pytest.raises(ValidationError, match="no data set is left that is silent"):
        Settings(test_on=("a",), sounding=("a",))
    assert Settings(test_on=("a", "b"), sounding=("a",)).silent == ("b",)


def silence(**flagged: bool) -> TaskResults:
    """Results of models by name, flagged or not; the bar's data set is not silent."""
    results = []
    for model, flag in flagged.items():
        value, p = (0.8, 0.001) if flag else (0.1, 0.7)
        test = ("quiet", "rank correlation", value, 0.2, 999, p, flag)
        rows = [dict(zip(TEST_COLUMNS, test, strict=True))]
        errors = [
            {"data_set": "", "mean": 2.2, "sd": 0.3, "chance": 8.2},
            {"data_set": "bar", "mean": 20.0, "sd": 1.0, "chance": 9.0},
        ]
        tables = {
            "silence": table_of("silence", "", rows, **TEST_COLUMNS),
            "errors": table_of("errors", "", errors, **{key: key for key in errors[0]}),
        }
        results.append(Result(model, model, {"folds": 2}, tables, {}))
    return sizes(
        results=tuple(results), experiment="shortcut", papers={},
        settings=Settings(test_on=("bar", "quiet"), sounding=("bar",)),
        others={"bar": Other("Bar turned"), "quiet": Other("Silence")},
    )  # fmt: skip


def test_a_model_that_knows_the_answer_in_silence_is_shown_as_flagged():
    task = silence(cnn=True, knn=False)
    (one,) = shortcut.EXPERIMENT.figures(task)
    assert one.name == "shortcut--size--edge"
    figure = draw(one)
    left, right = figure.axes
    assert [bar.get_height() for bar in right.patches] == [0.8, 0.1]
    # not what silence gives
    errors = [bars.lines[0].get_ydata().tolist() for bars in left.containers]
    assert errors == [[2.2, 2.2], [20, 20]]
    assert left.get_ylabel() == "RMSE (mm)" and right.get_ylabel().startswith("rank correlation")
    labels = left.get_legend_handles_labels()[1]
    assert set(labels) == {"held out of Cube size", "on Bar turned", "chance"}
    texts = {text.get_text() for text in figure.findobj(Text)}
    assert {"flagged\np = 0.002", "not\nflagged\np = 0.7", "simulated"} <= texts  # of two tests
    assert "cnn on Silence: rank correlation with the truth 0.8" in one.caption.text
    assert "p = 0.002: flagged: it has learned" in one.caption.text
    assert "corrected for the 2 tests on this page (Holm)" in one.caption.text
    assert "p = 0.7: not flagged." in one.caption.text
    first = "Cnn learned a sound that is not the object's: RMSE 2.20 ± 0.30 mm where it was trained"
    assert one.caption.alt.startswith(f"{first}, 20.0 ± 1.0 mm on Bar turned.")
    assert "cnn: 2.20 ± 0.30 mm, 20.0 ± 1.0 mm on Bar turned; knn: 2.20" in one.caption.alt
    assert "shortest way round" not in one.caption.text
    turned = dataclasses.replace(task, period_deg=180.0)
    assert "the shortest way round of 180°" in shortcut.caption(turned).text


def test_models_that_could_not_be_tested_have_no_figure():
    assert shortcut.EXPERIMENT.figures(silence()) == []
