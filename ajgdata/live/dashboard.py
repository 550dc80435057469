"""A live run in a browser: one page, which this process serves to this computer only.

The page receives the state of the run as server-sent events. Stop is a POST request with a token
that only the printed address contains (see `docs/dashboard.md`).
"""

from __future__ import annotations

import asyncio
import json
import secrets
import threading
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager
from typing import NamedTuple

from sse_starlette import EventSourceResponse, ServerSentEvent
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route

from ajgdata.live.events import Event, RunState
from ajgdata.live.server import guarded, has_token, served
from ajgdata.live.steps import Control

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
    with served(guarded(_FILES, _routes(feed, control, token)), port) as watching:
        try:
            yield Dashboard(feed, f"{watching}#{token}", watching)
        finally:
            feed.close(_FAREWELL_S)


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


def _routes(feed: Feed, control: Control, token: str) -> list[Route]:
    """Return the routes of a run."""

    async def events(request: Request) -> Response:
        return EventSourceResponse(
            feed.updates(),
            send_timeout=PATIENCE_S,
            ping=HEARTBEAT_S,
            ping_message_factory=lambda: ServerSentEvent("", event="alive"),
        )

    async def stop(request: Request) -> Response:
        if not has_token(request, token):
            return PlainTextResponse("the token is not that of this run", 403)
        control.stop()
        return Response(status_code=204)

    return [Route("/events", events), Route("/stop", stop, methods=["POST"])]
