"""A live run in a browser: one page without anything from elsewhere, served by this process.

The page gets the state of the run by server-sent events, and asks for start, pause, stop and
corrections by POST with a token that only its address holds. Who may ask what: `docs/dashboard.md`.
"""

from __future__ import annotations

import base64
import hashlib
import ipaddress
import re
import secrets
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

from ajgdata.live.control import Control
from ajgdata.live.dashboard_server import Page, Server
from ajgdata.live.events import EventLog
from ajgdata.live.feed import Feed
from ajgdata.paths import Paths
from ajgdata.types import DataError

LOOPBACK = "127.0.0.1"
#: Seconds that pages get at the end to hear the last event.
_FAREWELL_S = 1.0

#: Told the number of a grasp, and what it was.
Correct = Callable[[int, str], object]


class Dashboard(NamedTuple):
    """A page that is being served: tell its `feed` the events of a run.

    `address` lets whoever has it control the run, `watching` lets them watch; `warning` is one line
    to be shown, "" if there is nothing to warn of.
    """

    feed: Feed
    address: str
    watching: str
    warning: str


@contextmanager
def dashboard(
    control: Control,
    *,
    correct: Correct | None = None,
    host: str = LOOPBACK,
    port: int = 0,
    project: Paths | None = None,
    patience_s: float = 10.0,
) -> Iterator[Dashboard]:
    """Serve the page of a run until the context is left; its buttons go to `control`.

    `correct` takes corrections; without it none are offered. `port` 0 is any free one. Templates
    come from `project` (default: the working folder), else from the package. A reader that takes
    nothing for `patience_s` is dropped. Raises DataError if the address cannot be had.
    """
    feed = Feed(control, correctable=correct is not None)
    token = secrets.token_urlsafe(16)
    try:
        server = Server(
            (host, port), rendered(project), feed, control, token=token, correct=correct,
            patience_s=patience_s,
        )  # fmt: skip
    except (OSError, OverflowError, UnicodeError) as error:  # the last: no name of a host
        fix = "choose another port, or none: any free one is then taken"
        said = getattr(error, "strerror", None) or error
        raise DataError(f"dashboard at {host}:{port}", f"cannot be served ({said})", fix) from None
    thread = threading.Thread(target=server.serve_forever, args=(0.1,), daemon=True)
    thread.start()
    name = f"[{host}]" if ":" in host else host
    watching = f"http://{name}:{server.server_address[1]}/"
    try:
        yield Dashboard(feed, f"{watching}#{token}", watching, _warning(host))
    finally:
        feed.close()
        server.shutdown()
        server.wait_for_readers(_FAREWELL_S)
        server.server_close()
        thread.join()


@contextmanager
def serve_dashboard(
    log: EventLog,
    control: Control,
    *,
    host: str = LOOPBACK,
    port: int = 0,
    project: Paths | None = None,
) -> Iterator[Dashboard]:
    """Serve the page of a run that enters its events into `log`: begin before the first of them.

    Corrections are entered as events `truth`. See `dashboard` for the rest.
    """

    def correct(number: int, truth: str) -> None:
        log.say("truth", number=number, object=truth)

    with dashboard(control, correct=correct, host=host, port=port, project=project) as shown:
        log.listen(shown.feed.tell)
        yield shown


def rendered(project: Paths | None = None) -> Page:
    """Return the page and its content policy: only what stands in it may run or style it."""
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
    return Page(html.encode(), policy)


def _hashes(html: str, tag: str) -> str:
    """Return the sources of a content policy for what stands between each pair of `tag`."""
    found = re.findall(rf"<{tag}>(.*?)</{tag}>", html, re.DOTALL)
    digests = (hashlib.sha256(text.encode()).digest() for text in found)
    return " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)


def _warning(host: str) -> str:
    try:
        alone = ipaddress.ip_address(host).is_loopback
    except ValueError:
        alone = host == "localhost"
    if alone:
        return ""
    return (
        f"the dashboard listens on {host}: whoever is in this network can watch, without "
        "encryption, and who has the whole address can start and stop the robot; "
        "`ssh -L` is safer (docs/dashboard.md)"
    )
