"""Unlike anything seen: an object far from the others is noticed, one among them is not."""

import numpy as np
import pytest
from experiment_samples import measured, small_inputs, small_store, task_results

from ajgdata.experiments import EXPERIMENTS
from ajgdata.report.canvas import draw
from ajgdata.store.features import Column, Shard, text_column
from ajgdata.types import NotPossibleError

ASK = {"models": ["linear"], "false_alarms": [0.05, 0.2], "inner_folds": 2}


def world(seed=0, empty=0):
    """Three classes of 24 grasps: `near` and `beside` overlap, `far` does not; `empty` recordings
    of nothing, a grasp each."""
    rng = np.random.default_rng(seed)
    grasp = np.repeat(np.arange(72), 2)
    kind = grasp % 3
    spread = 0.3 * rng.normal(size=(72, 30))[grasp] + 0.05 * rng.normal(size=(144, 30))
    spread[kind == 2, :15] += 6
    nothing = np.zeros((empty, 30)) + 0.1 * rng.normal(size=(empty, 30))
    nothing[:, 15:] += 9
    objects = [("near", "beside", "far")[k] for k in kind] + [""] * empty
    names = [f"s/g{n}" for n in grasp] + [f"s/e{n}" for n in range(empty)]
    columns = {
        "recording": text_column([f"s/{n}" for n in range(144 + empty)]),
        "grasp_id": text_column(names),
        "object": text_column(objects),
    }
    attrs = {"data_set": "d", "source": "simulated", "git_commit": "", "settings": "{}"}
    feature = np.exp(np.concatenate([spread, nothing])).astype(np.float32)
    return Shard(feature, np.arange(30.0), columns, attrs)


def rounds_of(outcome):
    return next(table for table in outcome.tables if table.name == "rounds")


def test_what_lies_apart_is_noticed_and_what_lies_among_others_is_not():
    rounds = rounds_of(measured("novelty", small_inputs(store=world()), **ASK))
    assert len(rounds.rows) == 2 * 3 * 2  # judges, classes, rates
    far = rounds.where(judge="distance", left_out="far").numbers("detected")
    assert far.tolist() == [1, 1]
    among = [
        rounds.where(judge="distance", left_out=name, stated=0.05).numbers("detected")[0]
        for name in ("near", "beside")
    ]
    # 24 grasps of a distribution that is known: more than 6 have probability < 1e-3 at 5 %
    assert max(among) <= 6 / 24
    known = rounds.where(judge="distance", stated=0.2).numbers("false_alarm")
    assert known.mean() < 0.2 + 3 * np.sqrt(0.16 / 30)  # 3 rounds of 10 held-out grasps
    # `far` is surely taken for one of the others: doubt says nothing of it
    assert rounds.where(judge="linear", left_out="far", stated=0.05).numbers("detected")[0] < 0.5


def test_an_alarm_of_few_grasps_is_no_rarer_than_one_in_one_more():
    """Each class of 10 grasps, one left out and a fifth held out: 16 grasps, so that 1 % and 1/17
    are the same alarm, that of the largest distance."""
    rare = measured("novelty", small_inputs(), **ASK | {"false_alarms": [0.01, 1 / 17]})
    rounds = rounds_of(rare).where(judge="distance").parted("stated").values()
    first, second = (table.numbers("detected").tolist() for table in rounds)
    assert first == second


def test_nothing_held_is_recognised_where_there_are_references():
    outcome = measured("novelty", small_inputs(store=world(empty=10)), **ASK)
    nothing = next(table for table in outcome.tables if table.name == "nothing")
    assert nothing.numbers("recognised").tolist() == [1] * 5
    assert nothing.numbers("mistaken").tolist() == [0] * 5
    alone = measured("novelty", small_inputs(store=world(empty=1)), **ASK)
    assert [table.name for table in alone.tables] == ["scores", "rounds"]


def test_what_it_needs_is_told():
    with pytest.raises(NotPossibleError, match="record at least three"):
        measured("novelty", small_inputs(classes=["ball", "rod"]), **ASK)
    with pytest.raises(NotPossibleError, match="'svm' has no probabilities"):
        measured("novelty", small_inputs(), **ASK | {"models": ["svm"]})


def test_its_figure_and_tables_say_what_was_measured():
    outcome = measured("novelty", small_inputs(store=world(empty=10)), **ASK)
    results = task_results("novelty", {"": outcome}, settings=ASK)
    one = EXPERIMENTS["novelty"]
    (illustration,) = one.figures(results)
    left, right = draw(illustration).axes
    rounds = rounds_of(outcome)
    line = next(line for line in left.lines if line.get_label() == "distance")
    expected = [
        100 * rounds.where(judge="distance", stated=rate).numbers("detected").mean()
        for rate in (0.05, 0.2)
    ]
    np.testing.assert_allclose(line.get_xydata(), np.transpose([[5, 20], expected]))
    assert [label.get_text() for label in right.get_yticklabels()] == ["beside", "far", "near"]
    of_far = right.lines[0].get_xydata()[1]
    assert of_far[0] == 100
    main, nothing = one.tables(results)
    assert len(main.rows) == 4
    assert nothing.rows[0][0].startswith("100")
    (highlight,) = one.highlights(results)
    assert highlight.marks[0].value == pytest.approx(expected[0])
    assert f"{expected[0]:.3g} %" in illustration.caption.text


def test_columns_of_numbers_do_not_matter():
    store = small_store()
    columns = {**store.columns, "mass_g": Column(np.full(60, np.nan), {"units": "g"})}
    more = Shard(store.feature, store.frequency_hz, columns, store.attrs)
    found = [rounds_of(measured("novelty", small_inputs(store=s), **ASK)) for s in (store, more)]
    assert found[0].rows == found[1].rows
