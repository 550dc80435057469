"""The log of a live run, played again on the page of a run."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from datetime import datetime
from pathlib import Path
from threading import Event as Flag

from ajgdata.live.control import Control
from ajgdata.live.dashboard import dashboard
from ajgdata.live.events import Event, read_events

#: No pause is longer than this: somebody had lunch.
LONGEST_S = 10.0


def show_log(
    log: Path, ready: Callable[[str, int], object], *, speed: float = 0.0, port: int = 0
) -> None:
    """Serve the page of a run until Ctrl-C; `ready` is told its address and the number of events.

    The run is played `speed` times as fast as it was; 0 shows how it ended. Raises DataError for a
    file that is no log and for a port that is taken.
    """
    events = [
        {**one, "replay": True} if one["event"] == "start" else one for one in read_events(log)
    ]  # the page says that it is one
    control = Control()
    with dashboard(control, port=port) as shown:
        try:
            if speed:
                ready(shown.address, len(events))
            replay(events, shown.feed.tell, control, speed=speed)
            control.end()
            if not speed:  # whoever opens the page then sees the end
                ready(shown.address, len(events))
            Flag().wait()
        except KeyboardInterrupt:
            pass


def replay(
    events: Iterable[Event],
    tell: Callable[[Event], object],
    control: Control,
    *,
    speed: float = 0.0,
    sleep: Callable[[float], object] = time.sleep,
) -> None:
    """Call `tell` with each event, `speed` times as fast as they came, or at once (0).

    Pauses with `control`, and ends when it is stopped.
    """
    before: datetime | None = None
    for event in events:
        now = datetime.fromisoformat(event["time"])
        if before is not None and speed:
            pause = max(0.0, (now - before).total_seconds()) / speed
            sleep(min(pause, LONGEST_S))
        before = now
        try:
            control.checkpoint()
        except KeyboardInterrupt:
            return
        tell(event)
