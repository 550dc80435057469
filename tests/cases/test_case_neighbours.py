"""Protocols of other laboratories on folders with planted effects: each split has a known score.

The data set configs are the shipped ones, with shorter sounds and fast models.
"""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from neighbours import (
    BOARDS,
    write_sweeps,
)
from recorded import run_experiments

from ajgdata.paths import Paths
from ajgdata.store.tables import read_measurements

CV = "cross_validation"
ROOT = Path(__file__).resolve().parents[2]
#: Names of the parts of franka_contact in `source.yaml`, by the board in the name of its folder.
SURFACES = {"squares_cutout": "cutout", "pure_contact": "blank", "pure_no_contact": "empty"}


def declare(paths: Paths, source: Path, model: str = "knn_plain", **features: object) -> dict:
    """Write a shipped data set config into the project, with one fast model and other features."""
    content = yaml.safe_load(source.read_text())
    content["features"] = {**content.get("features", {}), **features}
    for task in content["tasks"].values():
        task["models"] = [model]
        for experiment in task.get("experiments", {}).values():
            experiment["models"] = [model]
    path = paths.dataset(content["name"])
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return content


def scores(paths: Paths, dataset: str) -> dict[tuple[str, ...], dict[str, float]]:
    """Run all experiments of a data set; return means over folds, or medians over fits, by task,
    experiment, split and tested data set."""
    found: dict[tuple[str, ...], dict[str, float]] = {}
    for request in run_experiments(paths, dataset):
        for job in request.jobs:
            for _, tables in read_measurements(paths.experiment(*job)):
                (table,) = [table for table in tables if table.name == "scores"]
                rows = table.where(statistic="mean").rows or table.where(statistic="median").rows
                for row in rows:
                    key = (request.task, request.experiment.name, row["split"], row["test_set"])
                    found.setdefault(key, {})[row["metric"]] = row["value"]
    return found


@pytest.fixture
def franka(paths, src, ajgdata, features):
    """Import the sweeps of three workspaces and of a new object, with an effect of the class."""

    def imported(effect: str) -> None:
        for workspace in (1, 2, 3):
            for board, points in BOARDS.items():
                folder = src / "old" / f"workspace_{workspace}_{SURFACES[board]}"
                write_sweeps(folder, workspace, board, effect, points)
        points = {"contact": 2, "no_contact": 2, "edge": 1}
        write_sweeps(src / "new" / "workspace_4_square", 4, "square", effect, points)
        counts = {"franka_contact": 210, "franka_new_object": 25}
        for name, count in counts.items():
            declare(paths, ROOT / "datasets" / name / "dataset.yaml", length_s=0.05, floor_db=-40)
            folder = src / ("old" if name == "franka_contact" else "new")
            printed = ajgdata("import", folder, "--dataset", name)
            assert printed.code == 0, printed.text
            assert f"{count} added" in printed.text
            features(name)

    return imported


#: Accuracy of random folds, of a new workspace, and of a new object with two classes, by effect.
#: An effect of the session has the accuracy of a guess: 1/3 and 1/2. In the mixture, half of the
#: points of each class have an effect of the class in all workspaces.
FRANKA = {"object": (1, 1, 1), "session": (1, 1 / 3, 1 / 2), "mixture": (1, 2 / 3, 3 / 4)}


@pytest.mark.parametrize("effect", FRANKA)
def test_a_rigid_finger_in_a_new_workspace_and_on_a_new_object(franka, paths, effect):
    franka(effect)
    found = scores(paths, "franka_contact")
    within, workspace, new_object = FRANKA[effect]
    own = "franka_contact"
    assert found["within_workspaces", CV, "random", own]["accuracy"] == within
    if effect != "mixture":  # some folds hold out all points with one tone of a mixture
        assert found["within_workspaces", CV, "grouped", own]["accuracy"] == within
    rotations = found["new_workspace", CV, "grouped", own]
    assert rotations["balanced_accuracy"] == pytest.approx(workspace)
    tested = found["new_object", CV, "grouped", "franka_new_object"]
    assert tested["accuracy"] == pytest.approx(new_object)
    fits = found["new_object", "repeated_fits", "grouped", "franka_new_object"]
    assert fits["accuracy"] == pytest.approx(new_object)
