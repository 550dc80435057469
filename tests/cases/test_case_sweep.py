"""Sweeps of a robot finger: one folder per board with `sweep.csv`, five recordings per point.

The layout is that of wolnik-georg/Robotics-Project. A sound consists of a tone of the class and a
tone of the workspace. The tone of a class is another one in each workspace: class c of workspace w
has tone (c + w) mod 3. Therefore all held-out points are recognised, because the tone of the
workspace says how to read the other one, and no recording of a held-out workspace is: each tone is
another class there.
"""

from __future__ import annotations

import csv
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import yaml
from recorded import run_experiments
from sounds import RATE_HZ, write_wav

import ajgdata as ajgdata_package
from ajgdata.store.tables import read_measurements

CLASSES = ("contact", "no_contact", "edge")
FOLDER = "collected_data_runs_2026_01_1{day}_workspace_{workspace}_{board}_relabeled"
POINTS = 6
PER_POINT = 5
OPTIONS = ("--file", "data/{acoustic_filename}", "--target", "relabeled_label")


def sound(label, workspace, seed, frames=RATE_HZ // 5):
    time_s = np.arange(frames) / RATE_HZ
    tone = 1000 + 700 * ((label + workspace) % 3)
    samples = 0.2 * np.sin(2 * np.pi * tone * time_s)
    samples += 0.2 * np.sin(2 * np.pi * (6000 + 1500 * workspace) * time_s)
    return samples + 1e-3 * np.random.default_rng(seed).normal(size=frames)


def sweep_rows(point, number, label, name):
    return {
        "point_index": point,
        "recording_index": number,
        "timestamp": 1768478400.25 + 30 * point + number,
        "x_target": 0.01 * point,
        "y_target": 0.02,
        "z_target": 0.1,
        "x": 0.01 * point + 1e-4,
        "y": 0.02,
        "z": 0.1,
        "normalized_x": point / POINTS,
        "normalized_y": 0.5,
        "original_label": label,
        "relabeled_label": label,
        "acoustic_filename": name,
    }


def write_table(folder, rows):
    with (folder / "sweep.csv").open("w", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def write_sweep(src, workspace, board, day=5):
    """Write a folder whose files are named by 100 times the point plus the recording."""
    folder = src / FOLDER.format(day=day, workspace=workspace, board=board)
    rows = []
    for point in range(1, POINTS + 1):
        label = point % 3
        for number in range(1, PER_POINT + 1):
            name = f"{100 * point + number}_{CLASSES[label]}.wav"
            seed = [workspace, point, number, len(board)]
            write_wav(folder / "data" / name, sound(label, workspace, seed))
            rows.append(sweep_rows(point, number, CLASSES[label], name))
    write_table(folder, rows)
    return folder


def test_one_folder_has_a_grasp_per_point_and_the_session_of_its_name(src, ajgdata, rows):
    folder = write_sweep(src, 1, "squares_cutout")
    options = (*OPTIONS, "--grasp", "{point_index}", "--table", "sweep.csv")
    printed = ajgdata("import", folder, "--dataset", "board", *options)
    assert printed.code == 0, printed.text
    assert "30 added" in printed.text
    table = rows("board", folder.name)
    assert Counter(row["grasp_id"] for row in table) == {str(p): 5 for p in range(1, 7)}
    assert table[0]["x"] == "0.0101" and table[0]["timestamp"] == "1768478431.25"


def test_older_files_number_each_label_from_one(src, ajgdata, rows):
    cells = []
    for label in (0, 1):
        for number in range(1, 4):
            name = f"{number}_{CLASSES[label]}.wav"
            write_wav(src / "data" / name, sound(label, 0, [label, number]))
            row = sweep_rows(number, 1, CLASSES[label], name)
            row["label"] = row.pop("relabeled_label")
            del row["original_label"]
            cells.append(row)
    write_table(src, cells)
    printed = ajgdata(
        *("import", src, "--dataset", "old", "--table", "sweep.csv", "--target", "label"),
        *("--file", "data/{acoustic_filename}", "--grasp", "{label}/{point_index}"),
    )
    assert printed.code == 0, printed.text
    files = {row["file"]: row["grasp_id"] for row in rows("old")}
    assert files["audio/data/1_contact.wav"] == "contact/1"
    assert files["audio/data/1_no_contact.wav"] == "no_contact/1"
    assert len(set(files.values())) == 6


EXAMPLE = Path(__file__).resolve().parents[2] / "docs" / "examples" / "sweeps.yaml"
DECLARED = yaml.safe_load(EXAMPLE.read_text())


def test_all_folders_are_one_data_set_and_each_split_has_the_planted_score(
    src, paths, ajgdata, features
):
    for workspace in (1, 2, 3):
        for board in ("squares_cutout", "pure_contact"):
            write_sweep(src, workspace, board)
    path = paths.dataset("board")
    path.parent.mkdir(parents=True)
    path.write_text(yaml.safe_dump(DECLARED, sort_keys=False))
    printed = ajgdata("import", src, "--dataset", "board")
    assert printed.code == 0, printed.text
    assert "180 added" in printed.text and "6 session(s)" in printed.text
    features("board")
    with ajgdata_package.load_features("board") as store:
        assert Counter(store.workspace.values.tolist()) == {"1": 60, "2": 60, "3": 60}
        assert set(store.board.values.tolist()) == {"squares_cutout", "pure_contact"}
        assert store.x.attrs["units"] == "m" and float(store.x.max()) == 0.0601
    scores = {}
    for request in run_experiments(paths, "board"):
        for job in request.jobs:
            ((_, tables),) = read_measurements(paths.experiment(*job))
            (table,) = [table for table in tables if table.name == "scores"]
            mean = table.where(metric="accuracy", statistic="mean", split="grouped").rows
            scores[request.task] = mean[0]["value"]
    assert scores == {"points": 1.0, "workspaces": 0.0}


@pytest.mark.parametrize(
    ("keys", "message", "code"),
    [
        ({"table": "*/swept.csv"}, "holds no table '*/swept.csv'", 1),
        ({"pattern": r"(?P<x>.*)"}, "group 'x' is also a column of the table", 1),
        ({"pattern": r"(?P<n>\d+)\.wav"}, "does not match the pattern, whose groups are empty", 3),
    ],
)
def test_wrong_tables_and_patterns_are_named(src, paths, ajgdata, keys, message, code):
    write_sweep(src, 1, "squares_cutout")
    path = paths.dataset("board")
    path.parent.mkdir(parents=True)
    imports = {**DECLARED["imports"], **keys}
    path.write_text(yaml.safe_dump({**DECLARED, "imports": imports}, sort_keys=False))
    printed = ajgdata("import", src, "--dataset", "board")
    assert printed.code == code and message in printed.text, printed.text


def test_a_column_that_one_table_lacks_is_noted_and_empty(src, paths, ajgdata, rows):
    first = write_sweep(src, 1, "squares_cutout")
    second = write_sweep(src, 2, "squares_cutout")
    lines = (second / "sweep.csv").read_text().replace("normalized_x,", "other_x,", 1)
    (second / "sweep.csv").write_text(lines)
    path = paths.dataset("board")
    path.parent.mkdir(parents=True)
    path.write_text(yaml.safe_dump(DECLARED, sort_keys=False))
    printed = ajgdata("import", src, "--dataset", "board")
    assert f"column normalized_x: only in {first.name}/sweep.csv" in printed.text
    assert {row["normalized_x"] for row in rows("board", second.name)} == {""}
    assert {row["other_x"] for row in rows("board", first.name)} == {""}
