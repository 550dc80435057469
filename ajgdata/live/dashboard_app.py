"""HTTP of the dashboard: its routes, the state that it shows, and the requests that it refuses."""

from __future__ import annotations

import asyncio
import hmac
import json
import threading
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass
from typing import NamedTuple

from sse_starlette import EventSourceResponse, ServerSentEvent
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from ajgdata.live.control import Control, Mode
from ajgdata.live.events import Event
from ajgdata.live.run_state import RunState

#: Header with the token of a run.
TOKEN_HEADER = "X-Ajgdata-Token"
#: Bytes of the body of a request.
MAX_BODY = 4096
#: Seconds after which a page that reads nothing is dropped.
PATIENCE_S = 10.0
#: Seconds between two signs of life, and between two checks for a newer state.
HEARTBEAT_S, POLL_S = 2.0, 0.02
_HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
}
#: A bar that exceeds its threshold.
_ICON = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 16 16"><rect width="16" height="16" '
    'rx="3" fill="#0069a3"/><path d="M2 5h11M2 11h5" stroke="#fff" stroke-width="3"/></svg>'
)
#: Receives the number of a grasp and the class of its object.
Correct = Callable[[int, str], object]


class Page(NamedTuple):
    """A page and the content policy that is sent with it."""

    html: str
    policy: str


class Feed:
    """The state of a run for many pages. The run never waits for a page; slow pages miss states."""

    def __init__(self, control: Control, *, correctable: bool) -> None:
        self.state = RunState()
        self.readers = 0  #: pages that watch
        self._control, self._correctable = control, correctable
        self._events = self._unshown = 0
        self._closed = False
        self._cached: tuple[object, str] = (None, "")
        self._lock = threading.Lock()

    def tell(self, event: Event) -> None:
        """Update the state. It raises nothing: an event that cannot be shown must not end a run."""
        with self._lock:
            try:
                json.dumps(event, allow_nan=False)
                self.state.add(event)
            except Exception:  # the page shows the number of these events
                self._unshown += 1
            self._events += 1

    @property
    def text(self) -> str:
        """The state as JSON, with the mode of the run (see `Control`)."""
        version = self._version  # first: the text is this version or newer
        if self._cached[0] != version:
            about = {
                "mode": self._mode, "correctable": self._correctable, "unshown": self._unshown
            }  # fmt: skip
            with self._lock:
                state = self.state.plain()
            self._cached = version, json.dumps(state | about, allow_nan=False)
        return self._cached[1]

    async def updates(self) -> AsyncIterator[ServerSentEvent]:
        """Yield the state, then each newer state until the feed is closed."""
        self.readers += 1
        seen: object = None
        number = 0
        try:
            while True:
                is_last, version = self._closed, self._version
                if version != seen:
                    yield ServerSentEvent(self.text, event="state", id=str(number), retry=1000)
                    seen, number = version, number + 1
                if is_last:
                    return
                await asyncio.sleep(POLL_S)
        finally:
            self.readers -= 1

    def close(self, timeout_s: float) -> None:
        """End all streams after the last state, and wait for them."""
        self._closed, end = True, time.monotonic() + timeout_s
        while self.readers and time.monotonic() < end:
            time.sleep(POLL_S)

    @property
    def _mode(self) -> str:
        return str(Mode.STOPPED if self.state.stopped is not None else self._control.mode)

    @property
    def _version(self) -> tuple[int, str]:
        return self._events, self._mode


class Guard:
    """Middleware that refuses requests from other pages, and adds headers."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                known = {name.lower() for name, _ in message["headers"]}
                extra = [(name.lower().encode(), text.encode()) for name, text in _HEADERS.items()]
                message["headers"] = [*message["headers"], *(h for h in extra if h[0] not in known)]
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


@dataclass(frozen=True)
class Site:
    """The web site of a run; see `dashboard.dashboard` for its values."""

    page: Page
    feed: Feed
    control: Control
    token: str
    correct: Correct | None

    def app(self) -> Starlette:
        """Return the application to be served."""
        routes = [
            Route("/", self._show),
            Route("/favicon.ico", self._icon),
            Route("/state", self._state),
            Route("/events", self._events),
            Route("/start", self._button(self.control.start), methods=["POST"]),
            Route("/pause", self._button(self.control.pause), methods=["POST"]),
            Route("/stop", self._button(self.control.stop), methods=["POST"]),
            Route("/truth", self._truth, methods=["POST"]),
        ]
        hosts = ["127.0.0.1", "localhost"]  # a foreign name may lead here (DNS rebinding)
        trusted = Middleware(TrustedHostMiddleware, allowed_hosts=hosts, www_redirect=False)
        app = Starlette(routes=routes, middleware=[Middleware(Guard), trusted])
        app.router.redirect_slashes = False
        return app

    async def _show(self, request: Request) -> Response:
        return HTMLResponse(self.page.html, headers={"Content-Security-Policy": self.page.policy})

    async def _icon(self, request: Request) -> Response:
        return Response(_ICON, media_type="image/svg+xml")

    async def _state(self, request: Request) -> Response:
        return Response(self.feed.text, media_type="application/json")

    async def _events(self, request: Request) -> Response:
        return EventSourceResponse(
            self.feed.updates(), send_timeout=PATIENCE_S, ping=HEARTBEAT_S,
            ping_message_factory=lambda: ServerSentEvent("", event="alive"),
        )  # fmt: skip

    def _button(self, press: Callable[[], object]) -> Callable[[Request], Awaitable[Response]]:
        async def handle(request: Request) -> Response:
            await self._authorised_body(request)
            press()
            return Response(status_code=204)

        return handle

    async def _truth(self, request: Request) -> Response:
        body = await self._authorised_body(request)
        if self.correct is None:
            raise HTTPException(409, "this run takes no corrections")
        number, name = _correction(body, self.feed.state)
        try:  # in a thread: the log may wait for a terminal
            await run_in_threadpool(self.correct, number, name)
        except ValueError:  # the log is closed
            raise HTTPException(409, "the run has ended") from None
        return Response(status_code=204)

    async def _authorised_body(self, request: Request) -> bytes:
        """Return the body of a request that has the token."""
        length = request.headers.get("content-length", "")
        if not (length.isascii() and length.isdecimal()):
            raise HTTPException(411, "the length of the body is missing")
        if int(length[:9]) > MAX_BODY:
            raise HTTPException(413, f"a body has up to {MAX_BODY} bytes")
        token = request.headers.get(TOKEN_HEADER, "").encode()
        if not hmac.compare_digest(token, self.token.encode()):
            raise HTTPException(403, "the token is not that of this run")
        return await request.body()


def _correction(body: bytes, state: RunState) -> tuple[int, str]:
    """Return number and class of `{"number": 3, "object": "marker"}`. Raises HTTPException."""
    try:
        content = json.loads(body)
        number, name = content["number"], content["object"]
    except (ValueError, TypeError, KeyError, RecursionError):
        raise HTTPException(400, "the body has no number and object as JSON") from None
    if type(number) is not int or number not in {grasp.number for grasp in state.grasps}:
        raise HTTPException(400, "there is no grasp with this number")
    if name not in state.plan.get("classes", ()):
        raise HTTPException(400, "this is not one of the classes")
    return number, name
