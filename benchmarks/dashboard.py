"""The dashboard: time from an event to the page that shows it, and memory over many events.

`python -m benchmarks.dashboard` needs Debian's chromium and chromium-driver (`make test-browser`
says what else). Events come `--pace` milliseconds apart, so that none is skipped; the page notes
when its content has changed. Then 10,000 events come at once, with fifty streams that read and one
that never does.
"""

from __future__ import annotations

import argparse
import gc
import os
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from ajgdata.live.control import Control
from ajgdata.live.dashboard import Dashboard, dashboard
from ajgdata.live.events import Event, read_events
from tools.browser import Browser, browser

LOG = Path(__file__).resolve().parents[1] / "docs/examples/sorting.jsonl"
#: When the page has taken in which event, in milliseconds since 1970.
WATCH = """
window.seen = [];
new MutationObserver(() => seen.push(
  [Number(document.body.dataset.n), performance.timeOrigin + performance.now()]
)).observe(document.body, {attributes: true, attributeFilter: ['data-n']});
"""


def again_and_again(events: list[Event]) -> Iterator[Event]:
    """The events of a run, for ever, with numbers that go on."""
    number = 0
    while True:
        for event in events[number > 0 :]:  # one start
            if event["event"] != "stopped":
                yield {**event, "n": number}
                number += 1


def event_to_dom(shown: Dashboard, window: Browser, count: int, pace_ms: float) -> np.ndarray:
    """Milliseconds (n,) from telling an event until the page shows it."""
    window.open(shown.address)
    window.run(WATCH)
    told = {}
    for event in again_and_again(read_events(LOG)):
        if event["n"] == count:
            break
        told[event["n"]] = 1e3 * time.time()
        shown.feed.tell(event)
        time.sleep(pace_ms / 1e3)
    time.sleep(1)
    seen = dict(reversed(window.run("return seen")))  # the first time of each
    print(f"{len(seen)} of {count} events seen one by one")
    return np.array([seen[n] - told[n] for n in told if n in seen])


def read_all(one: socket.socket) -> None:
    with suppress(OSError):  # closed
        while one.recv(65_536):
            pass


@contextmanager
def stream(shown: Dashboard, *, reads: bool) -> Iterator[None]:
    """A reader of /events, or one that never reads."""
    port = int(shown.watching.rsplit(":", 1)[1].strip("/"))
    with socket.create_connection(("127.0.0.1", port)) as one:
        one.sendall(f"GET /events HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode())
        if reads:
            threading.Thread(target=read_all, args=(one,), daemon=True).start()
        yield
        one.shutdown(socket.SHUT_RDWR)


def resident_mb() -> float:
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def memory(shown: Dashboard, count: int) -> tuple[list[float], float]:
    """Resident megabytes before, after a tenth, and after all events; milliseconds an event."""
    found = [resident_mb()]
    with ExitStack() as stack:
        for number in range(51):
            stack.enter_context(stream(shown, reads=number > 0))
        began = time.perf_counter()
        for event in again_and_again(read_events(LOG)):
            if event["n"] == count:
                break
            shown.feed.tell(event)
            if event["n"] == count // 10:
                found.append(resident_mb())
        each = 1e3 * (time.perf_counter() - began) / count
        found.append(resident_mb())
    return found, each


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-n", "--events", type=int, default=1_000)
    parser.add_argument("--pace", type=float, default=20.0, help="milliseconds")
    parser.add_argument("--many", type=int, default=10_000)
    arguments = parser.parse_args()
    with dashboard(Control()) as shown, browser() as window:
        took = event_to_dom(shown, window, arguments.events, arguments.pace)
        heap = [window.do("Runtime.getHeapUsage")["usedSize"] / 1e6]
        used, each = memory(shown, arguments.many)
        time.sleep(2)
        window.do("HeapProfiler.collectGarbage")
        heap.append(window.do("Runtime.getHeapUsage")["usedSize"] / 1e6)
    table = Table(title="event to page, ms")
    for heading in ("median", "99 %", "most"):
        table.add_column(heading, justify="right")
    table.add_row(*(f"{np.quantile(took, q):.1f}" for q in (0.5, 0.99, 1)))
    console = Console()
    console.print(table)
    before, tenth, after = used
    console.print(
        f"{arguments.many} events, 51 streams: {each:.2f} ms an event for the run; resident "
        f"{before:.0f} MB before, {tenth:.0f} after a tenth, {after:.0f} after all; "
        f"page's heap {heap[0]:.1f}, then {heap[1]:.1f} MB"
    )


if __name__ == "__main__":
    main()
