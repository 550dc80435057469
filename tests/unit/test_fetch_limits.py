"""`ajgdata fetch` from a server that lists too much, or is no host of data at all."""

import hashlib
import http.server
import shutil
import threading
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pytest
from published import make_project, published
from typer.testing import CliRunner

from ajgdata.cli import app
from ajgdata.paths import Paths, Tree
from ajgdata.types import DataError


@pytest.fixture(scope="module")
def published_tree(tmp_path_factory):
    root = tmp_path_factory.mktemp("limits")
    published(make_project(root / "project"), root / "tree")
    return Tree(root / "tree")


@pytest.fixture
def tree(published_tree, tmp_path):
    shutil.copytree(published_tree.root, tmp_path / "tree")
    return Tree(tmp_path / "tree")


@pytest.fixture
def project(tmp_path, monkeypatch):
    """An empty project, in which the command runs."""
    (tmp_path / "project" / "datasets").mkdir(parents=True)
    monkeypatch.setenv("AJGDATA_ROOT", str(tmp_path / "project"))
    return Paths(tmp_path / "project")


class Handler(http.server.SimpleHTTPRequestHandler):
    """Serves a folder and counts requests."""

    protocol_version = "HTTP/1.1"

    def do_GET(self):
        self.server.requests += 1
        name = Path(self.translate_path(self.path)).name
        if name in self.server.pages:
            self._send(self.server.pages[name])
        else:
            super().do_GET()

    def _send(self, content):
        self.send_response(200)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, *_):
        pass


@contextmanager
def serving(root):
    with http.server.ThreadingHTTPServer(
        ("127.0.0.1", 0), partial(Handler, directory=str(root))
    ) as server:
        server.daemon_threads = True
        server.requests, server.pages = 0, {}
        thread = threading.Thread(target=server.serve_forever, args=(0.02,))
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()


@pytest.fixture
def server(tree):
    with serving(tree.root) as started:
        yield started


def fetched(server):
    """Result of the command for the address of a server."""
    address = f"http://127.0.0.1:{server.server_address[1]}"
    return CliRunner().invoke(app, ["fetch", address])


def refusal(done, project):
    """The one line that says why nothing was registered."""
    assert isinstance(done.exception, DataError), done.output
    assert list(project.datasets.iterdir()) == []
    assert not project.data.exists()
    line = str(done.exception)
    assert "\n" not in line
    return line


def test_20000_listed_sessions_cause_no_requests(server, project, tree):
    lines = [
        f"{hashlib.sha256(b'').hexdigest()}  sessions/x{n}/session.yaml" for n in range(20_000)
    ]
    with (tree / tree.SUMS).open("a") as sums:
        sums.write("\n".join(lines) + "\n")
    line = refusal(fetched(server), project)
    assert "files to download; the limit is 5000" in line
    assert server.requests <= 2


LOGIN = b"\n<!DOCTYPE html><html><title>Sign in</title></html>"


@pytest.mark.parametrize("name", [Tree.SUMS, Tree.METADATA])
def test_a_login_page_is_named_as_one(server, project, name):
    server.pages = {name: LOGIN}
    line = refusal(fetched(server), project)
    assert f"/{name}: the server sent a web page (HTML)" in line
    assert "login" in line
    assert "publish" not in line.partition(": ")[2]


def test_a_login_page_that_was_saved_as_a_file_is_named_as_one(tree, project):
    (tree / tree.SUMS).write_bytes(LOGIN)
    line = refusal(CliRunner().invoke(app, ["fetch", str(tree.root)]), project)
    assert "SHA256SUMS: is a web page (HTML), not a list of hashes" in line


@pytest.mark.parametrize("address", ["ftp://example.org/d", "s3://bucket/d", "file:///srv/d"])
def test_addresses_of_another_kind_are_named(project, address):
    line = refusal(CliRunner().invoke(app, ["fetch", address]), project)
    scheme = address.partition("://")[0]
    assert line.startswith(f"{address}: addresses that begin with {scheme}:// are not supported; ")
