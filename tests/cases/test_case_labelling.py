"""Decisions of people about labels: nothing is lost by kills, other writers, imports or runs."""

from __future__ import annotations

import json
import subprocess
import sys
import time

import numpy as np
import pytest
from sounds import resonances, write_wav

import ajgdata as library
from ajgdata.paths import Paths
from ajgdata.pipeline.importing import import_folder
from ajgdata.pipeline.labelling import (
    ConflictError,
    change_recording,
    find_recording,
    recording_state,
    recording_states,
)
from ajgdata.pipeline.publish import publish
from ajgdata.pipeline.run_changes import changed_during_run, feature_states
from ajgdata.store import changes as log_file
from ajgdata.store.changes import read_changes
from ajgdata.store.features import read_store
from ajgdata.store.findings import read_findings
from ajgdata.store.freshness import changes_since_features, run_tables
from ajgdata.store.sessions import read_dataset, read_recordings
from ajgdata.types import DataError

NAME = "tones"
BALL = "src/1_ball"


@pytest.fixture
def tones(paths, src) -> Paths:
    """A data set of four balls and four cubes."""
    for number, label in enumerate(("ball", "cube")):
        for grasp in range(1, 5):
            write_wav(src / f"{grasp + 4 * number}_{label}.wav", resonances(number, grasp))
    import_folder(paths, NAME, src, settings=None)
    return paths


def log(paths: Paths):
    return paths.changes_file(NAME, "src")


def labels(paths: Paths) -> dict[str, str]:
    """Return the label of each recording, as every later step reads it."""
    recordings, problems = read_recordings(paths.session(NAME, "src"))
    assert problems == []
    return {row.recording_id: row.labels["label"] for row in recordings}


def relabel(paths: Paths, value: str, recording: str = BALL, **options):
    return change_recording(paths, NAME, recording, "label", column="label", value=value, **options)


def column(paths: Paths, name: str) -> dict[str, str]:
    """Return a column of the feature file by recording."""
    columns = read_store(paths.features(NAME)).columns
    return dict(
        zip(columns["recording"].values.tolist(), columns[name].values.tolist(), strict=True)
    )


def issues(ajgdata, dataset: str = NAME) -> dict[str, str]:
    """Return the problems that `ajgdata check` reports, by code."""
    document = json.loads(ajgdata("check", dataset, "--json").out.splitlines()[-1])
    return {issue["code"]: issue["problem"] for issue in document["issues"]}


def test_a_label_by_hand_is_used_and_recordings_csv_stays(tones, ajgdata, features):
    features(NAME)
    table = tones.recordings_file(NAME, "src").read_bytes()
    spectra = read_store(tones.features(NAME)).feature
    assert changes_since_features(tones, read_dataset(tones, NAME)) == []

    printed = ajgdata("label", NAME, "1_ball", "--label", "label=cube", "--reason", "misread")
    assert printed.code == 0
    assert "label 'ball' -> 'cube' (misread)" in printed.out
    assert labels(tones)["1_ball"] == "cube"
    assert tones.recordings_file(NAME, "src").read_bytes() == table
    assert changes_since_features(tones, read_dataset(tones, NAME)) == ["session src changed"]

    computed, reused = features(NAME)
    assert (computed, reused) == (0, 8)  # no sound is read
    assert column(tones, "label")[BALL] == "cube"
    assert np.array_equal(read_store(tones.features(NAME)).feature, spectra)
    assert changes_since_features(tones, read_dataset(tones, NAME)) == []


def test_several_recordings_and_columns_are_changed_by_one_command(tones, ajgdata):
    options = ("--label", "label=cube", "--label", "object=cube")
    assert ajgdata("label", NAME, "1_ball", "2_ball", *options).code == 0
    states = recording_states(tones, NAME)
    for name in ("src/1_ball", "src/2_ball"):
        assert states[name].labels["label"] == states[name].labels["object"] == "cube"
        assert states[name].changed == {"label": "ball", "object": "ball"}


def test_a_rejected_recording_is_excluded_until_undo(tones, ajgdata, features):
    assert ajgdata("label", NAME, "1_ball.wav", "--reject", "door slammed").code == 0
    features(NAME)
    assert BALL not in column(tones, "label")
    assert [issue.code for issue in read_findings(tones.quarantine(NAME))] == ["rejected"]
    assert ajgdata("label", NAME, BALL, "--undo").code == 0
    features(NAME)
    assert column(tones, "label")[BALL] == "ball"


def test_notes_and_changes_that_were_taken_back_compute_nothing(tones, features):
    features(NAME)
    spec = read_dataset(tones, NAME)
    change_recording(tones, NAME, BALL, "note", value="a scratch")
    change_recording(tones, NAME, BALL, "ok")
    assert changes_since_features(tones, spec) == []
    relabel(tones, "cube")
    assert changes_since_features(tones, spec) != []
    change_recording(tones, NAME, BALL, "undo")
    assert changes_since_features(tones, spec) == []
    state = recording_state(tones, NAME, BALL)
    assert state.notes == ("a scratch",)
    assert state.is_reviewed
    assert [change.action for change in state.history] == ["note", "ok", "label", "undo"]


def test_undo_takes_back_one_change_after_the_other(tones):
    relabel(tones, "cube")
    relabel(tones, "bar")
    assert change_recording(tones, NAME, BALL, "undo").new == "cube"
    assert change_recording(tones, NAME, BALL, "undo").new == "ball"
    with pytest.raises(DataError, match="has no change to undo"):
        change_recording(tones, NAME, BALL, "undo")


def test_ok_takes_back_a_rejection(tones):
    change_recording(tones, NAME, BALL, "reject", reason="noise")
    assert recording_state(tones, NAME, BALL).is_rejected
    change_recording(tones, NAME, BALL, "ok")
    state = recording_state(tones, NAME, BALL)
    assert not state.is_rejected
    assert state.is_reviewed


def test_an_import_keeps_labels_by_hand_and_lists_them(tones, ajgdata, src):
    relabel(tones, "bar")
    options = ("--dataset", NAME, "--on-change", "labels")
    # the folder has another label now: a new name of the file, of the same sound
    (src / "1_ball.wav").rename(src / "1_cube.wav")
    printed = ajgdata("import", src, *options)
    assert "label 'bar' here, 'cube' in the folder" in printed.text
    assert "because a person set it" in printed.text
    assert labels(tones)["1_ball"] == "bar"
    assert "changed_by_hand" in issues(ajgdata)
    change_recording(tones, NAME, BALL, "undo")
    assert labels(tones)["1_ball"] == "cube"  # that of the import


def test_the_second_of_two_browsers_sees_that_a_recording_changed(tones):
    seen = recording_state(tones, NAME, BALL).version
    relabel(tones, "cube", version=seen, author="anna")
    with pytest.raises(ConflictError, match="changed meanwhile: the last change is label by anna"):
        relabel(tones, "bar", version=seen)
    assert labels(tones)["1_ball"] == "cube"
    relabel(tones, "bar", version=recording_state(tones, NAME, BALL).version)
    assert labels(tones)["1_ball"] == "bar"


def test_two_processes_lose_no_change(tones):
    """Each process writes 20 notes; each note is there once, and in its own order."""
    program = (
        "import sys; from pathlib import Path; from ajgdata.paths import Paths\n"
        "from ajgdata.pipeline.labelling import change_recording\n"
        "for number in range(20):\n"
        f"    change_recording(Paths(Path(sys.argv[1])), {NAME!r}, {BALL!r}, 'note',"
        " value=f'{sys.argv[2]} {number}')\n"
    )
    started = [
        subprocess.Popen([sys.executable, "-c", program, str(tones.root), name]) for name in "ab"
    ]
    assert [process.wait(timeout=60) for process in started] == [0, 0]
    notes = recording_state(tones, NAME, BALL).notes
    for name in "ab":
        own = [note for note in notes if note.startswith(name)]
        assert own == [f"{name} {number}" for number in range(20)]
    assert len(notes) == 40


@pytest.mark.parametrize("share", [0.1, 0.5, 0.99])
def test_a_line_of_a_killed_process_is_named_and_loses_nothing(tones, ajgdata, share):
    relabel(tones, "cube")
    before = log(tones).read_bytes()
    relabel(tones, "bär")  # two bytes of UTF-8, of which one can be lost
    after = log(tones).read_bytes()
    cut = len(before) + int(share * (len(after) - len(before)))
    log(tones).write_bytes(after[:cut])

    assert labels(tones)["1_ball"] == "cube"
    assert "torn_change" in issues(ajgdata)
    change_recording(tones, NAME, BALL, "note", value="next")
    assert log(tones).read_bytes().startswith(before)
    assert [change.action for change in read_changes(log(tones).parent).changes] == [
        "label",
        "note",
    ]
    assert "torn_change" not in issues(ajgdata)


def test_a_complete_last_line_without_a_line_end_is_a_change(tones):
    relabel(tones, "cube")
    log(tones).write_bytes(log(tones).read_bytes().rstrip(b"\n"))
    assert labels(tones)["1_ball"] == "cube"
    relabel(tones, "bar")
    assert len(read_changes(log(tones).parent).changes) == 2


@pytest.mark.parametrize("step", ["open", "write", "fsync"])
def test_a_process_that_is_killed_at_any_step_leaves_a_complete_log(tones, step):
    """A process ends before the file is opened, after a part of the line, and before fsync."""
    relabel(tones, "cube")
    before = log(tones).read_bytes()
    program = (
        "import os, sys; from pathlib import Path; from ajgdata.paths import Paths\n"
        "from ajgdata.pipeline import labelling; from ajgdata.store import changes\n"
        "step = sys.argv[2]\n"
        "def kill(*_): os._exit(9)\n"
        "if step == 'open': labelling.append_change = kill\n"
        "if step == 'fsync': changes.os.fsync = kill\n"
        "if step == 'write':\n"
        "    whole = changes.log_bytes\n"
        "    changes.log_bytes = lambda lines: whole(lines)[:40]\n"
        "    changes.os.fsync = kill\n"
        f"labelling.change_recording(Paths(Path(sys.argv[1])), {NAME!r}, {BALL!r}, 'label',"
        " column='label', value='bar')\n"
    )
    command = [sys.executable, "-c", program, str(tones.root), step]
    assert subprocess.run(command, check=False).returncode == 9
    assert log(tones).read_bytes().startswith(before)
    assert labels(tones)["1_ball"] == ("bar" if step == "fsync" else "cube")
    relabel(tones, "prism")  # the lock of the killed process is free
    assert labels(tones)["1_ball"] == "prism"


def test_each_decision_that_a_killed_process_reported_is_in_the_log(tones):
    """The process reports each note after it is written, and is killed at any time."""
    program = (
        "import itertools, sys; from pathlib import Path; from ajgdata.paths import Paths\n"
        "from ajgdata.pipeline.labelling import change_recording\n"
        "for number in itertools.count():\n"
        f"    change_recording(Paths(Path(sys.argv[1])), {NAME!r}, {BALL!r}, 'note',"
        " value=str(number))\n"
        "    print(number, flush=True)\n"
    )
    random = np.random.default_rng(0)
    for _ in range(2):
        log(tones).unlink(missing_ok=True)
        command = [sys.executable, "-c", program, str(tones.root)]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        reported = [process.stdout.readline().strip() for _ in range(int(random.integers(1, 40)))]
        time.sleep(random.uniform(0, 0.01))
        process.kill()
        reported += process.communicate()[0].split()
        notes = recording_state(tones, NAME, BALL).notes
        assert list(notes[: len(reported)]) == reported
        assert len(notes) <= len(reported) + 1  # the last one may be written, but not reported
        change_recording(tones, NAME, BALL, "note", value="next")
        assert recording_state(tones, NAME, BALL).notes == (*notes, "next")


def test_a_full_disk_leaves_no_part_of_a_line(tones, monkeypatch):
    relabel(tones, "cube")
    before = log(tones).read_bytes()

    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(log_file.os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        relabel(tones, "bar")
    assert log(tones).read_bytes() == before


def test_a_label_during_a_run_is_reported_and_computed_by_the_next_run(tones, features):
    """The run begins, a person changes a label, and the run ends with its old tables."""
    from ajgdata.pipeline.plan import plan

    plans = {NAME: plan(tones, [NAME])[NAME]}
    relabel(tones, "cube")
    texts = run_tables(tones, NAME, ["src"], ())
    before = feature_states(tones, plans)
    features(NAME)
    relabel(tones, "bar")
    (line,) = changed_during_run(tones, plans, before)
    assert line.startswith("tones: session src changed during the run")
    assert run_tables(tones, NAME, ["src"], ()) != texts


def test_decisions_that_cannot_be_written_are_refused(tones, ajgdata, src):
    def refused(*arguments: str) -> str:
        printed = ajgdata("label", NAME, *arguments)
        assert printed.code == 1
        assert "Traceback" not in printed.text
        return printed.text

    assert "no decision" in refused(BALL)
    assert "--ok and --undo together" in refused(BALL, "--ok", "--undo")
    assert "has no such recording" in refused("src/9_ball", "--ok")
    assert "src/1_ball" in refused("src/1_bal", "--ok")
    assert "there is no label 'colour'" in refused(BALL, "--label", "colour=red")
    assert "has no =" in refused(BALL, "--label", "cube")
    assert "--reject and --reason together" in refused(BALL, "--reject", "a", "--reason", "b")
    audio = tones.session(NAME, "src") / "audio/1_ball.wav"
    write_wav(audio, resonances(5, 5))
    assert "sha256 differs" in refused(BALL, "--label", "label=cube")
    assert not log(tones).exists()
    with pytest.raises(DataError, match="needs a reason"):
        change_recording(tones, NAME, BALL, "reject")


def test_changes_of_another_sound_or_of_no_recording_are_listed(tones, ajgdata, src):
    relabel(tones, "cube")
    relabel(tones, "cube", recording="src/2_ball")
    write_wav(src / "1_ball.wav", resonances(0, 99))
    (src / "2_ball.wav").unlink()
    printed = ajgdata("import", src, "--dataset", NAME, "--on-change", "files")
    assert printed.code == 3
    assert "decisions about the replaced file no longer count" in printed.text
    assert labels(tones)["1_ball"] == "ball"  # the decision was about the other sound
    ajgdata("import", src, "--dataset", NAME, "--on-change", "prune")
    assert {"change_of_other_sound", "change_without_recording"} <= set(issues(ajgdata))
    with pytest.raises(DataError, match="is no longer in"):
        find_recording(tones, NAME, "src/2_ball")


def test_a_wrong_line_is_named_with_its_number(tones, ajgdata):
    relabel(tones, "cube")
    log(tones).write_text(log(tones).read_text(encoding="utf-8") + "cube\n", encoding="utf-8")
    assert "not a change" in issues(ajgdata)["bad_session"]


@pytest.mark.parametrize("column", ["start_s", "recording_id", "labels", "gripper", "a b", "../x"])
def test_a_line_can_only_change_labels(tones, ajgdata, column):
    relabel(tones, "cube")
    line = json.loads(log(tones).read_text(encoding="utf-8")) | {"column": column, "new": "0.05"}
    log(tones).write_text(f"{json.dumps(line)}\n", encoding="utf-8")
    if column == "labels":  # a name that a label can have
        recordings, _ = read_recordings(tones.session(NAME, "src"))
        assert recordings[0].labels["labels"] == "0.05"
    else:
        assert "is not a label" in issues(ajgdata)["bad_session"]


def test_a_text_in_a_line_is_plain_as_in_recordings_csv(tones):
    relabel(tones, "cube")
    line = json.loads(log(tones).read_text(encoding="utf-8"))
    line |= {"new": "cu\nbe\x1b", "reason": "a\tb"}
    log(tones).write_text(f"{json.dumps(line)}\n", encoding="utf-8")
    assert labels(tones)["1_ball"] == "cu be"
    assert recording_state(tones, NAME, BALL).history[0].reason == "a b"


def test_a_refused_decision_stops_the_command_before_the_first_change(tones, ajgdata):
    write_wav(tones.session(NAME, "src") / "audio/2_ball.wav", resonances(5, 5))
    printed = ajgdata("label", NAME, "1_ball", "2_ball", "--label", "label=cube")
    assert printed.code == 1
    assert "sha256 differs" in printed.text
    assert not log(tones).exists()


@pytest.mark.parametrize("decision", [("--label", "label=cube"), ("--ok",), ("--reject", "noise")])
def test_a_command_of_several_recordings_can_be_repeated(tones, ajgdata, decision):
    assert ajgdata("label", NAME, "2_ball", *decision).code == 0
    printed = ajgdata("label", NAME, "1_ball", "2_ball", "3_ball", *decision)
    assert printed.code == 0
    assert printed.text.count("already") == 1
    assert len(read_changes(log(tones).parent).changes) == 3


def test_a_published_data_set_has_the_labels_and_the_changes(tones, ajgdata, features, tmp_path):
    relabel(tones, "cube", author="anna", reason="misread")
    change_recording(tones, NAME, "src/2_ball", "reject", reason="noise")
    features(NAME)
    out = tmp_path / "published"
    publish(tones, NAME, out)
    card = (out / "README.md").read_text(encoding="utf-8")
    assert "| labels changed by hand | 1 recording; 1 further recording rejected |" in card
    table = (out / "sessions/src/recordings.csv").read_text(encoding="utf-8")
    assert "2_ball" not in table
    (change,) = read_changes(out / "sessions/src").changes
    assert (change.new, change.reason, change.author) == ("cube", "misread", "")

    assert ajgdata("fetch", out, "--name", "copy").code == 0
    assert recording_states(tones, "copy")[BALL].labels["label"] == "cube"
    printed = ajgdata("label", "copy", BALL, "--undo")
    assert "recordings.csv itself has label = 'cube'" in printed.text
    assert "change" not in " ".join(issues(ajgdata, "copy"))


def test_labels_of_a_recipe_are_read_only(tones, ajgdata):
    objects = "[{name: cube, shape: {kind: cube, edge_mm: 20}}]"
    recipe = f"recipe: {{grasps_per_object: 2, objects: {objects}}}\n"
    folder = tones.dataset("virtual").parent
    folder.mkdir()
    text = f"name: virtual\ntargets:\n  object: {{kind: classification}}\n{recipe}"
    tones.dataset("virtual").write_text(text, encoding="utf-8")
    printed = ajgdata("label", "virtual", "a/b", "--ok")
    assert printed.code == 1
    assert "labels are those of the simulation and read-only" in printed.text


def test_python_reads_the_labels_by_hand(tones, features):
    relabel(tones, "cube")
    features(NAME)
    for loaded in (library.load_features(NAME), library.load_recordings(NAME)):
        with loaded:
            names = loaded.recording.values.tolist()
            assert loaded.label.values[names.index(BALL)] == "cube"
