"""Public recordings by name: every byte right and imported, or one line and nothing imported."""

import http.server
import socket
import stat
import threading
from collections import Counter
from functools import partial
from pathlib import Path

import pytest
import yaml
from git_mirror import Mirror, git, sound
from test_fetch import Handler
from typer.testing import CliRunner

from ajgdata.cli import app
from ajgdata.paths import Paths, brought
from ajgdata.pipeline.fetch import fetch_source
from ajgdata.pipeline.plan import plan
from ajgdata.store import git_folders, sources
from ajgdata.store.audio import file_sha256
from ajgdata.store.sessions import list_sessions, read_recordings
from ajgdata.types import DataError, Source

ADDRESS = "https://example.org/lab/hits"
NAMES = [f"hits/{n}_{label}.wav" for n, label in enumerate(("metal", "desk") * 3, start=1)]


@pytest.fixture
def paths(tmp_path, monkeypatch):
    monkeypatch.setenv("AJGDATA_CACHE", str(tmp_path / "cache"))
    made = Paths(tmp_path / "project")
    made.dataset("hits").parent.mkdir(parents=True)
    declared = {
        "name": "hits", "licence": "none stated", "url": ADDRESS,
        "audio": {"sample_rate_hz": 8000}, "targets": {"label": {"kind": "classification"}},
        "tasks": {"label": {"target": "label"}}, "imports": {"pattern": "starter-kit"},
    }  # fmt: skip
    made.dataset("hits").write_text(yaml.safe_dump(declared))
    return made


@pytest.fixture
def mirror(tmp_path):
    return Mirror(tmp_path / "mirror", ADDRESS)


@pytest.fixture
def files(tmp_path):
    return {name: sound(tmp_path, name, 8000) for name in NAMES}


def declare(paths: Paths, origin: dict, **keys: object) -> None:
    content = {"status": "not yet run", "size_mb": 0.1, "origin": origin, **keys}
    paths.source("hits").write_text(yaml.safe_dump(content))


def of_git(paths: Paths, *parts: dict) -> None:
    declare(paths, {"kind": "git", "repository": ADDRESS, "parts": list(parts)})


def held(paths: Paths) -> dict[str, bytes]:
    """The bytes of what is brought, by name."""
    root = brought("hits")
    found = (path for path in root.rglob("*") if path.is_file() and path.name[0] != ".")
    return {path.relative_to(root).as_posix(): path.read_bytes() for path in found}


def test_the_folder_of_a_commit_and_nothing_else(paths, mirror, files):
    first = mirror.commit({**files, "paper/large.pdf": b"%PDF" * 1000})
    again = mirror.commit({"hits/1_metal.wav": files["hits/2_desk.wav"]})
    of_git(
        paths,
        {"commit": first, "folder": "hits", "into": "day1"},
        {"commit": again, "folder": "hits", "into": "day2/x"},
    )
    _, result = fetch_source(paths, "hits", mirror=mirror.url)
    assert (result.sessions, result.added) == (2, 12)
    day1 = {name.replace("hits/", "day1/"): content for name, content in files.items()}
    day2 = {name.replace("hits/", "day2/x/"): content for name, content in files.items()}
    assert held(paths) == day1 | day2 | {"day2/x/1_metal.wav": files["hits/2_desk.wav"]}
    rows, _ = read_recordings(paths.session("hits", "day1"))
    assert {row.labels["label"] for row in rows} == {"metal", "desk"}
    assert not list(paths.data.rglob("*.wav"))  # they are referred to, where they were brought


def test_copies_on_request(paths, mirror, files):
    of_git(paths, {"commit": mirror.commit(files)})
    fetch_source(paths, "hits", mirror=mirror.url, copy=True)
    assert len(list(paths.data.rglob("*.wav"))) == len(files)


def test_no_object_outside_the_folder_is_downloaded(paths, mirror, files):
    """Of a commit with 200 other files: only the files of the folder."""
    deep = {f"data/day1/{name}": content for name, content in files.items()}
    aside = {f"{top}/d{n}/x.txt": b"%d" % n for top in ("paper", "data/old") for n in range(100)}
    of_git(paths, {"commit": mirror.commit(deep | aside), "folder": "data/day1"})
    fetch_source(paths, "hits", mirror=mirror.url)
    assert held(paths) == files
    objects = brought("hits").with_name("hits.git")
    listed = git(objects, "cat-file", "--batch-all-objects", "--batch-check=%(objecttype)")
    assert Counter(listed.split())["blob"] == len(files)


def test_an_interrupted_transfer_resumes_at_the_next_part(paths, mirror, files):
    commit = mirror.commit({**files, "more/7_desk.wav": files[NAMES[1]]})
    parts = [{"commit": commit, "folder": name, "into": name} for name in ("hits", "more")]
    of_git(paths, *parts)

    def interrupted(names):
        yield names[0]
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fetch_source(paths, "hits", mirror=mirror.url, each=interrupted)
    assert held(paths) == files
    assert not paths.data.exists()
    written = {path: path.stat().st_mtime_ns for path in brought("hits").rglob("*.wav")}
    for stale in ("shallow.lock", "more.index.lock"):  # of a git that was killed
        (brought("hits").with_name("hits.git") / stale).touch()
    fetch_source(paths, "hits", mirror=mirror.url)
    assert held(paths) == files | {"more/7_desk.wav": files[NAMES[1]]}
    assert {path: path.stat().st_mtime_ns for path in written} == written


def test_a_second_time_needs_no_network_and_mends_what_was_changed(paths, mirror, files):
    of_git(paths, {"commit": mirror.commit(files)})
    fetch_source(paths, "hits", mirror=mirror.url)
    (brought("hits") / NAMES[0]).write_bytes(b"changed")
    (brought("hits") / NAMES[1]).unlink()
    _, result = fetch_source(paths, "hits", mirror="file:///nowhere")
    assert (result.unchanged, result.conflicts) == (len(files), [])
    assert held(paths) == files


def test_bytes_are_taken_as_they_are(paths, mirror, files, monkeypatch, tmp_path):
    """Neither what the repository asks of git nor what its reader does changes a byte."""
    (tmp_path / "config").write_text(
        '[core]\n\tautocrlf = true\n[filter "lfs"]\n\tsmudge = tr a b\n\trequired = true\n'
    )
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", str(tmp_path / "config"))
    more = {"notes.csv": b"a,b\n1,2\n", "a.txt": b"aaa\n"}
    rules = {".gitattributes": b"*.csv text eol=crlf\n*.txt filter=lfs\n"}
    of_git(paths, {"commit": mirror.commit(files | more | rules)})
    fetch_source(paths, "hits", mirror=mirror.url)
    assert held(paths) == files | more


def test_a_link_of_the_repository_leads_nowhere(paths, mirror, files, tmp_path):
    (tmp_path / "secret.wav").write_bytes(b"secret")
    mirror.commit(files)
    (mirror.repository / "hits" / "7_desk.wav").symlink_to(tmp_path / "secret.wav")
    of_git(paths, {"commit": mirror.commit({})})
    _, result = fetch_source(paths, "hits", mirror=mirror.url)
    assert [name for name, _ in result.unreadable] == ["7_desk.wav"]
    assert not (brought("hits") / "hits" / "7_desk.wav").is_symlink()


def refused(paths: Paths, mirror: str) -> str:
    """The line that says why nothing was imported."""
    with pytest.raises(DataError) as refusal:
        fetch_source(paths, "hits", mirror=mirror)
    assert not list_sessions(paths, "hits")
    assert "\n" not in str(refusal.value)
    return str(refusal.value)


def test_what_is_not_there_is_said_in_a_line(paths, mirror, files, monkeypatch):
    commit = mirror.commit(files)
    of_git(paths, {"commit": commit, "folder": "hots"})
    assert f"commit {commit[:12]} has no folder 'hots'" in refused(paths, mirror.url)
    of_git(paths, {"commit": commit, "folder": NAMES[0]})
    assert f"commit {commit[:12]} has no folder '{NAMES[0]}'" in refused(paths, mirror.url)
    of_git(paths, {"commit": "0123456789" * 4})
    assert "the server does not have this commit" in refused(paths, mirror.url)
    assert "does not appear to be a git repository" in refused(paths, f"{mirror.url}/elsewhere")
    assert "check the network" in refused(paths, "http://127.0.0.1:1")
    monkeypatch.setenv("PATH", "")
    assert "install git" in refused(paths, mirror.url)


SERVERS = {
    "forbidden": ("error: Server does not allow request for unadvertised object 0123",
                  "the server does not send single commits"),
    "certificate": ("fatal: unable to access 'https://x/': SSL certificate problem: self-signed",
                    "correct the cause that git names"),
    "owner": ("fatal: detected dubious ownership in repository at '/srv/x'\nfatal: Could not read "
              "from remote repository.", "correct the cause that git names"),
}  # fmt: skip


@pytest.mark.parametrize("name", SERVERS)
def test_a_failure_is_quoted_whole_and_not_guessed_at(paths, mirror, monkeypatch, tmp_path, name):
    """A stand-in for git prints what git prints then."""
    of_git(paths, {"commit": "0" * 40})
    text, fix = SERVERS[name]
    stand_in_for_git(tmp_path, monkeypatch, text)
    line = refused(paths, mirror.url)
    assert f": git failed ({text.replace(chr(10), '; ')}); {fix}" in line


def stand_in_for_git(folder: Path, monkeypatch, text: str) -> None:
    program = folder / "bin" / "git"
    program.parent.mkdir()
    (folder / "text").write_text(text)
    program.write_text(f"#!/bin/sh\n/bin/cat '{folder}/text' >&2\nexit 128\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", str(program.parent))


def test_changed_bytes_are_not_imported(paths, mirror, files):
    of_git(paths, {"commit": mirror.commit(files)})
    objects = sorted(mirror.repository.glob(".git/objects/??/*"))
    for path in objects:  # each holds one file, folder or commit
        if path.stat().st_size > 500:
            path.chmod(0o600)
            content = bytearray(path.read_bytes())
            content[-20] ^= 1
            path.write_bytes(content)
    refused(paths, mirror.url)
    assert not held(paths)


def test_a_full_disk_is_said_with_a_way_out(paths, mirror, files, monkeypatch, tmp_path):
    of_git(paths, {"commit": mirror.commit(files)})
    stand_in_for_git(tmp_path, monkeypatch, "fatal: write error: No space left on device\n")
    assert "set AJGDATA_CACHE to a folder on another disk" in refused(paths, mirror.url)


def test_a_server_that_never_answers_cannot_block(paths, monkeypatch):
    monkeypatch.setattr(git_folders, "MAX_S", 1.0)
    of_git(paths, {"commit": "0" * 40})
    with socket.create_server(("127.0.0.1", 0)) as silent:
        line = refused(paths, f"http://127.0.0.1:{silent.getsockname()[1]}")
    assert "git took longer than " in line


@pytest.fixture
def server(tmp_path, files):
    """A host of single files, in the layout of `ADDRESS`."""
    root = tmp_path / "host"
    for name, content in files.items():
        path = root / "lab/hits" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    handler = partial(Handler, directory=str(root))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as made:
        made.asked, made.cut, made.moved = [], {}, {}
        made.root = root / "lab/hits"
        made.url = f"http://127.0.0.1:{made.server_address[1]}"
        thread = threading.Thread(target=made.serve_forever, args=(0.02,))
        thread.start()
        yield made
        made.shutdown()
        thread.join()


def of_files(paths: Paths, server) -> None:
    hashes = {name: file_sha256(server.root / name) for name in NAMES}
    declare(paths, {"kind": "files", "address": ADDRESS, "files": hashes})


def test_single_files_by_their_hashes(paths, server, files, monkeypatch):
    of_files(paths, server)
    server.cut[f"lab/hits/{NAMES[2]}"] = 700
    monkeypatch.setattr(sources, "Download", partial(sources.Download, retries=0))
    assert "complete files are kept" in refused(paths, server.url)
    server.asked.clear()
    _, result = fetch_source(paths, "hits", mirror=server.url)
    assert (result.added, held(paths)) == (len(files), files)
    assert [name.removeprefix("lab/hits/") for name in server.asked] == NAMES[2:]


@pytest.mark.parametrize("what", ["changed", "missing"])
def test_a_single_file_that_is_wrong_is_named(paths, server, what):
    of_files(paths, server)
    if what == "changed":
        (server.root / NAMES[1]).write_bytes(b"other")
    else:
        (server.root / NAMES[1]).unlink()
    assert Path(NAMES[1]).name in refused(paths, server.url)


def test_the_licence_comes_first_and_the_next_step_last(paths, mirror, files, monkeypatch):
    of_git(paths, {"commit": mirror.commit(files)})
    monkeypatch.setenv("AJGDATA_ROOT", str(paths.root))
    monkeypatch.setenv("AJGDATA_MIRROR", mirror.url)
    done = CliRunner().invoke(app, ["fetch", "hits"])
    lines = done.output.splitlines()
    assert done.exit_code == 0, done.output
    assert lines[0] == "licence: none stated; do not hand them on"
    assert "not yet run: declared from the list of its files only" in lines
    assert "6 added, 0 changed, 0 unchanged in 1 session(s) of hits" in lines
    assert lines[-1] == "next: ajgdata run hits"


def test_another_name_is_told_which_there_are(paths, monkeypatch):
    of_git(paths, {"commit": "0" * 40})
    monkeypatch.setenv("AJGDATA_ROOT", str(paths.root))
    done = CliRunner().invoke(app, ["fetch", "hit"])
    assert done.exit_code
    assert "public recordings (hits)" in str(done.exception)


def test_what_nobody_fetched_is_not_in_the_plan(paths, mirror, files):
    of_git(paths, {"commit": mirror.commit(files)})
    with pytest.raises(DataError, match="no data set here has recordings"):
        plan(paths)
    fetch_source(paths, "hits", mirror=mirror.url)
    assert list(plan(paths)) == ["hits"]


@pytest.mark.parametrize(
    "wrong",
    [
        {"into": "../x"}, {"into": "/x"}, {"folder": "a//b"}, {"folder": ".git"}, {"into": "a\\b"},
        {"commit": "abc"}, {"branch": "main"},
    ],
)  # fmt: skip
def test_a_part_stays_inside_and_names_its_commit(wrong):
    part = {"commit": "0" * 40, **wrong}
    origin = {"kind": "git", "repository": ADDRESS, "parts": [part]}
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Source.model_validate({"status": "not yet run", "size_mb": 1, "origin": origin})


def test_two_parts_do_not_share_a_folder():
    parts = [{"commit": "0" * 40, "folder": name} for name in "ab"]
    origin = {"kind": "git", "repository": ADDRESS, "parts": parts}
    with pytest.raises(ValueError, match="into one folder"):
        Source.model_validate({"status": "not yet run", "size_mb": 1, "origin": origin})


def test_the_cache_is_outside_of_every_project(monkeypatch):
    monkeypatch.delenv("AJGDATA_CACHE", raising=False)
    assert brought("x").parts[-2:] == ("sources", "x")
    assert brought("x").is_relative_to(Path.home())
