"""The state of a run for many readers: none of them is waited for.

A reader who is slow skips states and gets the latest one: there is nothing to queue, so memory does
not grow with readers that do not keep up.
"""

from __future__ import annotations

import json
import threading
from typing import NamedTuple

from ajgdata.live.control import Control, Mode
from ajgdata.live.events import Event
from ajgdata.live.run_state import RunState, advanced


class Shown(NamedTuple):
    """A state as JSON text; `version` grows with each change."""

    version: int
    text: str


class Feed:
    """What pages show. `tell` is called by the run, everything else by threads of readers."""

    def __init__(self, control: Control, *, correctable: bool = False) -> None:
        self._control, self._correctable = control, correctable
        self._changed = threading.Condition()
        self._state = RunState()
        self._version = 0
        self._mode: Mode | None = None
        self._shown = Shown(-1, "")
        self._unshown = 0
        self._closed = False

    @property
    def state(self) -> RunState:
        """Return the state after the last event."""
        return self._state

    @property
    def closed(self) -> bool:
        """Return True when nothing will change any more."""
        return self._closed

    def tell(self, event: Event) -> None:
        """Take in an event. It never raises: a page that cannot show it is no reason to end a run
        with an object in the air."""
        with self._changed:
            try:
                json.dumps(event, allow_nan=False)  # else no reader would get a state any more
                self._state = advanced(self._state, event)
            except Exception:  # said on the page
                self._unshown += 1
            self._version += 1
            self._changed.notify_all()

    def wait(self, seen: int, timeout_s: float) -> bool:
        """Wait until there is something newer than version `seen`; return False if there is not."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._version > seen, timeout_s)
            self._look()
            return self._version > seen

    def shown(self) -> Shown:
        """Return the state as it is now, with mode (see `Control`) and if it can be corrected."""
        with self._changed:
            self._look()
            version, state, mode = self._version, self._state, self._mode
            if self._shown.version == version:
                return self._shown
            more = {"mode": str(mode), "correctable": self._correctable, "unshown": self._unshown}
        made = Shown(version, json.dumps({**state.plain(), **more}, allow_nan=False))
        with self._changed:
            if made.version > self._shown.version:
                self._shown = made
        return made

    def close(self) -> None:
        """Let all who wait go."""
        with self._changed:
            self._closed = True
            self._version += 1
            self._changed.notify_all()

    def _look(self) -> None:
        """Notice a mode that was changed without an event."""
        mode = Mode.STOPPED if self._state.stopped is not None else self._control.mode
        if mode is not self._mode:
            self._mode = mode
            self._version += 1
            self._changed.notify_all()
