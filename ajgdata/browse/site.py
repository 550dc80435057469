"""The web site of `ajgdata browse`: its files and routes. See `docs/browsing.md`."""

from __future__ import annotations

import json
import re
import secrets
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlencode

from pydantic import ValidationError
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route

from ajgdata.browse.view import View
from ajgdata.live.server import POLICY, guarded, has_token, served
from ajgdata.pipeline.labelling import ConflictError
from ajgdata.types import DataError
from ajgdata.types.base import Strict

#: The files of the page by route, with their templates and types.
_FILES = {
    "/": ("browse.html.j2", "text/html"),
    "/tokens.css": ("tokens.css", "text/css"),
    "/browse.css": ("browse.css", "text/css"),
    "/browse.js": ("browse.js", "text/javascript"),
    "/browse_plots.js": ("browse_plots.js", "text/javascript"),
}
#: Largest number of rows that one request gets.
MAX_ROWS = 500
_RANGE = re.compile(r"bytes=(\d*)-(\d*)")
#: Parameters of the address of the page, which are the state that a person sees.
STATE = ("filter", "sort", "predictions", "plane", "recording")


class DecisionRequest(Strict):
    """A decision about a recording that a page sends; `version` is that of the state it shows."""

    recording: str
    action: str
    column: str = ""
    value: str = ""
    reason: str = ""
    version: str


@contextmanager
def browsing(view: View, *, port: int = 0, **state: str) -> Iterator[str]:
    """Serve the page of a data set during the block, and yield its address.

    `state` are values of STATE with which the page opens; empty values are omitted. `port` 0
    selects a free port. Raises OSError if the port is not free.
    """
    policy = f"{POLICY}; media-src 'self'"
    token = secrets.token_urlsafe(16)
    with served(guarded(_FILES, routes(view, token), policy), port) as address:
        query = urlencode({key: text for key, text in state.items() if text})
        yield f"{address}?{query}#{token}" if query else f"{address}#{token}"


def routes(view: View, token: str) -> list[Route]:
    """Return the routes of a view. Only `/change` changes something, and needs the token."""
    return [
        *(Route(path, _json_route(value)) for path, value in _values(view).items()),
        *_sound_routes(view),
        _change_route(view, token),
    ]


def _values(view: View) -> dict[str, Callable[[Mapping[str, str]], Any]]:
    """Return the functions that give the values of a page, from the query of a request, by path."""

    def table(query: Mapping[str, str]) -> Any:
        return view.table(*_shown(query), query.get("filter", ""), query.get("sort", ""))

    def rows(query: Mapping[str, str]) -> Any:
        numbers = [int(text) for text in query.get("numbers", "").split(",") if text.isdecimal()]
        return view.rows(*_shown(query), numbers[:MAX_ROWS])

    def recording(query: Mapping[str, str]) -> Any:
        return view.recording(*_shown(query), query.get("recording", ""), _channel(query))

    return {
        "/about": lambda query: view.about(),
        "/table": table,
        "/rows": rows,
        "/points": lambda query: view.points(*_shown(query)),
        "/recording": recording,
    }


def _sound_routes(view: View) -> list[Route]:
    """Return the routes of the sounds of recordings and sessions."""

    def sound(request: Request) -> Response:
        query = request.query_params
        name = query.get("recording", "")
        return _wav(request, lambda: view.sound(name, _channel(query)))

    def played(request: Request) -> Response:
        session = request.query_params.get("session", "")
        return _wav(request, lambda: view.played(session))

    return [Route("/sound.wav", sound), Route("/played.wav", played)]


def _change_route(view: View, token: str) -> Route:
    """Return the route of decisions. It answers with the decision in words.

    The status is 409 if the recording changed since the page showed it, and 400 for other errors.
    """

    async def change(request: Request) -> Response:
        if not has_token(request, token):
            return PlainTextResponse("the token is not that of this page", 403)
        try:
            decision = DecisionRequest.model_validate_json(await request.body())
        except ValidationError:
            return PlainTextResponse("the request is not a decision", 400)
        try:
            text = await run_in_threadpool(view.change, **decision.model_dump())
        except DataError as error:
            status = 409 if isinstance(error, ConflictError) else 400
            return PlainTextResponse(f"{error.problem}; {error.fix}", status)
        return PlainTextResponse(text)

    return Route("/change", change, methods=["POST"])


def _shown(query: Mapping[str, str]) -> tuple[str, str]:
    """Return the names of the predictions and of the plane that a page shows."""
    return query.get("predictions", ""), query.get("plane", "")


def _channel(query: Mapping[str, str]) -> int:
    """Return the number of a channel, by default the first."""
    text = query.get("channel", "")
    return max(1, int(text)) if text.isdecimal() else 1


def _json_route(value: Callable[[Mapping[str, str]], Any]) -> Callable[[Request], Response]:
    """Return a route that answers with a value as JSON, or with status 400 and a message.

    Starlette runs it in a thread, because it is not a coroutine.
    """

    def answer(request: Request) -> Response:
        try:
            content = value(request.query_params)
        except DataError as error:
            return PlainTextResponse(f"{error.problem}; {error.fix}", 400)
        text = json.dumps(content, allow_nan=False, separators=(",", ":"))
        return Response(text, media_type="application/json")

    return answer


def _wav(request: Request, read: Callable[[], bytes]) -> Response:
    """Answer with a WAV file, or with the part that the header `Range` requests.

    Browsers request parts to play from the middle of a sound. Only one part is supported.
    """
    try:
        content = read()
    except DataError as error:
        return PlainTextResponse(f"{error.problem}; {error.fix}", 404)
    headers = {"Accept-Ranges": "bytes"}
    part = byte_range(request.headers.get("range", ""), len(content))
    if part is None:
        return Response(content, media_type="audio/wav", headers=headers)
    if not part:
        headers["Content-Range"] = f"bytes */{len(content)}"
        return Response(status_code=416, headers=headers)
    headers["Content-Range"] = f"bytes {part.start}-{part.stop - 1}/{len(content)}"
    body = content[part.start : part.stop]
    return Response(body, 206, media_type="audio/wav", headers=headers)


def byte_range(text: str, size: int) -> range | None:
    """Return the bytes that a header `Range` requests of `size` bytes.

    None is the complete content: no header, or one that is not understood. An empty range cannot
    be answered.

    >>> byte_range("bytes=2-", 10), byte_range("bytes=-3", 10), byte_range("bytes=12-", 10)
    (range(2, 10), range(7, 10), range(0, 0))
    """
    match = _RANGE.fullmatch(text.strip())
    if match is None or match.groups() == ("", ""):
        return None
    first, last = match.groups()
    if not first:
        return range(max(0, size - int(last)), size)
    stop = min(size, int(last) + 1) if last else size
    return range(int(first), stop) if int(first) < stop else range(0)
