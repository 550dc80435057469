"""A web server on this computer for one page: its guards, and its life during a block.

Only this computer can reach the page, other pages can send it no request, and it loads nothing from
another server (see `docs/dashboard.md`).
"""

from __future__ import annotations

import hmac
import socket
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import uvicorn
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from ajgdata.report.render import render

HOST = "127.0.0.1"
#: Header with the token of a page, which a request that changes something must have.
TOKEN_HEADER = "X-Ajgdata-Token"
#: The page loads its own files only, and sends requests to this server only.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}


@contextmanager
def served(app: Starlette, port: int = 0) -> Iterator[str]:
    """Serve `app` to this computer during the block, and yield its address, `http://…/`.

    `port` 0 selects a free port. Raises OSError if the port is not free.
    """
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
    try:
        while not server.started and thread.is_alive():
            time.sleep(0.01)
        yield f"http://{HOST}:{listener.getsockname()[1]}/"
    finally:
        server.should_exit = True
        thread.join()
        listener.close()


def guarded(
    files: Mapping[str, tuple[str, str]], routes: Sequence[Route], policy: str = POLICY
) -> Starlette:
    """Return a web site with the guards of this module.

    `files` are the fixed files of the page: template and media type by route. Templates in the
    working folder are used instead of the package's. `routes` are all other routes, and `policy`
    is the content security policy.
    """
    contents = {
        route: Response(render(template), media_type=media_type)
        for route, (template, media_type) in files.items()
    }

    async def file(request: Request) -> Response:
        return contents[request.url.path]

    hosts = [HOST, "localhost"]  # a foreign name may lead here (DNS rebinding)
    app = Starlette(
        routes=[*(Route(route, file) for route in contents), *routes],
        middleware=[
            Middleware(RequestGuard, policy=policy),
            Middleware(TrustedHostMiddleware, allowed_hosts=hosts, www_redirect=False),
        ],
    )
    app.router.redirect_slashes = False
    return app


def has_token(request: Request, token: str) -> bool:
    """Return whether a request has the token of the page."""
    sent = request.headers.get(TOKEN_HEADER, "")
    return hmac.compare_digest(sent.encode(), token.encode())


class RequestGuard:
    """Middleware that refuses requests from other pages, and adds headers."""

    def __init__(self, app: ASGIApp, policy: str) -> None:
        self._app = app
        headers = _HEADERS | {"Content-Security-Policy": policy}
        self._headers = [(name.lower().encode(), text.encode()) for name, text in headers.items()]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        names = {name for name, _ in self._headers}

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                own = [header for header in message["headers"] if header[0].lower() not in names]
                message["headers"] = [*own, *self._headers]
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
