"""Models asked about recordings with the speaker silent: what is measured, shown and refused."""

import numpy as np
import pytest
from pydantic import ValidationError
from test_cross_validation import KINDS, inputs, score, store

from ajgdata.experiments import cross_validation, shortcut
from ajgdata.experiments.shortcut import Settings
from ajgdata.store.features import Shard, text_column


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
