"""Stand-ins on this machine for the servers of other people, which check the requests."""

from __future__ import annotations

import http.server
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from urllib.parse import urlsplit

import requests
from requests.adapters import HTTPAdapter


class RecordingHandler(http.server.BaseHTTPRequestHandler):
    """Passes each request to `server.answer` and notes method and path."""

    protocol_version = "HTTP/1.1"

    def _serve(self) -> None:
        length = int(self.headers.get("Content-Length") or 0)
        body = self.rfile.read(length)
        self.server.requests.append((self.command, self.path))
        status, headers, content = self.server.answer(self.command, self.path, self.headers, body)
        self.send_response(status)
        for key, value in headers.items():
            self.send_header(key, value)
        if "Content-Length" not in headers:
            self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(content)

    do_GET = do_HEAD = do_PUT = do_POST = do_DELETE = _serve  # noqa: N815  # names of http.server

    def log_message(self, *_: object) -> None:
        """Print nothing."""


@contextmanager
def serving(answer: Callable) -> Iterator[http.server.ThreadingHTTPServer]:
    """Serve `answer(method, path, headers, body) -> (status, headers, content)` on 127.0.0.1."""
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), RecordingHandler) as server:
        server.requests = []
        server.answer = answer
        server.address = f"http://127.0.0.1:{server.server_address[1]}"
        thread = threading.Thread(target=server.serve_forever, args=(0.02,))
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()


def send_to(address: str, monkeypatch) -> None:
    """Send the requests of `requests` for any https host to `address/HOST`, unchanged otherwise."""

    class Redirected(HTTPAdapter):
        def send(self, request, **options):
            asked = request.url
            parts = urlsplit(asked)
            query = f"?{parts.query}" if parts.query else ""
            request.url = f"{address}/{parts.netloc}{parts.path}{query}"
            response = super().send(request, **options)
            request.url = response.url = asked
            return response

    plain = requests.Session.get_adapter
    monkeypatch.setattr(
        requests.Session,
        "get_adapter",
        lambda self, url: Redirected() if url.startswith("https://") else plain(self, url),
    )
