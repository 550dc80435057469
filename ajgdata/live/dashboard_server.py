"""HTTP of the dashboard: what is answered, to whom, and what is refused."""

from __future__ import annotations

import hmac
import io
import ipaddress
import json
import socket
import sys
import threading
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler
from socketserver import TCPServer, ThreadingMixIn
from typing import NamedTuple
from urllib.parse import urlsplit

from ajgdata.live.bounded import BoundedReader
from ajgdata.live.control import Control
from ajgdata.live.feed import Feed

#: Header that has the token.
TOKEN_HEADER = "X-Ajgdata-Token"
#: Bytes of a request's body; pages that watch at once.
MAX_BODY, MAX_READERS = 4096, 64
#: Bytes of a request altogether, its lines included.
MAX_REQUEST = 32 * MAX_BODY
#: Threads of this process beyond which a connection is closed unheard.
MAX_THREADS = 4 * MAX_READERS
#: Seconds between signs of life, by which a page notices that nobody answers.
HEARTBEAT_S = 2.0
#: A quarter of a megabyte waits in the kernel for one reader, no more.
_SEND_BUFFER = 65_536
_NAMES = {"localhost", "127.0.0.1", "::1"}


class Page(NamedTuple):
    """A page and the content policy that is sent with it."""

    html: bytes
    policy: str


class Server(ThreadingMixIn, TCPServer):
    """One thread for each request; a process that ends does not wait for them.

    Raises OSError if the address cannot be had.
    """

    daemon_threads = True
    allow_reuse_address = True
    request_queue_size = MAX_READERS

    def __init__(
        self,
        address: tuple[str, int],
        page: Page,
        feed: Feed,
        control: Control,
        *,
        token: str,
        correct: Callable[[int, str], object] | None,
        patience_s: float,
    ) -> None:
        if ":" in address[0]:
            self.address_family = socket.AF_INET6
        self.page, self.feed, self.control = page, feed, control
        self.token, self.correct, self.patience_s = token, correct, patience_s
        self.host = address[0]
        self.readers = 0
        self._fewer = threading.Condition()
        super().__init__(address, _Handler)

    def verify_request(self, request: object, client_address: object) -> bool:
        """Return False for a connection too many: a flood of them takes no thread each."""
        return threading.active_count() < MAX_THREADS

    def admit(self) -> bool:
        """Count one more reader; return False if there are too many."""
        with self._fewer:
            if self.readers >= MAX_READERS:
                return False
            self.readers += 1
            return True

    def dismiss(self) -> None:
        """Count one reader less."""
        with self._fewer:
            self.readers -= 1
            self._fewer.notify_all()

    def wait_for_readers(self, timeout_s: float) -> bool:
        """Wait until there is no reader; return False if there still is one."""
        with self._fewer:
            return self._fewer.wait_for(lambda: not self.readers, timeout_s)

    def serves(self, authority: str) -> bool:
        """Return True if a request to `authority` is meant for us, and not for a foreign name that
        was made to lead here (DNS rebinding)."""
        try:
            name = urlsplit(f"//{authority}").hostname or ""
        except ValueError:
            return False
        if name in _NAMES or self.host in _NAMES:
            return name in _NAMES
        try:
            ipaddress.ip_address(name)  # numbers cannot be rebound
        except ValueError:
            return name == self.host.lower()
        return True

    def handle_error(self, request: object, client_address: object) -> None:
        """Keep quiet about clients that go away in mid-sentence."""
        if not isinstance(sys.exc_info()[1], OSError):
            super().handle_error(request, client_address)  # type: ignore[arg-type]


class _RefusedError(Exception):
    """A request that is not answered: why, in a status and a line."""

    def __init__(self, status: HTTPStatus, said: str) -> None:
        self.status, self.said = status, said


class _Handler(BaseHTTPRequestHandler):
    server: Server
    server_version, sys_version = "ajgdata", ""

    def setup(self) -> None:
        super().setup()
        self.connection.settimeout(self.server.patience_s)
        self.rfile.close()  # the connection stays
        heard = BoundedReader(self.connection, MAX_REQUEST, self.server.patience_s)
        self.rfile = io.BufferedReader(heard)

    def do_GET(self) -> None:
        self._answer("GET")

    def do_POST(self) -> None:
        self._answer("POST")

    def log_message(self, format: str, *arguments: object) -> None:
        """Say nothing: the terminal is the run's."""

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """Refuse what is no HTTP as everything else is refused."""
        self._send(HTTPStatus(code), f"{message or HTTPStatus(code).phrase}\n".encode())

    def _answer(self, method: str) -> None:
        try:
            self._check_origin()
            path = self.path.partition("?")[0]
            asked = _ROUTES.get(path)
            if asked is None:
                raise _RefusedError(HTTPStatus.NOT_FOUND, "there is no such page")
            allowed, act = asked
            if method != allowed:
                raise _RefusedError(HTTPStatus.METHOD_NOT_ALLOWED, f"ask with {allowed}")
            act(self)
        except _RefusedError as refused:
            allow = (("Allow", allowed),) if refused.status == 405 else ()
            self._send(refused.status, f"{refused.said}\n".encode(), more=allow)

    def _check_origin(self) -> None:
        host, origin = self.headers.get("Host", ""), self.headers.get("Origin")
        if not self.server.serves(host):
            raise _RefusedError(HTTPStatus.FORBIDDEN, "asked under a name that is not ours")
        foreign = origin is not None and origin != f"http://{host}"
        # a picture or frame has no origin, but browsers say where it stands; a link may lead here
        if self.headers.get("Sec-Fetch-Site") in ("cross-site", "same-site"):
            foreign |= self.headers.get("Sec-Fetch-Mode") != "navigate"
        if foreign:
            raise _RefusedError(HTTPStatus.FORBIDDEN, "asked by a page from elsewhere")

    def _send_page(self) -> None:
        policy = ("Content-Security-Policy", self.server.page.policy)
        self._send(HTTPStatus.OK, self.server.page.html, "text/html; charset=utf-8", (policy,))

    def _send_icon(self) -> None:
        self._send(HTTPStatus.OK, _ICON, "image/svg+xml")

    def _send_state(self) -> None:
        text = self.server.feed.shown().text
        self._send(HTTPStatus.OK, text.encode(), "application/json")

    def _send_events(self) -> None:
        """Send the state as it is, then whenever it has changed, until the reader goes."""
        if not self.server.admit():
            raise _RefusedError(HTTPStatus.SERVICE_UNAVAILABLE, "too many pages watch; close some")
        try:
            self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)
            self._head(HTTPStatus.OK, "text/event-stream", (("Connection", "close"),))
            self.wfile.write(b"retry: 1000\n\n")
            feed, seen = self.server.feed, -1
            while True:
                if feed.wait(seen, HEARTBEAT_S):
                    last = feed.closed  # looked at first: what is sent is then the last state
                    seen, text = feed.shown()
                    self.wfile.write(f"id: {seen}\nevent: state\ndata: {text}\n\n".encode())
                    if last:
                        break
                else:
                    self.wfile.write(b"event: alive\ndata:\n\n")
        except OSError:  # gone, or reads nothing
            pass
        finally:
            self.server.dismiss()

    def _start(self) -> None:
        self._ask(self.server.control.start)

    def _pause(self) -> None:
        self._ask(self.server.control.pause)

    def _stop(self) -> None:
        self._ask(self.server.control.stop)

    def _ask(self, act: Callable[[], object]) -> None:
        self._body()
        act()
        self.server.feed.wait(-1, 0)  # a changed mode is seen at once
        self._send(HTTPStatus.NO_CONTENT)

    def _truth(self) -> None:
        """Take `{"number": 3, "object": "marker"}`: a grasp of those that are shown, a class."""
        body = self._body()
        if self.server.correct is None:
            raise _RefusedError(HTTPStatus.CONFLICT, "this run takes no corrections")
        try:
            given = json.loads(body)
            number, truth = given["number"], given["object"]
        except (ValueError, TypeError, KeyError, RecursionError):
            raise _RefusedError(HTTPStatus.BAD_REQUEST, "no number and object as JSON") from None
        state = self.server.feed.state
        if type(number) is not int or number not in {one.number for one in state.grasps}:
            raise _RefusedError(HTTPStatus.BAD_REQUEST, "no grasp of this number is shown")
        if truth not in state.plan.get("classes", ()):
            raise _RefusedError(HTTPStatus.BAD_REQUEST, "it is none of the classes")
        try:
            self.server.correct(number, truth)
        except ValueError:  # the log is closed
            raise _RefusedError(HTTPStatus.CONFLICT, "the run has ended") from None
        self._send(HTTPStatus.NO_CONTENT)

    def _body(self) -> bytes:
        """Return the body of a request by somebody who has the token."""
        if "Transfer-Encoding" in self.headers:
            raise _RefusedError(HTTPStatus.LENGTH_REQUIRED, "say how long the body is")
        said = self.headers.get("Content-Length", "0")
        if not (said.isascii() and said.isdecimal()):
            raise _RefusedError(HTTPStatus.BAD_REQUEST, "a length is a number")
        length = int(said[:9])
        body = self.rfile.read(min(length, 16 * MAX_BODY))  # read, or the refusal would be lost
        if length > MAX_BODY:
            raise _RefusedError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"at most {MAX_BODY} bytes")
        given = self.headers.get(TOKEN_HEADER, "").encode()
        if not hmac.compare_digest(given, self.server.token.encode()):
            raise _RefusedError(HTTPStatus.FORBIDDEN, "the token is not that of this run")
        return body

    def _send(
        self,
        status: HTTPStatus,
        body: bytes = b"",
        kind: str = "text/plain; charset=utf-8",
        more: tuple[tuple[str, str], ...] = (),
    ) -> None:
        self._head(status, kind, (*more, ("Content-Length", str(len(body)))))
        self.wfile.write(body)

    def _head(self, status: HTTPStatus, kind: str, more: tuple[tuple[str, str], ...]) -> None:
        self.send_response(status)
        sent = dict(more)
        sent.setdefault("Content-Security-Policy", "default-src 'none'; frame-ancestors 'none'")
        for name, value in {"Content-Type": kind, **_HEADERS, **sent}.items():
            self.send_header(name, value)
        self.end_headers()


_HEADERS = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
}
#: A bar that is over its threshold.
_ICON = (
    b'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 16 16"><rect width="16" height="16" '
    b'rx="3" fill="#0069a3"/><path d="M2 5h11M2 11h5" stroke="#fff" stroke-width="3"/></svg>'
)
_ROUTES: dict[str, tuple[str, Callable[[_Handler], None]]] = {
    "/": ("GET", _Handler._send_page),
    "/favicon.ico": ("GET", _Handler._send_icon),
    "/state": ("GET", _Handler._send_state),
    "/events": ("GET", _Handler._send_events),
    "/start": ("POST", _Handler._start),
    "/pause": ("POST", _Handler._pause),
    "/stop": ("POST", _Handler._stop),
    "/truth": ("POST", _Handler._truth),
}
