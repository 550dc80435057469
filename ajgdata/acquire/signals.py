"""Signals that end a program. The first signal ends it; later ones do not disturb the clean-up."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_ENDING = ("SIGINT", "SIGTERM", "SIGHUP")


@contextmanager
def ended_by_signals(names: tuple[str, ...] = _ENDING[1:]) -> Iterator[None]:
    """Let the first signal end the program, and ignore later signals.

    SIGINT raises KeyboardInterrupt; other signals raise SystemExit of 128 plus their number. A
    signal that was ignored before (`nohup`) stays ignored, except SIGINT, which stops a live run.
    Only the main thread may call this.
    """

    def end(number: int, _frame: FrameType | None) -> None:
        for other in numbers:
            signal.signal(other, signal.SIG_IGN)  # the program cleans up
        raise KeyboardInterrupt if number == signal.SIGINT else SystemExit(128 + number)

    numbers = [
        number
        for number in (getattr(signal, name) for name in names)
        if number == signal.SIGINT or signal.getsignal(number) != signal.SIG_IGN
    ]
    before = [signal.signal(number, end) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


@contextmanager
def undisturbed() -> Iterator[None]:
    """Ignore the ending signals in the block.

    In another thread, this does nothing, because only the main thread receives signals.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {name: signal.signal(getattr(signal, name), signal.SIG_IGN) for name in _ENDING}
    try:
        yield
    finally:
        for name, handler in before.items():
            signal.signal(getattr(signal, name), handler)
