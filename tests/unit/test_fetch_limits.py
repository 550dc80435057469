"""`ajgdata fetch` from a server that is slow, endless, or no host of data at all."""

import hashlib
import http.server
import shutil
import threading
import time
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
    """Serves a folder with connections that stay open; counts requests and connections."""

    protocol_version = "HTTP/1.1"

    def setup(self):
        super().setup()
        self.server.connections += 1

    def do_GET(self):
        self.server.requests += 1
        name = Path(self.translate_path(self.path)).name
        if name in self.server.pages:
            self._send(self.server.pages[name])
        elif name == self.server.slow:
            self._drip(name)
        else:
            super().do_GET()

    def _send(self, content):
        self.send_response(200)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def _drip(self, name):
        """Send the answer, or its header, a byte at a time."""
        content = (Path(self.directory) / name).read_bytes()
        head = f"HTTP/1.1 200 OK\r\nContent-Length: {len(content)}\r\n\r\n".encode()
        if self.server.fast_head:
            self.wfile.write(head)
            head = b""
        for byte in head + content:
            if self.server.ended.wait(0.1):
                return
            self.wfile.write(bytes([byte]))

    def log_message(self, *_):
        pass


@contextmanager
def serving(root):
    with http.server.ThreadingHTTPServer(
        ("127.0.0.1", 0), partial(Handler, directory=str(root))
    ) as server:
        server.daemon_threads = True
        server.requests = server.connections = 0
        server.pages, server.slow, server.fast_head = {}, "", True
        server.ended = threading.Event()
        thread = threading.Thread(target=server.serve_forever, args=(0.02,))
        thread.start()
        try:
            yield server
        finally:
            server.ended.set()
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


@pytest.mark.parametrize("name", [Tree.SUMS, Tree.DECLARATION, Tree.ARCHIVE])
@pytest.mark.parametrize("fast_head", [True, False], ids=["slow body", "slow header"])
def test_a_slow_server_cannot_block(server, project, monkeypatch, name, fast_head):
    monkeypatch.setattr("ajgdata.store.publishing.download.START_S", 1.0)
    server.slow, server.fast_head = name, fast_head
    begin = time.monotonic()
    line = refusal(fetched(server), project)
    assert time.monotonic() - begin < 5
    assert f"/{name}: the server sent 0 bytes in 1 s; run it again" in line


def test_the_whole_download_has_a_time_limit(server, project, monkeypatch):
    monkeypatch.setattr("ajgdata.store.publishing.download.MAX_S", 1.0)
    server.slow = Tree.ARCHIVE
    line = refusal(fetched(server), project)
    assert "audio.zip: the download took longer than " in line


def test_20000_listed_sessions_cause_no_requests(server, project, tree):
    lines = [
        f"{hashlib.sha256(b'').hexdigest()}  sessions/x{n}/session.yaml" for n in range(20_000)
    ]
    with (tree / tree.SUMS).open("a") as sums:
        sums.write("\n".join(lines) + "\n")
    line = refusal(fetched(server), project)
    assert "files to download; the limit is 5000" in line
    assert server.requests <= 2


def test_requests_are_limited_however_they_come_about(server, project, monkeypatch):
    monkeypatch.setattr("ajgdata.store.publishing.download.MAX_REQUESTS", 10)
    assert "needs more than 10 requests" in refusal(fetched(server), project)
    assert server.requests == 10


def test_files_share_one_connection(server, project):
    assert fetched(server).exit_code == 0
    assert server.requests == 11
    assert server.connections <= 3  # for SHA256SUMS, the declaration, and everything else


LOGIN = b"\n<!DOCTYPE html><html><title>Sign in</title></html>"


@pytest.mark.parametrize("name", [Tree.SUMS, Tree.METADATA])
def test_a_login_page_is_named_as_one(server, project, name):
    server.pages = {name: LOGIN}
    line = refusal(fetched(server), project)
    assert f"/{name}: the server sent a web page (HTML) instead of the file" in line
    assert "login" in line
    assert "publish" not in line.partition(": ")[2]


def test_a_login_page_that_was_saved_as_a_file_is_named_as_one(tree, project):
    (tree / tree.SUMS).write_bytes(LOGIN)
    line = refusal(CliRunner().invoke(app, ["fetch", str(tree.root)]), project)
    assert "SHA256SUMS: is a web page (HTML), not a list of hashes" in line


@pytest.mark.parametrize(
    ("address", "fix"),
    [
        ("ftp://example.org/d", "Use https"),
        ("s3://bucket/d", "Use https"),
        ("file:///srv/d", "Name the folder without 'file://'"),
    ],
)
def test_addresses_of_another_kind_are_named(project, address, fix):
    line = refusal(CliRunner().invoke(app, ["fetch", address]), project)
    scheme = address.partition("://")[0]
    expected = f"{address}: addresses that begin with {scheme}:// are not supported; {fix}"
    assert line == expected
