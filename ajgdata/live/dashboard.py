"""A live run in a browser: one page, served by this process to this computer only.

The page receives the state of the run as server-sent events. Start, pause, stop and corrections are
POST requests with a token that only the printed address contains (see `docs/dashboard.md`).
"""

from __future__ import annotations

import base64
import hashlib
import os
import re
import secrets
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import uvicorn

from ajgdata.live.control import Control
from ajgdata.live.dashboard_app import Correct, Feed, Page, Site
from ajgdata.live.events import EventLog
from ajgdata.paths import Paths
from ajgdata.types import DataError

HOST = "127.0.0.1"
#: Seconds for the pages to receive the last event.
_FAREWELL_S = 1.0


class Dashboard(NamedTuple):
    """A served page; pass the events of a run to `feed.tell`.

    With `address`, a person controls the run; with `watching`, a person only watches.
    """

    feed: Feed
    address: str
    watching: str


@contextmanager
def dashboard(
    control: Control,
    *,
    correct: Correct | None = None,
    port: int = 0,
    project: Paths | None = None,
) -> Iterator[Dashboard]:
    """Serve the page of a run during the block; its buttons call `control`.

    `correct` receives corrections; without it the page offers none. `port` 0 is any free port.
    Templates are those of `project` (default: the working folder), else those of the package.
    Raises DataError if the port is not free.
    """
    feed, token = Feed(control, correctable=correct is not None), secrets.token_urlsafe(16)
    site = Site(rendered(project), feed, control, token, correct)
    listener = _listener(port)
    server = uvicorn.Server(
        uvicorn.Config(
            site.app(), http="h11", ws="none", lifespan="off", access_log=False, log_config=None,
            log_level="critical", server_header=False, timeout_graceful_shutdown=1,
        )
    )  # fmt: skip
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


def _listener(port: int) -> socket.socket:
    """Return a socket that listens on a port of this computer. Raises DataError."""
    try:
        return socket.create_server((HOST, port), backlog=128)
    except OSError as error:
        problem = f"the port is not available ({os.strerror(error.errno or 0)})"
        fix = "use another port, or no port for any free one"
        raise DataError(f"port {port}", problem, fix) from None


@contextmanager
def serve_dashboard(
    log: EventLog, control: Control, *, port: int = 0, project: Paths | None = None
) -> Iterator[Dashboard]:
    """Serve the page of a run that writes its events to `log`; corrections become events `truth`.

    Begin before the first event. See `dashboard` for the rest.
    """

    def correct(number: int, truth: str) -> None:
        log.say("truth", number=number, object=truth)

    with dashboard(control, correct=correct, port=port, project=project) as shown:
        log.listen(shown.feed.tell)
        yield shown


def rendered(project: Paths | None = None) -> Page:
    """Return the page and its content policy: only its own scripts and styles are allowed."""
    from ajgdata.report.render import render

    html = render("dashboard.html.j2", {}, project=project)
    hashes = {tag: _hashes(html, tag) for tag in ("script", "style")}
    policy = "; ".join([
        "default-src 'none'",
        f"script-src {hashes['script']}",
        f"style-src {hashes['style']}",
        "connect-src 'self'",
        "img-src 'self'",  # the icon
        "base-uri 'none'",
        "form-action 'none'",
        "frame-ancestors 'none'",
    ])  # fmt: skip
    return Page(html, policy)


def _hashes(html: str, tag: str) -> str:
    """Return the sources of a content policy for the contents of all elements `tag`."""
    found = re.findall(rf"<{tag}>(.*?)</{tag}>", html, re.DOTALL)
    digests = (hashlib.sha256(text.encode()).digest() for text in found)
    return " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)
