"""Columns of a robot's table are joined to recordings by time, and every doubt is listed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from sounds import resonances, write_wav

import ajgdata as ajgdata_package

EXAMPLE = Path(__file__).resolve().parents[2] / "docs" / "examples" / "joined_by_time.yaml"
START_S = 1768478400  # 2026-01-15T12:00:00Z
JOIN = {
    "table": "robot.csv",
    "time": "stamp",
    "recording_time": "started",
    "tolerance_s": 0.5,
    "columns": ["x_m"],
}


def recordings(src, seconds):
    """Write a recording per number of seconds since START_S, which is in its name."""
    for number, second in enumerate(seconds):
        label = "cube" if number % 2 else "ball"
        write_wav(src / f"{label}_{START_S + second}.wav", resonances(number % 2, number))


def declare(paths, **join):
    path = paths.dataset("d")
    path.parent.mkdir(parents=True, exist_ok=True)
    imports = {"pattern": r"(?P<label>[a-z]+)_(?P<started>\d+)\.wav", "join": JOIN | join}
    targets = {
        "label": {"kind": "classification"},
        "x_m": {"kind": "regression", "unit": "m"},
    }
    tasks = {"label": {"target": "label", "models": ["knn"]}}
    declared = {"name": "d", "targets": targets, "tasks": tasks, "imports": imports}
    path.write_text(yaml.safe_dump(declared, sort_keys=False))


def test_each_recording_gets_the_nearest_row(src, paths, ajgdata, rows, features):
    recordings(src, [0, 10, 20, 30])
    (src / "robot.csv").write_text(
        "stamp,x_m,joint\n"
        "2026-01-15T13:00:30.2+01:00,0.3,4\n"
        "2026-01-15T13:00:00.0+01:00,0.0,1\n"
        "2026-01-15T13:00:10.5+01:00,0.1,2\n"
        "2026-01-15T13:00:19.9+01:00,0.2,3\n"
    )
    declare(paths)
    printed = ajgdata("import", src, "--dataset", "d")
    assert printed.code == 0, printed.text
    cells = {row["started"]: row["x_m"] for row in rows("d")}
    assert cells == {str(START_S + 10 * n): f"0.{n}" for n in range(4)}
    features("d")
    with ajgdata_package.load_features("d") as store:
        assert sorted(store.x_m.values.tolist()) == [0.0, 0.1, 0.2, 0.3]
        assert store.x_m.attrs["units"] == "m"


def test_the_example_of_the_page_joins_local_times(src, paths, ajgdata, rows):
    for second in range(4):
        label = ("contact", "edge")[second % 2]
        write_wav(src / f"{label}_20260115T13000{second}.wav", resonances(second % 2, second))
    stamps = [f"{START_S + second + 0.25},0.1{second},0.2\n" for second in range(4)]
    (src / "robot.csv").write_text("stamp,x_m,y_m\n" + "".join(reversed(stamps)))
    path = paths.dataset("joined")
    path.parent.mkdir(parents=True)
    path.write_text(EXAMPLE.read_text())
    printed = ajgdata("import", src, "--dataset", "joined")
    assert printed.code == 0, printed.text
    assert [row["x_m"] for row in rows("joined")] == ["0.10", "0.12", "0.11", "0.13"]
    assert {row["y_m"] for row in rows("joined")} == {"0.2"}


def test_recordings_without_one_row_are_listed_and_the_exit_code_says_so(src, paths, ajgdata, rows):
    recordings(src, [0, 10, 20])
    table = (
        f"stamp,x_m\n{START_S},1\n{START_S + 10.75},2\n{START_S + 19.75},3\n{START_S + 20.25},4\n"
    )
    (src / "robot.csv").write_text(table)
    declare(paths)
    printed = ajgdata("import", src, "--dataset", "d")
    assert printed.code == 3
    missing = f"cube_{START_S + 10}.wav (nearest row: 0.75 s): no row of robot.csv is within 0.5 s"
    assert missing in printed.text
    ambiguous = f"ball_{START_S + 20}.wav (lines 4, 5): several different rows of robot.csv are"
    assert ambiguous in printed.text
    cells = {row["started"]: row["x_m"] for row in rows("d")}
    assert list(cells.values()).count("") == 2 and cells[str(START_S)] == "1"
    # A larger tolerance joins one more; an empty cell is replaced only on request.
    declare(paths, tolerance_s=0.75)
    printed = ajgdata("import", src, "--dataset", "d", "--on-change", "labels")
    assert printed.code == 3 and "no row of robot.csv" not in printed.text
    assert {row["started"]: row["x_m"] for row in rows("d")}[str(START_S + 10)] == "2"


def test_segments_of_a_file_are_joined_by_their_own_time(src, paths, ajgdata, rows):
    write_wav(src / f"ball_{START_S}.wav", np.concatenate([resonances(0, n) for n in range(4)]))
    lines = [f"{START_S + 0.25 * n + 0.05},0.{n}\n" for n in range(4)]
    (src / "robot.csv").write_text("stamp,x_m\n" + "".join(lines))
    declare(paths, tolerance_s=0.1)
    path = paths.dataset("d")
    declared = yaml.safe_load(path.read_text())
    declared["imports"]["segments"] = {"period_s": 0.25}
    path.write_text(yaml.safe_dump(declared))
    ajgdata("import", src, "--dataset", "d")
    table = sorted(rows("d"), key=lambda row: float(row["start_s"]))
    assert [row["x_m"] for row in table] == ["0.0", "0.1", "0.2", "0.3"]


@pytest.mark.parametrize(
    ("join", "message"),
    [
        ({"recording_time": "begin"}, "imports.join: recording_time names 'begin'"),
        ({"columns": ["y_m"]}, "robot.csv: has no column 'y_m'"),
        ({"time": "label"}, "robot.csv: has no column 'label'"),
        ({"table": "arm.csv"}, "arm.csv"),
        ({"tolerance_s": -1}, "tolerance_s"),
        ({"utc_offset": "CET"}, "utc_offset"),
        ({"columns": ["started"]}, "column 'started' of robot.csv is also a label"),
    ],
)
def test_a_wrong_join_is_one_error_and_nothing_is_imported(src, paths, ajgdata, join, message):
    recordings(src, [0, 10])
    (src / "robot.csv").write_text(f"stamp,x_m,started\n{START_S},1,0\n{START_S + 10},2,0\n")
    declare(paths, **join)
    printed = ajgdata("import", src, "--dataset", "d")
    assert printed.code == 1 and message in printed.text, printed.text
    assert not paths.recordings("d").exists() or not list(paths.recordings("d").glob("*/*"))


def test_a_table_of_another_clock_is_refused(src, paths, ajgdata):
    recordings(src, [0, 10])
    (src / "robot.csv").write_text("stamp,x_m\n0.0,1\n10.0,2\n")
    declare(paths)
    printed = ajgdata("import", src, "--dataset", "d")
    assert printed.code == 1
    assert "no recording has a row of robot.csv" in printed.text
    assert "nearest row: 1768478390 s" in printed.text
