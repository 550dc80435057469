"""The page of a run over HTTP: what is answered, and what is refused. No browser is needed."""

import http.client
import json
import re
import time

import pytest
from html_page import Page
from live_events import run
from sorting_lab import BALL, BINS, CLASSES, CUBE, ROD, Cell, plan

from ajgdata.live.dashboard import dashboard
from ajgdata.live.server import TOKEN_HEADER
from ajgdata.live.steps import Control


class Client:
    """Asks a dashboard as a browser would that is at its page; `headers` differ from that."""

    def __init__(self, shown):
        self.feed = shown.feed
        self.port = int(shown.watching.rsplit(":", 1)[1].strip("/"))
        self.token = shown.address.rsplit("#", 1)[1]
        self.own = {"Host": f"127.0.0.1:{self.port}"}

    def ask(self, method, path, **headers):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
        try:
            connection.putrequest(method, path, skip_host=True)
            given = self.own | {"Content-Length": "0"} | headers
            for name, value in given.items():
                if value is not None:
                    connection.putheader(name, value)
            connection.endheaders()
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read()
        finally:
            connection.close()

    def post(self, path, **headers):
        own = {"Origin": f"http://127.0.0.1:{self.port}", TOKEN_HEADER: self.token}
        return self.ask("POST", path, **(own | headers))[0]

    def state(self):
        return json.loads(self.feed.text)


@pytest.fixture
def control():
    return Control()


@pytest.fixture
def client(control):
    with dashboard(control) as shown:
        for event in run():
            shown.feed.tell(event)
        yield Client(shown)


def test_the_page_loads_only_its_own_files(client):
    status, headers, html = client.ask("GET", "/")
    assert (status, headers["Content-Type"]) == (200, "text/html; charset=utf-8")
    text = html.decode()
    policy = dict(part.split(" ", 1) for part in headers["Content-Security-Policy"].split("; "))
    assert policy == {
        "default-src": "'none'",
        "script-src": "'self'",
        "style-src": "'self'",
        "connect-src": "'self'",
        "img-src": "'self' data:",
        "base-uri": "'none'",
        "form-action": "'none'",
        "frame-ancestors": "'none'",
    }
    assert headers["Cache-Control"] == "no-store"
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert client.token not in text
    page = Page(text)
    assert [tag["href"] for tag in page.all("link")] == ["data:,", "tokens.css", "dashboard.css"]
    assert page.all("script") == [{"src": "dashboard.js"}]
    assert not page.all("style") and not re.search(r"<[^>]* (style|on\w+)=", text)
    files = {"tokens.css": "css", "dashboard.css": "css", "dashboard.js": "javascript"}
    for name, kind in files.items():
        status, headers, content = client.ask("GET", f"/{name}")
        assert (status, headers["Content-Type"]) == (200, f"text/{kind}; charset=utf-8")
        assert not re.search(rb"https?://", content)


BAD = {
    "no token": (403, {TOKEN_HEADER: None}),
    "wrong token": (403, {TOKEN_HEADER: "A" * 22}),
    "token that is no ASCII": (403, {TOKEN_HEADER: "\xe9"}),
    "foreign origin": (403, {"Origin": "http://example.org"}),
    "no origin at all": (403, {"Origin": "null"}),
    "another program of this computer": (403, {"Origin": "http://127.0.0.1:1"}),
    "foreign name": (400, {"Host": "example.org", "Origin": "http://example.org"}),
    "no name": (400, {"Host": None}),
    "broken name": (403, {"Host": "[::1"}),
    "address that begins like ours": (403, {"Host": "127.0.0.1.example.org"}),
}


def test_who_may_not_ask_is_refused(client, control):
    answered = {why: client.post("/stop", **headers) for why, (_, headers) in BAD.items()}
    assert answered == {why: status for why, (status, _) in BAD.items()}
    assert not control.stopped


def test_foreign_pages_cannot_even_read(client):
    for status, headers in (BAD["foreign name"], BAD["foreign origin"]):
        for path in ("/", "/events"):
            assert (path, client.ask("GET", path, **headers)[0]) == (path, status)


@pytest.fixture
def sorting(tmp_path):
    """A sorter of three objects, its cell, and a client of its dashboard."""
    cell = Cell(tmp_path)
    with (
        cell.open(plan(objects=list(CLASSES)), BALL, CUBE, ROD) as sorter,
        dashboard(cell.control) as shown,
    ):
        sorter.log.listen(shown.feed.tell)
        sorter.log.say("start", classes=list(CLASSES), threshold=0.6, bins=BINS)
        yield cell, sorter, Client(shown)


def test_the_button_stops_a_run_in_the_middle_of_a_step(sorting):
    """As an object hangs in the air: the robot halts and the page says what it holds."""
    cell, sorter, client = sorting
    lift = 7 + 4  # of the second object: loosen, approach, hold, jam, lift

    def press():
        assert client.post("/stop") == 204
        time.sleep(600)  # the step goes on, until it is interrupted

    cell.robot.at[lift] = press
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        sorter.run()
    assert time.monotonic() - began < 600  # it was woken
    assert cell.robot.names[lift:] == ["lift", "halt"]
    state = client.state()
    assert (state["mode"], state["stopped"]["held"], state["sorts"]) == ("stopped", "cube", 1)
    assert state["stopped"]["reason"] == "stopped by a person"
