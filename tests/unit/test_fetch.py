"""Fetching: the same features elsewhere, or one line and nothing changed."""

import http.server
import threading
from functools import partial
from pathlib import Path

import pytest
import yaml
from published import edit_rows, make_project, published, remake, repack, reseal
from worlds import RATE_HZ, Project, tone

from ajgdata.acquire.excitation import played_samples
from ajgdata.paths import Paths
from ajgdata.pipeline.fetch import fetch
from ajgdata.pipeline.plan import plan
from ajgdata.store.audio import file_sha256, write_pcm24
from ajgdata.store.publishing import archive
from ajgdata.store.sessions import read_dataset, read_recordings, read_session, write_session
from ajgdata.types import Acquisition, DataError, PassiveRecording


@pytest.fixture
def elsewhere(tmp_path):
    """Another project, in which there is no data set yet."""
    (tmp_path / "elsewhere" / "datasets").mkdir(parents=True)
    return Project(Paths(tmp_path / "elsewhere"))


class Handler(http.server.SimpleHTTPRequestHandler):
    """Serves a folder; can cut an answer short once."""

    def do_GET(self):
        path = Path(self.translate_path(self.path))
        name = path.relative_to(self.directory).as_posix()
        self.server.requests.append(name)
        if not path.is_file():
            self.send_error(404)
            return
        content = path.read_bytes()
        self.send_response(200)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content[: self.server.cut.pop(name, len(content))])

    def log_message(self, *_):
        pass


@pytest.fixture
def server(tree):
    handler = partial(Handler, directory=str(tree.root))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as host:
        host.requests = []
        host.cut = {}
        thread = threading.Thread(target=host.serve_forever, args=(0.02,))
        thread.start()
        yield host
        host.shutdown()
        thread.join()


def address(server) -> str:
    return f"http://127.0.0.1:{server.server_address[1]}"


def test_the_same_features_on_another_machine(world, server, elsewhere):
    result = fetch(elsewhere.paths, address(server))
    assert (result.name, result.recordings, result.sessions) == ("d", 12, 2)
    original = world[0]
    assert not elsewhere.paths.features("d").exists()
    remake(elsewhere)  # from the recordings that were fetched
    assert elsewhere.paths.features("d").read_bytes() == original.paths.features("d").read_bytes()


def test_sessions_and_sounds_come_back(world, tree, elsewhere):
    fetch(elsewhere.paths, str(tree.root))
    for session in ("s1", "s2"):
        here = elsewhere.folder(session)
        there = world[0].folder(session)
        assert read_session(here) == read_session(there)
        assert (here / "excitation.wav").read_bytes() == (there / "excitation.wav").read_bytes()
    kept = elsewhere.paths.fetched_sums("d").parent
    assert {p.name for p in kept.iterdir()} == {
        "CITATION.cff",
        "LICENSE",
        "README.md",
        "SHA256SUMS",
    }


def test_a_sound_file_keeps_its_checksum_and_passive_sessions_their_settings(tmp_path, elsewhere):
    """The file itself is not published: sessions have their excitation.wav."""
    project = make_project(tmp_path / "origin")
    path = project.root / "sounds" / "own.wav"
    path.parent.mkdir()
    write_pcm24(path, tone(300), RATE_HZ)
    declared = yaml.safe_load(project.paths.dataset("d").read_text())
    sound = {"kind": "file", "file": "sounds/own.wav"}
    project.declare(**declared | {"excitation": sound})
    passive = PassiveRecording(trigger_dbfs=-30).model_dump()
    acquisition = Acquisition(finished=True, setup={"excitation": passive})
    session = read_session(project.folder("s2"))
    update = {"source": "soundcard", "excitation": None, "acquisition": acquisition}
    rows = read_recordings(project.folder("s2"))[0]
    write_session(project.folder("s2"), session.model_copy(update=update), rows)
    (project.folder("s2") / "excitation.wav").unlink()
    remake(project)
    published(project, tmp_path / "out")
    fetch(elsewhere.paths, str(tmp_path / "out"))
    excitation = read_dataset(elsewhere.paths, "d").excitation
    assert excitation.sha256 == file_sha256(path)
    assert excitation.sha256 == read_dataset(project.paths, "d").excitation.sha256
    assert (elsewhere.folder("s1") / "excitation.wav").read_bytes() == path.read_bytes()
    assert not (elsewhere.folder("s2") / "excitation.wav").exists()
    assert read_session(elsewhere.folder("s2")).acquisition == acquisition
    with pytest.raises(DataError, match=r"excitation\.file: there is no .*own\.wav"):
        played_samples(excitation, RATE_HZ, elsewhere.root)


def test_another_name_without_tests_on_other_data_sets(tree, elsewhere):
    content = yaml.safe_load((tree / tree.DECLARATION).read_text())
    content["tasks"]["edge"]["test_on"] = ["absent"]
    content["tasks"]["edge"]["paper"] = {"absent": "noise"}
    (tree / tree.DECLARATION).write_text(yaml.safe_dump(content))
    reseal(tree)
    removed = fetch(elsewhere.paths, str(tree.root), name="mine").removed
    assert removed == ("test_on of edge",)
    spec = read_dataset(elsewhere.paths, "mine")
    assert (spec.tasks["edge"].test_on, spec.tasks["edge"].papers) == ((), {})
    assert list(plan(elsewhere.paths, check=True)) == ["mine"]


def test_settings_that_may_start_a_program_or_leave_the_folder_are_not_taken_over(tree, elsewhere):
    content = yaml.safe_load((tree / tree.DECLARATION).read_text())
    arm = {"command": ["sh", "-c", "touch pwned"]}
    content["protocol"] = {"objects": [{"name": "cube"}], "robot": arm}
    content["imports"] = {"table": "/etc/passwd", "file": "{x}.wav"}
    (tree / tree.DECLARATION).write_text(yaml.safe_dump(content))
    reseal(tree)
    assert fetch(elsewhere.paths, str(tree.root)).removed == ("protocol", "imports")
    registered = yaml.safe_load(elsewhere.paths.dataset("d").read_text())
    assert not {"recipe", "protocol", "imports"} & set(registered)


@pytest.mark.parametrize(
    ("old", "microphone", "new"),
    [
        (0, 1, "1"),
        ("mean", "mean", "mean"),
        ("mono", None, "no microphone (files have one channel)"),
    ],
)
def test_the_key_channel_of_an_older_version_is_converted_with_a_message(
    tree, elsewhere, ajgdata, monkeypatch, old, microphone, new
):
    content = yaml.safe_load((tree / tree.DECLARATION).read_text())
    content["audio"]["channel"] = old
    (tree / tree.DECLARATION).write_text(yaml.safe_dump(content))
    reseal(tree)
    monkeypatch.chdir(elsewhere.root)
    code, out, _ = ajgdata("fetch", tree.root)
    assert code == 0
    line = f"audio.channel: {old} -> audio.microphone: {new}"
    assert f"converted from an older version: {line}" in out
    assert read_dataset(elsewhere.paths, "d").audio.microphone == microphone


def test_a_wrong_value_of_the_key_channel_is_refused(tree, elsewhere):
    content = yaml.safe_load((tree / tree.DECLARATION).read_text())
    content["audio"]["channel"] = True
    (tree / tree.DECLARATION).write_text(yaml.safe_dump(content))
    reseal(tree)
    with pytest.raises(DataError, match="channel was replaced by audio"):
        fetch(elsewhere.paths, str(tree.root))
    assert not elsewhere.paths.dataset("d").exists()


def test_a_cut_download_keeps_complete_files(tree, server, elsewhere):
    server.cut["audio.zip"] = (tree / tree.ARCHIVE).stat().st_size // 2
    with pytest.raises(DataError, match=r"audio.zip: cannot be fetched .*complete files are kept"):
        fetch(elsewhere.paths, address(server))
    first = list(server.requests)
    server.requests.clear()
    fetch(elsewhere.paths, address(server))
    assert first.index("audio.zip") > 1  # what came before it was complete
    assert not set(first[1 : first.index("audio.zip")]) & set(server.requests)
    assert len(list(elsewhere.root.glob("data/**/audio/*.wav"))) == 12
    assert list(elsewhere.paths.fetched.glob("[!.]*")) == []  # but for its lock


def test_nothing_there_is_replaced_or_downloaded_again(tree, server, elsewhere, snapshot):
    fetch(elsewhere.paths, str(tree.root))
    before = snapshot(elsewhere.paths.data)
    with pytest.raises(DataError, match=r"already exists. Choose another name with --name"):
        fetch(elsewhere.paths, address(server))
    assert server.requests == ["SHA256SUMS", "datapackage.json", "dataset.yaml"]
    assert snapshot(elsewhere.paths.data) == before
    elsewhere.paths.dataset("d").unlink()
    with pytest.raises(DataError, match="already has recordings"):
        fetch(elsewhere.paths, str(tree.root))


def edit_text(name, old, new):
    def change(tree):
        text = (tree / name).read_text()
        assert old in text
        (tree / name).write_text(text.replace(old, new))

    return change


def named(**cells):
    return lambda tree: edit_rows(tree, lambda rows: rows[0].update(cells))


#: What an attacker may try, hashes being right, and what is said.
ATTACKS = {
    "archive: lacks one": (lambda t: repack(t, lambda p: p.pop()), "lacks a recording .*audio/s2"),
    "archive: other audio": (
        lambda t: repack(t, lambda p: p.__setitem__(0, (p[0][0], p[1][1]))),
        "is not the one of SHA256SUMS",
    ),
    "table: parent": (named(file="../../evil.wav"), "leaves its folder"),
    "table: other hash": (named(sha256="0" * 64), "bytes are not those that were recorded"),
    "table: twice": (lambda t: edit_rows(t, lambda rows: rows.append(rows[0])), "2 rows share"),
    "session: parent": (
        edit_text("sessions/s1/session.yaml", "file: excitation.wav", "file: ../../README.md"),
        "leaves its folder",
    ),
    "session: audio elsewhere": (
        edit_text("sessions/s1/session.yaml", "session_id: s1", "session_id: s1\naudio_root: /etc"),
        "audio_root leaves the folder",
    ),
    "declaration: of a file elsewhere": (
        edit_text("dataset.yaml", "title:", "from: secret\ntitle:"),
        "is derived from another",
    ),
}


@pytest.mark.parametrize("name", ATTACKS)
def test_attacks_are_refused_in_one_line_and_nothing_is_changed(tree, elsewhere, snapshot, name):
    change, said = ATTACKS[name]
    change(tree)
    reseal(tree)
    before = snapshot(elsewhere.root)
    with pytest.raises(DataError, match=said) as caught:
        fetch(elsewhere.paths, str(tree.root))
    assert "\n" not in str(caught.value)
    assert snapshot(elsewhere.root) == before


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("{0}  ../evil", "'../evil' leaves the folder"),
        ("{0}  sessions/../../x/session.yaml", "leaves the folder"),
        ("{0}  C:\\\\evil", "leaves the folder"),
    ],
)
def test_sums_are_not_believed(tree, server, elsewhere, line, said):
    with (tree / tree.SUMS).open("a") as sums:
        sums.write(line.format("0" * 64) + "\n")
    with pytest.raises(DataError, match=said):
        fetch(elsewhere.paths, address(server))
    assert set(server.requests) == {tree.SUMS}


def test_what_is_no_published_data_set_is_one_line(elsewhere, tmp_path):
    with pytest.raises(DataError, match="has no SHA256SUMS: not a published data set"):
        fetch(elsewhere.paths, str(tmp_path))


def test_an_archive_that_unpacks_to_too_much_is_refused(tree, elsewhere, monkeypatch):
    monkeypatch.setattr(archive, "MAX_BYTES", 1000)
    with pytest.raises(DataError, match=r"audio.zip: .*unpacks to"):
        fetch(elsewhere.paths, str(tree.root))
    assert list(elsewhere.paths.datasets.iterdir()) == []
