"""What the page shows of a data set, before and after a run, and that nothing is changed."""

import csv
import http.client
import io
import json
from urllib.parse import quote

import numpy as np
import pytest
import soundfile
from recorded import make_features
from worlds import RATE_HZ, tone, write_tone

from ajgdata.browse.site import browsing
from ajgdata.browse.view import View
from ajgdata.live.server import TOKEN_HEADER
from ajgdata.paths import Paths
from ajgdata.pipeline.labelling import ConflictError
from ajgdata.pipeline.table_import import import_table
from ajgdata.store.tables import write_measurements
from ajgdata.types import DataError, Recording
from ajgdata.types.table import table_of

TASKS = {
    "targets": {
        "material": {"kind": "classification"},
        "edge_mm": {"kind": "regression", "unit": "mm"},
    },
    "tasks": {
        "material": {"target": "material", "models": ["knn"]},
        "edge": {"target": "edge_mm", "models": ["knn"]},
    },
}
MATERIALS = ["wood", "wood", "metal", "metal", ""]
HZ = [300.0, 320.0, 1500.0, 1600.0, 2500.0]


@pytest.fixture
def recorded(project):
    """Five recordings: two of wood, two of metal, one without a label, in two sessions."""
    project.declare(**TASKS)
    for session, places in (("s1", (0, 1, 2)), ("s2", (3, 4))):
        rows = [
            Recording(
                recording_id=f"r{n}",
                file=f"audio/r{n}.wav",
                sha256=write_tone(project.folder(session) / f"audio/r{n}.wav", HZ[n]),
                grasp_id=f"g{n}",
                object=f"box {n}",
                labels={
                    "material": MATERIALS[n],
                    "edge_mm": f"{n}",
                    "note": "" if n else "<b>x</b>",
                },
            )
            for n in places
        ]
        played = project.excitation(session, tone(1000.0))
        project.write(rows, session, notes=f"notes of {session}", excitation=played)
    return project


def predict(project, task, model, values, probabilities=None):
    """Write predictions of a task as its experiment does."""
    rows = [
        {
            "recording": name,
            "split": "grouped",
            "test_set": "d",
            "target_values": "training",
            "fold": 0,
            "y_true": "",
            "y_pred": value,
            "probability": None if probabilities is None else probabilities[name],
        }
        for name, value in values.items()
    ]
    titles = {key: key for key in rows[0]}
    about = {"dataset": "d", "task": task, "model": model}
    table = table_of("predictions", "Predictions", rows, **titles)
    path = project.paths.experiment("d", task, "cross_validation", "plain")
    write_measurements(path, [(about, [table])])


@pytest.fixture
def predicted(recorded):
    """The recordings after a run: r1 of wood is predicted as metal."""
    recorded.build("s1", "s2", targets=View(recorded.paths, "d").spec.label_targets)
    values = {"s1/r0": "wood", "s1/r1": "metal", "s1/r2": "metal", "s2/r3": "metal"}
    predict(
        recorded, "material", "knn", values, dict(zip(values, [0.9, 0.8, 0.7, 0.6], strict=True))
    )
    predict(recorded, "edge", "knn", {"s1/r0": 0.5, "s1/r1": 1.0, "s1/r2": 5.0})
    return recorded


def column(view, name, choice=""):
    cells = view.columns(choice, "", {name})[name]
    return [cells.cell(row) for row in range(5)]


def test_before_a_run_there_are_labels_and_issues(recorded):
    (recorded.folder("s1") / "audio/r2.wav").write_bytes(b"RIFF")
    view = View(recorded.paths, "d")
    assert column(view, "label") == MATERIALS
    assert column(view, "session") == ["s1", "s1", "s1", "s2", "s2"]
    assert column(view, "edge_mm") == [0, 1, 2, 3, 4]
    assert "predicted" not in view.columns("", "")
    assert view.table("", "", "issue=changed", "")["order"] == [2]
    shown = view.recording("", "", "s1/r2")
    assert shown["sound"] is None and "cannot be decoded" in shown["problem"]
    assert shown["spectrum"]["note"].startswith("The features are missing")


def test_a_row_that_cannot_be_read_is_a_row_with_the_reason(recorded):
    table = recorded.folder("s2") / "recordings.csv"
    table.write_text(table.read_text().replace("audio/r3.wav", ""))
    view = View(recorded.paths, "d")
    (row,) = view.table("", "", "issue=bad_row", "")["order"]
    shown = view.recording("", "", view.rows("", "", [row])["rows"][row]["cells"]["recording"])
    assert shown["issues"][0]["code"] == "bad_row" and shown["level"] == "error"


def test_an_open_page_shows_the_issues_of_changed_tables(recorded):
    view = View(recorded.paths, "d")
    assert view.table("", "", "issue!=", "")["order"] == []
    table = recorded.folder("s2") / "recordings.csv"
    original = table.read_text()
    table.write_text(original.replace("audio/r3.wav", "audio/none.wav"))
    assert view.table("", "", "issue=missing", "")["order"] == [3]
    table.write_text(original)
    assert view.table("", "", "issue!=", "")["order"] == []
    (recorded.folder("s1") / "session.yaml").write_text("[")
    assert view.table("", "", "", "")["total"] == 2
    codes = [issue["code"] for issue in view.about()["general"] if issue["session_id"] == "s1"]
    assert codes == ["bad_session"]
    (recorded.folder("s2") / "changes.jsonl").write_text("[\n")
    assert view.table("", "", "", "")["total"] == 0
    assert {issue["session_id"] for issue in view.about()["general"]} >= {"s1", "s2"}


@pytest.fixture
def growing(recorded, monkeypatch):
    """A view whose table has one more recording after each look."""
    view = View(recorded.paths, "d")
    table = recorded.folder("s2") / "recordings.csv"
    last = table.read_text().splitlines()[-1]
    look = view.snapshot

    def snapshot():
        result = look()
        row = last.replace("r4", f"r{len(result.recordings.names)}")
        table.write_text(f"{table.read_text()}{row}\n")
        return result

    monkeypatch.setattr(view, "snapshot", snapshot)
    return view


def test_an_answer_is_of_one_state_of_the_tables(growing):
    assert growing.rows("", "", [5, 6])["rows"] == {}
    answer = growing.table("", "", "", "")
    assert len(answer["order"]) == answer["total"] == 6
    assert growing.recording("", "", "s2/r6")["cells"]["recording"] == "s2/r6"


def test_a_decision_during_an_answer_is_a_conflict(recorded, monkeypatch):
    view = View(recorded.paths, "d")
    look = view.snapshot

    def snapshot():
        result = look()
        monkeypatch.setattr(view, "snapshot", look)
        label = {"column": "material", "value": "metal"}
        View(recorded.paths, "d").change("s1/r0", "label", **label)
        return result

    monkeypatch.setattr(view, "snapshot", snapshot)
    shown = view.recording("", "", "s1/r0")
    assert shown["cells"]["label"] == "wood"
    with pytest.raises(ConflictError):
        view.change("s1/r0", "ok", version=shown["state"]["version"])


def test_after_a_run_wrong_predictions_are_found(predicted):
    view = View(predicted.paths, "d")
    assert column(view, "predicted") == ["wood", "metal", "metal", "metal", ""]
    assert column(view, "wrong") == ["no", "yes", "no", "no", ""]
    assert column(view, "confidence") == [0.9, 0.8, 0.7, 0.6, None]
    assert view.table("", "", "label=wood predicted=metal", "")["order"] == [1]
    assert view.table("", "", "", "-confidence")["order"] == [0, 1, 2, 3, 4]
    assert column(view, "error", "edge/knn") == [0.5, 0, 3, None, None]


def test_the_wrong_label_is_right_after_its_correction(predicted):
    view = View(predicted.paths, "d")
    before = view.table("", "", "", "")["version"]
    table = predicted.folder("s1") / "recordings.csv"
    table.write_text(table.read_text().replace(",1,wood", ",1,metal"))
    assert column(view, "wrong")[1] == "no"
    assert view.table("", "", "", "")["version"] > before


def test_predictions_of_an_earlier_kind_of_target_are_empty(recorded):
    predict(recorded, "material", "knn", {"s1/r0": 0.5})
    predict(recorded, "edge", "knn", {"s1/r0": "small"})
    view = View(recorded.paths, "d")
    assert column(view, "predicted", "material/knn") == [""] * 5
    assert column(view, "predicted", "edge/knn") == [None] * 5
    assert column(view, "error", "edge/knn") == [None] * 5


def test_values_of_features(predicted):
    view = View(predicted.paths, "d")
    novelty = column(view, "novelty")
    assert np.isfinite(novelty).all()
    assert novelty[0] == novelty[1] == min(novelty)  # 300 and 320 Hz are in one bin
    points = view.points("", "")
    assert points["plane"] == "features" and len(points["x"]) == 5
    assert [points["classes"][number] for number in points["class"]] == MATERIALS
    spectrum = view.recording("", "", "s1/r1")["spectrum"]
    assert [line["role"] for line in spectrum["lines"]] == ["own", "class", "other"]
    # The window has 256 samples: the bins are 31.25 Hz apart, and 300 Hz and 320 Hz share one.
    assert np.argmax(spectrum["lines"][0]["y"]) == np.argmax(spectrum["lines"][1]["y"]) == 10


def test_the_sound_of_a_recording_and_of_its_session(predicted):
    view = View(predicted.paths, "d")
    sound = view.recording("", "", "s2/r3")["sound"]
    assert (sound["seconds"], sound["channels"]) == (0.25, 1)
    # 1600 Hz has 5 samples per period at 8000 Hz.
    assert max(sound["high"]) == pytest.approx(0.5 * np.sin(2 * np.pi / 5), rel=1e-3)
    played, rate_hz = soundfile.read(io.BytesIO(view.sound("s2/r3", 1)))
    assert rate_hz == RATE_HZ
    np.testing.assert_allclose(played, tone(1600.0), atol=2**-22)
    np.testing.assert_allclose(
        soundfile.read(io.BytesIO(view.played("s1")))[0], tone(1000.0), atol=2**-22
    )
    assert view.recording("", "", "s1/r0")["session"]["notes"] == "notes of s1"


@pytest.mark.parametrize(
    ("read", "problem"),
    [
        (lambda view: view.recording("", "", "s1/none"), "there is no recording 's1/none'"),
        (lambda view: view.table("edge/cnn", "", "", ""), "there is no 'edge/cnn'"),
        (lambda view: view.points("", "umap"), "there is no 'umap'"),
        (lambda view: view.played("s9"), "has no played sound"),
    ],
)
def test_unknown_names_are_errors(predicted, read, problem):
    with pytest.raises(DataError, match=problem):
        read(View(predicted.paths, "d"))


def test_nothing_is_changed(predicted, snapshot):
    before = snapshot(predicted.root)
    view = View(predicted.paths, "d", check=True)
    view.points("", "")
    view.recording("", "", "s1/r0")
    assert snapshot(predicted.root) == before


class Client:
    def __init__(self, address):
        self.port = int(address.split(":")[2].split("/")[0])
        self.token = address.partition("#")[2]

    def get(self, path, **headers):
        return self.ask("GET", path, None, headers)

    def post(self, content, **headers):
        given = {TOKEN_HEADER: self.token} | headers
        status, _, text = self.ask("POST", "/change", json.dumps(content), given)
        return status, text.decode()

    def ask(self, method, path, body, headers):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
        try:
            connection.request(method, path, body, headers)
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read()
        finally:
            connection.close()


def test_the_site_answers_and_refuses(predicted):
    view = View(predicted.paths, "d")
    with browsing(view, filter="label=wood predicted=metal", sort="") as address:
        assert "/?filter=label%3Dwood+predicted%3Dmetal#" in address
        client = Client(address)
        status, headers, page = client.get("/")
        assert status == 200 and b"browse.js" in page
        assert "media-src 'self'" in headers["Content-Security-Policy"]
        assert "default-src 'none'" in headers["Content-Security-Policy"]
        status, _, content = client.get("/table?" + "filter=" + quote("label=wood predicted=metal"))
        assert (status, json.loads(content)["order"]) == (200, [1])
        status, _, content = client.get("/table?filter=labl%3Dx")
        assert status == 400 and b"there is no column 'labl'" in content
        assert json.loads(client.get("/rows?numbers=1,x,99")[2])["rows"].keys() == {"1"}
        assert client.get("/about", Origin="http://evil.example")[0] == 403
        assert client.get("/about", Host="evil.example")[0] == 400
        whole = client.get("/sound.wav?recording=s1/r0")[2]
        status, headers, part = client.get("/sound.wav?recording=s1/r0", Range="bytes=10-19")
        assert (status, part) == (206, whole[10:20])
        assert headers["Content-Range"] == f"bytes 10-19/{len(whole)}"
        assert client.get("/sound.wav?recording=s1/r0", Range="bytes=999999-")[0] == 416
        assert client.get("/sound.wav?recording=s1/../../r0")[0] == 404


def test_the_command_refuses_a_wrong_filter(ajgdata, predicted):
    code, _, error = ajgdata("browse", "d", "--filter", "labl=wood")
    assert code == 1
    assert error.startswith("error --filter: there is no column 'labl'")
    assert ajgdata("browse", "nothing")[0] == 1


def test_a_table_of_features_has_no_sound(tmp_path):
    values = np.random.default_rng(0).normal(size=(12, 4))
    labels = ["metal", "wood"] * 6
    rows = [[*row, label] for row, label in zip(values.tolist(), labels, strict=True)]
    with (tmp_path / "day.csv").open("w", newline="") as file:
        csv.writer(file).writerows([["a", "b", "c", "d", "material_label"], *rows])
    (tmp_path / "datasets").mkdir()
    paths = Paths(tmp_path)
    import_table(paths, "finger", tmp_path / "day.csv")
    make_features(paths, "finger")
    view = View(paths, "finger")
    name = view.rows("", "", [0])["rows"][0]["cells"]["recording"]
    shown = view.recording("", "", name)
    assert shown["sound"] is None
    assert shown["problem"] == "the data set is a table of features without recordings"
    assert shown["spectrum"]["x"] == [0, 1, 2, 3] and not shown["spectrum"]["is_positive"]
    assert column(view, "label")[:2] == ["metal", "wood"]


def version(view, name):
    return view.recording("", "", name)["state"]["version"]


def test_a_decision_changes_what_the_page_shows(predicted):
    view = View(predicted.paths, "d")
    name = "s1/r1"
    label = {"column": "material", "value": "metal", "reason": "misread"}
    text = view.change(name, "label", version=version(view, name), **label)
    assert "material 'wood' -> 'metal' (misread)" in text
    assert column(view, "label")[1] == "metal"
    assert column(view, "wrong")[1] == "no"
    assert column(view, "decision") == ["", "label", "", "", ""]
    view.change(name, "note", value="heard twice")
    assert column(view, "notes")[1] == "heard twice"
    assert view.table("", "", "notes~twice", "")["order"] == [1]
    shown = view.recording("", "", name)["state"]
    assert shown["changed"] == {"material": "wood"} and len(shown["history"]) == 2
    view.change(name, "undo")
    view.change(name, "undo")
    assert column(view, "label")[1] == "wood"
    view.change("s2/r3", "reject", reason="door slammed")
    assert column(view, "quality") == ["ok", "ok", "ok", "reject", "ok"]


def test_the_review_list_is_an_order_and_decided_recordings_leave_it(predicted):
    view = View(predicted.paths, "d")
    assert column(view, "suspicion", "") != [None] * 5
    first = view.table("", "", "", "-suspicion")
    assert first["remarks"]
    view.change("s1/r0", "ok")
    assert column(view, "suspicion")[0] is None
    assert view.table("", "", "suspicion>=0", "")["order"] == [
        row for row in sorted(first["order"]) if row != 0
    ]


def test_labels_of_a_simulation_are_read_only(predicted):
    cube = {"name": "a", "shape": {"kind": "cube", "edge_mm": 20}}
    predicted.declare(**TASKS, recipe={"sessions": 1, "grasps_per_object": 1, "objects": [cube]})
    view = View(predicted.paths, "d")
    assert "read-only" in view.about()["read_only"]
    assert "decision" not in view.columns("", "")
    with pytest.raises(DataError, match="read-only"):
        view.change("s1/r0", "ok")


def test_only_the_page_decides_and_conflicts_are_reported(predicted, snapshot):
    view = View(predicted.paths, "d")
    with browsing(view) as address:
        client = Client(address)
        note = {"recording": "s1/r0", "action": "note", "value": "<i>x</i>"}
        note["version"] = version(view, "s1/r0")
        before = snapshot(predicted.root)
        assert client.post(note, **{TOKEN_HEADER: "wrong"})[0] == 403
        assert client.post(note, Origin="http://evil.example")[0] == 403
        assert client.post({"recording": "s1/r0"}) == (400, "the request is not a decision")
        assert client.post(note | {"action": "delete"})[0] == 400
        assert client.post(note | {"recording": "s1/../r0"})[0] == 400
        assert client.get("/change")[0] == 405
        assert snapshot(predicted.root) == before
        status, text = client.post(note)
        assert status == 200 and "<i>x</i>" in text
        status, text = client.post(note)
        assert status == 409 and "<i>x</i>" in text
