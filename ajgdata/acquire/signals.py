"""Signals that end a program. The first signal ends it; later ones do not disturb the clean-up."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

#: Signals that end a program. Windows has no SIGHUP.
ENDING_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)


@contextmanager
def ended_by_signals(*, also_ctrl_c: bool = False) -> Iterator[None]:
    """Let the first signal end the program, and ignore later signals.

    SIGTERM and SIGHUP raise SystemExit of 128 plus their number. If `also_ctrl_c`, SIGINT raises
    KeyboardInterrupt in the same way. A signal that was ignored before (`nohup`) stays ignored,
    except SIGINT, which stops a live run. Only the main thread may call this.
    """

    def end(number: int, _frame: FrameType | None) -> None:
        for other in numbers:
            signal.signal(other, signal.SIG_IGN)  # the program cleans up
        raise KeyboardInterrupt if number == signal.SIGINT else SystemExit(128 + number)

    numbers = [
        number
        for number in ENDING_SIGNALS
        if number != signal.SIGINT and signal.getsignal(number) != signal.SIG_IGN
    ]
    if also_ctrl_c:
        numbers.append(signal.SIGINT)
    before = [signal.signal(number, end) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


@contextmanager
def ending_signals_delayed() -> Iterator[None]:
    """Let ending signals that arrive in the block take effect at its end.

    The handlers of Python are delayed, not the default actions of the system. In another thread,
    this does nothing, because only the main thread receives signals.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received: list[tuple[int, FrameType | None]] = []

    def remember(number: int, frame: FrameType | None) -> None:
        received.append((number, frame))

    before = {}
    for number in ENDING_SIGNALS:
        handler = signal.getsignal(number)
        if callable(handler):
            before[number] = handler
            signal.signal(number, remember)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for number, frame in received[:1]:  # the first signal ends the program
            before[signal.Signals(number)](number, frame)


@contextmanager
def undisturbed() -> Iterator[None]:
    """Ignore the ending signals in the block.

    In another thread, this does nothing, because only the main thread receives signals.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, signal.SIG_IGN) for number in ENDING_SIGNALS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
