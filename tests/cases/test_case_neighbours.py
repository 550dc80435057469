"""Protocols of other laboratories on folders with planted effects: each split has a known score.

The data set configs are the shipped ones, with shorter sounds and fast models.
"""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from neighbours import (
    BOARDS,
    NOISE_HZ,
    PLACES,
    RATE_HZ,
    SIGNS,
    tones,
    write_demonstrations,
    write_finger,
    write_sweeps,
    write_taps,
)
from recorded import run_experiments
from sounds import write_wav

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


def adaptations(paths: Paths, dataset: str, task: str) -> dict[tuple[int, str], float]:
    """Return the means over left-out groups of `transfer`, by training groups and adaptation."""
    found = {}
    for request in run_experiments(paths, dataset):
        if (request.task, request.experiment.name) == (task, "transfer"):
            for job in request.jobs:
                ((_, tables),) = read_measurements(paths.experiment(*job))
                (table,) = [table for table in tables if table.name == "means"]
                for row in table.rows:
                    found[row["training_groups"], row["adaptation"]] = row["value"]
    return found


def import_fingers(paths, src, ajgdata, features, dataset, folders, labels, repeats, is_gained):
    """Import the sessions of soft fingers as a shipped data set; `folders` has their fingers."""
    for name, finger in folders.items():
        write_finger(src / name, finger, labels, repeats, is_gained=is_gained)
    content = declare(paths, ROOT / "datasets" / dataset / "dataset.yaml")
    (task,) = content["tasks"].values()
    task["models"] = []  # only the experiment transfer
    task["experiments"]["transfer"].update(align=[0, 8], repeats=1)
    paths.dataset(dataset).write_text(yaml.safe_dump(content, sort_keys=False))
    printed = ajgdata("import", src, "--dataset", dataset)
    assert printed.code == 0, printed.text
    assert printed.text.count("the played sound") == len(folders)
    for name in folders:
        assert (paths.session(dataset, name) / "session.yaml").read_text().count("0_sweep.wav")
    features(dataset)


@pytest.mark.parametrize("is_gained", [False, True])
def test_a_soft_finger_that_is_left_out_is_recognised_after_normalisation(
    paths, src, ajgdata, features, is_gained
):
    """Unchanged, all recordings of a left-out finger are predicted as one of four classes."""
    folders = {f"finger_{finger}_no_stand": finger for finger in ("029", "030", "032")}
    arguments = (paths, src, ajgdata, features, "soft_finger_contact", folders, PLACES)
    import_fingers(*arguments, repeats=6, is_gained=is_gained)
    means = adaptations(paths, "soft_finger_contact", "contact")
    assert {size for size, _ in means} == {1, 2}  # training fingers
    for size in (1, 2):
        assert means[size, "unchanged"] == (0.25 if is_gained else 1)
        assert means[size, "normalised"] == 1
        assert means[size, "normalised, aligned with 8 grasps"] == 1
    # The classes of one finger are aligned with those of the other one, but not with the mean of
    # two fingers with opposite gains.
    assert means[1, "aligned with 8 grasps"] == 1
    assert means[2, "aligned with 8 grasps"] == (0 if is_gained else 1)


@pytest.mark.parametrize("is_gained", [False, True])
def test_positions_along_a_new_soft_finger(paths, src, ajgdata, features, is_gained):
    """Positions of a finger are 1.5 cm apart; a left-out finger is another place of the scale."""
    folders = {f"finger_{finger}": finger for finger in ("030", "032", "035")}
    labels = ("none", *(f"{1.5 * place:.1f}" for place in range(7)))
    arguments = (paths, src, ajgdata, features, "soft_finger_position", folders, labels)
    import_fingers(*arguments, repeats=5, is_gained=is_gained)
    means = adaptations(paths, "soft_finger_position", "position")
    for size in (1, 2):
        assert means[size, "normalised"] == pytest.approx(0, abs=1e-6)
        if is_gained:
            assert means[size, "unchanged"] > 1.5
        else:
            assert means[size, "unchanged"] == pytest.approx(0, abs=1e-6)


def test_a_file_of_ten_minutes_becomes_one_recording_per_played_sound(paths, src, ajgdata, rows):
    """The unlabelled file of a finger repeats the sound: here ten times, in 0.6 s."""
    name = "finger_030_unlabelled"
    write_finger(src / name, "030", ("none",), 1, is_gained=False)
    (src / name / "1_none.wav").unlink()
    write_wav(src / name / "1_unlabelled.wav", tones({1200.0: 0.2}, 1, 0.6), RATE_HZ)
    content = declare(paths, ROOT / "datasets" / "soft_finger_contact" / "dataset.yaml")
    imports = content["imports"]
    imports["pattern"] = imports["pattern"].replace("none|", "none|unlabelled|")
    imports["segments"] = {"period_s": 0.06}
    paths.dataset(content["name"]).write_text(yaml.safe_dump(content, sort_keys=False))
    printed = ajgdata("import", src, "--dataset", content["name"])
    assert printed.code == 0, printed.text
    table = rows(content["name"], name)
    assert [row["start_s"] for row in table[:3]] == ["0.0", "0.06", "0.12"]
    assert len(table) == 10 and {row["finger"] for row in table} == {"030"}


EXAMPLES = ROOT / "docs" / "examples"


@pytest.fixture
def import_demonstrations(paths, src, ajgdata, features):
    """Import demonstrations under a name, with a level of the robot's noise."""

    def imported(name: str, noise: float = 0.0) -> None:
        content = declare(paths, EXAMPLES / "contact_microphones.yaml", floor_db=-40)
        if name != content["name"]:
            content |= {"name": name, "tasks": {}}
        path = paths.dataset(name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(yaml.safe_dump(content, sort_keys=False))
        folder = src / name
        folder.mkdir()
        write_demonstrations(folder, noise, seed=round(10 * noise))
        printed = ajgdata("import", folder, "--dataset", name)
        assert printed.code == 0 and "36 added" in printed.text, printed.text
        features(name)

    return imported


def test_contact_microphones_of_either_polarity_in_the_noise_of_a_robot(
    import_demonstrations, paths, src, ajgdata, features, rows
):
    """The noise is the tone of one of two contacts, so a model without copies predicts it always.

    Each contact has its own pose, 0.25 s before its sound.
    """
    name = "contact_microphones"
    import_demonstrations(name)
    for demo in SIGNS:
        poses = [float(row["z_m"]) for row in rows(name, demo)]
        assert poses == pytest.approx([0.01 * event for event in range(12)])
    import_demonstrations("noisy", noise=0.3)
    noise = src / "robot_noise"
    for number in range(1, 4):
        write_wav(noise / f"{number}_hum.wav", tones({NOISE_HZ: 0.3}, [9, number], 0.1), RATE_HZ)
    assert ajgdata("import", noise, "--dataset", "robot_noise").code == 0
    features("robot_noise")
    content = yaml.safe_load(paths.dataset(name).read_text())
    task = {**content["tasks"]["contact"], "test_on": ["noisy"], "compare_sessions": False}
    tasks = {"with_copies": task, "without": {**task, "augment": None}}
    content["tasks"].update(tasks)
    del content["tasks"]["contact"]
    paths.dataset(name).write_text(yaml.safe_dump(content, sort_keys=False))
    found = scores(paths, name)
    assert found["new_demonstration", "transfer", "leave one demo out", name]["accuracy"] == 1
    for task, in_noise in (("without", 0.5), ("with_copies", 1)):
        assert found[task, CV, "grouped", name]["accuracy"] == 1
        assert found[task, CV, "grouped", "noisy"]["accuracy"] == in_noise


def test_the_mean_of_microphones_with_opposite_signs_is_refused_and_silent(
    paths, src, ajgdata, features
):
    name = "averaged"
    content = declare(paths, EXAMPLES / "contact_microphones.yaml", floor_db=-40)
    content |= {"name": name, "audio": {"sample_rate_hz": RATE_HZ, "microphone": "mean"}}
    paths.dataset(name).parent.mkdir()
    paths.dataset(name).write_text(yaml.safe_dump(content, sort_keys=False))
    write_demonstrations(src)
    printed = ajgdata("import", src, "--dataset", name)
    assert printed.code == 1
    assert "so they are not averaged (microphone 1: level -23.0 dBFS, correlation" in printed.text
    assert "they have opposite signs, which cancel in the mean" in printed.text
    assert ajgdata("import", src, "--dataset", name, "--microphone", "mean").code == 0
    features(name)
    lines = paths.quarantine(name).read_text().splitlines()
    silent = [line for line in lines if "silent" in line]
    assert len(silent) == 24 and not any("demo_1" in line for line in silent)


#: Accuracy of materials of new objects, and of known objects, by effect. If objects differ and
#: materials do not, two of four objects are most similar to an object of another material.
TAPS = {"material": (1, 1), "object": (0.5, 1)}


@pytest.mark.parametrize("effect", TAPS)
def test_tapped_objects_that_are_new_or_known(paths, src, ajgdata, features, effect):
    write_taps(src, effect, taps=5)
    declare(paths, EXAMPLES / "tapping_fingers.yaml", floor_db=-40)
    name = "tapping_fingers"
    printed = ajgdata("import", src, "--dataset", name)
    assert printed.code == 0, printed.text
    assert "80 added" in printed.text and "20 grasps" in printed.text
    features(name)
    found = scores(paths, name)
    new_object, known_object = TAPS[effect]
    assert found["new_object", CV, "grouped", name]["accuracy"] == new_object
    assert found["known_object", CV, "grouped", name]["accuracy"] == known_object
    assert found["new_finger", CV, "grouped", name]["accuracy"] == 1
