"""Public recordings by name: every byte right and imported, or one line and nothing imported."""

import hashlib
import os
import subprocess
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
import soundfile
import yaml

from ajgdata.paths import Paths, public_recordings
from ajgdata.pipeline.fetch import fetch_source
from ajgdata.store.sessions import list_sessions, read_recordings
from ajgdata.types import DataError, DatasetSource

NOBODY = {"GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_NOSYSTEM": "1"} | {
    f"GIT_{who}_{what}": "nobody@example.org"
    for who in ("AUTHOR", "COMMITTER")
    for what in ("NAME", "EMAIL")
}


def git(folder: Path, *words: str) -> str:
    done = subprocess.run(
        ["git", *words],
        cwd=folder,
        env=os.environ | NOBODY,
        check=True,
        capture_output=True,
        text=True,
    )
    return done.stdout.strip()


class Mirror:
    """A folder whose `file://` address stands for a host, with the repository of `address`."""

    def __init__(self, folder: Path, address: str) -> None:
        self.url = folder.as_uri()
        self.repository = folder / urlsplit(address).path.strip("/")
        self.repository.mkdir(parents=True)
        git(self.repository, "init", "-q", ".")
        for setting in ("allowFilter", "allowAnySHA1InWant"):  # as public hosts do
            git(self.repository, "config", f"uploadpack.{setting}", "true")

    def commit(self, files: dict[str, bytes]) -> str:
        """Return the hash of a commit with `files` over those of the last one."""
        for name, content in files.items():
            path = self.repository / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        git(self.repository, "add", "--all")
        git(self.repository, "commit", "-q", "-m", "more")
        return git(self.repository, "rev-parse", "HEAD")


def sound(folder: Path, name: str, rate_hz: int, channels: int = 1) -> bytes:
    """Return the bytes of a short recording that no other `name` has."""
    seed = int.from_bytes(hashlib.sha256(name.encode()).digest()[:4], "big")
    samples = 0.1 * np.random.default_rng(seed).standard_normal((800, channels))
    path = folder / f"one{Path(name).suffix}"
    soundfile.write(path, samples, rate_hz)
    return path.read_bytes()


HOST = "https://example.org/"
ADDRESS = f"{HOST}lab/hits"
NAMES = [f"hits/{n}_{label}.wav" for n, label in enumerate(("metal", "desk") * 3, start=1)]


@pytest.fixture
def paths(tmp_path, monkeypatch):
    monkeypatch.setenv("AJGDATA_CACHE", str(tmp_path / "cache"))
    folders = Paths(tmp_path / "project")
    folders.dataset("hits").parent.mkdir(parents=True)
    declared = {
        "name": "hits",
        "licence": "none stated",
        "url": ADDRESS,
        "audio": {"sample_rate_hz": 8000},
        "targets": {"label": {"kind": "classification"}},
        "tasks": {"label": {"target": "label"}},
        "imports": {"pattern": "starter-kit"},
    }
    folders.dataset("hits").write_text(yaml.safe_dump(declared))
    return folders


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
    declare(paths, {"repository": ADDRESS, "parts": list(parts)})


def held(paths: Paths) -> dict[str, bytes]:
    """The bytes of the downloaded files, by name."""
    root = public_recordings("hits")
    members = (path for path in root.rglob("*") if path.is_file() and path.name[0] != ".")
    return {path.relative_to(root).as_posix(): path.read_bytes() for path in members}


@pytest.fixture
def fetched_from(paths, monkeypatch):
    """Return a function that fetches from an address that stands for that of the source."""

    def fetch_from(address: str):
        for name, value in (
            ("COUNT", "1"),
            ("KEY_0", f"url.{address}/.insteadOf"),
            ("VALUE_0", HOST),
        ):
            monkeypatch.setenv(f"GIT_CONFIG_{name}", value)
        return fetch_source(paths, "hits")

    return fetch_from


def test_the_folder_of_a_commit_and_nothing_else(paths, mirror, files, fetched_from):
    first = mirror.commit({**files, "paper/large.pdf": b"%PDF" * 1000})
    again = mirror.commit({"hits/1_metal.wav": files["hits/2_desk.wav"]})
    of_git(
        paths,
        {"commit": first, "folder": "hits", "into": "day1"},
        {"commit": again, "folder": "hits", "into": "day2/x"},
    )
    result = fetched_from(mirror.url)
    assert (result.sessions, result.added) == (2, 12)
    day1 = {name.replace("hits/", "day1/"): content for name, content in files.items()}
    day2 = {name.replace("hits/", "day2/x/"): content for name, content in files.items()}
    assert held(paths) == day1 | day2 | {"day2/x/1_metal.wav": files["hits/2_desk.wav"]}
    rows, _ = read_recordings(paths.session("hits", "day1"))
    assert {row.labels["label"] for row in rows} == {"metal", "desk"}
    assert not list(paths.data.rglob("*.wav"))  # the table refers to the downloaded files


def test_a_second_time_needs_no_network_and_mends_what_was_changed(
    paths, mirror, files, fetched_from
):
    of_git(paths, {"commit": mirror.commit(files)})
    fetched_from(mirror.url)
    (public_recordings("hits") / NAMES[0]).write_bytes(b"changed")
    (public_recordings("hits") / NAMES[1]).unlink()
    result = fetched_from("file:///nowhere")
    assert result.unchanged == len(files)
    assert held(paths) == files


def test_what_is_not_there_is_said_in_a_line(paths, mirror, files, fetched_from, monkeypatch):
    def refused(address: str) -> str:
        with pytest.raises(DataError) as refusal:
            fetched_from(address)
        assert not list_sessions(paths, "hits")
        assert "\n" not in str(refusal.value)
        return str(refusal.value)

    commit = mirror.commit(files)
    of_git(paths, {"commit": commit, "folder": "hots"})
    assert "git failed" in refused(mirror.url)
    of_git(paths, {"commit": "0123456789" * 4})
    assert "not our ref" in refused(mirror.url)
    assert "git failed" in refused("http://127.0.0.1:1")
    monkeypatch.setenv("PATH", "")
    assert "Install git" in refused(mirror.url)


@pytest.mark.parametrize(
    "wrong",
    [
        {"into": "../x"},
        {"folder": ".git"},
        {"commit": "abc"},
    ],
)
def test_a_part_stays_inside_and_names_its_commit(wrong):
    part = {"commit": "0" * 40, **wrong}
    origin = {"repository": ADDRESS, "parts": [part]}
    with pytest.raises(ValueError, match=next(iter(wrong))):
        DatasetSource.model_validate({"status": "not yet run", "size_mb": 1, "origin": origin})
