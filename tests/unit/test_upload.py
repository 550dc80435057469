"""`ajgdata publish --to`: stand-ins for Zenodo and Hugging Face check all requests and bytes."""

import base64
import hashlib
import io
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from hosts import send_to, serving
from published import make_project, remake
from worlds import Project, assert_one_line

from ajgdata.paths import Paths
from ajgdata.pipeline.fetch import fetch
from ajgdata.pipeline.upload import add_doi
from ajgdata.store.remote.zenodo import Zenodo
from ajgdata.types import DataError

TOKEN = "not-a-secret"
DOI = "10.5281/zenodo.42"


@pytest.fixture
def project(tmp_path):
    return make_project(tmp_path / "project")


@pytest.fixture
def elsewhere(tmp_path):
    """Another project, in which there is no data set yet."""
    (tmp_path / "elsewhere" / "datasets").mkdir(parents=True)
    return Project(Paths(tmp_path / "elsewhere"))


class ZenodoStandIn:
    """Deposits as in Zenodo's documentation; refuses any other request."""

    def __init__(self) -> None:
        self.address = ""
        self.deposits: dict[str, dict] = {}
        self.metadata: dict[str, dict] = {}
        self.damaged: set[str] = set()
        self.fails_at = ""
        self.submitted = False

    def answer(self, method, path, headers, body):
        if path.startswith(("/doi.org", "/zenodo.org")):
            return self.public(method, path)
        assert headers["Authorization"] == f"Bearer {TOKEN}"
        assert TOKEN not in path
        if (method, path) == ("POST", "/api/deposit/depositions"):
            assert json.loads(body) == {}
            self.deposits["42"] = {}
            return self.deposit("42", 201)
        match = re.fullmatch(r"/api/deposit/depositions/(\d+)", path)
        if match and match[1] not in self.deposits:
            return 404, {}, b'{"message": "PID does not exist."}'
        if match and method == "PUT":
            assert headers["Content-Type"] == "application/json"
            self.metadata[match[1]] = json.loads(body)["metadata"]
        if match and method in ("GET", "PUT"):
            return self.deposit(match[1], 200)
        match = re.fullmatch(r"/api/files/bucket-(\d+)/([\w.-]+)", path)
        assert match and method == "PUT", f"{method} {path}"
        if match[2] == self.fails_at:
            return 503, {}, b'{"message": "try later"}'
        assert int(headers["Content-Length"]) == len(body) > 0
        kept = body[:-1] if match[2] in self.damaged else body
        self.deposits[match[1]][match[2]] = kept
        checksum = f"md5:{hashlib.md5(kept).hexdigest()}"
        return 201, {}, json.dumps({"key": match[2], "checksum": checksum}).encode()

    def deposit(self, number, status):
        files = [
            {"filename": name, "checksum": hashlib.md5(content).hexdigest()}
            for name, content in self.deposits[number].items()
        ]
        content = {
            "id": int(number),
            "submitted": self.submitted,
            "links": {
                "bucket": f"{self.address}/api/files/bucket-{number}",
                "html": f"{self.address}/uploads/{number}",
            },
            "metadata": {"prereserve_doi": {"doi": f"10.5281/zenodo.{number}"}},
            "files": files,
        }
        return status, {"Content-Type": "application/json"}, json.dumps(content).encode()

    def public(self, method, path):
        """The record after a person pressed Publish."""
        assert method == "GET"
        files = self.deposits["42"]
        if path == f"/doi.org/{DOI}":
            return 302, {"Location": "https://zenodo.org/records/42"}, b""
        if path == "/zenodo.org/api/records/42":
            base = "https://zenodo.org/api/records/42/files"
            keys = [{"key": name, "links": {"self": f"{base}/{name}"}} for name in files]
            return 200, {}, json.dumps({"files": keys}).encode()
        return 200, {}, files.get(path.rpartition("/")[2], b"page")


@pytest.fixture
def zenodo(monkeypatch):
    stand_in = ZenodoStandIn()
    with serving(stand_in.answer) as server:
        stand_in.address = server.address
        stand_in.requests = server.requests
        monkeypatch.setenv("ZENODO_ENDPOINT", server.address)
        monkeypatch.setenv("ZENODO_TOKEN", TOKEN)
        yield stand_in


def test_a_draft_has_a_doi_all_files_and_the_description_and_comes_back_equal(
    ajgdata, project, zenodo, elsewhere, monkeypatch
):
    declared = project.paths.dataset("d").read_text()
    code, out, err = ajgdata("publish", "d", "--to", "zenodo", "--yes")
    assert (code, TOKEN in out + err) == (0, False)
    assert project.paths.dataset("d").read_text() == f"{declared}doi: {DOI}\n"
    assert out.splitlines()[0] == f"reserved {DOI}, now in {project.paths.dataset('d')}"
    assert "check the draft and press Publish at " + zenodo.address + "/uploads/42" in out
    folder = project.paths.published("d")
    files = {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    sent = dict(zenodo.deposits["42"])
    assert sent.pop("folders.zip")
    assert sent == files
    assert DOI in (folder / "README.md").read_text()
    assert zenodo.metadata["42"] == {
        "upload_type": "dataset",
        "title": "Tones | <b>",
        "creators": [{"name": "A. Nobody"}],
        "description": "<p>Sines.</p><p>```python\nimport nothing\n```</p>",
        "access_right": "open",
        "license": "cc0-1.0",
        "version": "1.0.0",
        "keywords": ["acoustic sensing", "jamming gripper", "soft robotics", "tactile", "recorded"],
        "prereserve_doi": True,
        "publication_date": zenodo.metadata["42"]["publication_date"],
    }
    assert not any("publish" in path for _, path in zenodo.requests)
    send_to(zenodo.address, monkeypatch)
    assert fetch(elsewhere.paths, f"doi:{DOI}").recordings == 12
    remake(elsewhere)
    original = project.paths.features("d").read_bytes()
    assert elsewhere.paths.features("d").read_bytes() == original


def test_an_interrupted_upload_resumes_and_a_damaged_file_is_an_error(ajgdata, project, zenodo):
    zenodo.fails_at = "metadata.csv"
    code, _, err = ajgdata("publish", "d", "--to", "zenodo", "--yes")
    assert code == 1
    assert_one_line(err, "answers 503 (try later). Run it again: complete files are kept.")
    complete = set(zenodo.deposits["42"])
    assert {"LICENSE", "audio.zip"} <= complete
    zenodo.fails_at = ""
    zenodo.damaged = {"metadata.csv"}
    zenodo.requests.clear()
    code, _, err = ajgdata("publish", "d", "--to", "zenodo", "--yes")
    assert code == 1
    assert_one_line(err, "the server has other bytes of metadata.csv (MD5 differs)")
    sent = {path.rpartition("/")[2] for method, path in zenodo.requests if "/files/" in path}
    assert sent == {"metadata.csv"}
    zenodo.damaged = set()
    zenodo.deposits["42"]["paper.pdf"] = b"by a person"
    code, out, _ = ajgdata("publish", "d", "--to", "zenodo", "--yes")
    assert code == 0
    assert "also in the draft, from elsewhere: paper.pdf" in out


def declare(project, **keys):
    """Write the same declaration with other keys."""
    content = yaml.safe_load(project.paths.dataset("d").read_text())
    project.declare(**{**content, **keys})


@pytest.mark.parametrize(
    ("keys", "to", "said"),
    [
        ({}, "ftp:x", "--to: unknown destination 'ftp:x'. Use hf:USER/NAME or zenodo"),
        ({}, "hf:name", "hf:name: is not a repository. Use the form hf:USER/NAME"),
        ({"authors": []}, "zenodo", "has no authors, which Zenodo requires. Add `authors`"),
        ({"licence": "free"}, "zenodo", ""),
        ({"licence": "my own"}, "zenodo", "licence 'my own' is not an SPDX identifier"),
        ({"doi": "10.6084/m9.figshare.7"}, "zenodo", "is not of Zenodo. Remove `doi`"),
        ({"doi": "10.5281/zenodo.7"}, "zenodo", "there is no such draft in this account"),
    ],
)
def test_what_cannot_be_sent_is_one_line_before_anything_is_sent(
    ajgdata, project, zenodo, keys, to, said
):
    declare(project, **keys)
    code, _, err = ajgdata("publish", "d", "--to", to)
    assert code == 1  # also without a mistake: nobody can agree
    assert_one_line(err, said or "asks before it sends, and nobody can answer. Add --yes")
    assert [method for method, _ in zenodo.requests if method != "GET"] == []


class Answers(io.StringIO):
    """Lines that a person types."""

    def isatty(self) -> bool:
        return True


def test_a_person_sees_the_files_and_can_say_no(ajgdata, project, zenodo, monkeypatch):
    monkeypatch.setattr(sys, "stdin", Answers("n\n"))
    code, out, _ = ajgdata("publish", "d", "--to", "zenodo")
    assert (code, zenodo.requests) == (1, [])
    assert f"Create a draft at {zenodo.address}, and write its DOI into" in out
    monkeypatch.setattr(sys, "stdin", Answers("y\nn\n"))
    code, out, _ = ajgdata("publish", "d", "--to", "zenodo")
    assert code == 1
    assert re.search(r"^  audio\.zip +1 file +0\.1 MB$", out, re.M)
    assert re.search(r"Send \d+ files, \d\.\d MB to zenodo\?", out)
    assert zenodo.requests == [("POST", "/api/deposit/depositions")]
    monkeypatch.setattr(sys, "stdin", Answers("y\n"))
    assert ajgdata("publish", "d", "--to", "zenodo")[0] == 0  # the same draft
    assert list(zenodo.deposits) == ["42"]


def test_a_published_record_stays(ajgdata, project, zenodo):
    declare(project, doi=DOI)
    zenodo.deposits["42"] = {}
    zenodo.submitted = True
    code, _, err = ajgdata("publish", "d", "--to", "zenodo", "--yes")
    assert code == 1
    assert_one_line(err, "a published record cannot change. Press New version on its page")


def test_tokens_are_needed_and_never_sent_unencrypted(ajgdata, project, zenodo, monkeypatch):
    monkeypatch.setenv("ZENODO_ENDPOINT", "http://zenodo.org")
    assert_one_line(ajgdata("publish", "d", "--to", "zenodo")[2], "does not begin with https://")
    monkeypatch.setenv("ZENODO_ENDPOINT", zenodo.address)
    monkeypatch.delenv("ZENODO_TOKEN")
    err = ajgdata("publish", "d", "--to", "zenodo")[2]
    assert_one_line(err, "ZENODO_TOKEN: is not set. Create a token with the scope deposit:write")
    monkeypatch.setattr("huggingface_hub.get_token", lambda: None)
    err = ajgdata("publish", "d", "--to", "hf:user/name")[2]
    assert_one_line(err, "there is no token of Hugging Face. Run `hf auth login`, or set HF_TOKEN")
    assert zenodo.requests == []


def test_a_doi_is_added_as_one_line_or_not_at_all(tmp_path):
    path = tmp_path / "dataset.yaml"
    path.write_text("name: d\ntargets:\n  a: {kind: regression}  # last")
    add_doi(path, DOI)
    text = f"name: d\ntargets:\n  a: {{kind: regression}}  # last\ndoi: {DOI}\n"
    assert path.read_text() == text
    path.write_text("{name: d}\n")
    with pytest.raises(DataError, match=f"Add `doi: {DOI}` to it, then run it again"):
        add_doi(path, DOI)
    assert path.read_text() == "{name: d}\n"


@pytest.mark.parametrize("end", ["\r\n", ""])
def test_a_doi_keeps_the_line_ends_of_the_file(tmp_path, end):
    path = tmp_path / "dataset.yaml"
    path.write_bytes(f"name: d\r\ntitle: b{end}".encode())
    add_doi(path, DOI)
    assert path.read_bytes() == f"name: d\r\ntitle: b\r\ndoi: {DOI}\r\n".encode()
    path.write_bytes(b"{name: d}\r\n")
    with pytest.raises(DataError, match="is not stated here"):
        add_doi(path, DOI)
    assert path.read_bytes() == b"{name: d}\r\n"


def test_the_token_is_not_in_the_text_of_an_object():
    assert TOKEN not in repr(vars(Zenodo("https://zenodo.org", TOKEN)))


class HubStandIn:
    """One data set repository, with the requests of huggingface_hub; refuses any other request.

    Files with a suffix in LARGE are stored by Git LFS, as in the repositories of Hugging Face.
    """

    LARGE = (".wav", ".zip", ".nc", ".parquet", ".png")

    def __init__(self) -> None:
        self.address = ""
        self.files: dict[str, bytes] = {}
        self.objects: dict[str, bytes] = {}
        self.commits: list[str] = []
        self.exists = False
        self.is_private = False
        self.refused: list[str] = []
        self.damaged: dict[int, str] = {}  # a file by the number of the commit

    def answer(self, method, path, headers, body):
        path = path.partition("?")[0]
        if method in ("GET", "HEAD") and path.startswith("/datasets/user/name/resolve/"):
            return self.resolve(path)
        if path.startswith("/lfs/"):
            assert method == "PUT"
            assert hashlib.sha256(body).hexdigest() == path.removeprefix("/lfs/")
            self.objects[path.removeprefix("/lfs/")] = body
            return 200, {}, b""
        assert headers["Authorization"] == f"Bearer {TOKEN}"
        content = self.content(method, path, body)
        if content is None:
            self.refused.append(f"{method} {path}")
            return 404, {"X-Error-Code": "RepoNotFound"}, b"{}"
        return 200, {"Content-Type": "application/json"}, json.dumps(content).encode()

    def content(self, method, path, body):
        answer = None
        match method, path:
            case "POST", "/api/repos/create":
                request = json.loads(body)
                assert (request["name"], request["organization"]) == ("name", "user")
                assert request["type"] == "dataset"
                assert request.get("private") or request.get("visibility") == "private"
                self.is_private = self.is_private or not self.exists
                self.exists = True
                answer = {"url": f"{self.address}/datasets/user/name", "id": "user/name"}
            case "POST", "/api/validate-yaml":
                front = yaml.safe_load(json.loads(body)["content"].split("---\n")[1])
                assert front["license"] == "cc0-1.0"
                answer = {"errors": [], "warnings": []}
            case "POST", "/api/datasets/user/name/preupload/main":
                answer = {"files": [self.mode(file) for file in json.loads(body)["files"]]}
            case "POST", "/datasets/user/name.git/info/lfs/objects/batch":
                answer = {"objects": [self.batch(item) for item in json.loads(body)["objects"]]}
            case "POST", "/api/datasets/user/name/commit/main":
                self.commit([json.loads(line) for line in body.splitlines()])
                page = f"{self.address}/datasets/user/name/commit/0"
                answer = {"commitUrl": page, "commitOid": "0" * 40}
            case "GET", "/api/datasets/user/name" if self.exists:
                answer = {"id": "user/name", "private": self.is_private, "sha": "0" * 40}
            case "GET", _ if path.startswith("/api/datasets/user/name/tree/"):
                answer = [self.entry(name) for name in sorted(self.files)]
        return answer

    def mode(self, file):
        assert Path(file["path"]).name
        large = file["path"].endswith(self.LARGE)
        return {
            "path": file["path"],
            "uploadMode": "lfs" if large else "regular",
            "shouldIgnore": False,
            "oid": None,
        }

    def batch(self, item):
        stored = item["oid"] in self.objects
        actions = {"upload": {"href": f"{self.address}/lfs/{item['oid']}"}}
        return item if stored else {**item, "actions": actions}

    def commit(self, lines):
        for line in lines:
            value = line["value"]
            match line["key"]:
                case "header":
                    self.commits.append(value["summary"])
                case "file":
                    self.files[value["path"]] = base64.b64decode(value["content"])
                case "lfsFile":
                    assert value["algo"] == "sha256"
                    self.files[value["path"]] = self.objects[value["oid"]]
                case "deletedFile":
                    del self.files[value["path"]]
        if len(self.commits) in self.damaged:
            self.files[self.damaged[len(self.commits)]] = b"others"

    def entry(self, name):
        content = self.files[name]
        blob = hashlib.sha1(b"blob %d\0%s" % (len(content), content)).hexdigest()
        entry = {"type": "file", "path": name, "size": len(content), "oid": blob}
        if name.endswith(self.LARGE):
            sha256 = hashlib.sha256(content).hexdigest()
            entry["lfs"] = {"oid": sha256, "size": len(content), "pointerSize": 130}
        return entry

    def resolve(self, path):
        name = path.removeprefix("/datasets/user/name/resolve/").partition("/")[2]
        if name not in self.files:
            return 404, {"X-Error-Code": "EntryNotFound"}, b""
        content = self.files[name]
        tag = {"ETag": f'"{hashlib.sha256(content).hexdigest()}"', "X-Repo-Commit": "0" * 40}
        return 200, tag, content


@pytest.fixture
def hub(tmp_path):
    """The stand-in, and the environment of a program that uses it, with its real client."""
    stand_in = HubStandIn()
    with serving(stand_in.answer) as server:
        stand_in.address = server.address
        stand_in.requests = server.requests
        stand_in.environment = {
            **os.environ,
            "HF_ENDPOINT": server.address,
            "HF_TOKEN": TOKEN,
            "HF_HOME": str(tmp_path / "hf"),
            "HF_HUB_DISABLE_XET": "1",  # the protocol of xet needs servers of its own
            "HF_HUB_DISABLE_TELEMETRY": "1",
            "HF_HUB_DISABLE_PROGRESS_BARS": "1",
        }
        stand_in.environment.pop("HF_HUB_OFFLINE", None)
        yield stand_in


#: Runs several commands, each in a folder, and prints their exit codes, output and messages.
PROGRAM = """
import contextlib, io, json, os, sys
from ajgdata.cli import main
results = []
for folder, *words in json.load(sys.stdin):
    os.chdir(folder)
    sys.argv = ["ajgdata", *words]
    texts = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(texts[0]), contextlib.redirect_stderr(texts[1]):
        try:
            main()
        except SystemExit as ended:
            results.append([ended.code or 0, *(text.getvalue() for text in texts)])
print(json.dumps(results))
"""


def run(environment, *commands):
    """Run `ajgdata` several times in one process with the real client; return `PROGRAM`'s list."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        input=json.dumps([[str(folder), *words] for folder, *words in commands]),
        env=environment,
        check=False,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_a_repository_is_the_folder_and_comes_back_equal(project, hub, elsewhere):
    hub.files = {"audio/s1/old.wav": b"of an older version", "notes.txt": b"by a person"}
    hub.damaged = {2: "metadata.csv"}
    publish = (project.root, "publish", "d", "--to", "hf:user/name", "--yes")
    first, fetched, absent, second = run(
        hub.environment,
        publish,
        (elsewhere.root, "fetch", "hf:user/name"),
        (elsewhere.root, "diff", "d", "hf:user/absent"),
        publish,
    )
    assert (first[0], fetched[0], absent[0], second[0]) == (0, 0, 1, 1), (first, fetched)
    assert "hf:user/name: the repository is new and private" in first[1]
    assert "hf:user/name: the repository exists and is private" in second[1]
    assert "only your account can see it" in first[1]
    assert "hf:user/absent/SHA256SUMS: cannot be fetched" in absent[2]
    assert "1 file differs after the upload, first metadata.csv" in second[2]
    assert TOKEN not in str((first, fetched, absent, second))
    folder = project.paths.published("d")
    expected = {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }
    assert hub.files == {**expected, "notes.txt": b"by a person", "metadata.csv": b"others"}
    assert hub.commits == ["Version 1.0.0", "Version 1.0.0"]
    paths = [path for _, path in hub.requests]
    later = paths[paths.index("/api/datasets/user/name/commit/main") :]
    assert not [path for path in later if path.startswith("/lfs/")]  # no file is sent again
    remake(elsewhere)
    original = project.paths.features("d").read_bytes()
    assert elsewhere.paths.features("d").read_bytes() == original
