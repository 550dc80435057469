"""Object or placement: verdicts with known answers, and the plan of the next session."""

from collections import Counter

import numpy as np
import pytest
from result_samples import CLASSES, kind_result, kinds, sizes

from ajgdata.evaluate.agreement import UNDEFINED, Estimate, Interval
from ajgdata.evaluate.diagnosis import diagnose, kept_skill, over_sessions
from ajgdata.evaluate.next_session import GRASPS_PER_PLACEMENT, PLACEMENTS, next_session
from ajgdata.experiments.diagnosis import diagnosis
from ajgdata.report.format import Score

KNOWN = Estimate(0.9, Interval(0.8, 0.98), chance=0.5, perfect=1.0)


def accuracy(value: float, low: float, high: float) -> Estimate:
    return Estimate(value, Interval(low, high), chance=0.5, perfect=1.0)


@pytest.mark.parametrize(
    "new, verdict",
    [
        (accuracy(0.88, 0.80, 0.95), "object"),  # keeps 95 %, at least 75 %
        (accuracy(0.50, 0.35, 0.65), "placement"),  # keeps nothing, at most 37.5 %
        (accuracy(0.70, 0.60, 0.80), "inconclusive"),  # 25 to 75 %
        (Estimate(0.7, UNDEFINED, 0.5, 1.0), "inconclusive"),
        (None, "unmeasured"),
    ],
)
def test_the_verdict_is_the_skill_that_a_new_session_keeps(new, verdict):
    assert diagnose(KNOWN, new) == verdict


def test_the_variation_of_five_sessions_widens_the_interval():
    """Sessions 0.5, 0.6, 0.7, 0.8, 0.9: mean 0.7, variance 0.025, t(4) = 2.776."""
    new = accuracy(0.7, 0.66, 0.74)
    wide = over_sessions(new, [0.5, 0.6, 0.7, 0.8, 0.9], "accuracy")
    reach = 2.776 * np.sqrt((1 / 5 + 1 / 4) * 0.025)
    assert wide.interval == pytest.approx((0.7 - reach, 0.7 + reach), abs=1e-3)
    assert over_sessions(new, [0.5, 0.9], "accuracy") == new
    assert over_sessions(new, [0.70, 0.70, 0.70, 0.70, 0.71], "accuracy").interval == new.interval


def test_errors_have_the_same_rule():
    """Chance 8 mm: 2 mm in known sessions is a skill of 0.75; 3 mm and 7 mm keep 5/6 and 1/6."""
    known = Estimate(2.0, Interval(1.8, 2.2), chance=8.0, perfect=0.0)
    assert kept_skill(known, known._replace(value=3.0))[0] == pytest.approx(5 / 6)
    assert diagnose(known, Estimate(3.0, Interval(2.5, 3.5), 8.0, 0.0)) == "object"
    assert diagnose(known, Estimate(7.0, Interval(6.0, 7.5), 8.0, 0.0)) == "placement"


def test_a_model_that_is_no_better_than_chance_or_the_placebo_recognises_nothing():
    new = accuracy(0.88, 0.80, 0.95)
    assert diagnose(accuracy(0.55, 0.4, 0.7), new) == "nothing"
    assert diagnose(KNOWN, new, placebo=accuracy(0.85, 0.75, 0.95)) == "nothing"
    assert diagnose(KNOWN, new, placebo=accuracy(0.5, 0.4, 0.6)) == "object"


def test_the_plan_places_each_class_once_per_round_in_random_order():
    labels = ["ball", "bar", "cube"]
    plan = next_session(labels)
    assert [row.step for row in plan] == list(range(1, 3 * PLACEMENTS + 1))
    for number in range(PLACEMENTS):
        first = 3 * number
        assert sorted(row.label for row in plan[first : first + 3]) == labels
        assert {row.placement for row in plan[first : first + 3]} == {number + 1}
    assert Counter(row.label for row in plan) == dict.fromkeys(labels, PLACEMENTS)
    assert {row.grasps for row in plan} == {GRASPS_PER_PLACEMENT}
    assert plan == next_session(labels) != next_session(labels, seed=1)


def sessions(mean: float, predicted: np.ndarray) -> dict:
    """Return the part with held-out sessions: accuracy and predictions."""
    true = np.repeat(CLASSES, (4, 6))
    return {
        "parts": {"sessions": ({"accuracy": Score(mean, 0.05)}, 0.6)},
        "predictions": {"grouped": (true, true), "sessions": (true, predicted)},
    }


def test_a_task_in_words_with_two_sounds_and_the_plan():
    """In new sessions all granite is predicted as basalt. The first sound is granite."""
    result = kind_result(score=Score(0.9, 0.02), **sessions(0.6, np.repeat(CLASSES[0], 10)))
    told = diagnosis(kinds(result), lambda name: f"{name}.wav")
    assert told.answer.startswith("Preliminary. The placement: the model keeps only 0 % (0 to ")
    assert "accuracy 90 % (87 to 93) on new grasps of known sessions" in told.explanation
    assert "60 % (52.5 to 67.5) in new sessions (chance level 60 %)" in told.explanation
    assert [link for _, link in told.sounds] == ["r4.wav", "r0.wav"]
    assert told.sounds[0][0] == f"{CLASSES[1]}, predicted as {CLASSES[0]}"
    assert len(told.plan) == len(told.plan_table.rows) == 2 * PLACEMENTS
    assert told.advice.startswith("Record more placements") and "below" in told.advice


def test_one_session_is_not_enough_and_numbers_have_no_sounds():
    told = diagnosis(sizes(), lambda name: f"{name}.wav")
    assert told.answer == "Unknown: all grasps are from one session."
    assert told.sounds == () and told.plan == ()
    assert "second session" in told.advice and "below" not in told.advice


def test_recordings_without_sound_are_not_offered():
    result = kind_result(score=Score(0.9, 0.02), **sessions(0.6, np.repeat(CLASSES[0], 10)))
    assert diagnosis(kinds(result), lambda name: "").sounds == ()
