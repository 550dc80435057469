"""Signals that end a program in the middle of a step: once is enough, then it tidies up."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

#: Those that there are on every system, and those of POSIX.
_ENDING = ("SIGINT", "SIGTERM", "SIGHUP")
_Handlers = dict[int, Any]


@contextmanager
def ended_by_signals(names: tuple[str, ...] = _ENDING[1:]) -> Iterator[None]:
    """Let the first of these signals end the program, SIGINT by KeyboardInterrupt, the others by
    SystemExit of 128 and their number; those that follow are ignored.

    A signal that was to be ignored from the start stays so, but SIGINT, by which a live run is
    stopped. For the main thread.
    """

    def end(number: int, _frame: FrameType | None) -> None:
        for one in before:
            signal.signal(one, signal.SIG_IGN)  # what is going on now is tidying up
        raise KeyboardInterrupt if number == signal.SIGINT else SystemExit(128 + number)

    before = {
        number: handler
        for number, handler in _handlers(names).items()
        if handler != signal.SIG_IGN or number == signal.SIGINT
    }
    for number in before:
        signal.signal(number, end)
    try:
        yield
    finally:
        _restore(before)


@contextmanager
def undisturbed() -> Iterator[None]:
    """Ignore these signals meanwhile, if this is the main thread (no other one hears them)."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = _handlers(_ENDING)
    for number in before:
        signal.signal(number, signal.SIG_IGN)
    try:
        yield
    finally:
        _restore(before)


def _handlers(names: tuple[str, ...]) -> _Handlers:
    known = (getattr(signal, name, None) for name in names)
    return {number: signal.getsignal(number) for number in known if number is not None}


def _restore(before: _Handlers) -> None:
    for number, handler in before.items():
        signal.signal(number, handler)
