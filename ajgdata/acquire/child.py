"""A process of its own for what may hang: asked in turn, killed when it does not answer."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection, wait
from typing import Any

from ajgdata.types import DataError

#: What is asked and answered: plain values, and bytes where there are samples.
Message = tuple[Mapping[str, Any], bytes]


def follow_parent() -> None:
    """End this process with its parent, whatever becomes of it, and leave Ctrl-C to the parent.

    A killed parent cannot tell its children: without this they would wait for ever.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


class Child:
    """Process that answers requests with a handler that `start()` makes in it, one at a time."""

    def __init__(self, start: Callable[[], Callable[[Mapping[str, Any], bytes], Message]]) -> None:
        context = multiprocessing.get_context("spawn")  # forking would copy threads in any state
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, start), daemon=True)
        self._process.start()
        theirs.close()

    @property
    def pid(self) -> int | None:
        """Its process id."""
        return self._process.pid

    def ask(self, request: Mapping[str, Any], content: bytes, timeout_s: float) -> Message:
        """Return the answer. DataError as the handler raised it, TimeoutError when there is none
        in time, EOFError when the process is gone; after both it is killed."""
        late = threading.Event()

        def end() -> None:  # a full pipe, and half an answer, block: only its end wakes them
            late.set()
            self._process.kill()

        watchdog = threading.Timer(timeout_s, end)
        watchdog.daemon = True
        watchdog.start()
        try:
            _send(self._connection, request, content)
            if not self._connection.poll(timeout_s):
                raise TimeoutError
            answer, returned = _receive(self._connection)
        except (EOFError, OSError) as error:
            self.kill()
            silent = late.is_set() or isinstance(error, TimeoutError)
            raise (TimeoutError if silent else EOFError) from None
        finally:
            watchdog.cancel()
        if "problem" in answer:
            raise DataError(answer["where"], answer["problem"], answer["fix"])
        return answer, returned

    def kill(self) -> None:
        """End the process at once, whatever it is doing. May be called twice."""
        self._connection.close()
        if self._process.is_alive():
            self._process.kill()
        self._process.join(5)


def _send(connection: Connection, answer: Mapping[str, Any], content: bytes) -> None:
    connection.send_bytes(json.dumps(answer).encode())
    connection.send_bytes(content)


def _receive(connection: Connection) -> Message:
    answer = json.loads(connection.recv_bytes())
    return answer, connection.recv_bytes()


def _serve(
    connection: Connection, start: Callable[[], Callable[[Mapping[str, Any], bytes], Message]]
) -> None:
    follow_parent()
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):  # drivers talk; an inherited pipe would keep its reader waiting
        os.dup2(nowhere, stream)
    handle = start()
    while True:
        try:
            request, content = _receive(connection)
        except EOFError:
            os._exit(0)  # not by way of drivers, which may hang
        try:
            answer, returned = handle(request, content)
        except DataError as error:
            answer = {"where": error.where, "problem": error.problem, "fix": error.fix}
            returned = b""
        except Exception as error:
            said = f"{type(error).__name__}: {error}"
            answer, returned = {"where": "sound card", "problem": said, "fix": "report this"}, b""
        _send(connection, answer, returned)
