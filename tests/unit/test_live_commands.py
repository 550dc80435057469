"""`ajgdata sense` and `ajgdata sort` as they are typed, over the virtual gripper."""

import json
import shutil
import signal
import subprocess
import sys
import time
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
import yaml
from fake_card import FakeLine, fake_card
from json_page import assert_documented
from live_events import read_events
from typer.testing import CliRunner

import ajgdata
from ajgdata.acquire.excitation import excitation_samples
from ajgdata.acquire.virtual import VirtualTable
from ajgdata.cli.main import app
from ajgdata.features.spectrum import frequencies_hz, spectrum
from ajgdata.paths import Paths
from ajgdata.pipeline.train import train_model
from ajgdata.store.feature_array import frequency_axis
from ajgdata.store.features import FeatureRows, read_store, text_column, write_store
from ajgdata.store.files import json_bytes
from ajgdata.store.sessions import read_recordings, read_session
from ajgdata.types import DataError

CLASSES = ("box", "rod")
DECLARATION = {
    "name": "d",
    "targets": {"label": {"kind": "classification"}, "mass_g": {"kind": "regression", "unit": "g"}},
    "tasks": {"what": {"target": "label", "models": ["linear"]}},
    "excitation": {"kind": "log_sweep", "length_s": 0.1},
    "recipe": {
        "grasps_per_object": 8,
        "scene": {"numerics": {"dx_mm": 6, "max_time_s": 0.004}},
        "vary": {"angle_deg": [-5, 5]},
        "objects": [
            {
                "name": "cube",
                "shape": {"kind": "cube", "edge_mm": 34},
                "targets": {"label": "box", "mass_g": 30.5},
            },
            {"name": "screw", "shape": "screw", "targets": {"label": "rod"}},
        ],
    },
}
PLAN = {
    "dataset": "d",
    "task": "what",
    "model": "linear",
    "bins": {"box": "A", "rod": "B"},
    "source": "virtual",
    "objects": ["cube", "screw"],
    "wait_s": 0,
    "references": {"every": 10},
}
RUNNER = CliRunner()


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A project with a model that knows 5 grasps of each of two objects, and 3 of nothing."""
    paths = Paths(tmp_path_factory.mktemp("trained"))
    paths.dataset("d").parent.mkdir(parents=True)
    paths.dataset("d").write_text(yaml.safe_dump(DECLARATION))
    spec = ajgdata.load_dataset("d", paths.root).spec
    table = VirtualTable(spec.recipe, 99, paths.responses)
    played = excitation_samples(spec.excitation, 44_100).astype(np.float32)
    rows = [(name, n) for name in ("cube", "screw") for n in range(5)] + [("", n) for n in range(3)]
    features = []
    for name, n in rows:
        table.place(name, n, f"train {n}")
        features.append(spectrum(table.take(played).samples, 44_100, spec.features))
    named = [f"virtual-01/{name or 'empty'}_{n}" for name, n in rows]
    labels = {"cube": "box", "screw": "rod", "": ""}
    columns = {
        "recording": text_column(named),
        "grasp_id": text_column(named),
        "object": text_column([name for name, _ in rows]),
        "label": text_column([labels[name] for name, _ in rows], role="target"),
    }
    settings = {key: getattr(spec, key).model_dump(mode="json") for key in ("audio", "features")}
    attrs = {"settings": json.dumps(settings)}
    frequency_hz = frequencies_hz(44_100, spec.features)
    shard = FeatureRows(
        np.array(features, np.float32), (frequency_axis(frequency_hz),), columns, attrs
    )
    write_store(paths.features("d"), shard)
    train_model(
        read_store(paths.features("d")),
        spec.training("what"),
        model="linear",
        seed=0,
        task="what",
        folder=paths.model("d", "what", "linear"),
    )
    return paths


@pytest.fixture
def run(trained, tmp_path, monkeypatch):
    """Run the command in a copy of the project; return its result."""
    root = tmp_path / "p"
    for name in ("datasets", "results", ".ajgdata"):
        (root / name).parent.mkdir(exist_ok=True)
        (root / name).symlink_to(trained.root / name)
    monkeypatch.chdir(root)
    monkeypatch.setenv("AJGDATA_ROOT", str(root))
    return lambda *arguments: RUNNER.invoke(app, [str(argument) for argument in arguments])


def plan(**changes):
    Path("plan.yaml").write_text(yaml.safe_dump(PLAN | changes))
    return "plan.yaml"


SENSE = ("sense", "d", "what", "linear", "--source", "virtual", "--seed", "1")


@pytest.mark.parametrize("columns", [30, 80])
def test_sense_says_what_it_holds_on_any_terminal(run, monkeypatch, columns):
    monkeypatch.setattr("ajgdata.cli.sense.out.width", columns)
    monkeypatch.setenv("NO_COLOR", "1")
    done = run(*SENSE, "--object", "cube")
    assert done.exit_code == 0, done.output
    head, *rows, last = done.stdout.splitlines()
    assert "dBFS" in head and head.endswith("holds cube (simulated)")
    assert [row.split()[0] for row in rows] == ["box", "rod"]  # the most probable first
    shares = [float(row.split()[-2]) for row in rows]
    assert shares[0] > 90 and sum(shares) == pytest.approx(100, abs=0.2)  # rounded down
    assert all(len(row) <= columns for row in rows) and "█" in rows[0]
    assert last.startswith("known: box") and "\x1b" not in done.stdout
    assert not Path("data").exists()  # nothing is stored


def test_sense_as_json_prints_one_object_per_grasp(run, monkeypatch):
    monkeypatch.setattr("ajgdata.cli.sense.count", lambda first: (first, first + 1))
    done = run(*SENSE, "--object", "cube", "--watch", "--json")
    assert (done.exit_code, done.stderr) == (0, "")
    documents = [json.loads(line) for line in done.stdout.splitlines()]
    assert [document["number"] for document in documents] == [1, 2]
    for document in documents:
        assert_documented("sense", document)
        assert (document["object"], document["source"]) == ("cube", "simulated")
        assert (document["kind"], document["value"]) == ("classification", "box")
        assert (document["verdict"], document["unit"]) == ("known", None)
        assert sum(document["probability"].values()) == pytest.approx(1)
        assert document["probability"]["box"] > 0.9
        assert document["novelty"] < 1 and document["interval"] is None
        assert document["time_s"] > 0 and document["peak_dbfs"] < 0


def test_sense_as_json_has_no_value_for_the_empty_gripper(run):
    done = run(*SENSE, "--object", "empty", "--json")
    assert done.exit_code == 0, done.output
    document = json.loads(done.stdout)
    assert (document["verdict"], document["value"]) == ("nothing", None)


def change_calibration(trained, root, **values):
    """Copy the results of `trained` to `root`, and change values of the calibration there."""
    (root / "results").unlink()
    shutil.copytree(trained.root / "results", root / "results")
    folder = Paths(root).model("d", "what", "linear")
    about = json.loads((folder / "model.json").read_text())
    about["calibration"] |= values
    (folder / "model.json").write_bytes(json_bytes(about))


def test_sense_without_a_novelty_check_does_not_call_anything_known(trained, run, tmp_path):
    change_calibration(trained, tmp_path / "p", novelty_threshold=None)
    done = run(*SENSE, "--object", "cube")
    assert done.exit_code == 0, done.output
    assert done.output.splitlines()[-1] == "novelty not checked: box"


@pytest.mark.parametrize(
    ("rate", "text"),
    [
        (0.124, "this check detects 12.4 % of novel objects"),
        (None, "the detection rate of this check is not measured"),
    ],
)
def test_sense_calls_nothing_known_if_most_novel_objects_are_missed(
    trained, run, tmp_path, rate, text
):
    change_calibration(trained, tmp_path / "p", detection_rate=rate)
    done = run(*SENSE, "--object", "cube")
    assert done.exit_code == 0, done.output
    last = done.output.replace("\n", " ")
    assert "no sign of a novel object: box (novelty " in last
    assert f"limit 1; {text})" in last
    assert "known" not in last


@pytest.fixture
def passive(trained, run, tmp_path, monkeypatch):
    """Run `sense` with a card in a room where something is tapped, and without a played sound."""
    datasets = tmp_path / "p" / "datasets"
    datasets.unlink()
    (datasets / "d").mkdir(parents=True)
    excitation = {"kind": "none", "length_s": 0.2, "trigger_dbfs": -20, "time_limit_s": 1}
    content = {key: value for key, value in DECLARATION.items() if key != "recipe"}
    (datasets / "d" / "dataset.yaml").write_text(
        yaml.safe_dump(content | {"excitation": excitation})
    )

    def sense(level):
        room = 1e-3 * np.random.default_rng(0).standard_normal(100_000)
        room[20_000] = level
        monkeypatch.setattr(
            "ajgdata.pipeline.acquire_live.open_card",
            lambda settings: nullcontext(fake_card(FakeLine(room=room))),
        )
        return run("sense", "d", "what", "linear", "--device", "fake")

    return sense


def test_sense_waits_for_a_sound_if_none_is_played(passive):
    done = passive(0.5)
    assert done.exit_code == 0, done.output
    assert done.stdout.startswith("recording starts at -20 dBFS; waiting up to 1 s\n")
    assert " -6.0 dBFS" in done.stdout
    with pytest.raises(DataError, match="no sound reached -20 dBFS in 1 s"):
        raise passive(0.05).exception


@pytest.mark.parametrize(
    "arguments, said",
    [
        (("sense", "d", "what"), "requires a device"),
        (("sense", "d", "who", "--source", "virtual"), "there is no task 'who'. Use one of what"),
        ((*SENSE, "--object", "rock"), "the recipe has no object 'rock'"),
        (
            ("sense", "d", "what", "--device", "x", "--object", "cube"),
            "is only used with --source virtual",
        ),
        (("sense", "d", "what", "--source", "tape"), "unknown value 'tape'"),
    ],
)
def test_sense_refuses_what_it_cannot_do(run, arguments, said):
    with pytest.raises(DataError, match=said):
        raise run(*arguments).exception


def test_another_sample_rate_is_refused_before_anything_moves(run, monkeypatch):
    monkeypatch.setattr("ajgdata.live.predictor.Predictor.sample_rate_hz", 48_000)
    for command in (SENSE, ("sort", plan())):
        with pytest.raises(DataError, match="at 44100 Hz, and the model was trained at 48000 Hz"):
            raise run(*command).exception
    assert not Path("data").exists()


def test_a_run_from_plan_to_labels(run):
    done = run("sort", plan())
    assert done.exit_code == 0, done.output
    assert "2 sorted, 2 in a row at most; A 1, B 1" in done.stdout
    assert "(simulated)" in done.stdout
    assert "the gripper has changed" not in done.stdout
    folder = Paths().session("d", "sort-01")
    session = read_session(folder)
    assert (session.source, session.acquisition.finished) == ("virtual", True)
    rows, findings = read_recordings(folder)
    assert findings == []
    kept = [(r.recording_id, r.object, r.labels["label"], r.labels["mass_g"]) for r in rows]
    assert kept == [
        ("empty_0001_1", "", "", ""),
        ("sort_0001_1", "cube", "box", "30.5"),
        ("sort_0002_1", "screw", "rod", ""),
    ]
    events = read_events(Paths().events("d", "sort-01"))
    start = events[0]
    assert (start["event"], start["classes"]) == ("start", ["box", "rod"])
    assert start["source"] == "simulated"
    # The next run is another session, of the same grasps: seed and numbers are the same.
    assert run("sort", plan()).exit_code == 0
    again = read_events(Paths().events("d", "sort-02"))
    shares = [
        [e["probability"]["box"] for e in log if e["event"] == "prediction"]
        for log in (events, again)
    ]
    np.testing.assert_array_equal(*shares)


def test_doubt_stops_it_with_an_exit_code_of_its_own(run):
    done = run("sort", plan(threshold=1.0))
    assert done.exit_code == 3
    assert "needs 100 %" in done.stdout and "0 sorted" in done.stdout


@pytest.mark.parametrize(
    "changes, said",
    [
        ({"bins": {"box": "A"}}, "bins: no bin for rod. Name a bin for each class"),
        ({"objects": ["rock"]}, "objects: the label of rock is unknown"),
        ({"threshold": 7}, r"plan.yaml:\d+: threshold = 7"),
        ({"model": "knn"}, "has not been trained. Run `ajgdata train d what --model knn`"),
        ({"source": "soundcard", "card": {"device": "x"}, "objects": []}, "both in one data set"),
    ],
)
def test_what_cannot_be_sorted_is_refused_before_anything_moves(run, changes, said):
    with pytest.raises(DataError, match=said):
        raise run("sort", plan(**changes)).exception
    assert not Path("data/d/sessions/sort-01").exists()


ROBOT = """
read asked; echo "$asked" >> robot.log
case "$asked" in *'"jam"'*) sleep 3000;; esac
"""


def test_sigterm_in_the_middle_of_a_step_halts_the_robot(run):
    """The robot's program sleeps while it jams: it is ended, and `halt` is its next step."""
    robot = {"command": ["sh", "-c", ROBOT], "timeout_s": 3000}
    file = plan(objects=["screw"], robot=robot, references=None)
    log = Path("robot.log")
    log.touch()
    program = [sys.executable, "-c", "from ajgdata.cli import main; main()", "sort", file]
    process = subprocess.Popen(
        program, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        end = time.monotonic() + 300
        while '"jam"' not in log.read_text():
            assert time.monotonic() < end and process.poll() is None, process.communicate()
            time.sleep(0.02)
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate(timeout=300)  # sooner than the step would have ended
    finally:
        process.kill()
    assert process.returncode == 128 + signal.SIGTERM, err
    steps = [json.loads(line) for line in log.read_text().splitlines()]
    assert steps[-1] == {"step": "halt", "held": "rod"}
    assert "still held: rod" in out and "Traceback" not in err
    stopped = read_events(Paths().events("d", "sort-01"))[-1]
    assert (stopped["event"], stopped["held"]) == ("stopped", "rod")
    assert read_session(Paths().session("d", "sort-01")).acquisition.finished
