"""Numbers, predictions and settings of two runs: what changed, with answers worked out by hand."""

import math

import pytest
from run_samples import ACCURACY, COMMIT_B, RMSE, folds, predictions, rows_of

from ajgdata.report.run_context import Described, flips, known_folds, settings, verdicts
from ajgdata.report.run_difference import Key, better_sign, compare_numbers, numbers_of


def compared(a, b, same_folds=True):
    return compare_numbers(numbers_of(a), numbers_of(b), lambda key: same_folds)


def test_folds_that_are_the_same_are_compared_in_pairs():
    found = compared(rows_of(RMSE, folds(1, 2, 3), "mm"), rows_of(RMSE, folds(2, 3.5, 3.5), "mm"))
    (one,) = found.changed
    assert one.key == Key(*RMSE) and one.paired
    assert (one.a.score.mean, one.b.score.mean) == (2, 3)
    # Differences 1, 1.5 and 0.5: mean 1, sample standard deviation 0.5.
    assert (one.difference, one.spread, one.ratio) == (1, 0.5, 2)
    assert not one.beyond  # not more than two
    assert one.direction == "worse" and one.unit == "mm"


def test_other_folds_are_compared_by_both_deviations():
    a, b = rows_of(RMSE, folds(1, 2, 3)), rows_of(RMSE, folds(6, 7, 8))
    (one,) = compared(a, b, same_folds=False).changed
    assert not one.paired and one.spread == pytest.approx(math.sqrt(2), rel=1e-15)
    assert one.ratio == pytest.approx(5 / math.sqrt(2), rel=1e-15) and one.beyond
    (one,) = compared(a, rows_of(RMSE, folds(6, 7)), same_folds=True).changed
    assert not one.paired  # fewer folds


def test_another_seed_is_another_split():
    a, b = rows_of(RMSE, folds(1, 2, 3)), rows_of(RMSE, folds(2, 3, 4.5))
    (one,) = compared(a, [{**row, "seed": "1"} for row in b]).changed
    assert not one.paired


def test_folds_that_differ_alike_are_beyond_any_spread():
    a, b = folds(0.1, 0.2, 0.7), folds(0.1 + 1e-3, 0.2 + 1e-3, 0.7 + 1e-3)
    (one,) = compared(rows_of(ACCURACY, a), rows_of(ACCURACY, b)).changed
    assert one.ratio == math.inf and one.beyond and one.direction == "better"


def test_rounding_is_no_change_and_a_fold_that_moved_is():
    a = rows_of(RMSE, folds(1, 2, 3))
    found = compared(a, rows_of(RMSE, folds(1 + 1e-13, 2, 3)))
    assert not found.changed and len(found.equal) == found.compared == 1
    (one,) = compared(a, rows_of(RMSE, folds(2, 1, 3))).changed  # the same mean
    assert (one.difference, one.ratio, one.direction) == (0, 0, "")


def test_infinite_values_are_compared():
    """Widths of intervals without ends: equal infinities are no change."""
    key = ("size", "edge", "linear", "intervals 0.95", "width")
    unlimited = rows_of(key, {"fold 0": math.inf, "fold 1": math.inf})
    assert not compared(unlimited, unlimited).changed
    (one,) = compared(unlimited, rows_of(key, {"fold 0": 1.0, "fold 1": math.inf})).changed
    assert one.difference == 0 and math.isnan(one.spread)
    (one,) = compared(unlimited, rows_of(key, {"fold 0": 1.0, "fold 1": 2.0})).changed
    assert one.difference == -math.inf and not one.beyond


def test_a_number_without_folds_has_no_spread():
    key = ("size", "edge", "cnn", "sorting", "calibration_error")
    (one,) = compared(rows_of(key, {"pooled": 0.1}), rows_of(key, {"pooled": 0.2})).changed
    assert one.key.metric == "calibration_error, pooled"
    assert math.isnan(one.spread) and math.isnan(one.ratio) and not one.beyond
    assert one.direction == "worse"


def test_means_are_taken_as_they_stand_and_say_what_pooled_says():
    stated = {"mean": 5, "sd": 1, "pooled": 7, "chance": 9, **folds(1, 2, 3)}
    found = numbers_of(rows_of(RMSE, stated)).scores
    assert {key.metric: number.score[:2] for key, number in found.items()} == {
        "rmse": (5, 1), "rmse, chance": (9, pytest.approx(math.nan, nan_ok=True)),
    }  # fmt: skip


def test_what_is_beyond_its_spread_stands_first_then_what_has_none():
    keys = [("d", name, "m", "grouped", "rmse") for name in "abcd"]
    a = [row for key in keys[:3] for row in rows_of(key, folds(1, 2, 3))]
    a += rows_of(keys[3], {"mean": 1})
    b = rows_of(keys[0], folds(1.1, 2.3, 2.9)) + rows_of(keys[1], folds(2, 3.1, 4))
    b += rows_of(keys[2], folds(9, 10.1, 11)) + rows_of(keys[3], {"mean": 2})
    assert [one.key.task for one in compared(a, b).changed] == ["c", "b", "d", "a"]


def test_what_one_run_lacks_is_named_and_costs_stand_apart():
    other = ("size", "edge", "knn", "grouped", "rmse")
    cost = ("size", "edge", "cnn", "cost of grouped", "train_s")
    a = rows_of(RMSE, folds(1, 2)) + rows_of(cost, {"measured": 2}) + rows_of(other, {"mean": ""})
    b = rows_of(other, folds(1, 2)) + rows_of(cost, {"measured": 6})
    found = compared(a, b)
    assert (found.only_a, found.only_b) == ((Key(*RMSE),), (Key(*other),))
    assert [(one.key, one.ratio) for one in found.costs] == [(Key(*cost), 3)]
    assert found.compared == 0


def test_a_cell_that_is_no_number_is_named():
    with pytest.raises(ValueError, match=r"size/edge/cnn/grouped/rmse: 'x' is not a number"):
        numbers_of(rows_of(RMSE, {"mean": "x"}))


@pytest.mark.parametrize(
    ("part", "metric", "sign"),
    [
        ("grouped", "rmse", -1),
        ("grouped", "mae", -1),
        ("probe:grouped:linear", "r2 of height_mm", 1),
        ("retrieval:all", "precision at 5", 1),
        ("grouped", "balanced_accuracy", 1),
        ("probe:grouped:knn", "accuracy of session_id", 0),
        ("silent", "accuracy", 0),
        ("grouped", "accuracy, chance", 0),
        ("intervals:80 %", "width", 0),
        ("distances", "banana to spoon", 0),
    ],
)
def test_which_way_is_better(part, metric, sign):
    assert better_sign(Key("d", "t", "m", part, metric)) == sign


def test_predictions_that_flipped():
    place = ("stones", "kind", "cnn", "grouped")
    a = {"r1": (0, "x", "x"), "r2": (0, "x", "x"), "r3": (1, "y", "x"), "r4": (1, "y", "z")}
    b = {"r2": (0, "x", "y"), "r3": (1, "y", "y"), "r4": (1, "y", "x"), "r5": (0, "x", "x")}
    numbers = numbers_of(rows_of(ACCURACY, folds(0.5, 1)))
    (one,) = flips(predictions(place, a), predictions(place, b | {"r1": (0, "y", "x")}), numbers)
    assert one.classes and (one.both, one.only_a, one.only_b) == (4, 0, 1)
    assert (one.changed, one.lost, one.gained, one.relabelled) == (3, 1, 1, 1)
    assert one.share == 0.75


def test_predicted_numbers_move():
    place = ("size", "edge", "cnn", "grouped")
    a = {"r1": (0, "10.0", "11"), "r2": (0, "20", "20"), "r3": (0, "30", "30")}
    b = {"r1": (0, "10.0", "14"), "r2": (0, "20", "20.0"), "r3": (0, "30", "29")}
    numbers = numbers_of(rows_of(RMSE, folds(1, 2), "mm"))
    (one,) = flips(predictions(place, a), predictions(place, b), numbers)
    assert (one.classes, one.changed, one.moved, one.unit) == (False, 2, 2.0, "mm")


def test_a_recording_that_several_folds_predict_is_compared_fold_by_fold():
    place = ("stones", "kind", "cnn", "withheld")
    a = [row for fold in (0, 1) for row in predictions(place, {"r": (fold, "x", "x")})]
    b = [a[0], {**a[1], "y_pred": "y"}]
    (one,) = flips(a, b, numbers_of(rows_of(ACCURACY, folds(1, 1))))
    assert (one.both, one.changed) == (2, 1)


def test_folds_are_the_same_where_their_recordings_are():
    place = ("stones", "kind", "cnn", "grouped")
    a = predictions(place, {"r1": (0, "x", "x"), "r2": (1, "x", "x")})
    moved = predictions(place, {"r1": (1, "x", "x"), "r2": (0, "x", "x")})
    other_task, elsewhere = ("stones", "other", *ACCURACY[2:]), ("size", *ACCURACY[1:])
    for b, same in ((a, True), (moved, False)):
        same_folds = known_folds(a, b)
        assert same_folds(Key(*ACCURACY)) is same
        assert same_folds(Key(*other_task)) is same  # the data set's other task says so
        assert same_folds(Key(*elsewhere)) is True  # nothing is known


def test_verdicts_that_changed():
    row = {"figure": "size", "dataset": "d", "task": "t", "agrees": "yes", "result": "2 mm"}
    other = {**row, "figure": "noise"}
    (one,) = verdicts([row, other], [{**row, "agrees": "no: lower", "result": "1 mm"}, other])
    assert one == ("size", "d", "t", "yes", "no: lower", "2 mm", "1 mm")
    assert verdicts([row], [other]) == []


def described(band, torch="2.0", **more):
    features = f'{{"features": {{"band_hz": {band}, "hop": 512}}}}'
    tasks = [
        {
            "experiment": "cross_validation", "dataset": "d", "task": task, "model": "cnn",
            "tables": [task], "provenance": {"settings": features}, "settings": {"deep": [1, 2]},
            **more,
        }
        for task in ("s", "t")
    ]  # fmt: skip
    return Described({"software": {"packages": {"torch": torch}}, "experiments": tasks}, [])


def test_settings_that_differ_are_said_once_with_their_places():
    a, b = described("null"), described("[1, 2]", "2.1", folds=4)
    assert settings(a, a) == []
    assert settings(a, b) == [
        ("packages.torch", "2.0", "2.1", ("software",)),
        ("folds", "—", "4", ("d/s cross_validation cnn", "d/t cross_validation cnn")),
        ("settings.features.band_hz", "null", "[1, 2]", ("data set d",)),
    ]


def test_a_run_that_does_not_say_how_it_was_made_is_compared_by_its_commits():
    old = Described({}, rows_of(RMSE, folds(1, 2)))
    new = Described(described("null").document, rows_of(RMSE, folds(1, 2), commit=COMMIT_B))
    assert settings(old, new) == [("git_commit", "a" * 40, COMMIT_B, ("data set size",))]
