"""Novel objects: one far from the known objects raises the alarm, one among them does not."""

from dataclasses import replace

import numpy as np
import pytest
from experiment_samples import measured, small_inputs

from ajgdata.evaluate.in_use import calibration
from ajgdata.evaluate.intervals import mean_interval
from ajgdata.evaluate.novelty import Guard
from ajgdata.evaluate.splits import grouped_folds
from ajgdata.experiments.novelty import Round, _shares
from ajgdata.store.features import FeatureRows, text_column

ASK = {"false_alarms": [0.05, 0.2]}


def world(seed=0):
    """Three classes of 24 grasps: `near` and `close` overlap, `far` does not."""
    rng = np.random.default_rng(seed)
    grasp = np.repeat(np.arange(72), 2)
    kind = grasp % 3
    spread = 0.3 * rng.normal(size=(72, 30))[grasp] + 0.05 * rng.normal(size=(144, 30))
    spread[kind == 2, :15] += 6
    objects = [("near", "close", "far")[k] for k in kind]
    names = [f"s/g{n}" for n in grasp]
    columns = {
        "recording": text_column([f"s/{n}" for n in range(144)]),
        "grasp_id": text_column(names),
        "object": text_column(objects),
    }
    attrs = {"data_set": "d", "source": "simulated", "git_commit": "", "settings": "{}"}
    feature = np.exp(spread).astype(np.float32)
    return FeatureRows(feature, np.arange(30.0), columns, attrs)


def rounds_of(outcome):
    return next(table for table in outcome.tables if table.name == "rounds")


def test_what_lies_apart_is_noticed_and_what_lies_among_others_is_not():
    rounds = rounds_of(measured("novelty", small_inputs(store=world()), **ASK))
    assert len(rounds.rows) == 3 * 2  # classes, rates
    far = rounds.where(withheld="far").numbers("detected")
    assert far.tolist() == [1, 1]
    among = [
        rounds.where(withheld=name, stated=0.05).numbers("detected")[0]
        for name in ("near", "close")
    ]
    # 24 grasps of a distribution that is known: more than 6 have probability < 1e-3 at 5 %
    assert max(among) <= 6 / 24
    known = rounds.where(stated=0.2).numbers("false_alarm")
    assert known.mean() < 0.2 + 3 * np.sqrt(0.16 / 30)  # 3 rounds of 10 held-out grasps


def test_the_distance_and_its_alarm_are_those_of_a_model_in_use():
    """Of the first round: guard and alarm that training for use stores, of all but one class and
    one fold."""
    inputs = small_inputs(store=world())
    rounds = rounds_of(measured("novelty", inputs, **ASK)).where(stated=0.05)
    data = inputs.data()
    known = np.flatnonzero(data.value != "close")
    train, test = grouped_folds(data.value[known], data.group[known], "classification", 5, 0)[0]
    train, test = known[train], known[test]
    x, group = data.feature, data.group
    shipped = calibration(
        x[train], data.value[train], group[train], group[train], model="linear_plain",
        kind="classification", false_alarm=0.05,
    )  # fmt: skip
    guard = replace(Guard.of(x[train], group[train]), threshold=shipped.novelty_threshold)
    row = rounds.where(withheld="close").rows[0]
    assert row["false_alarm"] == np.mean(guard.novelty(x[test]) > 1)
    assert row["detected"] == np.mean(guard.novelty(x[data.value == "close"]) > 1)


def test_a_grasp_that_several_rounds_test_counts_once():
    """Rounds that test the same grasps again tell nothing more of false alarms, however many there
    are: the interval is that of one round. Classes that are left out are independent."""
    generator = np.random.default_rng(0)
    known, group = generator.random(80) < 0.2, np.repeat(np.arange(40), 2)
    new = generator.random(80) < 0.7
    tests = [Round(str(n), 0.05, new, known, group) for n in range(12)]
    one, many = (list(_shares(0.05, given, 0)) for given in (tests[:1], tests))
    (_, few_alarms), (_, alarms) = one, many
    assert alarms["share"] == pytest.approx(known.mean())
    ends = [alarms[key] for key in ("low", "high")]
    assert ends == pytest.approx([few_alarms[key] for key in ("low", "high")])
    expected = mean_interval(known.astype(float), group, is_share=True)
    assert ends == pytest.approx(expected)
    spread = [Round(str(n), 0.05, generator.random(80) < n / 12, known, group) for n in range(12)]
    detected, _ = _shares(0.05, spread, 0)
    assert detected["low"] < detected["share"] < detected["high"]
    assert detected["high"] - detected["low"] > 0.2  # of 12 classes from 0 to 11 / 12
