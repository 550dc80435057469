"""A live run in a browser: one page, which this process serves to this computer only.

The page receives the state of the run as server-sent events. Stop is a POST request with a token
that only the printed address contains (see `docs/dashboard.md`).
"""

from __future__ import annotations

import asyncio
import hmac
import json
import secrets
import socket
import threading
import time
from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import contextmanager
from typing import NamedTuple

import uvicorn
from sse_starlette import EventSourceResponse, ServerSentEvent
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from ajgdata.live.events import Event, RunState
from ajgdata.live.steps import Control
from ajgdata.report.render import render

HOST = "127.0.0.1"
#: Header with the token of a run.
TOKEN_HEADER = "X-Ajgdata-Token"
#: Seconds after which a page that reads nothing is dropped.
PATIENCE_S = 10.0
#: Seconds between two heartbeats of an open page.
HEARTBEAT_S = 2.0
#: Seconds between two checks for a newer state.
POLL_S = 0.02
#: Seconds for the pages to receive the last event.
_FAREWELL_S = 1.0
#: The files of the page by route, with their templates and types.
_FILES = {
    "/": ("dashboard.html.j2", "text/html"),
    "/tokens.css": ("tokens.css", "text/css"),
    "/dashboard.css": ("dashboard.css", "text/css"),
    "/dashboard.js": ("dashboard.js", "text/javascript"),
}
#: The page loads these files only, and sends requests to this server only.
_HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "connect-src 'self'; img-src 'self' data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}


class Dashboard(NamedTuple):
    """A served page. `feed.tell` receives the events of the run.

    A person who opens `address` can stop the run; a person who opens `watching` can only watch.
    """

    feed: Feed
    address: str
    watching: str


@contextmanager
def dashboard(control: Control, *, port: int = 0) -> Iterator[Dashboard]:
    """Serve the page of a run during the block; its button calls `control.stop`.

    The block begins before the first event of the run. `port` 0 selects a free port. Templates in
    the working folder are used instead of the package's. Raises OSError if the port is not
    free.
    """
    feed = Feed(control)
    token = secrets.token_urlsafe(16)
    files = {
        route: Response(render(template), media_type=media_type)
        for route, (template, media_type) in _FILES.items()
    }
    app = _app(files, feed, control, token)
    listener = socket.create_server((HOST, port), backlog=128)
    server = uvicorn.Server(
        uvicorn.Config(
            app,
            http="h11",
            ws="none",
            lifespan="off",
            access_log=False,
            log_config=None,
            log_level="critical",
            server_header=False,
            timeout_graceful_shutdown=1,
        )
    )
    thread = threading.Thread(target=server.run, args=([listener],), daemon=True)
    thread.start()
    watching = f"http://{HOST}:{listener.getsockname()[1]}/"
    try:
        while not server.started and thread.is_alive():
            time.sleep(0.01)
        yield Dashboard(feed, f"{watching}#{token}", watching)
    finally:
        feed.close(_FAREWELL_S)
        server.should_exit = True
        thread.join()
        listener.close()


class Feed:
    """The state of a run for many pages. The run never waits for a page; slow pages miss states."""

    def __init__(self, control: Control) -> None:
        self.state = RunState()
        self.readers = 0  #: pages that watch
        self._control = control
        self._events = 0
        self._closed = False
        self._lock = threading.Lock()

    def tell(self, event: Event) -> None:
        """Update the state by one event."""
        with self._lock:
            self.state.add(event)
            self._events += 1

    @property
    def text(self) -> str:
        """The state as JSON, with the `mode` of the run: running or stopped."""
        with self._lock:
            return json.dumps(self.state.plain() | {"mode": self._mode}, allow_nan=False)

    async def updates(self) -> AsyncIterator[ServerSentEvent]:
        """Yield the state, then each newer state until the feed is closed."""
        self.readers += 1
        seen: tuple[int, str] | None = None
        number = 0
        try:
            while True:
                is_last = self._closed
                version = self._events, self._mode
                if version != seen:
                    yield ServerSentEvent(self.text, event="state", id=str(number), retry=1000)
                    seen = version
                    number += 1
                if is_last:
                    return
                await asyncio.sleep(POLL_S)
        finally:
            self.readers -= 1

    def close(self, timeout_s: float) -> None:
        """End all streams after the last state, and wait for them."""
        self._closed = True
        end = time.monotonic() + timeout_s
        while self.readers and time.monotonic() < end:
            time.sleep(POLL_S)

    @property
    def _mode(self) -> str:
        is_stopped = self._control.stopped or self.state.stopped is not None
        return "stopped" if is_stopped else "running"


class RequestGuard:
    """Middleware that refuses requests from other pages, and adds headers."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                extra = [(name.lower().encode(), text.encode()) for name, text in _HEADERS.items()]
                names = {name for name, _ in extra}
                own = [header for header in message["headers"] if header[0].lower() not in names]
                message["headers"] = [*own, *extra]
            await send(message)

        app = self._app
        if scope["type"] == "http" and _is_foreign(Request(scope)):
            app = PlainTextResponse("the request is from another page", 403)
        await app(scope, receive, send_with_headers)


def _is_foreign(request: Request) -> bool:
    """Return whether a page from elsewhere sent the request. Links to the page are allowed.

    Images and frames have no origin, but browsers report their site.
    """
    headers = request.headers
    origin = headers.get("origin")
    if origin is not None and origin != f"http://{headers.get('host', '')}":
        return True
    is_other_site = headers.get("sec-fetch-site") in ("cross-site", "same-site")
    return is_other_site and headers.get("sec-fetch-mode") != "navigate"


def _app(files: Mapping[str, Response], feed: Feed, control: Control, token: str) -> Starlette:
    """Return the web site of a run; `files` are its fixed files by route."""

    async def file(request: Request) -> Response:
        return files[request.url.path]

    async def events(request: Request) -> Response:
        return EventSourceResponse(
            feed.updates(),
            send_timeout=PATIENCE_S,
            ping=HEARTBEAT_S,
            ping_message_factory=lambda: ServerSentEvent("", event="alive"),
        )

    async def stop(request: Request) -> Response:
        sent = request.headers.get(TOKEN_HEADER, "")
        if not hmac.compare_digest(sent.encode(), token.encode()):
            return PlainTextResponse("the token is not that of this run", 403)
        control.stop()
        return Response(status_code=204)

    routes = [Route(route, file) for route in files]
    routes += [Route("/events", events), Route("/stop", stop, methods=["POST"])]
    hosts = [HOST, "localhost"]  # a foreign name may lead here (DNS rebinding)
    trusted = Middleware(TrustedHostMiddleware, allowed_hosts=hosts, www_redirect=False)
    app = Starlette(routes=routes, middleware=[Middleware(RequestGuard), trusted])
    app.router.redirect_slashes = False
    return app
