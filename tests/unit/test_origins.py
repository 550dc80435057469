"""Fetching from a DOI and from git: requests to a stand-in, equal bytes, one line per failure."""

import json
import subprocess
import zipfile
from contextlib import contextmanager

import pytest
from hosts import send_to, serving
from published import flip, remake
from worlds import Project, assert_one_line

from ajgdata.paths import Paths
from ajgdata.pipeline.dataset_versions import read_version
from ajgdata.pipeline.fetch import fetch
from ajgdata.store.remote.origins import (
    Deposit,
    GitRepository,
    HubRepository,
    WebFolder,
    origin_of,
)
from ajgdata.types import DataError

DOI = "10.5281/zenodo.42"


@pytest.fixture
def elsewhere(tmp_path):
    """Another project, in which there is no data set yet."""
    (tmp_path / "elsewhere" / "datasets").mkdir(parents=True)
    return Project(Paths(tmp_path / "elsewhere"))


def test_each_address_has_its_origin():
    expected = {
        "folder/d": None,
        "https://example.org/d": WebFolder("https://example.org/d"),
        "https://example.org/d/SHA256SUMS": WebFolder("https://example.org/d/"),
        f"doi:{DOI}": Deposit(DOI),
        f"https://doi.org/{DOI}": Deposit(DOI),
        "hf:user/name": HubRepository("user/name"),
        "hf:user/name@v1.0": HubRepository("user/name", "v1.0"),
        "https://example.org/d.git": GitRepository("https://example.org/d.git"),
        "git@example.org:d": GitRepository("git@example.org:d"),
        "git+file:///srv/d": GitRepository("file:///srv/d"),
    }
    assert {text: origin_of(text) for text in expected} == expected


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("ftp://example.org/d", "ftp:// are not supported"),
        ("doi:zenodo.42", "is not a DOI"),
        (f"doi:{DOI}/../../x", "is not a DOI"),
        ("hf:name", "is not a repository"),
        ("hf:../name/x", "is not a repository"),
    ],
)
def test_an_address_with_a_mistake_is_one_line(text, said):
    with pytest.raises(DataError, match=said):
        origin_of(text)


SECRET = "c0ffee"


@pytest.mark.parametrize(
    "address",
    [
        f"ftp://anna:{SECRET}@127.0.0.1/d",
        f"http://anna:{SECRET}@127.0.0.1:9/d",
        f"http://127.0.0.1:9/d?time=1:00&sig={SECRET}&x=",
        f"git+http://anna:{SECRET}@127.0.0.1:9/d.git",
        f"git+file:///absent?sig={SECRET}",
    ],
)
def test_a_password_in_an_address_is_in_no_message_and_in_no_file(elsewhere, monkeypatch, address):
    works = []

    @contextmanager
    def locked(path, work, *_, **__):
        works.append(work)
        yield

    monkeypatch.setattr("ajgdata.pipeline.fetch.locked", locked)
    with pytest.raises(DataError) as caught:
        fetch(elsewhere.paths, address)
    assert SECRET not in f"{caught.value} {works}"


@pytest.fixture
def zenodo(tree, monkeypatch):
    """A stand-in for doi.org and zenodo.org with the deposit of a published data set."""
    files = {path.name: path.read_bytes() for path in tree.root.iterdir() if path.is_file()}
    archive = tree.root.parent / "folders.zip"
    with zipfile.ZipFile(archive, "w") as packed:
        for path in sorted((tree.root / "sessions").rglob("*")):
            packed.write(path, path.relative_to(tree.root))
    files["folders.zip"] = archive.read_bytes()

    def answer(method, path, headers, body):
        assert (method, body) == ("GET", b"")
        assert "Authorization" not in headers
        if path == f"/doi.org/{DOI}":
            return 302, {"Location": "https://zenodo.org/records/42"}, b""
        if path == "/zenodo.org/records/42":
            return 200, {}, b"page"
        if path == "/zenodo.org/api/records/42":
            keys = [
                {"key": name, "links": {"self": f"https://zenodo.org/api/records/42/files/{name}"}}
                for name in files
            ]
            return 200, {"Content-Type": "application/json"}, json.dumps({"files": keys}).encode()
        name = path.removeprefix("/zenodo.org/api/records/42/files/")
        return (200, {}, files[name]) if name in files else (404, {}, b"")

    with serving(answer) as server:
        server.files = files
        send_to(server.address, monkeypatch)
        yield server


def test_a_doi_gives_the_same_features_on_another_machine(world, zenodo, elsewhere):
    assert fetch(elsewhere.paths, f"doi:{DOI}").recordings == 12
    remake(elsewhere)
    original = world[0].paths.features("d").read_bytes()
    assert elsewhere.paths.features("d").read_bytes() == original
    folders = "/zenodo.org/api/records/42/files/folders.zip"
    assert [path for _, path in zenodo.requests].count(folders) == 1
    assert not any("features.nc" in path for _, path in zenodo.requests)


def test_a_version_with_a_doi_is_compared_without_its_recordings(world, zenodo):
    assert read_version(f"doi:{DOI}") == read_version(str(world[1].root))
    assert not any("audio.zip" in path for _, path in zenodo.requests)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda files: files.pop("folders.zip"), r"folders.zip: cannot be fetched"),
        (lambda files: files.update({"folders.zip": b"no archive"}), "damaged or lacks a file"),
        (lambda files: files.update({"audio.zip": b"others"}), "audio.zip: cannot be fetched"),
        (lambda files: files.pop("SHA256SUMS"), "SHA256SUMS.* not found in data archive"),
    ],
)
def test_a_deposit_with_an_error_is_one_line_and_nothing_is_changed(
    zenodo, elsewhere, snapshot, change, said
):
    change(zenodo.files)
    with pytest.raises(DataError, match=said) as caught:
        fetch(elsewhere.paths, f"doi:{DOI}")
    assert "\n" not in str(caught.value)
    assert not elsewhere.paths.data.exists()
    assert not elsewhere.paths.dataset("d").exists()


def test_an_unknown_doi_is_one_line(zenodo, elsewhere):
    with pytest.raises(DataError, match=r"doi:10.5281/zenodo.43/SHA256SUMS: cannot be fetched"):
        fetch(elsewhere.paths, "doi:10.5281/zenodo.43")


@pytest.fixture
def repository(tree):
    """A git repository with the published data set, as its author commits it."""
    git = ("git", "-c", "user.name=A", "-c", "user.email=a@example.org", "-C", str(tree.root))
    for words in (("init", "--quiet"), ("add", "--all"), ("commit", "--quiet", "-m", "data")):
        subprocess.run([*git, *words], check=True, capture_output=True)
    return f"git+file://{tree.root}"


def test_a_git_repository_gives_the_same_sessions(world, repository, elsewhere, ajgdata):
    assert fetch(elsewhere.paths, repository).recordings == 12
    audio = elsewhere.folder("s1") / "audio"
    assert len(list(audio.iterdir())) == 6
    assert read_version(repository) == read_version(str(world[1].root))
    origin_of(repository).download(elsewhere.root / "cloned", "SHA256SUMS")
    assert not (elsewhere.root / "cloned/.git").exists()  # its settings have the address


def test_git_failures_are_one_line(tree, repository, elsewhere, ajgdata, monkeypatch):
    monkeypatch.chdir(elsewhere.root)
    with pytest.raises(DataError, match="git failed"):
        fetch(elsewhere.paths, f"{repository}-absent")
    with pytest.raises(DataError, match=r"git failed .*transport 'ext' not allowed"):
        fetch(elsewhere.paths, "git+ext::sh -c touch% pwned")
    assert not (elsewhere.root / "pwned").exists()
    git = ("git", "-c", "user.name=A", "-c", "user.email=a@example.org", "-C", str(tree.root))
    flip(tree / tree.ARCHIVE)
    subprocess.run([*git, "commit", "--quiet", "-am", "other"], check=True, capture_output=True)
    code, out, err = ajgdata("fetch", repository)
    assert (code, out) == (1, "")
    assert_one_line(err, "its bytes are not those of SHA256SUMS")
    (tree / tree.ARCHIVE).write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\n")
    subprocess.run([*git, "commit", "--quiet", "-am", "lfs"], check=True, capture_output=True)
    with pytest.raises(DataError, match=r"stores audio.zip with Git LFS. Install git-lfs"):
        fetch(elsewhere.paths, repository)
    assert not elsewhere.paths.data.exists()
