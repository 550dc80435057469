"""What happened in a live run: told to whoever listens, and kept in a log that only grows.

One JSON object a line: `n` counts from 0, `time` is ISO 8601 in UTC, `event` the kind, and what the
kind has. A log that was cut off in the middle of a line loses that line alone.
"""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self, get_args

import numpy as np
from numpy.typing import ArrayLike

from ajgdata.store.files import read_text
from ajgdata.types import DataError

#: Kinds of events and what each has.
#: start: dataset task model unit classes threshold bins looks device robot session; for whoever
#:        draws it also source ("simulated", "recorded"), spectra (by class the mean of what was
#:        trained on, as `shown_spectrum` has it), top_hz (the highest frequency of a spectrum)
#: grasp: number object ("" if nobody knows what it is)
#: step: step seconds                      (loosen approach wait jam lift place release halt)
#: take: recording look seconds peak_dbfs clipped xruns attempts spectrum (`shown_spectrum`)
#: prediction: recording look seconds and the keys of `Prediction.plain`
#: decision: action (place again wait ask reject stop) value bin probability (by class, combined)
#:        looks reason seconds
#: placed: value bin object ("" if nobody knows)
#: truth: number object                    (a correction, by a person)
#: reference: kind (empty) recording drift (ratio to the alarm's threshold, or null)
#: drift: text ratio                       (the gripper has changed)
#: paused, resumed: reason
#: stopped: reason held ("" for nothing) sorts seconds finished (as planned; old logs: without)
#: problem: text                           (one line, with what to do)
Kind = Literal[
    "start", "grasp", "step", "take", "prediction", "decision", "placed", "truth", "reference",
    "drift", "paused", "resumed", "stopped", "problem",
]  # fmt: skip
KINDS = frozenset(get_args(Kind))
Event = Mapping[str, Any]
Listener = Callable[[Event], object]
#: Numbers of a spectrum that is drawn, from 0 Hz to the highest frequency in equal bands.
SHOWN_BANDS = 64


def shown_spectrum(feature: ArrayLike) -> list[float]:
    """Return a feature (n_frequencies,) as `SHOWN_BANDS` numbers with mean 1: its band means.

    A feature of nothing but zeros stays so.
    """
    bands = [band.mean() for band in np.array_split(np.asarray(feature, float), SHOWN_BANDS)]
    mean = float(np.mean(bands)) or 1.0
    return [round(float(band) / mean, 4) for band in bands]


def read_events(path: Path) -> list[Event]:
    """Return the events of a log, in order; a last line that was cut off is left out.

    Raises DataError for a file that is missing or no log.
    """
    lines = read_text(path).splitlines()
    events: list[Event] = []
    for number, line in enumerate(lines, start=1):
        try:
            event = json.loads(line)
            kind, _ = event["event"], event["n"]
            if datetime.fromisoformat(event["time"]).utcoffset() is None:
                raise ValueError("a time without zone")
        except (ValueError, TypeError, KeyError):
            if number == len(lines) and number > 1:
                break
            kind = None
        if kind not in KINDS:
            fix = "name the events.jsonl of a run"
            raise DataError(f"{path}:{number}", "is no line of a log of a live run", fix)
        events.append(event)
    if not events:
        raise DataError(path, "holds no event", "name the log of a run that has begun")
    return events


class EventLog:
    """Writes events to a file, each of them before anybody hears of it. Safe under threads."""

    def __init__(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = path.open("ab")
        self._lock = threading.Lock()
        self._listeners: list[Listener] = []
        self._count = 0

    def listen(self, listener: Listener) -> None:
        """Call `listener` with each event from now on, in order, under the log's lock."""
        with self._lock:
            self._listeners.append(listener)

    def say(self, event: Kind, **about: Any) -> Event:
        """Enter an event. Values must be such that JSON holds them; NaN is refused.

        Raises OSError if a listener does (a terminal that is gone), when all of them have heard it.
        """
        if event not in KINDS:
            raise ValueError(f"no event is called {event!r}")
        with self._lock:
            now = datetime.now(UTC).isoformat(timespec="milliseconds")
            said = {"n": self._count, "time": now, "event": event, **about}
            line = json.dumps(said, allow_nan=False).encode() + b"\n"
            self._count += 1  # first: no two events have one number, even if this is interrupted
            self._file.write(line)
            self._file.flush()
            gone = None
            for listener in self._listeners:
                try:
                    listener(said)
                except OSError as error:
                    gone = error
            if gone is not None:
                raise gone
        return said

    def close(self) -> None:
        """Have all of it on disk."""
        with self._lock:
            if not self._file.closed:
                self._file.flush()
                os.fsync(self._file.fileno())
                self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
