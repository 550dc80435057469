"""Cells become values or findings, never a wrong number."""

import math

import pytest

from ajgdata.store.labels import bad_labels, copies, label_columns, parse_label
from ajgdata.types import Target

SIZE = Target(kind="regression", unit="mm", missing=("0", "n/a"))
KIND = Target(kind="classification", missing=("?",))


def row(**cells: str) -> dict[str, str]:
    return {"recording_id": "", "grasp_id": "g", "sample": "0", "quality": "ok"} | cells


@pytest.mark.parametrize(
    ("text", "target", "value"),
    [
        ("12.5", SIZE, 12.5),
        (" -1e-3 ", SIZE, -1e-3),
        ("", SIZE, math.nan),
        ("0", SIZE, math.nan),
        ("0.0", SIZE, 0.0),
        ("?", KIND, ""),
        ("0", KIND, "0"),
    ],
)
def test_cells(text, target, value):
    assert parse_label(text, target) == pytest.approx(value, nan_ok=True, abs=0)


def test_cells_that_are_no_values_are_named():
    findings = bad_labels("s1", "b", row(edge_mm="1,5"), {"edge_mm": SIZE})
    assert [(f.session_id, f.recording_id, f.level, f.problem) for f in findings] == [
        ("s1", "b", "warning", "edge_mm = '1,5' is not a finite number: no task of edge_mm uses it")
    ]
    for cell in ("1", "n/a", ""):
        assert bad_labels("s1", "b", row(edge_mm=cell), {"edge_mm": SIZE}) == []


def test_copies():
    names = ["s1/a", "s1/b", "s2/a", "s2/b", "s2/c"]
    findings = copies(names, ["1", "2", "1", "3", "3"], [("x",), ("x",), ("x",), ("x",), ("y",)])
    assert {index: (f.recording_id, f.level, f.code) for index, f in findings.items()} == {
        2: ("a", "warning", "copy"),
        3: ("b", "error", "two_labels"),
        4: ("c", "error", "two_labels"),
    }
    assert findings[2].problem == "the same bytes as s1/a (2 recordings); left out"
    assert findings[3].problem == "the same bytes as s2/c (2 recordings), labelled otherwise"


def test_placements_are_unique_in_a_data_set_and_unknown_ones_stay_empty():
    rows = [
        {"session_id": session, "recording_id": "1", "grasp_id": "g", "sample": "0", **more}
        for session, more in [("x", {"placement_id": "p"}), ("y", {"placement_id": "p"}), ("z", {})]
    ]
    columns = label_columns(rows, {"placement_id"}, {})
    assert columns["placement_id"].values.tolist() == ["x/p", "y/p", ""]
    assert "placement_id" not in label_columns(rows, set(), {})


def test_columns_of_the_robot_are_numbers_with_the_unit_in_their_name():
    cells = [
        {"robot_x_m": "0.31", "robot_q_rad_1": "1", "robot_count": "7", "robot_state": "1"},
        {"robot_x_m": "", "robot_q_rad_1": "-2.5e-3", "robot_count": "8", "robot_state": "ok"},
    ]
    rows = [row(session_id="s", **own) for own in cells]
    columns = label_columns(rows, cells[0].keys(), {})
    assert columns["robot_x_m"].values.tolist() == pytest.approx([0.31, math.nan], nan_ok=True)
    assert columns["robot_x_m"].attrs["units"] == "m"
    assert columns["robot_q_rad_1"].values.tolist() == [1.0, -2.5e-3]
    assert columns["robot_q_rad_1"].attrs["units"] == "rad"
    assert columns["robot_count"].values.dtype == float
    assert "units" not in columns["robot_count"].attrs
    assert columns["robot_state"].values.tolist() == ["1", "ok"]  # a text stays a text


def test_a_column_of_the_robot_can_be_a_target():
    rows = [row(session_id="s", robot_x_mm="310")]
    target = Target(kind="regression", unit="mm", description="position")
    column = label_columns(rows, {"robot_x_mm"}, {"robot_x_mm": target})["robot_x_mm"]
    assert column.values.tolist() == [310.0]
    assert column.attrs == {"long_name": "position", "units": "mm", "role": "target"}
