"""What a column of labels is taken for, why, and which cells stand against it."""

import pytest

from ajgdata.pipeline.label_kinds import (
    decimal_points,
    label_findings,
    near_labels,
    no_numbers,
    odd_labels,
    verdict,
    zeros_apart,
)
from ajgdata.types import Target

NUMBERS = [str(100.5 + n) for n in range(14)]
CLASS = Target(kind="classification")
NUMBER = Target(kind="regression")


@pytest.mark.parametrize(
    ("cells", "kind", "missing", "said"),
    [
        (NUMBERS, "regression", (), "a number (14 distinct numbers, 100.5 to 113.5)"),
        ([*NUMBERS, "", ""], "regression", (), "a number (14 distinct"),
        (
            [*NUMBERS, "n/a", "NaN"],
            "regression",
            ("NaN", "n/a"),
            "declared missing, remove what was measured: 'NaN', 'n/a'",
        ),
        ([*NUMBERS, "inf"], "regression", (), "a number (14 distinct"),
        ([n.replace(".", ",") for n in NUMBERS], "regression", (), "100.5 to 113.5"),
        (["1", "2", "3"] * 9, "classification", (), "only 3 distinct numbers; 11 would make it a"),
        (
            [*NUMBERS, *"abcdefgh"],
            "classification",
            (),
            "a class (22 distinct texts)",
        ),
        (
            ["cube", "ball", "NaN"],
            "classification",
            ("NaN",),
            "declared missing, remove what was measured: 'NaN'",
        ),
        (
            ["cube", "none"],
            "classification",
            (),
            "add to `missing` if it means not measured: 'none'",
        ),
    ],
)
def test_kinds(cells, kind, missing, said):
    target, why = verdict(cells)
    assert (target.kind, target.missing) == (kind, missing)
    assert said in why


def test_decimal_commas_are_told_from_thousands():
    assert decimal_points(["1,5", "2", "10,25"]) == {"1,5": "1.5", "10,25": "10.25"}
    assert decimal_points(["1,234", "2", "10,250"]) == {}
    assert decimal_points(["1,234", "2,5"]) == {"1,234": "1.234", "2,5": "2.5"}
    assert decimal_points(["a,b", "1,5"]) == {"1,5": "1.5"}


def test_zeros_that_were_not_measured_stand_apart():
    masses = [str(m) for m in (854, 902, 1033, 1210, 1388, 1405, 1776, 1990, 2345, 2702, 3458)]
    assert zeros_apart([*masses, "0.00", "0.00"]) == ["0.00"]
    target, why = verdict([*masses, "0.00", "0.00"])
    assert target.missing == ("0.00",)
    assert why.startswith("a number (11 distinct numbers, 854 to 3458; declared missing")
    assert zeros_apart([*masses, "0.00"]) == []  # one alone may be true
    angles = [str(a) for a in range(0, 360, 15)] * 2
    assert zeros_apart(angles) == []
    offsets = [str(n) for n in (-90, -80, -70, -60, -50, -40, 0, 0, 40, 50, 60, 70, 80, 90)]
    assert zeros_apart(offsets) == []


def test_classes_that_differ_in_case_or_spaces_look_like_one():
    assert near_labels({"A", "a", "b"}) == [["A", "a"]]
    assert near_labels({"no object", "no_object", "No-Object", "nothing"}) == [
        ["No-Object", "no object", "no_object"]
    ]
    assert near_labels({"-1", "1", "1 0", "10"}) == []


def test_oddities_are_notes():
    rows = [{"quality": "ok", "label": cell, "mass": "1"} for cell in ("A", "a", "a", "")]
    rows.append({"quality": "reject", "label": "B", "mass": "1"})
    rows.append({"quality": "ok", "label": "b", "mass": "1"})
    found = label_findings([rows[:3], rows[3:]], {"label": CLASS, "mass": NUMBER})
    assert [(f.level, f.problem) for f in found] == [
        ("note", "label: 'A' (1), 'a' (2) look like one class"),
        ("note", "label: 1 recordings have no label"),
    ]


def test_cells_of_declared_numbers_that_are_none():
    targets = {"mass": Target(kind="regression", missing=("?",)), "label": CLASS}
    cells = {"mass": ["1", "", "?", "inf", "1O2"], "label": ["x"]}
    assert no_numbers(cells, targets) == [
        "mass: no number: '1O2', 'inf'; correct it, or add it to `missing`",
    ]


def test_what_is_declared_missing_is_not_odd():
    zeros = ["0.00"] * 2 + [str(m) for m in range(1000, 1100, 7)]
    assert odd_labels({"mass": zeros}, {"mass": NUMBER}) == [
        "mass: 2 cells '0.00' are apart from other numbers"
    ]
    declared = Target(kind="regression", missing=("0.00",))
    assert odd_labels({"mass": zeros}, {"mass": declared}) == []
