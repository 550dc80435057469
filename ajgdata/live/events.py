"""Events of a live run: passed to listeners, and written to a log that only grows.

One JSON object per line: `n` counts from 0, `time` is ISO 8601 in UTC, `event` is the kind, and the
other keys depend on the kind.
"""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal, Self, get_args

import numpy as np
from numpy.typing import ArrayLike

#: Kinds of events and what each has.
#: start: dataset task model unit classes threshold bins looks device robot session; for whoever
#:        draws it also source ("simulated", "recorded"), spectra (by class the mean of what was
#:        trained on, as `shown_spectrum` has it), top_hz (the highest frequency of a spectrum)
#: grasp: number object ("" if nobody knows what it is)
#: step: step seconds                      (loosen approach wait jam lift place release halt)
#: take: recording look seconds peak_dbfs clipped xruns attempts spectrum (`shown_spectrum`)
#: prediction: recording look seconds and the keys of `Prediction.plain`
#: decision: action (place again wait reject stop) value bin probability (by class, combined)
#:        looks reason seconds
#: placed: value bin object ("" if nobody knows)
#: reference: kind (empty) recording drift (ratio to the alarm's threshold, or null)
#: drift: text ratio                       (the gripper has changed)
#: paused, resumed: reason
#: stopped: reason held ("" for nothing) sorts seconds finished (as planned)
#: problem: text                           (one line, with what to do)
Kind = Literal[
    "start", "grasp", "step", "take", "prediction", "decision", "placed", "reference",
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


class EventLog:
    """Writes each event to a file, then passes it to the listeners. Safe under threads."""

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
        """Write an event; raises ValueError for values that JSON cannot represent, such as NaN.

        Raises OSError if a listener does (a terminal that is gone), after all were called.
        """
        if event not in KINDS:
            raise ValueError(f"no event is called {event!r}")
        with self._lock:
            now = datetime.now(UTC).isoformat(timespec="milliseconds")
            entry = {"n": self._count, "time": now, "event": event, **about}
            line = json.dumps(entry, allow_nan=False).encode() + b"\n"
            self._count += 1  # first: no two events have one number, even if this is interrupted
            self._file.write(line)
            self._file.flush()
            gone = None
            for listener in self._listeners:
                try:
                    listener(entry)
                except OSError as error:
                    gone = error
            if gone is not None:
                raise gone
        return entry

    def close(self) -> None:
        """Write the whole log to the disk."""
        with self._lock:
            if not self._file.closed:
                self._file.flush()
                os.fsync(self._file.fileno())
                self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
