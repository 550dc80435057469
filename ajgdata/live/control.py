"""Start, pause and stop of a live run, from the dashboard's threads to the run's own."""

from __future__ import annotations

import signal
import threading
from enum import StrEnum


class Mode(StrEnum):
    """What a run is asked to do."""

    RUNNING = "running"
    PAUSED = "paused"
    STOPPED = "stopped"


class Control:
    """Asked by any thread; `checkpoint` is called by the run between two steps."""

    def __init__(self) -> None:
        self._mode = Mode.RUNNING
        self._changed = threading.Condition()
        self._in_run = False

    @property
    def mode(self) -> Mode:
        """Return what the run is asked to do now."""
        return self._mode

    def start(self) -> None:
        """Let a run that pauses go on; one that is stopped stays so."""
        self._set(Mode.RUNNING)

    def pause(self) -> None:
        """Let the run wait before its next step."""
        if self._mode is Mode.RUNNING:
            self._set(Mode.PAUSED)

    def stop(self) -> None:
        """End the run now, in the middle of a step: as Ctrl-C does, by KeyboardInterrupt in the
        main thread. Asked again, or after the run has ended, it does nothing."""
        with self._changed:
            if self._mode is Mode.STOPPED:
                return
            self._mode = Mode.STOPPED
            self._changed.notify_all()
            if self._in_run:
                # a signal also wakes what sleeps, reads, or waits for a program
                signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)

    def checkpoint(self) -> None:
        """Wait while the run is not to go on. Raises KeyboardInterrupt if it is to stop."""
        with self._changed:
            while self._mode is Mode.PAUSED:
                self._changed.wait(0.5)  # so that Ctrl-C is heard meanwhile
            if self._mode is Mode.STOPPED:
                raise KeyboardInterrupt

    def begin(self) -> None:
        """Say that the run begins, in the main thread: only now may `stop` interrupt it.

        A program that a shell started in the background ignores SIGINT; a run must be stoppable.
        """
        if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        with self._changed:
            self._in_run = True

    def end(self) -> None:
        """Say that the run has ended: nobody is interrupted from now on."""
        with self._changed:
            self._in_run = False
            self._mode = Mode.STOPPED

    def _set(self, mode: Mode) -> None:
        with self._changed:
            if self._mode is not Mode.STOPPED:
                self._mode = mode
                self._changed.notify_all()
