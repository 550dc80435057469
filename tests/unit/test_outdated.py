"""Reasons of outdated results, from what Snakemake reports."""

import pytest

from ajgdata.pipeline.outdated import FEATURES, RECIPE, PlannedJob, grouped, literals, reasons

NAMES = {"dataset": "d", "task": "t", "experiment": "cross_validation", "models": "cnn"}
OUTPUTS = ("a.json", "a.cost.json")
PARAMS = (
    "Params have changed since last execution: Union of exclusive params before and now across all "
    "output: before: {} now: {} "
)


def job(reason: str, missing: tuple[str, ...] = ()) -> PlannedJob:
    return PlannedJob("experiment", NAMES, OUTPUTS, missing, reason)


def params(before: list[object], now: list[object]) -> str:
    """Return the reason of a job whose parameters changed, as Snakemake words it."""
    lists = [",".join(map(repr, values)) or "<nothing exclusive>" for values in (before, now)]
    return PARAMS.format(*lists)


@pytest.mark.parametrize(
    ("before", "now", "expected"),
    [
        ([{"folds": 3, "models": ["cnn"]}], [{"folds": 5, "models": ["cnn"]}], "settings (folds)"),
        # two mappings changed: each is compared with the most similar earlier one
        ([{"a": 1, "b": 2}, {"c": 3}], [{"a": 1, "b": 0}, {"c": 4}], "settings (b)+settings (c)"),
        ([0], [7], "`seed` of the config changed"),
        ([True], [False], "`quick` of the config changed"),
        (["cpu"], ["cuda"], "`device` of the config changed"),
        ([f"{FEATURES} 01"], [f"{FEATURES} 02"], "its features changed"),
        ([f"{RECIPE} 01"], [f"{RECIPE} 02"], "the recipe changed"),
        (["0123"], ["4567"], "this version of ajgdata or a library computes it differently"),
        ([["a"]], [["a", "b"]], "other results are requested than before"),
        ([3], [], "its settings changed"),
    ],
)
def test_changed_parameters_are_named(before, now, expected):
    planned = job(params(before, now))
    texts = [
        text.replace("its settings in dataset.yaml changed", "settings")
        for text in reasons(planned, [planned], {})
    ]
    assert "+".join(texts) == expected


def test_values_that_are_no_literals_do_not_stop_the_command():
    assert literals("<function f>,3") == []
    planned = job(PARAMS.format("<function f>", "<function g>"))
    assert reasons(planned, [planned], {}) == ["its settings changed"]


def test_a_result_that_never_existed_is_no_outdated_one():
    updated = "; Input files updated by another job: f.nc"
    new = job(f"Missing output files: a.json, a.cost.json{updated}", OUTPUTS)
    assert reasons(new, [new], {}) == ["not computed yet"]
    deleted = job(f"Missing output files: a.json{updated}", OUTPUTS[:1])
    features = PlannedJob("features", {"dataset": "d"}, ("f.nc",), (), "Updated input files: s.csv")
    assert reasons(deleted, [deleted, features], {}) == [
        "a.json is missing",
        "its input is outdated: features",
    ]


def test_features_have_the_reasons_of_the_data():
    features = PlannedJob(
        "features", {"dataset": "d"}, ("f.nc",), (), "Updated input files: s.csv, t.csv"
    )
    assert reasons(features, [features], {}) == ["s.csv and 1 other result changed"]
    changes = {"d": ["session day2 is new"], "e": ["session x changed"]}
    assert reasons(features, [features], changes) == ["session day2 is new"]
    other = PlannedJob("collect", {}, ("m.csv",), (), "Input files updated by another job: f.nc")
    assert list(grouped([features, other], changes)) == [
        ("d", "session day2 is new", ["features"]),
        ("", "its input is outdated: features of d", ["metrics and predictions"]),
    ]
